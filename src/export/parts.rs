//! The parts of an exported mesh: its triangles by object and material of the scene.

use std::collections::HashMap;

use crate::{
    scene::{ObjectName, Scene},
    solver::DisplayMesh,
};

/// Triangles of one object and one material.
pub(super) struct Part {
    /// Index into the scene's materials.
    pub(super) material: usize,
    /// Indices into the triangles of the display mesh.
    pub(super) triangles: Vec<u32>,
}

/// The parts of one object.
pub(super) struct ObjectParts<'a> {
    /// What the object is called in the scene; `None` where all objects are one.
    pub(super) name: Option<&'a ObjectName>,
    /// One for each of its materials, in the order in which they come.
    pub(super) parts: Vec<Part>,
}

/// The parts by object, in the order in which they come; runs of triangles with one name are one object, and with `merge` all
/// are.
pub(super) fn by_object<'a>(
    mesh: &DisplayMesh,
    scene: &'a Scene,
    merge: bool,
) -> Vec<ObjectParts<'a>> {
    // The number of the object that each run of triangles belongs to.
    let mut known: HashMap<Option<&ObjectName>, usize> = HashMap::new();
    let name_of = |run: usize| (!merge).then(|| &scene.objects[run].name);
    let numbers: Vec<usize> = (0..scene.objects.len())
        .map(|run| {
            let next = known.len();
            *known.entry(name_of(run)).or_insert(next)
        })
        .collect();
    let mut objects: Vec<Option<ObjectParts<'a>>> = (0..known.len()).map(|_| None).collect();
    let mut order = Vec::new();
    let mut places: HashMap<(usize, usize), usize> = HashMap::new();
    for (index, &triangle) in mesh.triangle_of.iter().enumerate() {
        let runs = &scene.objects;
        let run = runs.partition_point(|object| object.end.0 <= triangle);
        let Some(&number) = numbers.get(run) else {
            continue;
        };
        let object = objects[number].get_or_insert_with(|| {
            order.push(number);
            ObjectParts {
                name: name_of(run),
                parts: Vec::new(),
            }
        });
        let material = scene.triangles[triangle as usize].material.index();
        let place = *places.entry((number, material)).or_insert_with(|| {
            object.parts.push(Part {
                material,
                triangles: Vec::new(),
            });
            object.parts.len() - 1
        });
        object.parts[place].triangles.push(index as u32);
    }
    let ordered = order
        .into_iter()
        .filter_map(|number| objects[number].take());
    ordered.collect()
}

#[cfg(test)]
mod tests {
    use super::{super::mesh::tests::named_scene, *};

    #[test]
    fn runs_of_one_name_are_one_object_with_a_part_for_each_material() {
        let scene = named_scene(&[("a", 0), ("b", 1), ("a", 1), ("a", 0)]);
        let mesh = DisplayMesh {
            // Two display triangles on the last one.
            triangle_of: vec![0, 1, 2, 3, 3],
            ..DisplayMesh::default()
        };
        let found = |merge: bool| -> String {
            let mut text = String::new();
            for object in by_object(&mesh, &scene, merge) {
                text += object.name.map_or("all", ObjectName::label);
                for part in object.parts {
                    text += &format!(" {}{:?}", part.material, part.triangles);
                }
                text += "\n";
            }
            text
        };
        assert_eq!(found(false), "a 0[0, 3, 4] 1[2]\nb 1[1]\n");
        assert_eq!(found(true), "all 0[0, 3, 4] 1[1, 2]\n");
    }
}
