//! From the meshes of a glTF file to faces of a scene: each where a node places it, again for each node.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};

use super::accessors::Elements;
use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::materials::{Look, Materials, Slot};
use super::nodes::Placed;
use super::printable;
use crate::scene::palette::Palettes;
use crate::scene::texcoords::near_origin;
use crate::scene::warning::WarningLog;
use crate::scene::{Face, SceneBuilder, WarningKind, Wrap};

/// Triangles of a scene at most: a small file may place a mesh any number of times. So many take some gigabytes.
pub(super) const MAX_TRIANGLES: usize = 1 << 24;

/// Parts of meshes of a scene at most, those without a surface included, which cost time, too.
const MAX_PARTS: usize = 1 << 20;

/// Vertices for each corner of a part up to which they are kept by number. A part that uses few of many, as where meshes
/// share their buffers, keeps each corner apart, and the scene finds equal ones.
const VERTICES_PER_CORNER: usize = 8;

/// More triangles, or parts, than a scene may have.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooMany {
    pub(super) count: usize,
    pub(super) limit: usize,
}

/// The faces on their way in.
#[derive(Debug)]
pub(super) struct Meshes<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    pub(super) materials: Materials<'a>,
    pub(super) builder: SceneBuilder,
    palettes: Palettes,
    pub(super) log: WarningLog,
    /// Why the first part that was left out was so.
    pub(super) first_fault: Option<String>,
    /// Parts without surface.
    bare_parts: usize,
    /// Faces with corners that do not exist.
    unknown_indices: usize,
    /// Faces two corners of which are one.
    flat_faces: usize,
}

impl<'a> Meshes<'a> {
    pub(super) fn new(
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        materials: Materials<'a>,
        builder: SceneBuilder,
    ) -> Self {
        Self {
            document,
            buffers,
            materials,
            builder,
            palettes: Palettes::default(),
            log: WarningLog::default(),
            first_fault: None,
            bare_parts: 0,
            unknown_indices: 0,
            flat_faces: 0,
        }
    }

    /// Add the meshes of nodes.
    ///
    /// # Errors
    /// When there would be too many triangles.
    pub(super) fn add(&mut self, placed: &[Placed]) -> Result<(), TooMany> {
        let triangle_count = self.count(placed)?;
        self.builder.faces.reserve(triangle_count);
        placed.iter().for_each(|placed| self.add_mesh(placed));
        Ok(())
    }

    /// Triangles of all nodes.
    fn count(&self, placed: &[Placed]) -> Result<usize, TooMany> {
        let (mut parts, mut triangles) = (0_usize, 0_usize);
        for placed in placed {
            let mesh = placed.node.mesh;
            let mesh = mesh.and_then(|index| self.document.meshes.get(index));
            for primitive in mesh.iter().flat_map(|mesh| &mesh.primitives) {
                let part = Part::of(self.document, self.buffers, primitive, placed.world);
                let count = part.map_or(0, |part| part.map_or(0, |part| part.triangle_count()));
                triangles = triangles.saturating_add(count);
                parts += 1;
                for (count, limit) in [(triangles, MAX_TRIANGLES), (parts, MAX_PARTS)] {
                    if count > limit {
                        return Err(TooMany { count, limit });
                    }
                }
            }
        }
        Ok(triangles)
    }

    /// Add the mesh of a node, if it has one.
    fn add_mesh(&mut self, placed: &Placed) {
        let Some(index) = placed.node.mesh else {
            return;
        };
        let Some(mesh) = self.document.meshes.get(index) else {
            self.fault(
                "a mesh that does not exist is named",
                &printable(&placed.node.name),
            );
            return;
        };
        let named = [&placed.node.name, &mesh.name];
        let name = named.into_iter().find(|name| !name.is_empty());
        let name = name.map(|name| printable(name)).unwrap_or_default();
        let objects = &mut self.builder.objects;
        if objects.last().is_none_or(|(last, _)| last.label() != name) {
            objects.push((name.as_str().into(), self.builder.faces.len()));
        }
        let is_posed = mesh.primitives.iter().any(|part| !part.targets.is_empty());
        if is_posed || placed.node.skin.is_some() {
            let what = "meshes that are posed by bones or shapes are in their rest pose";
            self.materials.remark(WarningKind::Unsupported, what, &name);
        }
        for primitive in &mesh.primitives {
            if let Err(reason) = self.part(primitive, placed.world, &name) {
                self.fault(&reason, &name);
            }
        }
    }

    /// Paint what has colours of its own, and count what was left out.
    pub(super) fn finish(mut self) -> Self {
        std::mem::take(&mut self.palettes).finish(&mut self.builder);
        for (kind, count, message) in [
            (
                WarningKind::Unsupported,
                self.bare_parts,
                "lines and points have no surface and were omitted",
            ),
            (
                WarningKind::FaceSkipped,
                self.unknown_indices,
                "skipped a face: vertex index out of range",
            ),
            (
                WarningKind::FaceSkipped,
                self.flat_faces,
                "skipped a face: no area",
            ),
        ] {
            if count > 0 {
                self.log.note_times(kind, message, count, "", 0);
            }
        }
        self
    }

    fn fault(&mut self, reason: &str, name: &str) {
        let message = format!("mesh '{name}': a part was left out, as {reason}");
        self.log.note(WarningKind::FaceSkipped, &message, "", 0);
        self.first_fault.get_or_insert_with(|| reason.to_owned());
    }

    /// Add a part of a mesh; the error is why it is left out.
    fn part(&mut self, primitive: &Primitive, world: DAffine3, name: &str) -> Result<(), String> {
        let part = Part::of(self.document, self.buffers, primitive, world)?;
        let Some(part) = part else {
            self.bare_parts += 1;
            return Ok(());
        };
        let attributes = self.attributes(primitive, &part, name)?;
        self.push_faces(&part, &attributes, name);
        Ok(())
    }

    /// Which material, texture coordinates, colours and normals a part has.
    fn attributes(
        &mut self,
        primitive: &Primitive,
        part: &Part<'a>,
        name: &str,
    ) -> Result<Attributes<'a>, String> {
        let (document, buffers) = (self.document, self.buffers);
        let read = |attribute: &str, widths: &[usize]| {
            let accessor = primitive.attributes.get(attribute);
            let elements = accessor.map(|&index| Elements::of(document, buffers, index, widths));
            elements.transpose()
        };
        let material = primitive.material;
        if material.is_some_and(|index| index >= document.materials.len()) {
            return Err("a material that does not exist is named".to_owned());
        }
        let normals = read("NORMAL", &[3])?;
        let set = self.materials.texture_set(material);
        let texcoords = match set {
            Some(set) => read(&format!("TEXCOORD_{set}"), &[2])?,
            None => None,
        };
        if set.is_some() && texcoords.is_none() {
            let what =
                "meshes without the texture coordinates of their textures have the means of these";
            self.materials
                .remark(WarningKind::TextureMissing, what, name);
        }
        let colors = read("COLOR_0", &[3, 4])?.filter(|colors| part.has_other_than_white(colors));
        let is_textured = texcoords.is_some() && self.materials.has_base_texture(material);
        if colors.is_some() && is_textured {
            let what = "vertex colours of meshes with textures were left out";
            self.materials.remark(WarningKind::Unsupported, what, name);
        }
        let colors = colors.filter(|_| !is_textured);
        let look = match (&colors, &texcoords) {
            (Some(_), _) => Look::Painted,
            (None, Some(_)) => Look::Textured,
            (None, None) => Look::Plain,
        };
        let slot = self
            .materials
            .slot(material, look, buffers, &mut self.builder);
        Ok(Attributes {
            slot,
            texcoords,
            colors,
            normals,
        })
    }

    fn push_faces(&mut self, part: &Part, attributes: &Attributes, name: &str) {
        let mut vertices = Vertices::of(part);
        let mut is_graded = false;
        for triangle in 0..part.triangle_count() {
            let corners = part.corners(triangle);
            let known = corners
                .map(|corner| corner.filter(|&corner| (corner as usize) < part.positions.count()));
            let [Some(a), Some(b), Some(c)] = known else {
                self.unknown_indices += 1;
                continue;
            };
            if a == b || b == c || c == a {
                // Strips are led on by such.
                self.flat_faces += usize::from(part.mode == Primitive::TRIANGLES);
                continue;
            }
            let numbers = match part.is_mirrored {
                true => [a, c, b],
                false => [a, b, c],
            };
            let builder = &mut self.builder;
            let corners = numbers.map(|number| vertices.index(number, part, builder));
            let uv = attributes.uv(numbers);
            if let Some(colors) = attributes.colors(numbers) {
                is_graded |= colors[0] != colors[1] || colors[1] != colors[2];
                let face = builder.faces.len();
                self.palettes.paint(face, attributes.slot.id, colors);
            }
            builder.faces.push(Face {
                corners,
                texcoords: uv.and_then(|uv| near_origin(uv, attributes.wrap())),
                normals: attributes.normals(numbers, part),
                material: attributes.slot.id,
                line: 0,
            });
        }
        if is_graded {
            let what = "vertex colours are those of whole faces, the means of their corners, on these meshes";
            self.materials.remark(WarningKind::Unsupported, what, name);
        }
    }
}

/// The triangles of a part.
struct Part<'a> {
    positions: Elements<'a>,
    /// Nothing where vertices are used in their order.
    indices: Option<Elements<'a>>,
    mode: u32,
    world: DAffine3,
    /// Turns normals, of any length.
    of_normals: DMat3,
    is_mirrored: bool,
}

impl<'a> Part<'a> {
    /// Nothing where it has no surface.
    fn of(
        document: &Document,
        buffers: &'a Buffers<'a>,
        primitive: &Primitive,
        world: DAffine3,
    ) -> Result<Option<Self>, String> {
        if !(Primitive::TRIANGLES..=Primitive::FAN).contains(&primitive.mode) {
            return Ok(None);
        }
        let position = primitive.attributes.get("POSITION");
        let position = *position.ok_or("it has no positions")?;
        let positions = Elements::of(document, buffers, position, &[3])?;
        if positions.are_zero() {
            return Err("all of its positions are 0".to_owned());
        }
        let indices = match primitive.indices {
            None => None,
            Some(index) => {
                let indices = Elements::of(document, buffers, index, &[1])?;
                if !indices.are_indices() {
                    return Err("its indices are no whole numbers".to_owned());
                }
                Some(indices)
            }
        };
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = world.matrix3;
        let is_mirrored = world.matrix3.determinant() < 0.0;
        let side = if is_mirrored { -1.0 } else { 1.0 };
        Ok(Some(Self {
            positions,
            indices,
            mode: primitive.mode,
            world,
            of_normals: DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * side,
            is_mirrored,
        }))
    }

    /// Corners, as far as they are listed.
    fn corner_count(&self) -> usize {
        self.indices
            .map_or(self.positions.count(), |indices| indices.count())
    }

    fn triangle_count(&self) -> usize {
        match self.mode {
            Primitive::TRIANGLES => self.corner_count() / 3,
            _ => self.corner_count().saturating_sub(2),
        }
    }

    /// The vertices of a triangle, as the specification orders them.
    fn corners(&self, triangle: usize) -> [Option<u32>; 3] {
        let at = match self.mode {
            Primitive::STRIP => [
                triangle,
                triangle + 1 + triangle % 2,
                triangle + 2 - triangle % 2,
            ],
            Primitive::FAN => [triangle + 1, triangle + 2, 0],
            _ => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
        };
        at.map(|corner| match &self.indices {
            Some(indices) => indices.index(corner),
            None => u32::try_from(corner).ok(),
        })
    }

    fn position(&self, vertex: u32) -> DVec3 {
        let local = self.positions.floats::<3>(vertex as usize);
        let local = local.map_or(DVec3::NAN, |local| Vec3::from_array(local).as_dvec3());
        self.world.transform_point3(local)
    }

    /// Whether any corner has a colour that changes something.
    fn has_other_than_white(&self, colors: &Elements) -> bool {
        let numbers = (0..self.triangle_count()).flat_map(|triangle| self.corners(triangle));
        let mut colors = numbers
            .flatten()
            .filter_map(|vertex| colors.floats::<3>(vertex as usize));
        colors.any(|color| color != [1.0; 3])
    }
}

/// Where the vertices of a part went in the scene.
struct Vertices {
    /// By vertex, `u32::MAX` where it was not met; empty where each corner is kept apart.
    known: Vec<u32>,
}

impl Vertices {
    fn of(part: &Part) -> Self {
        let count = part.positions.count();
        let is_kept = count <= VERTICES_PER_CORNER * part.triangle_count();
        Self {
            known: vec![u32::MAX; if is_kept { count } else { 0 }],
        }
    }

    fn index(&mut self, vertex: u32, part: &Part, builder: &mut SceneBuilder) -> u32 {
        match self.known.get_mut(vertex as usize) {
            Some(known) if *known != u32::MAX => *known,
            Some(known) => {
                *known = builder.push_position(part.position(vertex));
                *known
            }
            None => builder.push_position(part.position(vertex)),
        }
    }
}

/// What the faces of a part have beside their positions.
struct Attributes<'a> {
    slot: Slot,
    texcoords: Option<Elements<'a>>,
    colors: Option<Elements<'a>>,
    normals: Option<Elements<'a>>,
}

impl Attributes<'_> {
    fn uv(&self, vertices: [u32; 3]) -> Option<[DVec2; 3]> {
        let (placement, texcoords) = (self.slot.placement?, self.texcoords?);
        let mut uv = [DVec2::ZERO; 3];
        for (uv, vertex) in uv.iter_mut().zip(vertices) {
            *uv = placement.place(texcoords.floats(vertex as usize)?);
        }
        Some(uv)
    }

    /// How the textures go on beyond their edges.
    fn wrap(&self) -> [Wrap; 2] {
        let placement = self.slot.placement;
        placement.map_or([Wrap::Repeat; 2], |placement| placement.wrap)
    }

    fn colors(&self, vertices: [u32; 3]) -> Option<[Vec3; 3]> {
        let colors = self.colors?;
        Some(vertices.map(|vertex| {
            let color = colors
                .floats(vertex as usize)
                .map_or(Vec3::ONE, Vec3::from_array);
            color.map(|channel| if channel.is_finite() { channel } else { 0.0 })
        }))
    }

    fn normals(&self, vertices: [u32; 3], part: &Part) -> Option<[Vec3; 3]> {
        let elements = self.normals?;
        let mut normals = [Vec3::ZERO; 3];
        for (normal, vertex) in normals.iter_mut().zip(vertices) {
            let local = Vec3::from_array(elements.floats(vertex as usize)?);
            *normal = (part.of_normals * local.as_dvec3())
                .try_normalize()?
                .as_vec3();
        }
        Some(normals)
    }
}
