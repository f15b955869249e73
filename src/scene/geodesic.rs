//! Spheres of triangles that are nearly alike.

use std::collections::HashMap;

use glam::DVec3;

/// A unit sphere of `20 · frequency²` triangles: the icosahedron with every face cut into `frequency` rows. Its vertices and
/// faces, which look outward.
pub(super) fn sphere(frequency: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (corners, faces) = icosahedron();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    // A vertex is known by the weights of the icosahedron's corners, so that neighbouring faces share it exactly.
    let mut known: HashMap<[(u8, u32); 3], u32> = HashMap::new();
    for face in faces {
        let mut row_above: Vec<u32> = Vec::new();
        for row in 0..=frequency {
            let this_row: Vec<u32> = (0..=row)
                .map(|column| {
                    let weights = [frequency - row, row - column, column];
                    let mut key = [0, 1, 2].map(|k| match weights[k] {
                        0 => (0, 0),
                        weight => (face[k], weight),
                    });
                    key.sort_unstable();
                    *known.entry(key).or_insert_with(|| {
                        let sum: DVec3 = key
                            .iter()
                            .map(|&(corner, weight)| corners[corner as usize] * f64::from(weight))
                            .sum();
                        positions.push(sum.normalize_or_zero());
                        positions.len() as u32 - 1
                    })
                })
                .collect();
            triangles.extend(strip(&row_above, &this_row));
            row_above = this_row;
        }
    }
    (positions, triangles)
}

/// Triangles between a row of vertices and one that has one more.
pub(super) fn strip<'a>(above: &'a [u32], below: &'a [u32]) -> impl Iterator<Item = [u32; 3]> + 'a {
    above.iter().enumerate().flat_map(|(column, &apex)| {
        let pointing_up = [apex, below[column], below[column + 1]];
        let beside = above.get(column + 1);
        let pointing_down = beside.map(|&beside| [apex, below[column + 1], beside]);
        [Some(pointing_up), pointing_down].into_iter().flatten()
    })
}

/// Corners and outward faces of the regular icosahedron.
fn icosahedron() -> ([DVec3; 12], [[u8; 3]; 20]) {
    const GOLDEN: f64 = 1.618_033_988_749_895;
    let corners = [
        (-1.0, GOLDEN, 0.0),
        (1.0, GOLDEN, 0.0),
        (-1.0, -GOLDEN, 0.0),
        (1.0, -GOLDEN, 0.0),
        (0.0, -1.0, GOLDEN),
        (0.0, 1.0, GOLDEN),
        (0.0, -1.0, -GOLDEN),
        (0.0, 1.0, -GOLDEN),
        (GOLDEN, 0.0, -1.0),
        (GOLDEN, 0.0, 1.0),
        (-GOLDEN, 0.0, -1.0),
        (-GOLDEN, 0.0, 1.0),
    ]
    .map(|(x, y, z)| DVec3::new(x, y, z));
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    (corners, faces)
}
