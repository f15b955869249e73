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
    /// What the object is called in the scene.
    pub(super) name: &'a ObjectName,
    /// One for each of its materials, in the order in which they come.
    pub(super) parts: Vec<Part>,
}

/// The parts by object, in the order in which they come; runs of triangles with one name are one object.
pub(super) fn by_object<'a>(mesh: &DisplayMesh, scene: &'a Scene) -> Vec<ObjectParts<'a>> {
    // The objects of the scene by name.
    let mut known: HashMap<&ObjectName, usize> = HashMap::new();
    let runs: Vec<usize> = scene
        .objects
        .iter()
        .map(|object| {
            let next = known.len();
            *known.entry(&object.name).or_insert(next)
        })
        .collect();
    let mut objects: Vec<Option<ObjectParts<'a>>> = (0..known.len()).map(|_| None).collect();
    let mut order = Vec::new();
    let mut places: HashMap<(usize, usize), usize> = HashMap::new();
    for (index, &triangle) in mesh.triangle_of.iter().enumerate() {
        let run = scene
            .objects
            .partition_point(|object| object.end.0 <= triangle);
        let Some((&number, object)) = runs.get(run).zip(scene.objects.get(run)) else {
            continue;
        };
        let parts = objects[number].get_or_insert_with(|| {
            order.push(number);
            ObjectParts {
                name: &object.name,
                parts: Vec::new(),
            }
        });
        let material = scene.triangles[triangle as usize].material.index();
        let place = *places.entry((number, material)).or_insert_with(|| {
            parts.parts.push(Part {
                material,
                triangles: Vec::new(),
            });
            parts.parts.len() - 1
        });
        parts.parts[place].triangles.push(index as u32);
    }
    let ordered = order
        .into_iter()
        .filter_map(|number| objects[number].take());
    ordered.collect()
}
