//! A scene as OBJ, MTL and texture files, in world units.
//!
//! Coordinates have the fewest digits that lead back to the same position in the frame. Files are written aside and
//! renamed, the OBJ last, so that no half of a scene is ever found under its name. What OBJ cannot say (that a closed
//! shell is two-sided) is omitted.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Pixel, Rgb};

use super::{
    Cutout, Frame, Material, ObjectName, Scene, SceneOptions, Specular, Texture, TextureId, Wrap,
    builtin, mtl_specular::MIRROR_EXPONENT, srgb_byte, whole::write_whole,
};

/// Write `scene` to `path`, its materials beside it under the same stem, and its textures beside both.
///
/// # Errors
/// When the folder cannot be written to or `path` names no file.
pub fn write_obj(scene: &Scene, path: &Path) -> io::Result<()> {
    let library = MaterialLibrary::beside(path, scene)?;
    library.write(scene)?;
    write_whole(path, |out| write_geometry(scene, &library, out))
}

/// The MTL file of a scene and its textures, beside an OBJ file.
pub struct MaterialLibrary {
    folder: PathBuf,
    /// Name of the MTL file.
    name: String,
    /// By material.
    materials: Vec<String>,
    /// Files by texture, and by cut-out.
    textures: Vec<String>,
    cutouts: Vec<String>,
}

impl MaterialLibrary {
    /// Names of the files for an OBJ file of this path.
    ///
    /// # Errors
    /// Where it names no file.
    pub fn beside(path: &Path, scene: &Scene) -> io::Result<Self> {
        let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "the path names no file");
        let stem = path.file_stem().ok_or_else(no_name)?.to_string_lossy();
        let stem = token(&stem);
        let cutouts = 0..scene.cutouts.len();
        Ok(Self {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            materials: material_names(&scene.materials),
            textures: texture_files(&stem, scene),
            cutouts: cutouts
                .map(|index| format!("{stem}-cutout-{index}.png"))
                .collect(),
            name: format!("{stem}.mtl"),
        })
    }

    /// All its files.
    pub fn paths(&self) -> Vec<PathBuf> {
        let names = [&self.name].into_iter();
        let names = names.chain(&self.textures).chain(&self.cutouts);
        names.map(|name| self.folder.join(name)).collect()
    }

    /// Name of the MTL file.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Names by material: single words, all different.
    pub(crate) fn material_names(&self) -> &[String] {
        &self.materials
    }

    /// Write all files, each whole or not at all.
    ///
    /// # Errors
    /// Those of the system.
    pub fn write(&self, scene: &Scene) -> io::Result<()> {
        let write = |name: &str, bytes: &[u8]| {
            write_whole(&self.folder.join(name), |out| out.write_all(bytes))
        };
        for (texture, name) in scene.textures.iter().zip(&self.textures) {
            write(name, &encoded_texture(texture)?)?;
        }
        for (cutout, name) in scene.cutouts.iter().zip(&self.cutouts) {
            write(name, &encoded_cutout(cutout)?)?;
        }
        let textures = scene.textures.iter().map(|texture| texture.wrap);
        let cutouts = scene.cutouts.iter().map(|cutout| cutout.wrap);
        let references = [
            references(&self.textures, textures),
            references(&self.cutouts, cutouts),
        ];
        let references = references.each_ref().map(Vec::as_slice);
        let texts = scene.materials.iter().zip(&self.materials);
        let texts: String = texts
            .map(|(material, name)| material_text(material, name, references))
            .collect();
        write(&self.name, texts.as_bytes())
    }
}

/// Write a built-in scene to `folder/NAME.obj`, making the folder if need be; returns the path of the OBJ file.
///
/// # Errors
/// [`io::ErrorKind::NotFound`] where no built-in scene has this name; otherwise as [`write_obj`].
pub fn write_builtin(name: &str, folder: &Path) -> io::Result<PathBuf> {
    let unknown = || {
        let message = format!("no built-in scene is named '{name}'");
        io::Error::new(io::ErrorKind::NotFound, message)
    };
    let scene = builtin::builtin(name, &SceneOptions::default())
        .ok_or_else(unknown)?
        .map_err(io::Error::other)?;
    fs::create_dir_all(folder)?;
    let path = folder.join(format!("{name}.obj"));
    write_obj(&scene, &path)?;
    Ok(path)
}

/// Vertices, texture coordinates, normals, objects and faces.
fn write_geometry(
    scene: &Scene,
    library: &MaterialLibrary,
    out: &mut dyn io::Write,
) -> io::Result<()> {
    writeln!(out, "mtllib {}", library.name)?;
    for &position in &scene.positions {
        let [x, y, z] = coordinates(&scene.frame, position);
        writeln!(out, "v {x} {y} {z}")?;
    }
    let texcoords = Numbering::of(&scene.texcoords, |uv| [uv.x, uv.y]);
    for [u, v] in &texcoords.values {
        writeln!(out, "vt {u} {v}")?;
    }
    let normals = Numbering::of(&scene.normals, |n| n.to_array());
    for [x, y, z] in &normals.values {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let mut objects = scene.objects.iter().peekable();
    let mut named = None;
    let mut material = None;
    for id in scene.triangle_ids() {
        if let Some(object) = objects.next_if(|object| object.start <= id)
            && named != Some(&object.name)
        {
            write_name(out, &object.name, named)?;
            named = Some(&object.name);
        }
        let triangle = &scene.triangles[id.index()];
        if material != Some(triangle.material) {
            material = Some(triangle.material);
            writeln!(
                out,
                "usemtl {}",
                library.materials[triangle.material.index()]
            )?;
        }
        let mut line = String::from("f");
        for (k, corner) in triangle.corners.into_iter().enumerate() {
            let texcoord = texcoords.number(id.index(), k);
            let normal = normals.number(id.index(), k);
            // Writing to a string cannot fail.
            let _ = match (texcoord, normal) {
                (None, None) => write!(line, " {}", corner + 1),
                (Some(vt), None) => write!(line, " {}/{vt}", corner + 1),
                (None, Some(vn)) => write!(line, " {}//{vn}", corner + 1),
                (Some(vt), Some(vn)) => write!(line, " {}/{vt}/{vn}", corner + 1),
            };
        }
        writeln!(out, "{line}")?;
    }
    Ok(())
}

/// The statements that give the next faces a name, after others had the name `before`.
pub(crate) fn write_name(
    out: &mut dyn io::Write,
    name: &ObjectName,
    before: Option<&ObjectName>,
) -> io::Result<()> {
    let before = before.cloned().unwrap_or_default();
    let is_new_object = name.object != before.object;
    if is_new_object || name.group.is_empty() && !before.group.is_empty() {
        writeln!(out, "o {}", name.object)?;
    }
    match &*name.group {
        "" => Ok(()),
        group if is_new_object || name.group != before.group => writeln!(out, "g {group}"),
        _ => Ok(()),
    }
}

/// Equal corner values under one number, counted from 1 as OBJ does.
struct Numbering<const N: usize> {
    values: Vec<[f32; N]>,
    of_corner: Vec<[usize; 3]>,
}

impl<const N: usize> Numbering<N> {
    fn of<T: Copy>(corners: &[[T; 3]], value: impl Fn(T) -> [f32; N]) -> Self {
        let mut known = HashMap::new();
        let mut values = Vec::new();
        let of_corner = corners
            .iter()
            .map(|corners| {
                corners.map(|corner| {
                    // Adding 0 turns −0 into 0.
                    let value = value(corner).map(|x| x + 0.0);
                    *known.entry(value.map(f32::to_bits)).or_insert_with(|| {
                        values.push(value);
                        values.len()
                    })
                })
            })
            .collect();
        Self { values, of_corner }
    }

    fn number(&self, triangle: usize, corner: usize) -> Option<usize> {
        self.of_corner.get(triangle).map(|numbers| numbers[corner])
    }
}

/// World coordinates in the fewest decimals that lead back to the same frame position.
pub(crate) fn coordinates(frame: &Frame, position: Vec3) -> [String; 3] {
    /// An f64 has no more digits to give.
    const MOST_DECIMALS: usize = 17;
    let world = frame.to_world(position);
    [0, 1, 2].map(|axis| {
        let leads_back = |text: &str| {
            text.parse().is_ok_and(|value: f64| {
                let mut point = DVec3::ZERO;
                point[axis] = value;
                frame.from_world(point)[axis] == position[axis]
            })
        };
        let text = (0..MOST_DECIMALS)
            .map(|decimals| format!("{:.decimals$}", world[axis]))
            .find(|text| leads_back(text))
            .unwrap_or_else(|| format!("{}", world[axis]));
        // Rounding leaves "-0" of tiny negative numbers.
        if text.parse() == Ok(0.0) {
            "0".to_owned()
        } else {
            text
        }
    })
}

/// A material in MTL.
fn material_text(material: &Material, name: &str, [textures, cutouts]: [&[String]; 2]) -> String {
    let triple = |c: Vec3| format!("{} {} {}", c.x, c.y, c.z);
    let mut text = format!("newmtl {name}\nKd {}\n", triple(material.reflectance));
    if material.emission != Vec3::ZERO {
        text += &format!("Ke {}\n", triple(material.emission));
    }
    if material.opacity < 1.0 && !(material.is_glass() && material.opacity <= 0.0) {
        text += &format!("d {}\n", material.opacity);
    }
    if material.filter != Vec3::ONE {
        text += &format!("Tf {}\n", triple(material.filter));
    }
    if let Some(cutout) = material.cutout {
        text += &format!("map_d {}\n", cutouts[cutout.index()]);
    }
    let mut map = |keyword: &str, texture: Option<TextureId>| {
        if let Some(texture) = texture {
            text += &format!("{keyword} {}\n", textures[texture.index()]);
        }
    };
    map("map_Kd", material.reflectance_texture);
    map("map_Ke", material.emission_texture);
    text + &specular_text(material.specular)
}

/// The statements of a mirror, gloss or glass, and the model of illumination.
fn specular_text(specular: Option<Specular>) -> String {
    let Some(specular) = specular else {
        return "illum 1\n\n".to_owned();
    };
    let Vec3 { x, y, z } = specular.color();
    match specular {
        Specular::Mirror { .. } => format!("Ks {x} {y} {z}\nillum 3\n\n"),
        Specular::Gloss { roughness, .. } => {
            let exponent = 2.0 / (roughness * roughness) - 2.0;
            // Larger exponents mean mirrors.
            let width = match exponent < MIRROR_EXPONENT {
                true => format!("Ns {}", exponent.max(0.0)),
                false => format!("Pr {}", roughness.sqrt()),
            };
            format!("Ks {x} {y} {z}\n{width}\nillum 2\n\n")
        }
        Specular::Glass { index, is_thin } => {
            format!("Ni {index}\nillum {}\n\n", if is_thin { 4 } else { 7 })
        }
    }
}

/// One word for each material, all different: readers cut names at blanks.
fn material_names(materials: &[Material]) -> Vec<String> {
    unlike(materials.iter().map(|material| token(&material.name)))
}

/// The same names, with a number where one came before.
fn unlike(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut taken: HashSet<String> = HashSet::new();
    let mut next: HashMap<String, usize> = HashMap::new();
    names
        .map(|base| {
            let mut name = base.clone();
            // File names that differ in case only are one file on some systems.
            while !taken.insert(name.to_lowercase()) {
                let number = next.entry(base.clone()).or_insert(1);
                *number += 1;
                name = format!("{base}_{number}");
            }
            name
        })
        .collect()
}

/// A name without blanks and separators, and never empty.
fn token(name: &str) -> String {
    let is_unsafe = |c: char| c.is_whitespace() || c.is_control() || "/\\:".contains(c);
    let text = name.replace(is_unsafe, "_");
    if text.is_empty() {
        "unnamed".to_owned()
    } else {
        text
    }
}

/// The files that textures go to: PNG, or OpenEXR where one is brighter than a PNG can hold.
fn texture_files(stem: &str, scene: &Scene) -> Vec<String> {
    let stems = unlike(scene.textures.iter().map(|texture| {
        let name = Path::new(&texture.name);
        let name = token(&name.file_stem().unwrap_or_default().to_string_lossy());
        match name.starts_with(stem) {
            true => name,
            false => format!("{stem}-{name}"),
        }
    }));
    let extension = |texture| if is_bright(texture) { "exr" } else { "png" };
    let named = stems.iter().zip(&scene.textures);
    named
        .map(|(stem, texture)| format!("{stem}.{}", extension(texture)))
        .collect()
}

fn is_bright(texture: &Texture) -> bool {
    texture.pixels.iter().any(|pixel| pixel.max_element() > 1.0)
}

/// What texture statements say of these files: the options that let them go on beyond their edges, and the name. MTL has one
/// word for both axes, and none for mirrored pictures, which are written with their image beside them.
fn references(names: &[String], wraps: impl Iterator<Item = [Wrap; 2]>) -> Vec<String> {
    let reference = |(name, wrap): (&String, [Wrap; 2])| {
        let mut text = String::new();
        if wrap.contains(&Wrap::Clamp) {
            text += "-clamp on ";
        }
        if wrap.contains(&Wrap::Mirror) {
            let [u, v] = repeats(wrap).map(|repeats| 1.0 / f64::from(repeats));
            text += &format!("-s {u} {v} 1 ");
        }
        text + name
    };
    names.iter().zip(wraps).map(reference).collect()
}

/// How often a picture is written side by side, along u and v.
fn repeats(wrap: [Wrap; 2]) -> [u32; 2] {
    wrap.map(|wrap| if wrap == Wrap::Mirror { 2 } else { 1 })
}

/// A picture with its image beside it where it goes on mirrored; `pixel` gives its pixels by column and row.
fn unfolded<P: Pixel>(
    [width, height]: [u32; 2],
    wrap: [Wrap; 2],
    pixel: impl Fn(u32, u32) -> P,
) -> ImageBuffer<P, Vec<P::Subpixel>> {
    let [across, up] = repeats(wrap);
    ImageBuffer::from_fn(across * width, up * height, |column, row| {
        // The picture itself is below its image: v points up.
        let above = i64::from(up * height - 1 - row);
        let column = wrap[0].pixel(i64::from(column), width);
        pixel(column, height - 1 - wrap[1].pixel(above, height))
    })
}

/// A grey PNG: white is there.
fn encoded_cutout(cutout: &Cutout) -> io::Result<Vec<u8>> {
    let size = [cutout.width, cutout.height];
    let picture = unfolded(size, cutout.wrap, |column, row| {
        Luma([u8::MAX * u8::from(cutout.has(column, row))])
    });
    let mut bytes = Cursor::new(Vec::new());
    let written = picture.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(io::Error::other)?;
    Ok(bytes.into_inner())
}

fn encoded_texture(texture: &Texture) -> io::Result<Vec<u8>> {
    if !texture.is_consistent() {
        let message = format!("texture '{}' has too few pixels", texture.name);
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let size = [texture.width, texture.height];
    let color = |column: u32, row: u32| {
        texture.pixels[row as usize * texture.width as usize + column as usize].to_array()
    };
    let (picture, format) = if is_bright(texture) {
        let picture = unfolded(size, texture.wrap, |column, row| Rgb(color(column, row)));
        (DynamicImage::ImageRgb32F(picture), ImageFormat::OpenExr)
    } else {
        let code = |column, row| Rgb(color(column, row).map(srgb_byte));
        let picture = unfolded(size, texture.wrap, code);
        (DynamicImage::ImageRgb8(picture), ImageFormat::Png)
    };
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, format)
        .map_err(io::Error::other)?;
    Ok(bytes.into_inner())
}
