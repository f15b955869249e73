//! An OBJ file on its way to the parser: every statement is checked, bad ones become harmless ones so that indices
//! keep their meaning, and what only this program understands (objects, materials, lines of faces) is noted aside.
//!
//! The parser reads nothing but ASCII `v`, `vt`, `vn`, `f` and `o` statements. Its `o` names are numbers of
//! [`Segment`]s. The first `vt` and the first `vn` it sees are not numbers: they stand for "none".
//! Faces that follow each other are handed over as one long face, which it reads several times faster than many short
//! ones; [`FaceNote`] has the end of each.

use std::collections::HashMap;
use std::io::BufRead;
use std::sync::Arc;

use super::builder::ObjectName;
use super::lines::{LogicalLines, Notation, Number, decode, label, split_keyword, words};
use super::up_axis::UpAxis;
use super::upright::told_by;
use super::warning::{WarningKind, WarningLog};

/// Faces that share an object name and a material.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Names of the last `o` and the last `g` after it.
    pub(super) name: ObjectName,
    /// Index into [`Notes::materials`].
    pub(super) material: Option<usize>,
}

/// A name with the line where it was first met and how often.
#[derive(Clone, Debug)]
pub(super) struct Mention {
    /// The name as in the file, decoded.
    pub(super) name: String,
    /// The first line.
    pub(super) line: usize,
    /// How often.
    pub(super) count: usize,
}

/// A face that the parser sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceNote {
    /// Where it stands in the file.
    pub(super) line: u32,
    /// How many corners it has.
    pub(super) corner_count: u32,
}

/// A number in a notation that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ForeignNumber {
    /// How it is written.
    pub(super) notation: Notation,
    /// Where it stands in the file.
    pub(super) line: usize,
}

/// Notes of the cleaner.
#[derive(Debug, Default)]
pub(super) struct Notes {
    /// Segments by the number that the parser sees as their name.
    pub(super) segments: Vec<Segment>,
    /// The faces that the parser sees, in order.
    pub(super) faces: Vec<FaceNote>,
    /// Names of `usemtl`, in order of first use.
    pub(super) materials: Vec<Mention>,
    /// Arguments of `mtllib`, each once.
    pub(super) libraries: Vec<Mention>,
    /// The first number of a vertex in a notation that cannot be read.
    pub(super) foreign_number: Option<ForeignNumber>,
    /// Faces that were omitted.
    pub(super) skipped_faces: usize,
    /// OBJ statements that were understood.
    pub(super) statements: usize,
    /// Whether the file holds anything but white space.
    pub(super) any_text: bool,
    /// The error that ended reading.
    pub(super) failure: Option<String>,
    /// The line of the first vertex with a colour.
    pub(super) first_color: Option<usize>,
    /// The axis that points up, as a comment before the first statement tells.
    pub(super) up: Option<UpAxis>,
    /// Corrections and omissions.
    pub(super) log: WarningLog,
}

/// Text handed to the parser at once. Smaller, and threads wait for each other; larger, and the text leaves the cache.
const CHUNK: usize = 64 << 10;

/// The colour of vertices without one beside others with colours: white.
const UNCOLORED: [&[u8]; 3] = [b"1"; 3];

/// A clean view of an OBJ file.
#[derive(Debug)]
pub(super) struct ObjCleaner<R> {
    lines: LogicalLines<R>,
    file: String,
    clean: Vec<u8>,
    /// Whether the clean text ends within a face, which the next one continues.
    in_face: bool,
    /// Notes so far.
    pub(super) notes: Notes,
    /// Whether vertices have colours, as the first one says: the parser needs one for all or none.
    is_colored: bool,
    position_count: i64,
    texcoord_count: i64,
    normal_count: i64,
    /// Numbers of positions that are no points, ascending from 1.
    bad_positions: Vec<i64>,
    name: ObjectName,
    material: Option<usize>,
    material_index: HashMap<String, usize>,
    segment_is_new: bool,
    corners: Vec<[i64; 3]>,
    /// Whether the last face had texture coordinates or normals: the parser repeats the last one where there is none.
    last_had_attributes: bool,
}

/// One statement's trouble that costs the face.
type Reason = &'static str;

impl<R: BufRead> ObjCleaner<R> {
    /// Start at the beginning of a file; `file` is its name for messages.
    pub(super) fn new(source: R, file: &str) -> Self {
        Self {
            lines: LogicalLines::new(source),
            file: file.to_owned(),
            clean: b"vt nan nan\nvn nan nan nan\n".to_vec(),
            in_face: false,
            notes: Notes::default(),
            is_colored: false,
            position_count: 0,
            texcoord_count: 0,
            normal_count: 0,
            bad_positions: Vec::new(),
            name: ObjectName::default(),
            material: None,
            material_index: HashMap::new(),
            segment_is_new: true,
            corners: Vec::new(),
            last_had_attributes: false,
        }
    }

    /// The next lines as clean text, or nothing at the end or after [`Notes::failure`].
    pub(super) fn next_chunk(&mut self) -> Option<Vec<u8>> {
        while self.clean.len() < CHUNK {
            let line = match self.lines.advance(&mut self.notes.log, &self.file) {
                Ok(Some(line)) => line,
                Ok(None) => break,
                Err(error) => {
                    self.notes.failure = Some(error.to_string());
                    return None;
                }
            };
            let text = std::mem::take(&mut self.lines.text);
            self.statement(&text, line);
            self.lines.text = text;
        }
        self.end_face();
        let next = Vec::with_capacity(self.clean.len() + CHUNK / 8);
        let chunk = std::mem::replace(&mut self.clean, next);
        (!chunk.is_empty()).then_some(chunk)
    }

    /// End the face that the clean text ends in.
    fn end_face(&mut self) {
        if std::mem::take(&mut self.in_face) {
            self.clean.push(b'\n');
        }
    }

    fn statement(&mut self, text: &[u8], line: usize) {
        let (keyword, rest) = split_keyword(text);
        self.notes.any_text |= !keyword.is_empty();
        match keyword {
            b"v" => self.position_statement(rest, line),
            b"vt" => self.texcoord_statement(rest, line),
            b"vn" => self.normal_statement(rest, line),
            b"f" | b"fo" => self.face_statement(rest, line),
            b"o" => {
                self.name = ObjectName::from(label(&decode(rest)));
                self.segment_is_new = true;
            }
            b"g" => {
                self.name.group = Arc::from(label(&decode(rest)));
                self.segment_is_new = true;
            }
            b"usemtl" => self.material_statement(rest, line),
            b"mtllib" => self.library_statement(rest, line),
            [b'#', ..] if self.notes.statements == 0 => {
                self.notes.up = self.notes.up.or_else(|| told_by(text));
                return;
            }
            _ => return self.other_statement(keyword, line),
        }
        self.notes.statements += 1;
    }

    fn other_statement(&mut self, keyword: &[u8], line: usize) {
        let (kind, message) = match keyword {
            b"" | [b'#', ..] => return,
            b"l" | b"p" => (
                WarningKind::Unsupported,
                "lines and points have no surface and were omitted",
            ),
            b"curv" | b"curv2" | b"surf" => (
                WarningKind::Unsupported,
                "free-form curves and surfaces (NURBS) were omitted; export them as polygons",
            ),
            b"call" | b"csh" => (
                WarningKind::Unsupported,
                "calls of other files and commands were omitted",
            ),
            // Smoothing, display hints and the details of free-form surfaces change nothing here.
            b"s" | b"mg" | b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"parm" | b"trim"
            | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"bevel" | b"c_interp"
            | b"d_interp" | b"lod" | b"shadow_obj" | b"trace_obj" | b"ctech" | b"stech"
            | b"maplib" | b"usemap" => return,
            _ => (
                WarningKind::LineSkipped,
                "skipped a line that is no OBJ statement",
            ),
        };
        self.note(kind, message, line);
    }

    fn note(&mut self, kind: WarningKind, message: &str, line: usize) {
        self.notes.log.note(kind, message, &self.file, line);
    }

    fn position_statement(&mut self, rest: &[u8], line: usize) {
        self.position_count += 1;
        self.end_face();
        let mut values = words(rest);
        if let Err(trouble) = self.copy_numbers(b"v", &mut values, 3) {
            self.clean.extend_from_slice(b"v 0 0 0\n");
            self.bad_positions.push(self.position_count);
            let message = match trouble.notation() {
                Some(notation) => {
                    let first = ForeignNumber { notation, line };
                    self.notes.foreign_number.get_or_insert(first);
                    let Notation { name, cure } = notation;
                    &format!("vertex with {name}; faces that use it are omitted; {cure}")
                }
                None if trouble == Number::NotFinite => {
                    "vertex that is not a finite number; faces that use it are omitted"
                }
                None => "vertex without three numbers; faces that use it are omitted",
            };
            self.note(WarningKind::LineSkipped, message, line);
        }
        self.color(&mut values, line);
    }

    /// Copy the colour behind the position that the clean text ends with: three more numbers; one is a weight for
    /// free-form surfaces. The parser needs a colour for all vertices or none, so the first one decides.
    fn color<'a>(&mut self, values: &mut impl Iterator<Item = &'a [u8]>, line: usize) {
        let color = [(); 3].map(|()| values.next().unwrap_or_default());
        let is_color = color.iter().all(|word| Number::of(word) == Number::Finite);
        if is_color {
            self.notes.first_color.get_or_insert(line);
        }
        if self.position_count == 1 {
            self.is_colored = is_color;
        }
        if self.is_colored {
            let words = if is_color { color } else { UNCOLORED };
            self.clean.pop();
            for word in words {
                self.clean.push(b' ');
                self.clean.extend_from_slice(word);
            }
            self.clean.push(b'\n');
        }
    }

    fn texcoord_statement(&mut self, rest: &[u8], line: usize) {
        self.texcoord_count += 1;
        self.end_face();
        // One value is legal, the other is then 0.
        let second: &[u8] = if words(rest).nth(1).is_some() {
            b""
        } else {
            b"0"
        };
        let mut values = words(rest).chain(words(second));
        let copied = match words(rest).next() {
            Some(_) => self.copy_numbers(b"vt", &mut values, 2),
            None => Err(Number::Malformed),
        };
        if let Err(trouble) = copied {
            self.clean.extend_from_slice(b"vt nan nan\n");
            self.note_ignored("texture coordinate", trouble, line);
        }
    }

    fn normal_statement(&mut self, rest: &[u8], line: usize) {
        self.normal_count += 1;
        self.end_face();
        if let Err(trouble) = self.copy_numbers(b"vn", &mut words(rest), 3) {
            self.clean.extend_from_slice(b"vn nan nan nan\n");
            self.note_ignored("normal", trouble, line);
        }
    }

    fn note_ignored(&mut self, what: &str, trouble: Number, line: usize) {
        let message = match trouble.notation() {
            Some(Notation { name, cure }) => &format!("{what} with {name} was ignored; {cure}"),
            None => &format!("{what} that is not a number was ignored"),
        };
        self.note(WarningKind::LineSkipped, message, line);
    }

    /// Copy a statement of `count` finite numbers, or nothing if one of them is not.
    fn copy_numbers<'a>(
        &mut self,
        keyword: &[u8],
        values: &mut impl Iterator<Item = &'a [u8]>,
        count: usize,
    ) -> Result<(), Number> {
        let start = self.clean.len();
        self.clean.extend_from_slice(keyword);
        for _ in 0..count {
            let word = values.next().unwrap_or_default();
            let number = Number::of(word);
            if number != Number::Finite {
                self.clean.truncate(start);
                return Err(number);
            }
            self.clean.push(b' ');
            self.clean.extend_from_slice(word);
        }
        self.clean.push(b'\n');
        Ok(())
    }

    fn material_statement(&mut self, rest: &[u8], line: usize) {
        let name = decode(rest);
        if name.is_empty() {
            let message = "skipped a usemtl without a name";
            return self.note(WarningKind::LineSkipped, message, line);
        }
        let index = match self.material_index.get(&*name) {
            Some(&index) => index,
            None => {
                let index = self.notes.materials.len();
                self.material_index.insert(name.clone().into_owned(), index);
                self.notes.materials.push(Mention {
                    name: name.into_owned(),
                    line,
                    count: 0,
                });
                index
            }
        };
        self.notes.materials[index].count += 1;
        self.segment_is_new |= self.material != Some(index);
        self.material = Some(index);
    }

    fn library_statement(&mut self, rest: &[u8], line: usize) {
        let name = decode(rest);
        if name.is_empty() {
            let message = "skipped an mtllib without a name";
            return self.note(WarningKind::LineSkipped, message, line);
        }
        if let Some(known) = self
            .notes
            .libraries
            .iter_mut()
            .find(|known| known.name == name)
        {
            known.count += 1;
        } else if self.notes.libraries.len() < MAX_LIBRARIES {
            self.notes.libraries.push(Mention {
                name: name.into_owned(),
                line,
                count: 1,
            });
        } else {
            let message = "skipped an mtllib after the first thousand";
            self.note(WarningKind::LineSkipped, message, line);
        }
    }

    fn face_statement(&mut self, rest: &[u8], line: usize) {
        match self.read_corners(rest, line) {
            Ok(()) => self.write_face(line),
            Err(reason) => {
                self.notes.skipped_faces += 1;
                let message = format!("skipped a face: {reason}");
                self.note(WarningKind::FaceSkipped, &message, line);
            }
        }
    }

    /// Fill [`Self::corners`] with absolute indices from 1, 0 where a texture coordinate or normal is missing.
    fn read_corners(&mut self, rest: &[u8], line: usize) -> Result<(), Reason> {
        self.corners.clear();
        let mut ignored = false;
        for word in words(rest) {
            let [position, texcoord, normal] = parse_corner(word)?;
            let position = resolve(position, self.position_count)?;
            if !self.bad_positions.is_empty() && self.bad_positions.binary_search(&position).is_ok()
            {
                return Err("a corner is not a finite number");
            }
            let mut optional = |index: Option<i64>, count: i64| match index {
                None => 0,
                index => resolve(index, count).unwrap_or_else(|_| {
                    ignored = true;
                    0
                }),
            };
            self.corners.push([
                position,
                optional(texcoord, self.texcoord_count),
                optional(normal, self.normal_count),
            ]);
        }
        if ignored {
            let message =
                "texture coordinates or normals of a face with an index out of range were ignored";
            self.note(WarningKind::LineSkipped, message, line);
        }
        if self.corners.len() < 3 {
            return Err("fewer than three corners");
        }
        Ok(())
    }

    fn write_face(&mut self, line: usize) {
        if std::mem::take(&mut self.segment_is_new) {
            self.end_face();
            self.write_segment();
        }
        let corners = std::mem::take(&mut self.corners);
        // The parser has its "none" at 1, so all indices move up by one.
        let [with_texcoords, with_normals] =
            [1, 2].map(|which| corners.iter().all(|corner| corner[which] > 0));
        let with_attributes = with_texcoords || with_normals;
        if !std::mem::replace(&mut self.in_face, true) {
            self.clean.push(b'f');
        }
        for &[position, texcoord, normal] in &corners {
            self.clean.push(b' ');
            push_integer(&mut self.clean, position);
            if with_attributes || self.last_had_attributes {
                self.clean.push(b'/');
                push_integer(
                    &mut self.clean,
                    if with_texcoords { texcoord + 1 } else { 1 },
                );
                self.clean.push(b'/');
                push_integer(&mut self.clean, if with_normals { normal + 1 } else { 1 });
            }
        }
        self.last_had_attributes = with_attributes;
        self.notes.faces.push(FaceNote {
            line: u32::try_from(line).unwrap_or(0),
            corner_count: corners.len() as u32,
        });
        self.corners = corners;
    }

    /// Start a segment with the names in force.
    fn write_segment(&mut self) {
        self.clean.extend_from_slice(b"o ");
        push_integer(&mut self.clean, self.notes.segments.len() as i64);
        self.clean.push(b'\n');
        self.notes.segments.push(Segment {
            name: self.name.clone(),
            material: self.material,
        });
    }
}

/// Material files that are looked at: searching a list of names must not take longer than reading the file.
pub(super) const MAX_LIBRARIES: usize = 1000;

/// `v`, `v/vt`, `v//vn` or `v/vt/vn` as they stand.
fn parse_corner(word: &[u8]) -> Result<[Option<i64>; 3], Reason> {
    const MALFORMED: Reason = "a corner is no vertex index";
    let mut corner = [None; 3];
    for (slot, part) in word.split(|&byte| byte == b'/').enumerate() {
        let target = corner.get_mut(slot).ok_or(MALFORMED)?;
        if !part.is_empty() {
            *target = Some(parse_integer(part).ok_or(MALFORMED)?);
        }
    }
    Ok(corner)
}

/// A decimal integer; with more than 18 digits it saturates, which is out of every range.
fn parse_integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0_i64;
    for &digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = value
            .saturating_mul(10)
            .saturating_add(i64::from(digit - b'0'));
    }
    Some(if negative { -value } else { value })
}

/// The absolute index from 1 of what an index of the file means when `count` elements have been read.
fn resolve(index: Option<i64>, count: i64) -> Result<i64, Reason> {
    let absolute = match index {
        None => return Err("a corner is no vertex index"),
        Some(0) => return Err("index 0 (indices count from 1)"),
        Some(index) if index < 0 => index.saturating_add(count + 1),
        Some(index) => index,
    };
    if (1..=count).contains(&absolute) {
        Ok(absolute)
    } else {
        Err("vertex index out of range")
    }
}

/// Append a non-negative integer in decimal.
fn push_integer(text: &mut Vec<u8>, mut value: i64) {
    let start = text.len();
    loop {
        text.push(b'0' + (value % 10) as u8);
        value /= 10;
        if value <= 0 {
            break;
        }
    }
    text[start..].reverse();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clean(text: &str) -> (String, Notes) {
        let mut cleaner = ObjCleaner::new(text.as_bytes(), "x.obj");
        let mut out = Vec::new();
        while let Some(chunk) = cleaner.next_chunk() {
            out.extend(chunk);
        }
        (String::from_utf8(out).unwrap(), cleaner.notes)
    }

    #[test]
    fn bad_vertices_keep_their_number_and_lose_their_faces() {
        let (text, notes) = clean("v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 3 4\n");
        assert!(text.contains("v 0 0 0\nv 1 0 0\n"));
        assert!(text.ends_with("o 0\nf 2 3 4\n"));
        let face = FaceNote {
            line: 6,
            corner_count: 3,
        };
        assert_eq!(notes.faces, [face]);
        assert_eq!(notes.skipped_faces, 1);
    }

    #[test]
    fn relative_indices_become_absolute() {
        let (text, _) = clean("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n");
        assert!(text.ends_with("f 1 2 3\n"));
    }

    #[test]
    fn faces_without_attributes_refer_to_none_after_faces_with_them() {
        let (text, _) =
            clean("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1 2 3\nf 1 2 3\n");
        assert!(text.ends_with("f 1/2/1 2/2/1 3/2/1 1/1/1 2/1/1 3/1/1 1 2 3\n"));
    }

    #[test]
    fn faces_are_one_until_something_else_follows() {
        let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
        let faces = "f 1 2 3\nf 1 2 3 4\n# note\nf 1 2 4\n";
        let (text, notes) = clean(&format!(
            "{points}{faces}{points}{faces}usemtl a\nf 1 2 3\n"
        ));
        let merged = "f 1 2 3 1 2 3 4 1 2 4\n";
        let expected = format!("o 0\n{merged}{points}{merged}o 1\nf 1 2 3\n");
        assert!(text.ends_with(&expected), "{text}");
        let counts: Vec<u32> = notes.faces.iter().map(|face| face.corner_count).collect();
        assert_eq!(counts, [3, 4, 3, 3, 4, 3, 3]);
    }

    #[test]
    fn indices_out_of_all_range_are_refused() {
        for corner in [
            "0",
            "4",
            "-4",
            "99999999999999999999999",
            "1/2/3/4",
            "x",
            "1.0",
            "/1",
        ] {
            let (_, notes) = clean(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {corner}\n"));
            assert_eq!(notes.skipped_faces, 1, "{corner}");
        }
    }
}
