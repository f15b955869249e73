//! Reading an OBJ file with its MTL files and textures into a [`Scene`].
//!
//! The file passes [`ObjCleaner`], beside it the parser, then [`Triangulator`], and ends in [`SceneBuilder`]. Parts that can
//! be skipped are skipped, counted and named with their lines; only a file without a usable face is an error.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::ahead::parse_ahead;
use super::builder::{BuildError, Face, SceneBuilder, Source};
use super::clean::{FaceNote, ForeignNumber, MAX_LIBRARIES, Mention, Notes, ObjCleaner};
use super::color::linear_from_srgb;
use super::library::{Defined, Library};
use super::lines::{Notation, spellings};
use super::listed::{MOST_LISTED, listed, shortened};
use super::locate::{Missing, SceneFolder};
use super::mtl::{MtlMaterial, read_mtl};
use super::options::SceneOptions;
use super::palette::Palettes;
use super::read_error::ReadError;
use super::source::{CHANGED, Watch};
use super::texcoords::near_origin;
use super::texture::Role;
use super::texture_statement::{Mapping, TextureReference, TextureStatement};
use super::triangulate::{Doubt, MAX_CLIPPED_CORNERS, Triangulator};
use super::warning::WarningKind;
use super::whole::folder_of;
use super::wrap::Wrap;
use super::{CutoutId, Material, MaterialId, Scene, Sides, Texture, TextureId};

/// Read the faces of an OBJ file that was opened, and what they show.
///
/// # Errors
/// [`ReadError`] when no scene is left; everything else is a warning in [`Scene::warnings`].
pub(super) fn import<'a>(
    path: &Path,
    reader: impl BufRead + Send,
    watch: &Watch,
    options: &'a SceneOptions,
) -> Result<Import<'a>, ReadError> {
    let source = Source::of(path);
    let (models, mut notes) = parse(path, ObjCleaner::new(reader, &source.file))?;
    if watch.has_changed() {
        notes.log.note(WarningKind::FileChanged, CHANGED, "", 0);
    }
    let mut import = Import {
        options,
        folder: SceneFolder::new(folder_of(path).to_owned()),
        builder: SceneBuilder {
            source: Source {
                up: notes.up,
                ..source
            },
            ..SceneBuilder::default()
        },
        notes,
        textures: HashMap::new(),
        pixel_budget: PIXEL_BUDGET,
        library_budget: MAX_LIBRARIES,
        slots: Vec::new(),
        default_slot: None,
        painted_slot: None,
        palettes: Palettes::default(),
    };
    import.materials(&models);
    import.models(&models);
    drop(models);
    Ok(import)
}

/// Run the parser over the clean text.
fn parse(
    path: &Path,
    cleaner: ObjCleaner<impl BufRead + Send>,
) -> Result<(Vec<tobj::Model>, Notes), ReadError> {
    let options = tobj::LoadOptions::default();
    let parsed = parse_ahead(cleaner, |text| {
        tobj::load_obj_buf(text, &options, |_| Err(tobj::LoadError::OpenFileFailed))
    });
    let path = path.to_owned();
    let parsed = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            let reason = error.to_string();
            return Err(ReadError::Unreadable { reason, path });
        }
    };
    let (Some(models), Some(notes)) = (parsed.value, parsed.notes) else {
        let reason = "internal failure".to_owned();
        return Err(ReadError::Parser { reason, path });
    };
    if let Some(reason) = notes.failure {
        return Err(ReadError::Unreadable { reason, path });
    }
    match models {
        Ok(_) if !notes.any_text => Err(ReadError::Empty { path }),
        Ok(_) if notes.statements == 0 => Err(ReadError::NotScene { path }),
        Ok((models, _)) => Ok((models, notes)),
        Err(error) => Err(ReadError::Parser {
            reason: error.to_string(),
            path,
        }),
    }
}

/// Pixels of all textures together: 768 MiB. The next picture gets a quarter of what is left.
const PIXEL_BUDGET: usize = 1 << 26;

/// Bytes of an MTL file that are read.
const MAX_MTL_BYTES: u64 = 256 << 20;

/// A material of the scene with what its faces need.
#[derive(Clone, Copy, Debug)]
struct Slot {
    id: MaterialId,
    /// How its textures lie, where it has any.
    mapping: Option<Mapping>,
    /// What the colours of vertices are multiplied by to lie within 0…1, where faces reflect these.
    color_scale: Option<f64>,
}

/// The scene on its way in.
pub(super) struct Import<'a> {
    options: &'a SceneOptions,
    folder: SceneFolder,
    pub(super) builder: SceneBuilder,
    notes: Notes,
    /// Pictures by path, by what they are for and by how they go on; nothing where reading failed.
    textures: HashMap<(PathBuf, Role, Wrap), Option<Loaded>>,
    pixel_budget: usize,
    /// Names of MTL files that are still looked for.
    library_budget: usize,
    /// By index in [`Notes::materials`].
    slots: Vec<Slot>,
    default_slot: Option<Slot>,
    /// The material of faces that only the colours of their vertices describe.
    painted_slot: Option<Slot>,
    palettes: Palettes,
}

/// The part of glass that is opaque: nothing, where it does not say that it lets light pass.
fn glass_opacity(defined: &Defined, remarks: &mut Remarks) -> f64 {
    let model = defined.material.model.unwrap_or_default();
    remarks.see_through.add(format!("illum {model}"), defined);
    defined
        .material
        .opacity()
        .map_or(0.0, |(_, opacity)| opacity)
}

/// Materials of which the same is to be said.
#[derive(Default)]
struct Groups {
    /// By why: their names.
    names: Vec<(String, Vec<String>)>,
    /// File and line of the first.
    place: (String, usize),
}

impl Groups {
    fn add(&mut self, why: String, defined: &Defined) {
        if self.names.is_empty() {
            self.place = (defined.file.clone(), defined.material.line);
        }
        let name = defined.material.name.clone();
        match self.names.iter_mut().find(|(known, _)| *known == why) {
            Some((_, names)) => names.push(name),
            None => self.names.push((why, vec![name])),
        }
    }

    /// The names, each group with its reason.
    fn listed(&self) -> String {
        let mut most = MOST_LISTED;
        let groups = self.names.iter().map(|(why, names)| {
            let listed = listed(names.iter().map(|name| &**name), most);
            most = most.saturating_sub(names.len());
            format!("{listed} ({why})")
        });
        groups.collect::<Vec<_>>().join(", ")
    }
}

/// What is to be said of materials, each once.
#[derive(Default)]
struct Remarks {
    /// Whether more than half of the materials state that nothing of them is there.
    most_are_invisible: bool,
    /// Light passes through them.
    see_through: Groups,
    /// They ask for that, but are solid.
    solid: Groups,
    /// They ask for gloss or relief.
    matt: Groups,
}

/// Texture coordinates of the faces of a material.
#[derive(Clone, Copy, Debug, Default)]
struct Shown {
    has_faces: bool,
    /// Whether any of them has texture coordinates.
    has_texcoords: bool,
}

impl Shown {
    fn add(&mut self, other: Self) {
        self.has_faces |= other.has_faces;
        self.has_texcoords |= other.has_texcoords;
    }
}

/// A texture of the scene.
#[derive(Clone, Copy, Debug)]
struct Loaded {
    /// Nothing where it only cuts out.
    id: Option<TextureId>,
    is_transparent: bool,
    /// Where it is not there, if that is anywhere.
    cutout: Option<CutoutId>,
}

/// A texture of a material, and how it lies.
struct Placed {
    texture: Loaded,
    mapping: Mapping,
}

impl Import<'_> {
    /// Make a material of each one that `usemtl` mentions.
    fn materials(&mut self, models: &[tobj::Model]) {
        let library = self.read_libraries();
        let shown = self.shown(models);
        let mentions = std::mem::take(&mut self.notes.materials);
        let found: Vec<Option<usize>> = mentions
            .iter()
            .map(|mention| library.find(&mention.name))
            .collect();
        // A material may be mentioned by several names.
        let mut shown_by: HashMap<usize, Shown> = HashMap::new();
        for (number, shown) in found.iter().zip(shown) {
            if let Some(number) = number {
                shown_by.entry(*number).or_default().add(shown);
            }
        }
        let mut slot_of: HashMap<usize, Slot> = HashMap::new();
        let is_shown = |number: &usize| shown_by[number].has_faces;
        let numbers: Vec<usize> = shown_by.keys().copied().filter(is_shown).collect();
        let invisible = numbers
            .iter()
            .filter(|number| library.get(**number).material.is_invisible());
        let mut remarks = Remarks {
            most_are_invisible: 2 * invisible.count() > numbers.len(),
            ..Remarks::default()
        };
        let mut unknown = Vec::new();
        for (mention, number) in mentions.into_iter().zip(found) {
            let slot = match number {
                Some(number) => *slot_of.entry(number).or_insert_with(|| {
                    let shown = shown_by[&number];
                    self.define(library.get(number), shown, &mut remarks)
                }),
                None => {
                    let grey = Material::plain(&mention.name, DEFAULT_REFLECTANCE, Vec3::ZERO);
                    unknown.push(mention);
                    Slot {
                        id: self.builder.push_material(grey),
                        mapping: None,
                        color_scale: None,
                    }
                }
            };
            self.slots.push(slot);
        }
        self.warn_of_unknown(&unknown);
        self.tell(&remarks);
    }

    /// By material that is mentioned: whether its faces have texture coordinates.
    fn shown(&self, models: &[tobj::Model]) -> Vec<Shown> {
        let mut shown = vec![Shown::default(); self.notes.materials.len()];
        for model in models {
            let segment = model.name.parse::<usize>().ok();
            let segment = segment.and_then(|segment| self.notes.segments.get(segment));
            if let Some(material) = segment.and_then(|segment| segment.material) {
                shown[material].has_faces |= !model.mesh.indices.is_empty();
                // Non-finite coordinates stand for none.
                let mut texcoords = model.mesh.texcoords.iter();
                shown[material].has_texcoords |= texcoords.any(|at| at.is_finite());
            }
        }
        shown
    }

    fn warn_of_unknown(&mut self, unknown: &[Mention]) {
        let Some(first) = unknown.first() else {
            return;
        };
        let names = listed(unknown.iter().map(|mention| &*mention.name), MOST_LISTED);
        let message = format!("no material file defines {names}; grey is used instead");
        let count = unknown.iter().map(|mention| mention.count).sum();
        let file = &self.builder.source.file;
        let kind = WarningKind::MaterialMissing;
        self.notes
            .log
            .note_times(kind, &message, count, file, first.line);
    }

    /// Say once what lets light pass, what does not though it asks for it, and what is not computed.
    fn tell(&mut self, remarks: &Remarks) {
        for (kind, what, groups) in [
            (
                WarningKind::SeeThrough,
                "transparent materials:",
                &remarks.see_through,
            ),
            (WarningKind::SeeThrough, "treated as solid:", &remarks.solid),
            (
                WarningKind::Unsupported,
                "gloss and relief of these kinds are not computed:",
                &remarks.matt,
            ),
        ] {
            if groups.names.is_empty() {
                continue;
            }
            let message = format!("{what} {}", groups.listed());
            let (file, line) = &groups.place;
            self.notes.log.note(kind, &message, file, *line);
        }
    }

    /// Read every MTL file that is mentioned; later definitions of a name replace earlier ones.
    fn read_libraries(&mut self) -> Library {
        let mut library = Library::default();
        let mut read = Vec::new();
        for mention in std::mem::take(&mut self.notes.libraries) {
            for path in self.library_paths(&mention) {
                if !read.contains(&path) {
                    self.read_library(&path, &mut library);
                    read.push(path);
                }
            }
        }
        library
    }

    /// The files that one `mtllib` means: its whole text as one name with spaces, else a list of names.
    fn library_paths(&mut self, mention: &Mention) -> Vec<PathBuf> {
        let here = Path::new("");
        let names: Vec<&str> = spellings(&mention.name).collect();
        if let Ok((_, path)) = self.folder.locate(here, &names) {
            return vec![path];
        }
        let whole = names[names.len() - 1];
        let mut words: Vec<&str> = whole.split_whitespace().take(self.library_budget).collect();
        self.library_budget -= words.len();
        let mut all = Vec::new();
        for word in &words {
            all.push(self.folder.locate(here, &[word]));
        }
        if all.iter().all(Result::is_err) {
            // One missing name with spaces is likelier than several missing ones.
            words = vec![whole];
        }
        let mut found = Vec::new();
        for (word, path) in words.into_iter().zip(all) {
            let why = match path {
                Ok((_, path)) => {
                    found.push(path);
                    continue;
                }
                Err(Missing::Absent) => "was not found beside the OBJ file",
                Err(missing) => missing_because(missing),
            };
            let message = format!("material file '{}' {why}", shortened(word));
            let file = &self.builder.source.file;
            let kind = WarningKind::MaterialMissing;
            self.notes
                .log
                .note_times(kind, &message, mention.count, file, mention.line);
        }
        found
    }

    fn read_library(&mut self, path: &Path, library: &mut Library) {
        let file = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let file_path = self.folder.path_of(path);
        self.builder.source.files.push(file_path);
        let log = &mut self.notes.log;
        let materials = File::open(self.folder.path_of(path))
            .and_then(|source| read_mtl(BufReader::new(source.take(MAX_MTL_BYTES)), &file, log));
        match materials {
            Ok(materials) => {
                for material in materials {
                    library.add(Defined {
                        material,
                        file: file.clone(),
                        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
                    });
                }
            }
            Err(error) => {
                let message =
                    format!("material file '{file}' was omitted: it cannot be read ({error})");
                log.note(WarningKind::MaterialMissing, &message, "", 0);
            }
        }
    }

    /// Turn a material of an MTL file into one of the scene. Pictures that no face shows are not read, but where a missing
    /// colour depends on whether there is one.
    fn define(&mut self, defined: &Defined, shown: Shown, remarks: &mut Remarks) -> Slot {
        let MtlMaterial {
            name,
            diffuse_map,
            emissive_map,
            ..
        } = &defined.material;
        // Black beside a picture would hide it: exporters write it where the picture is all of the colour.
        let color_beside = |map: &Option<TextureStatement>, color: Option<Vec3>| {
            color.filter(|color| map.is_none() || *color != Vec3::ZERO)
        };
        let diffuse = color_beside(diffuse_map, defined.material.diffuse);
        let emissive = color_beside(emissive_map, defined.material.emissive);
        let is_all_solid = self.options.is_opaque;
        let mut texture = |map: &Option<TextureStatement>, color: Option<Vec3>, role| {
            if shown.has_texcoords || (shown.has_faces && color.is_none()) {
                return self.texture(map.as_ref()?, defined, role);
            }
            if let Some(map) = map {
                self.builder.omitted_textures.unused_textures += 1;
                self.note_unread(map, defined);
            }
            None
        };
        let reflecting = texture(diffuse_map, diffuse, Role::Reflects);
        let is_same = |map: &TextureStatement| {
            let same = diffuse_map.as_ref().map(|colors| colors.means_file_of(map));
            same.unwrap_or(false)
        };
        let cuts_out = reflecting
            .as_ref()
            .is_some_and(|placed| placed.texture.cutout.is_some() && !is_all_solid);
        // What is cut out is dark without being black.
        let emits = match emissive_map.as_ref().is_some_and(is_same) && cuts_out {
            true => Role::Reflects,
            false => Role::Emits,
        };
        let emitting = texture(emissive_map, emissive, emits);
        // Exporters name the coloured picture itself, whose alpha counts anyway.
        let dissolve_map = defined.material.dissolve_map.clone();
        let dissolve_map = dissolve_map.filter(|map| shown.has_texcoords && !is_same(map));
        let cutting = texture(&dissolve_map, None, Role::CutsOut);
        let mut cutout = self.cutout(
            defined,
            shown,
            reflecting.as_ref(),
            cutting.as_ref(),
            remarks,
        );
        let glass = defined
            .material
            .glass()
            .filter(|_| shown.has_faces && !self.options.is_opaque && !self.options.is_matt);
        let opacity = match glass {
            None => self.opacity(defined, shown, remarks),
            Some(_) => glass_opacity(defined, remarks),
        };
        if self.options.is_opaque {
            cutout = None;
        }
        if shown.has_faces && !defined.material.uncomputed.is_empty() {
            remarks
                .matt
                .add(defined.material.uncomputed.join(", "), defined);
        }
        let linear = |colour: Vec3| {
            if self.options.mtl_color_is_srgb {
                colour.map(linear_from_srgb)
            } else {
                colour
            }
        };
        // A texture without a colour stands for itself.
        let color = |given: Option<Vec3>, texture: &Option<Placed>, otherwise: Vec3| match texture {
            Some(_) => given.map_or(Vec3::ONE, linear),
            None => given.map_or(otherwise, linear),
        };
        let id_of =
            |texture: &Option<Placed>| texture.as_ref().and_then(|placed| placed.texture.id);
        let reflectance = color(diffuse, &reflecting, DEFAULT_REFLECTANCE);
        let shine = defined.material.shine(match &reflecting {
            Some(placed) => reflectance * self.mean_color(placed),
            None => reflectance,
        });
        let shine = shine.filter(|_| glass.is_none() && !self.options.is_matt);
        let material = Material {
            name: name.clone(),
            reflectance: reflectance * shine.map_or(1.0, |shine| shine.diffuse),
            emission: color(emissive, &emitting, Vec3::ZERO),
            reflectance_texture: id_of(&reflecting),
            emission_texture: id_of(&emitting),
            opacity: opacity as f32,
            filter: defined.material.filter.unwrap_or(Vec3::ONE),
            cutout,
            specular: glass.or(shine.map(|shine| shine.specular)),
            sides: Sides::Auto,
        };
        let cutting = cutting.filter(|_| cutout.is_some());
        let mapping = self.mapping([reflecting, emitting, cutting], defined);
        Slot {
            id: self.builder.push_material(material),
            mapping,
            color_scale: None,
        }
    }

    /// What is cut out of a material: by its `map_d`, else by the alpha of its `map_Kd`.
    fn cutout(
        &self,
        defined: &Defined,
        shown: Shown,
        reflecting: Option<&Placed>,
        cutting: Option<&Placed>,
        remarks: &mut Remarks,
    ) -> Option<CutoutId> {
        let (placed, statement) = match (cutting, reflecting) {
            (Some(cutting), _) => (cutting, "map_d"),
            (None, reflecting) => (reflecting?, "alpha of map_Kd"),
        };
        if !shown.has_faces || !placed.texture.is_transparent {
            return None;
        }
        match placed.texture.cutout {
            _ if self.options.is_opaque => {
                remarks
                    .solid
                    .add(format!("{statement}, by --opaque"), defined);
                None
            }
            None => {
                remarks
                    .solid
                    .add(format!("{statement} of 0.5 and more"), defined);
                None
            }
            cutout => {
                remarks
                    .see_through
                    .add(format!("cut out by {statement}"), defined);
                cutout
            }
        }
    }

    /// The opacity of a material. Many programs write `d 0` or `Tr 1` into opaque ones, so that counts only where most
    /// materials are otherwise, and for those without a picture, which nobody would see.
    fn opacity(&self, defined: &Defined, shown: Shown, remarks: &mut Remarks) -> f64 {
        let material = &defined.material;
        let Some((statement, opacity)) = material.opacity().filter(|_| shown.has_faces) else {
            return 1.0;
        };
        let written = match statement {
            "d" => format!("d {}", short(opacity)),
            _ => format!("Tr {}", short(1.0 - opacity)),
        };
        let has_picture = material.diffuse_map.is_some() || material.dissolve_map.is_some();
        let why = match (self.options.is_opaque, material.is_invisible()) {
            (true, _) => ", by --opaque",
            (false, true) if remarks.most_are_invisible => ", as most materials",
            (false, true) if has_picture => " beside a picture",
            _ => {
                remarks.see_through.add(written, defined);
                return opacity;
            }
        };
        remarks.solid.add(written + why, defined);
        1.0
    }

    /// Mean colour of a texture.
    fn mean_color(&self, placed: &Placed) -> Vec3 {
        let texture = placed
            .texture
            .id
            .map(|id| &self.builder.textures[id.index()]);
        texture.map_or(Vec3::ONE, |texture| {
            let sum: Vec3 = texture.pixels.iter().sum();
            sum / texture.pixels.len().max(1) as f32
        })
    }

    /// How the material's textures lie; all share the coordinates of a face.
    fn mapping(&mut self, placed: [Option<Placed>; 3], defined: &Defined) -> Option<Mapping> {
        let mut placed = placed.into_iter().flatten();
        let first = placed.next()?.mapping;
        if placed.any(|placed| placed.mapping != first) {
            let message = "the textures of a material have different -s, -o or -clamp: those of the first of map_Kd, map_Ke and map_d are used for all";
            self.note_defined(WarningKind::Unsupported, message, defined);
        }
        Some(first)
    }

    fn note_defined(&mut self, kind: WarningKind, message: &str, defined: &Defined) {
        let line = defined.material.line;
        self.notes.log.note(kind, message, &defined.file, line);
    }

    /// Read a picture once for each role; a missing or broken one is a warning.
    fn texture(
        &mut self,
        statement: &TextureStatement,
        defined: &Defined,
        role: Role,
    ) -> Option<Placed> {
        let mut readings = statement.readings();
        let names: Vec<&str> = readings.iter().map(|reading| &*reading.name).collect();
        let located = self.folder.locate(&defined.folder, &names);
        // A missing file is named without quotes and other marks around its name.
        let meant = located
            .as_ref()
            .map_or(readings.len() - 1, |(number, _)| *number);
        let reading = readings.swap_remove(meant);
        if let Some(option) = &reading.ignored {
            let message = format!("texture option {option} is not followed");
            self.note_defined(WarningKind::Unsupported, &message, defined);
        }
        let why = match located {
            Ok((_, path)) => match self.load(&path, &reading, role) {
                Ok(texture) => {
                    let mapping = reading.mapping;
                    return Some(Placed { texture, mapping });
                }
                Err(reason) => format!("cannot be used: {reason}"),
            },
            Err(missing) => missing_because(missing).to_owned(),
        };
        let name = shortened(&reading.name);
        let instead = match role {
            Role::CutsOut => "nothing is cut out",
            Role::Reflects | Role::Emits => "the plain colour is used",
        };
        let message = format!("texture '{name}' {why}; {instead}");
        self.note_defined(WarningKind::TextureMissing, &message, defined);
        None
    }

    fn load(
        &mut self,
        path: &Path,
        reference: &TextureReference,
        role: Role,
    ) -> Result<Loaded, String> {
        let wrap = reference.mapping.wrap;
        let key = |role| (path.to_owned(), role, wrap);
        if let Some(known) = self.textures.get(&key(role)) {
            return known.ok_or_else(|| "see above".to_owned());
        }
        let file = self.folder.path_of(path);
        let read = Texture::read(&file, &reference.name, role).map(|picture| {
            let picture = picture.wrapped([wrap; 2]);
            let id = picture.texture.map(|texture| {
                let texture = texture.reduced_to(self.pixel_budget / 4);
                self.pixel_budget = self.pixel_budget.saturating_sub(texture.pixels.len());
                self.builder.textures.push(texture);
                TextureId(self.builder.textures.len() as u32 - 1)
            });
            let cutout = picture.cutout.map(|cutout| {
                self.builder.cutouts.push(cutout);
                CutoutId(self.builder.cutouts.len() as u32 - 1)
            });
            Loaded {
                id,
                is_transparent: picture.is_transparent,
                cutout,
            }
        });
        self.builder.source.files.push(file);
        let loaded = read.as_ref().ok().copied();
        self.textures.insert(key(role), loaded);
        // Only what is hidden looks different in another role.
        if let Some(loaded) = loaded.filter(|loaded| !loaded.is_transparent)
            && let Some(other) = role.other()
        {
            self.textures.insert(key(other), Some(loaded));
        }
        read
    }

    /// A picture that is not read belongs to the scene, too.
    fn note_unread(&mut self, statement: &TextureStatement, defined: &Defined) {
        let readings = statement.readings();
        let names: Vec<&str> = readings.iter().map(|reading| &*reading.name).collect();
        if let Ok((_, path)) = self.folder.locate(&defined.folder, &names) {
            let file = self.folder.path_of(&path);
            self.builder.source.files.push(file);
        }
    }

    /// Copy all parsed faces into the builder.
    fn models(&mut self, models: &[tobj::Model]) {
        let mut triangulator = Triangulator::default();
        let faces = std::mem::take(&mut self.notes.faces);
        self.builder.faces.reserve(faces.len());
        let mut faces = faces.into_iter();
        let scale = color_scale(models);
        let is_without = |model: &tobj::Model| model.mesh.vertex_color.is_empty();
        let mut has_unused_colors = models.iter().all(is_without);
        for model in models {
            let segment = model.name.parse::<usize>().ok();
            let Some(segment) = segment.and_then(|segment| self.notes.segments.get(segment)) else {
                continue;
            };
            let objects = &mut self.builder.objects;
            if objects.last().is_none_or(|(name, _)| *name != segment.name) {
                objects.push((segment.name.clone(), self.builder.faces.len()));
            }
            let mesh = &model.mesh;
            // White everywhere says nothing.
            let has_colors = mesh.vertex_color.iter().any(|&channel| channel != 1.0);
            let slot = match segment.material {
                Some(material) => {
                    has_unused_colors |= has_colors;
                    self.slots[material]
                }
                None if has_colors => self.painted_slot(scale),
                None => self.default_slot(),
            };
            self.mesh(mesh, slot, &mut triangulator, &mut faces);
        }
        std::mem::take(&mut self.palettes).finish(&mut self.builder);
        if let Some(line) = self.notes.first_color.filter(|_| has_unused_colors) {
            let message = "vertex colours are not used on faces with a material, and where the first vertex has none; give Kd or map_Kd";
            let file = &self.builder.source.file;
            let log = &mut self.notes.log;
            log.note(WarningKind::Unsupported, message, file, line);
        }
    }

    fn default_slot(&mut self) -> Slot {
        let builder = &mut self.builder;
        *self.default_slot.get_or_insert_with(|| Slot {
            id: builder.push_material(Material::plain("", DEFAULT_REFLECTANCE, Vec3::ZERO)),
            mapping: None,
            color_scale: None,
        })
    }

    /// The material of faces that reflect the colours of their vertices.
    fn painted_slot(&mut self, scale: f64) -> Slot {
        let builder = &mut self.builder;
        *self.painted_slot.get_or_insert_with(|| Slot {
            id: builder.push_material(Material::plain("", Vec3::ONE, Vec3::ZERO)),
            mapping: None,
            color_scale: Some(scale),
        })
    }

    fn mesh(
        &mut self,
        mesh: &tobj::Mesh,
        slot: Slot,
        triangulator: &mut Triangulator,
        faces: &mut impl Iterator<Item = FaceNote>,
    ) {
        let base = self.builder.positions.len();
        let points = mesh.positions.as_chunks::<3>().0;
        self.builder
            .positions
            .extend(points.iter().map(|&point| DVec3::from_array(point)));
        let mut start = 0;
        let mut polygon = Vec::new();
        while start < mesh.indices.len() {
            let Some(FaceNote { line, corner_count }) = faces.next() else {
                break;
            };
            let count = corner_count as usize;
            let corners = Corners { mesh, slot, start };
            if count == 3 {
                self.push_face(&corners, [0, 1, 2], base, line);
            } else {
                polygon.clear();
                polygon.extend((0..count).map(|corner| corners.position(corner)));
                let (triangles, doubt) = triangulator.cut(&polygon);
                for &triangle in triangles.as_chunks::<3>().0 {
                    self.push_face(&corners, triangle.map(|corner| corner as usize), base, line);
                }
                if let Some(doubt) = doubt {
                    self.warn_of_doubt(doubt, line);
                }
            }
            start += count.max(1);
        }
    }

    fn warn_of_doubt(&mut self, doubt: Doubt, line: u32) {
        let (kind, message) = match doubt {
            Doubt::TooManyCorners => (
                WarningKind::Unsupported,
                &*format!(
                    "a face with more than {MAX_CLIPPED_CORNERS} corners that is not convex was cut as a fan and may overlap itself; export it triangulated"
                ),
            ),
            Doubt::CrossesItself => (
                WarningKind::Orientation,
                "the edges of a face cross each other, so it is unclear what it covers; put its corners in order",
            ),
        };
        let file = &self.builder.source.file;
        self.notes.log.note(kind, message, file, line as usize);
    }

    fn push_face(&mut self, corners: &Corners, which: [usize; 3], base: usize, line: u32) {
        let index = |corner: usize| {
            let index = corners.mesh.indices[corners.start + corner] as usize + base;
            // Out of range it stays out of range, and the builder says so.
            u32::try_from(index).unwrap_or(u32::MAX)
        };
        if let Some(colors) = corners.colors(which) {
            let face = self.builder.faces.len();
            self.palettes.paint(face, corners.slot.id, colors);
        }
        self.builder.faces.push(Face {
            corners: which.map(index),
            texcoords: corners.texcoords(which),
            normals: corners.normals(which),
            material: corners.slot.id,
            line,
        });
    }

    /// Build the scene, with what was noted while reading before what the builder adds.
    ///
    /// # Errors
    /// When no face is left.
    pub(super) fn finish(mut self, path: &Path) -> Result<Scene, ReadError> {
        let skipped = self.notes.skipped_faces;
        let foreign_number = self.notes.foreign_number;
        let (file, log) = (self.builder.source.file.clone(), self.notes.log);
        self.builder.warnings.splice(..0, log.into_warnings());
        let first = self
            .builder
            .warnings
            .iter()
            .find(|warning| warning.kind == WarningKind::FaceSkipped);
        let first = first.map(ToString::to_string);
        let path = path.to_owned();
        self.builder
            .finish(self.options)
            .map_err(|error| match (error, foreign_number) {
                (BuildError::NoFaces { .. }, Some(ForeignNumber { notation, line }))
                    if skipped > 0 =>
                {
                    let Notation { name, cure } = notation;
                    ReadError::ForeignNumbers {
                        line,
                        notation: name,
                        cure,
                        path,
                    }
                }
                (BuildError::NoFaces { detail }, _) => ReadError::NoFaces {
                    detail: match first {
                        Some(first) if skipped > 0 => format!(" ({first})"),
                        _ if detail.is_empty() => format!(" (no face is defined in {file})"),
                        _ => detail,
                    },
                    path,
                },
                (BuildError::TooLarge { count, limit }, _) => {
                    ReadError::TooLarge { count, limit, path }
                }
            })
    }
}

/// What the colours of vertices are to be multiplied by: some programs write bytes.
fn color_scale(models: &[tobj::Model]) -> f64 {
    let mut channels = models.iter().flat_map(|model| &model.mesh.vertex_color);
    match channels.any(|&channel| channel > 1.0) {
        true => 1.0 / f64::from(u8::MAX),
        false => 1.0,
    }
}

/// Reflectance where the file gives none.
const DEFAULT_REFLECTANCE: Vec3 = Vec3::splat(0.5);

/// Why a file is not taken, behind its name.
fn missing_because(missing: Missing) -> &'static str {
    match missing {
        Missing::Absent => "was not found",
        Missing::Outside => "lies outside the folder of the OBJ file and was not read",
        Missing::Ambiguous => "fits several files that differ in letter case, so none was read",
    }
}

/// A number with few digits for a message.
fn short(number: f64) -> f64 {
    (number * 1000.0).round() / 1000.0
}

/// The corners of one face of a parsed mesh.
struct Corners<'a> {
    mesh: &'a tobj::Mesh,
    slot: Slot,
    start: usize,
}

impl Corners<'_> {
    fn position(&self, corner: usize) -> DVec3 {
        let index = self.mesh.indices[self.start + corner] as usize * 3;
        DVec3::from_slice(&self.mesh.positions[index..index + 3])
    }

    /// Texture coordinates, mapped and moved next to the origin, where the material has a texture.
    fn texcoords(&self, which: [usize; 3]) -> Option<[Vec2; 3]> {
        let mapping = self.slot.mapping?;
        let mut uv = [DVec2::ZERO; 3];
        for (uv, corner) in uv.iter_mut().zip(which) {
            let index = *self.mesh.texcoord_indices.get(self.start + corner)? as usize * 2;
            let value = DVec2::from_slice(self.mesh.texcoords.get(index..index + 2)?);
            *uv = mapping.place(value);
        }
        near_origin(uv, [mapping.wrap; 2])
    }

    /// Colours of the vertices, linear, where they are reflected.
    fn colors(&self, which: [usize; 3]) -> Option<[Vec3; 3]> {
        let scale = self.slot.color_scale?;
        let mut colors = [Vec3::ZERO; 3];
        for (color, corner) in colors.iter_mut().zip(which) {
            let index = self.mesh.indices[self.start + corner] as usize * 3;
            let encoded = DVec3::from_slice(self.mesh.vertex_color.get(index..index + 3)?);
            *color = (encoded * scale).as_vec3().map(linear_from_srgb);
        }
        Some(colors)
    }

    fn normals(&self, which: [usize; 3]) -> Option<[Vec3; 3]> {
        let mut normals = [Vec3::ZERO; 3];
        for (normal, corner) in normals.iter_mut().zip(which) {
            let index = *self.mesh.normal_indices.get(self.start + corner)? as usize * 3;
            let value = DVec3::from_slice(self.mesh.normals.get(index..index + 3)?);
            *normal = value.try_normalize()?.as_vec3();
        }
        Some(normals)
    }
}
