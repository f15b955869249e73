//! Random damage to files, and what every scene that was read promises.

#![allow(dead_code, reason = "each test uses some of it")]

use std::path::PathBuf;

use vecrad::scene::Scene;

/// How many cases a randomised test runs: `VECRAD_FUZZ_CASES`, else as many as take seconds.
pub(crate) fn case_count(usual: u64) -> u64 {
    std::env::var("VECRAD_FUZZ_CASES")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(usual)
}

/// Repeatable numbers: SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Chance(u64);

impl Chance {
    /// The sequence of a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    /// Any number.
    pub(crate) fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below a bound of at least 1.
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.number() % bound as u64) as usize
    }

    /// One of several.
    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// Words that readers stumble over.
const WORDS: [&[u8]; 36] = [
    b"nan",
    b"-inf",
    b"1e39",
    b"1e-320",
    b"1e999",
    b"-0",
    b"0",
    b"-1",
    b"9999999999",
    b"99999999999999999999999",
    b"-9223372036854775808",
    b"4294967296",
    b"1/",
    b"//",
    b"1/2/3/4",
    b"1.#IND",
    b"\\\n",
    b"\\",
    b"\0",
    b"\r",
    b"\n",
    b"\t",
    b"#",
    b"\"",
    b"'",
    b"[",
    b"=",
    b"\xff\xb0",
    b"\xef\xbb\xbf",
    b"\x1b[2J",
    b"f 1 2 3\n",
    b"v 0 0 0\n",
    b"newmtl m\n",
    b"usemtl m\n",
    b"mtllib a.mtl\n",
    b"../../../etc/passwd",
];

/// Spoil a text in one to a handful of places: bytes, words, lines, or its end.
pub(crate) fn spoil(text: &mut Vec<u8>, chance: &mut Chance) {
    for _ in 0..=chance.below(5) {
        spoil_once(text, chance);
    }
}

fn spoil_once(text: &mut Vec<u8>, chance: &mut Chance) {
    let at = chance.below(text.len() + 1);
    let end = (at + chance.below(8)).min(text.len());
    let is_break = |byte: &u8| *byte == b'\n';
    match chance.below(9) {
        // A bit, a byte, a word.
        0 if at < text.len() => text[at] ^= 1 << chance.below(8),
        1 => drop(text.splice(at..end, [chance.number() as u8])),
        2 => drop(text.splice(at..end, chance.pick(&WORDS).iter().copied())),
        3 => {
            let is_space = |byte: &u8| byte.is_ascii_whitespace();
            let start = text[..at].iter().rposition(is_space).map_or(0, |i| i + 1);
            let end = text[at..]
                .iter()
                .position(is_space)
                .map_or(text.len(), |length| at + length);
            text.splice(start..end.max(start), chance.pick(&WORDS).iter().copied());
        }
        // Something gone, something twice.
        4 => drop(text.drain(at..end)),
        5 => {
            let piece = text[at..end].to_vec();
            let times = 1 + chance.below(50);
            text.splice(at..at, piece.repeat(times));
        }
        // A line gone, or moved.
        6 | 7 => {
            let start = text[..at].iter().rposition(is_break).map_or(0, |i| i + 1);
            let end = text[at..]
                .iter()
                .position(is_break)
                .map_or(text.len(), |length| at + length + 1);
            let line: Vec<u8> = text.drain(start..end).collect();
            if chance.below(2) == 0 {
                let to = chance.below(text.len() + 1);
                text.splice(to..to, line);
            }
        }
        _ => text.truncate(at),
    }
}

/// The invariants of every scene, whatever its file of so many bytes was.
pub(crate) fn assert_promises(scene: &Scene, bytes: usize) {
    assert!(scene.positions.iter().all(|position| position.is_finite()));
    assert_eq!(scene.surfaces.len(), scene.triangles.len());
    assert!(!scene.triangles.is_empty());
    for triangle in &scene.triangles {
        let mut corners = triangle.corners.iter();
        assert!(corners.all(|&corner| (corner as usize) < scene.positions.len()));
        assert!(triangle.material.index() < scene.materials.len());
    }
    for surface in &scene.surfaces {
        assert!(surface.area_vector.is_finite() && surface.area_vector.length() > 0.0);
        assert!(surface.reflectance.min_element() >= 0.0);
        assert!(surface.reflectance.max_element() <= 0.98);
        assert!(surface.emission.is_finite() && surface.emission.min_element() >= 0.0);
    }
    let per_triangle = |count: usize| count == 0 || count == scene.triangles.len();
    assert!(per_triangle(scene.texcoords.len()) && per_triangle(scene.normals.len()));
    let end = scene.objects.iter().fold(0, |end, object| {
        assert_eq!(object.start.index(), end);
        object.end.index()
    });
    assert_eq!(end, scene.triangles.len());
    // A corner takes two bytes at least, and a polygon has more corners than triangles.
    assert!(scene.face_count <= bytes / 2);
    // Faces that others cross are cut, each into so many parts at most.
    let most_points = bytes + 1024 * scene.face_count;
    assert!(scene.positions.len() <= most_points);
    assert!(scene.triangles.len() <= 2 * most_points);
    for count in [scene.materials.len(), scene.objects.len()] {
        assert!(count <= bytes, "{count} of {bytes} bytes");
    }
    for texture in &scene.textures {
        let count = texture.width as usize * texture.height as usize;
        assert_eq!(texture.pixels.len(), count);
    }
    for warning in &scene.warnings {
        assert!(warning.count >= 1 && warning.message.len() < 4000);
        assert!(!warning.message.contains(char::is_control), "{warning:?}");
    }
}

/// Everything of two readings of one file that could differ.
pub(crate) fn assert_same(one: &Scene, other: &Scene) {
    assert_eq!(one.positions, other.positions);
    assert_eq!(one.triangles, other.triangles);
    assert_eq!(one.surfaces, other.surfaces);
    assert_eq!(one.materials, other.materials);
    assert_eq!(one.objects, other.objects);
    assert_eq!(one.texcoords, other.texcoords);
    assert_eq!(one.normals, other.normals);
    assert_eq!(one.warnings, other.warnings);
    assert_eq!(one.files, other.files);
}

/// A folder for one test's files, on a disk in memory where there is one.
pub(crate) fn folder() -> (tempfile::TempDir, PathBuf) {
    let memory = std::path::Path::new("/dev/shm");
    let made = tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir());
    let folder = made.expect("a folder can be made");
    let path = folder.path().to_owned();
    (folder, path)
}
