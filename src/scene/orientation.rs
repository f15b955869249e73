//! Which side of a closed shell is meant to be lit, where its winding cannot be what was meant.
//!
//! Closed shells divide space into regions: the inside of each, without what lies within shells in it, and the outside of
//! all. A shell bounds two, and its winding says which of them it faces. Other objects are evidence of which regions are seen:
//! sheets and lamps lie in a region that is seen, and shells face one.
//!
//! * A shell that faces a region without other evidence, while there is evidence for the one behind it, is wound the
//!   wrong way: a solid that is inside out, a room or a sky that looks away from what is in it.
//! * Where light shines on its back and its front is needed, too, both sides are lit, as those of a sheet are.
//! * Shading normals of the file that oppose the winding show that a shell was mirrored.
//!
//! A hollow wall, whose outer shell looks outward and whose inner one looks inward, is correct: there is
//! no evidence for the region between them.

use glam::Vec3;

use super::shells::Shells;

/// Mean cosine between the shading normals of a shell and the normals of its faces, weighted by area, at or below which the
/// former oppose the winding: half way between normals without information and those of a mirrored shell. Those of a smooth
/// coarse shape still come to 0.7.
const OPPOSED: f64 = -0.5;

/// Rounds of evaluating the shells again after others have changed. Evidence spreads by one region a time; in
/// nested rooms that are all inside out it takes two.
const ROUNDS: usize = 8;

/// How much of a shell emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Emission {
    None,
    /// A part, whose light may fall on the rest.
    Part,
    Whole,
}

/// How a closed shell is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Facing {
    /// It is lit where the file's winding says.
    AsWound,
    /// It is lit on the other side.
    Turned,
    /// It is lit on both sides.
    Both,
}

/// Properties of the faces, apart from their corners.
pub(super) struct Evidence<'a> {
    /// Whether each triangle emits.
    pub(super) emits: &'a (dyn Fn(usize) -> bool + Sync),
    /// Area vector of each triangle.
    pub(super) area_vector: &'a (dyn Fn(usize) -> Vec3 + Sync),
    /// Shading normals of the corners of each triangle, where it has any.
    pub(super) normals: &'a (dyn Fn(usize) -> Option<[Vec3; 3]> + Sync),
}

/// The closed shells of a scene, the regions they bound, and what else lies in those.
pub(super) struct Regions {
    /// By shell: the region that it lies in. Region 0 is outside of all, that inside shell `s` is `s + 1`.
    around: Vec<usize>,
    /// By shell: whether it encloses space.
    is_closed: Vec<bool>,
    /// By shell: whether its winding looks inward.
    is_inward: Vec<bool>,
    /// By shell: whether the shading normals oppose the winding.
    is_opposed: Vec<bool>,
    emission: Vec<Emission>,
    /// By region: sheets, and those that emit.
    sheets: Vec<Tally>,
    /// By region: shells in it, and the one around it.
    bounds: Vec<u32>,
}

/// Evidence that a region is seen.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Things in it, or facing it and nothing else.
    sure: u32,
    /// Shells that face it among others.
    likely: u32,
    /// Of both, those that shine into it.
    lights: u32,
}

impl Regions {
    /// Gather what lies where; `parents` by shell.
    pub(super) fn new(shells: &Shells, parents: &[Option<u32>], evidence: &Evidence<'_>) -> Self {
        let count = shells.closed.len();
        let mut area = vec![0.0f64; count];
        let mut emitting = vec![0.0f64; count];
        let mut agreement = vec![0.0f64; count];
        for (triangle, &shell) in shells.of_triangle.iter().enumerate() {
            let vector = (evidence.area_vector)(triangle);
            let own = f64::from(vector.length());
            area[shell as usize] += own;
            if (evidence.emits)(triangle) {
                emitting[shell as usize] += own;
            }
            if let Some(normals) = (evidence.normals)(triangle) {
                let sum: Vec3 = normals.into_iter().map(Vec3::normalize_or_zero).sum();
                agreement[shell as usize] += f64::from(vector.dot(sum)) / 3.0;
            }
        }
        let emission: Vec<Emission> = emitting
            .iter()
            .zip(&area)
            .map(|(&emitting, &area)| match emitting {
                0.0 => Emission::None,
                emitting if emitting < area => Emission::Part,
                _ => Emission::Whole,
            })
            .collect();
        let is_closed: Vec<bool> = shells.volume.iter().map(|&volume| volume != 0.0).collect();
        let around: Vec<usize> = parents
            .iter()
            .map(|parent| parent.map_or(0, |parent| parent as usize + 1))
            .collect();
        let mut sheets = vec![Tally::default(); count + 1];
        let mut bounds = vec![0; count + 1];
        for shell in 0..count {
            let region = around[shell];
            if is_closed[shell] {
                bounds[region] += 1;
                bounds[shell + 1] += 1;
            } else {
                sheets[region].sure += 1;
                sheets[region].lights += u32::from(emission[shell] != Emission::None);
            }
        }
        Self {
            around,
            is_inward: shells.volume.iter().map(|&volume| volume < 0.0).collect(),
            is_opposed: (0..count)
                .map(|shell| agreement[shell] < OPPOSED * area[shell])
                .collect(),
            is_closed,
            emission,
            sheets,
            bounds,
        }
    }

    /// Which side of each shell is meant to be lit. Open shells are as they are wound.
    pub(super) fn facings(&self) -> Vec<Facing> {
        let opposed = |shell: usize| match self.is_opposed[shell] && self.is_closed[shell] {
            true => Facing::Turned,
            false => Facing::AsWound,
        };
        let mut facings: Vec<Facing> = (0..self.around.len()).map(opposed).collect();
        for _ in 0..ROUNDS {
            let tallies = self.tallies(&facings);
            let judged = (0..facings.len())
                .map(|shell| match self.is_closed[shell] {
                    true => self.judge(shell, facings[shell], &tallies),
                    false => Facing::AsWound,
                })
                .collect();
            if facings == judged {
                break;
            }
            facings = judged;
        }
        facings
    }

    /// Whether the shading normals of a shell oppose its winding.
    pub(super) fn is_opposed(&self, shell: usize) -> bool {
        self.is_opposed[shell]
    }

    /// By shell: whether it bounds a solid. A shell that looks outward does, unless there is light inside: it may be a room
    /// that is turned inside out. One that looks inward does where it is the hollow of a solid: else it is a room.
    pub(super) fn solids(&self, facings: &[Facing]) -> Vec<bool> {
        let tallies = self.tallies(facings);
        let looks_outward = |shell: usize| {
            self.faces(shell, facings[shell]) == [false, true] && self.is_closed[shell]
        };
        (0..facings.len())
            .map(|shell| {
                let is_hollow = || {
                    let around = self.around[shell].checked_sub(1);
                    around.is_some_and(looks_outward)
                        && self.faces(shell, facings[shell]) == [true, false]
                };
                let is_dark = || tallies[shell + 1].lights == 0;
                self.is_closed[shell] && (looks_outward(shell) && is_dark() || is_hollow())
            })
            .collect()
    }

    /// Whether a shell faces the region inside and the one outside.
    fn faces(&self, shell: usize, facing: Facing) -> [bool; 2] {
        let is_inward = self.is_inward[shell];
        match facing {
            Facing::AsWound => [is_inward, !is_inward],
            Facing::Turned => [!is_inward, is_inward],
            Facing::Both => [true, true],
        }
    }

    /// The evidence of a shell for the region inside and for the one outside.
    fn says(&self, shell: usize, facing: Facing) -> [Tally; 2] {
        let is_sure = facing != Facing::Both;
        let shines = self.emission[shell] != Emission::None;
        self.faces(shell, facing).map(|faces| Tally {
            sure: u32::from(faces && is_sure),
            likely: u32::from(faces && !is_sure),
            lights: u32::from(faces && shines),
        })
    }

    fn tallies(&self, facings: &[Facing]) -> Vec<Tally> {
        let mut tallies = self.sheets.clone();
        for (shell, &facing) in facings.iter().enumerate() {
            if self.is_closed[shell] {
                let [inside, outside] = self.says(shell, facing);
                tallies[shell + 1].add(inside);
                tallies[self.around[shell]].add(outside);
            }
        }
        tallies
    }

    /// How a closed shell is lit, by the evidence of others for its two regions; `facing` is its present state.
    fn judge(&self, shell: usize, facing: Facing, tallies: &[Tally]) -> Facing {
        let [own_inside, own_outside] = self.says(shell, facing);
        let inside = tallies[shell + 1].without(own_inside);
        let outside = tallies[self.around[shell]].without(own_outside);
        let is_inward = self.is_inward[shell] != self.is_opposed[shell];
        let ([front, back], before, behind) = if is_inward {
            ([inside, outside], shell + 1, self.around[shell])
        } else {
            ([outside, inside], self.around[shell], shell + 1)
        };
        let emission = self.emission[shell];
        let shines = emission != Emission::None;
        let (as_told, turned) = match self.is_opposed[shell] {
            true => (Facing::Turned, Facing::AsWound),
            false => (Facing::AsWound, Facing::Turned),
        };
        match (front.is_used(), back.is_used()) {
            (true, true) if back.lights > 0 || shines && !is_inward => Facing::Both,
            // A room whose lamps are its own, or a lamp with its housing.
            (false, true) if is_inward && emission == Emission::Part => Facing::Both,
            // A solid without light inside may hold what is never seen.
            (false, true) if is_inward || back.lights > 0 || shines => match back.sure {
                0 => Facing::Both,
                _ => turned,
            },
            // The same as above, outward.
            (false, false) if !is_inward && emission == Emission::Part => Facing::Both,
            // All light of a lamp is lost, and other shells, which may be wound the wrong way, too, lie behind it.
            (false, false)
                if emission == Emission::Whole
                    && self.bounds[before] == 1
                    && self.bounds[behind] > 1 =>
            {
                Facing::Both
            }
            _ => as_told,
        }
    }
}

impl Tally {
    fn is_used(self) -> bool {
        self.sure + self.likely > 0
    }

    fn add(&mut self, other: Self) {
        self.sure += other.sure;
        self.likely += other.likely;
        self.lights += other.lights;
    }

    fn without(self, other: Self) -> Self {
        Self {
            sure: self.sure - other.sure,
            likely: self.likely - other.likely,
            lights: self.lights - other.lights,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::scene::{
        Material, MaterialId, Scene, SceneBuilder, SceneOptions, Sides, WarningKind,
        shells::tests::CUBOID,
    };

    const GREY: MaterialId = MaterialId(0);
    const LAMP: MaterialId = MaterialId(1);

    /// A scene of cuboids that look outward or inward, and of lamps that look down.
    struct Cuboids(SceneBuilder);

    impl Cuboids {
        fn new() -> Self {
            let mut builder = SceneBuilder::default();
            let half = glam::Vec3::splat(0.5);
            builder.push_material(Material::plain("grey", half, glam::Vec3::ZERO));
            builder.push_material(Material::plain("lamp", glam::Vec3::ZERO, glam::Vec3::ONE));
            Self(builder)
        }

        /// A cube about a point; `ceiling` is the material of its top.
        fn cube(
            mut self,
            at: [f64; 3],
            side: f64,
            is_inward: bool,
            material: MaterialId,
            ceiling: MaterialId,
        ) -> Self {
            let name = format!("cube {}", self.0.objects.len());
            self.0
                .objects
                .push((name.as_str().into(), self.0.faces.len()));
            let corners: Vec<u32> = (0..8)
                .map(|corner| {
                    let of_axis = |axis: usize| f64::from(corner >> axis & 1) - 0.5;
                    let offset = DVec3::new(of_axis(0), of_axis(1), of_axis(2));
                    self.0.push_position(DVec3::from(at) + offset * side)
                })
                .collect();
            let materials = [material, ceiling, material, material, material, material];
            for (face, of_face) in CUBOID.into_iter().zip(materials) {
                let [a, mut b, c, mut d] = face.map(|corner| corners[corner]);
                if is_inward {
                    (b, d) = (d, b);
                }
                self.0.push_triangle([a, b, c], of_face);
                self.0.push_triangle([a, c, d], of_face);
            }
            self
        }

        fn outward(self, at: [f64; 3], side: f64, material: MaterialId) -> Self {
            self.cube(at, side, false, material, material)
        }

        fn inward(self, at: [f64; 3], side: f64, material: MaterialId) -> Self {
            self.cube(at, side, true, material, material)
        }

        /// A level square sheet.
        fn sheet(mut self, at: [f64; 3], side: f64, material: MaterialId) -> Self {
            self.0.objects.push(("sheet".into(), self.0.faces.len()));
            let [a, b, c, d] =
                [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)].map(|(x, y)| {
                    let offset = DVec3::new(x, y, 0.0);
                    self.0.push_position(DVec3::from(at) + offset * side)
                });
            self.0.push_triangle([a, b, c], material);
            self.0.push_triangle([a, c, d], material);
            self
        }

        fn scene(&self, sides: Sides) -> Scene {
            self.0
                .clone()
                .finish(&SceneOptions::with_sides(sides))
                .expect("it has faces")
        }

        /// How each cube is lit, in order, and how many the warning counts.
        fn lit(&self) -> (String, usize) {
            let scene = self.scene(Sides::Auto);
            let states = cubes(&scene).map(|triangles| {
                let position = |corner: u32| scene.positions[corner as usize];
                let corners = scene.triangles[triangles.clone()]
                    .iter()
                    .flat_map(|triangle| triangle.corners);
                let (min, max) = corners
                    .map(position)
                    .fold((glam::Vec3::MAX, glam::Vec3::MIN), |(min, max), at| {
                        (min.min(at), max.max(at))
                    });
                let first = scene.triangles[triangles.start];
                let outward = position(first.corners[0]) - (min + max) / 2.0;
                let normal = scene.surfaces[triangles.start].area_vector;
                match (first.two_sided, normal.dot(outward) > 0.0) {
                    (true, _) => 'b',
                    (false, true) => 'o',
                    (false, false) => 'i',
                }
            });
            (states.collect(), warned(&scene))
        }
    }

    /// The triangles of each cube, which other faces may have cut.
    fn cubes(scene: &Scene) -> impl Iterator<Item = std::ops::Range<usize>> {
        let cubes = scene.objects.iter();
        cubes
            .filter(|object| object.name.label().starts_with("cube"))
            .map(|object| object.start.index()..object.end.index())
    }

    fn warned(scene: &Scene) -> usize {
        let warnings = scene.warnings.iter();
        warnings
            .filter(|warning| warning.kind == WarningKind::Orientation)
            .map(|warning| warning.count)
            .sum()
    }

    fn expect(cuboids: &Cuboids, lit: &str, warned: usize) {
        assert_eq!(cuboids.lit(), (lit.to_owned(), warned));
    }

    const O: [f64; 3] = [0.0; 3];

    #[test]
    fn solids_that_are_inside_out_are_turned() {
        let room = || {
            Cuboids::new()
                .inward(O, 8.0, GREY)
                .sheet([0.0, 0.0, 3.5], 1.0, LAMP)
        };
        // In a room, standing on its floor, on a sheet.
        for at in [O, [1.0, 2.0, -3.5]] {
            let cuboids = Cuboids::new()
                .inward(O, 8.0, GREY)
                .inward(at, 1.0, GREY)
                .sheet([0.0, 0.0, 3.5], 1.0, LAMP);
            expect(&cuboids, "io", 1);
        }
        let on_ground = Cuboids::new()
            .inward([0.0, 0.0, 0.5], 1.0, GREY)
            .inward([3.0, 0.0, 0.5], 1.0, GREY)
            .sheet([0.0, 0.0, -0.1], 20.0, GREY)
            .sheet([0.0, 0.0, 9.0], 1.0, LAMP);
        expect(&on_ground, "oo", 2);
        expect(&room(), "i", 0);
    }

    #[test]
    fn bulbs_that_are_inside_out_are_turned() {
        let cuboids = Cuboids::new()
            .inward(O, 8.0, GREY)
            .inward([0.0, 0.0, 2.0], 1.0, LAMP)
            .outward([0.0, 0.0, -3.0], 1.0, GREY);
        expect(&cuboids, "ioo", 1);
    }

    #[test]
    fn skies_and_rooms_that_look_outward_are_turned() {
        let sky = Cuboids::new()
            .outward(O, 50.0, LAMP)
            .inward(O, 1.0, GREY)
            .sheet(O, 9.0, GREY);
        expect(&sky, "io", 2);
        let room = Cuboids::new()
            .outward(O, 8.0, GREY)
            .outward(O, 1.0, GREY)
            // In the plane of the ceiling, as lamps often are.
            .sheet([0.0, 0.0, 4.0], 1.0, LAMP);
        expect(&room, "io", 1);
        let all = Cuboids::new()
            .outward(O, 8.0, GREY)
            .inward(O, 1.0, GREY)
            .sheet([0.0, 0.0, 3.5], 1.0, LAMP);
        expect(&all, "io", 2);
    }

    #[test]
    fn what_both_sides_speak_for_is_lit_on_both() {
        // A house on sunlit ground; a room of one shell with its lamps; a lampshade in a room.
        let house = Cuboids::new()
            .outward([0.0, 0.0, 2.5], 5.0, GREY)
            .sheet([0.0, 0.0, 4.0], 1.0, LAMP)
            .sheet([0.0, 0.0, -0.1], 40.0, GREY)
            .sheet([0.0, 0.0, 30.0], 9.0, LAMP);
        expect(&house, "b", 1);
        let whole = Cuboids::new().cube(O, 4.0, false, GREY, LAMP);
        expect(&whole, "b", 1);
        let shade = Cuboids::new()
            .inward(O, 8.0, GREY)
            .outward(O, 1.0, GREY)
            .outward(O, 0.2, LAMP);
        expect(&shade, "ibo", 1);
    }

    #[test]
    fn what_is_wound_as_it_is_meant_stays() {
        // A hollow wall about a lamp, with something in the room; the same, dark; rooms of one shell side by side, one of
        // them empty; a furnace; a block on the ground; solids that reach into each other.
        let hollow = || Cuboids::new().outward(O, 9.0, GREY).inward(O, 8.0, GREY);
        let lamp = [0.0, 0.0, 3.9];
        expect(
            &hollow().outward(O, 1.0, GREY).sheet(lamp, 1.0, LAMP),
            "oio",
            0,
        );
        expect(&hollow().sheet([0.0, 0.0, 30.0], 1.0, LAMP), "oi", 0);
        let rooms = Cuboids::new()
            .cube(O, 4.0, true, GREY, LAMP)
            .cube([6.0, 0.0, 0.0], 4.0, true, GREY, LAMP)
            .inward([12.0, 0.0, 0.0], 4.0, GREY);
        expect(&rooms, "iii", 0);
        expect(&Cuboids::new().inward(O, 4.0, LAMP), "i", 0);
        let outside = Cuboids::new()
            .outward([0.0, 0.0, 0.5], 1.0, GREY)
            .outward([0.8, 0.3, 0.6], 1.0, GREY)
            .sheet([0.0, 0.0, -0.1], 20.0, GREY)
            .sheet([0.0, 0.0, 9.0], 1.0, LAMP);
        expect(&outside, "oo", 0);
    }

    #[test]
    fn shading_normals_tell_which_side_is_the_front() {
        // A mirrored room with its furniture, lamps and all, as its normals know.
        let mut cuboids = Cuboids::new()
            .outward(O, 8.0, GREY)
            .inward([2.0, 0.0, 0.0], 1.0, GREY)
            .inward([-2.0, 0.0, 0.0], 1.0, LAMP);
        let builder = &mut cuboids.0;
        let positions = builder.positions.clone();
        for face in &mut builder.faces {
            let [a, b, c] = face.corners.map(|corner| positions[corner as usize]);
            let normal = -(b - a).cross(c - a).normalize_or_zero();
            face.normals = Some([normal.as_vec3(); 3]);
        }
        expect(&cuboids, "ioo", 3);
        // Normals that tell nothing change nothing.
        for face in &mut cuboids.0.faces {
            face.normals = Some([glam::Vec3::Z; 3]);
        }
        assert_eq!(cuboids.lit().0.len(), 3);
        let solid = |normal: glam::Vec3| {
            let mut cuboids =
                Cuboids::new()
                    .outward(O, 1.0, GREY)
                    .sheet([0.0, 0.0, 3.0], 1.0, LAMP);
            for face in &mut cuboids.0.faces {
                face.normals = Some([normal; 3]);
            }
            cuboids
        };
        for normal in [glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::NAN] {
            expect(&solid(normal), "o", 0);
        }
    }

    #[test]
    fn the_winding_of_the_file_stays_where_it_is_asked_for() {
        let cuboids = Cuboids::new().outward(O, 8.0, GREY).sheet(O, 1.0, LAMP);
        let (one, two) = (cuboids.scene(Sides::One), cuboids.scene(Sides::Two));
        assert_eq!((warned(&one), warned(&two)), (1, 0));
        for scene in [&one, &two] {
            let corners = scene.triangles[0]
                .corners
                .map(|at| scene.positions[at as usize]);
            let [a, b, c] = corners;
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
    }

    #[test]
    fn solids_and_their_hollows_are_told_from_rooms() {
        let solids = |cuboids: Cuboids| -> Vec<bool> {
            let scene = cuboids.scene(Sides::One);
            cubes(&scene)
                .map(|triangles| scene.triangles[triangles.start].bounds_solid)
                .collect()
        };
        let beside = [20.0, 0.0, 0.0];
        let all_outward = Cuboids::new()
            .outward(O, 8.0, GREY)
            .outward(O, 4.0, GREY)
            .outward(beside, 1.0, GREY);
        assert_eq!(solids(all_outward), [true; 3]);
        let hollow = Cuboids::new()
            .inward(O, 8.0, GREY)
            .outward(O, 4.0, GREY)
            .inward(O, 1.0, GREY)
            .inward(beside, 1.0, GREY);
        assert_eq!(solids(hollow), [false, true, true, false]);
        let around_light = Cuboids::new().outward(O, 8.0, GREY).outward(O, 1.0, LAMP);
        assert_eq!(solids(around_light), [false, true]);
    }
}
