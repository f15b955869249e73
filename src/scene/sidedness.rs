//! Which faces are two-sided, and which are turned: sheets are lit on both sides, faces of a consistently wound closed
//! shell on one. What light passes through is lit on both sides, and so is a shell that looks outward if light gets in
//! through a part of it. Materials may say otherwise for their faces.

use glam::Vec3;

use super::nesting;
use super::orientation::{Evidence, Facing, Regions};
use super::shells::{ShelledTriangles, Shells};
use super::{Face, SceneBuilder, SceneOptions, Sides, Triangle, Warning, WarningKind};

impl SceneBuilder {
    /// Triangles in the frame with their sidedness. Shells that are wound the wrong way are turned.
    pub(super) fn triangles(
        &mut self,
        corner_of: &[u32],
        positions: &[Vec3],
        options: &SceneOptions,
    ) -> ShelledTriangles {
        let make = |face: &Face| Triangle {
            corners: face.corners.map(|corner| corner_of[corner as usize]),
            material: face.material,
            two_sided: false,
            bounds_solid: false,
        };
        let mut list: Vec<Triangle> = self.faces.iter().map(make).collect();
        debug_assert!(positions.iter().all(|position| position.is_finite()));
        let shells = Shells::of(&list, positions);
        let facings = self.orient(&mut list, &shells, positions, options.sides);
        let flags = two_sided(&shells, &facings, options.sides);
        for (triangle, two_sided) in list.iter_mut().zip(flags) {
            let material = &self.materials[triangle.material.index()];
            triangle.two_sided = match (options.sides, material.sides) {
                (Sides::Auto, Sides::One) => material.transmission() != Vec3::ZERO,
                (Sides::Auto, Sides::Two) => true,
                (Sides::Auto, Sides::Auto) => two_sided || material.is_see_through(),
                (Sides::One | Sides::Two, _) => two_sided,
            };
            triangle.bounds_solid &= !triangle.two_sided;
        }
        ShelledTriangles { list, shells }
    }

    /// Find out which side of each shell is meant, turn those that are wound otherwise, and mark those that bound solids.
    fn orient(
        &mut self,
        list: &mut [Triangle],
        shells: &Shells,
        positions: &[Vec3],
        sides: Sides,
    ) -> Vec<Facing> {
        let parents = nesting::parents(shells, list, positions);
        let (regions, meant) = {
            let regions = Regions::new(
                shells,
                &parents,
                &Evidence {
                    emits: &|triangle| {
                        let material = list[triangle].material;
                        self.materials[material.index()].emission != Vec3::ZERO
                    },
                    area_vector: &|triangle| {
                        let corners = list[triangle].corners;
                        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
                        (b - a).cross(c - a) * 0.5
                    },
                    normals: &|triangle| self.faces[triangle].normals,
                },
            );
            let mut meant = regions.facings();
            // Where the file says which side is meant, nobody else does.
            for (triangle, &shell) in list.iter().zip(&shells.of_triangle) {
                if self.materials[triangle.material.index()].sides == Sides::One {
                    meant[shell as usize] = Facing::AsWound;
                }
            }
            (regions, meant)
        };
        self.warn_of_orientation(shells, &regions, &meant, sides);
        let mut facings = match sides {
            Sides::Auto => meant,
            Sides::One | Sides::Two => vec![Facing::AsWound; meant.len()],
        };
        let mut solids = regions.solids(&facings);
        for (triangle, &shell) in list.iter().zip(&shells.of_triangle) {
            let shell = shell as usize;
            if self.is_see_through(triangle) {
                solids[shell] = false;
                let is_open = self.materials[triangle.material.index()].sides != Sides::One;
                if sides == Sides::Auto && shells.volume[shell] > 0.0 && is_open {
                    facings[shell] = Facing::Both;
                }
            }
        }
        let faces = self.faces.iter_mut().zip(list);
        for ((face, triangle), &shell) in faces.zip(&shells.of_triangle) {
            triangle.bounds_solid = solids[shell as usize];
            if facings[shell as usize] == Facing::Turned {
                triangle.corners.swap(1, 2);
                face.turn();
            }
        }
        facings
    }

    fn is_see_through(&self, triangle: &Triangle) -> bool {
        self.materials[triangle.material.index()].is_see_through()
    }

    /// Say which shells are not lit as they are wound, or would not be.
    fn warn_of_orientation(
        &mut self,
        shells: &Shells,
        regions: &Regions,
        meant: &[Facing],
        sides: Sides,
    ) {
        let is_odd = |shell: usize| {
            meant[shell] != Facing::AsWound || sides == Sides::One && regions.is_opposed(shell)
        };
        let odd: Vec<usize> = (0..meant.len()).filter(|&shell| is_odd(shell)).collect();
        let is_first = |shell: &u32| odd.first() == Some(&(*shell as usize));
        let Some(first) = shells.of_triangle.iter().position(is_first) else {
            return;
        };
        let of_kind = |kind: Facing| odd.iter().filter(|&&shell| meant[shell] == kind).count();
        let message = match (sides, of_kind(Facing::Turned), of_kind(Facing::Both)) {
            (Sides::Two, _, _) => return,
            (Sides::One, _, _) => {
                "the faces of a surface look away from what they should light, or light falls on their black backs; flip \
                 them, or use --sides auto"
            }
            (Sides::Auto, _, 0) => {
                "the faces of a closed surface looked away from what they should light and were turned; --sides one keeps \
                 their winding"
            }
            (Sides::Auto, 0, _) => {
                "light falls on the backs of a closed surface, so it is lit on both sides; --sides one keeps the backs black"
            }
            (Sides::Auto, _, _) => {
                "the faces of a closed surface looked away from what they should light and were turned or are lit on both \
                 sides; --sides one keeps their winding"
            }
        };
        let line = self.faces[first].line as usize;
        self.warnings.push(Warning {
            kind: WarningKind::Orientation,
            message: message.to_owned(),
            count: odd.len(),
            place: (line > 0).then(|| (self.source.file.clone(), line)),
        });
    }
}

/// One flag per triangle; `facings` by shell.
fn two_sided(shells: &Shells, facings: &[Facing], sides: Sides) -> Vec<bool> {
    let flag = |&shell: &u32| match sides {
        Sides::Auto => !shells.closed[shell as usize] || facings[shell as usize] == Facing::Both,
        Sides::One => false,
        Sides::Two => true,
    };
    shells.of_triangle.iter().map(flag).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shells::tests::{TETRAHEDRON, shells};

    fn flags(corners: &[[u32; 3]]) -> Vec<bool> {
        let shells = shells(corners);
        let facings = vec![Facing::AsWound; shells.closed.len()];
        two_sided(&shells, &facings, Sides::Auto)
    }

    #[test]
    fn closed_shells_are_one_sided_and_sheets_are_not() {
        assert_eq!(flags(&TETRAHEDRON), [false; 4]);
        assert_eq!(flags(&TETRAHEDRON[..3]), [true; 3]);
        let mut with_sheet = TETRAHEDRON.to_vec();
        with_sheet.push([4, 5, 6]);
        assert_eq!(flags(&with_sheet), [false, false, false, false, true]);
        assert!(flags(&[]).is_empty());
    }

    #[test]
    fn one_flipped_or_doubled_face_opens_the_shell() {
        let mut flipped = TETRAHEDRON;
        flipped[2].swap(0, 1);
        assert_eq!(flags(&flipped), [true; 4]);
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push(TETRAHEDRON[0]);
        assert_eq!(flags(&doubled), [true; 5]);
    }
}
