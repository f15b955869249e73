//! Materials of an MTL file, cleaned statement by statement before the parser sees them.
//!
//! Used are `Kd`, `Ke`, `map_Kd` and `map_Ke`; `d`, `Tr`, `illum` and `map_d` only to say that nothing is transparent.
//! `Ka` is never light.

use std::io::BufRead;

use glam::{DVec2, Vec3};

use super::lines::{LogicalLines, Number, decode, split_keyword, words};
use super::warning::{WarningKind, WarningLog};

/// A material as the file gives it; values are not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MtlMaterial {
    /// `newmtl`.
    pub(super) name: String,
    /// Line of `newmtl`.
    pub(super) line: usize,
    /// `Kd`.
    pub(super) diffuse: Option<Vec3>,
    /// `Ke`.
    pub(super) emissive: Option<Vec3>,
    /// `map_Kd`.
    pub(super) diffuse_map: Option<TextureReference>,
    /// `map_Ke`.
    pub(super) emissive_map: Option<TextureReference>,
}

/// A texture statement without its keyword.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureReference {
    /// File name.
    pub(super) name: String,
    /// `-s`: texture coordinates are multiplied by it …
    pub(super) scale: DVec2,
    /// `-o`: … and then moved by it.
    pub(super) offset: DVec2,
    /// The first option that changes the picture and is not followed.
    pub(super) ignored: Option<String>,
}

/// Read all materials of a file; `file` is its name for messages.
///
/// # Errors
/// A sentence when the file cannot be read to its end.
pub(super) fn read_mtl(
    source: impl BufRead,
    file: &str,
    log: &mut WarningLog,
) -> Result<Vec<MtlMaterial>, String> {
    let mut cleaner = MtlCleaner {
        file,
        log,
        clean: String::new(),
        lines: Vec::new(),
    };
    cleaner
        .read(source)
        .map_err(|error| format!("it cannot be read ({error})"))?;
    let MtlCleaner { clean, lines, .. } = cleaner;
    let parsed = std::panic::catch_unwind(|| tobj::load_mtl_buf(&mut clean.as_bytes()));
    let Ok(Ok((materials, _))) = parsed else {
        return Err("it cannot be parsed".to_owned());
    };
    Ok(materials
        .into_iter()
        .zip(lines)
        .map(|(material, line)| convert(material, line, file, log))
        .collect())
}

fn convert(material: tobj::Material, line: usize, file: &str, log: &mut WarningLog) -> MtlMaterial {
    let parameter = |name: &str| material.unknown_param.get(name);
    // Some exporters write both with the same meaning, so `d` decides where it is given.
    let dissolve = material
        .dissolve
        .or_else(|| Some(1.0 - parameter("Tr")?.parse::<f64>().ok()?));
    if dissolve.is_some_and(|dissolve| dissolve < 1.0)
        || material.dissolve_texture.is_some()
        || matches!(material.illumination_model, Some(4 | 6 | 7 | 9))
    {
        let message = "transparent materials are treated as opaque";
        log.note(WarningKind::Unsupported, message, file, line);
    }
    let colour = |values: [f64; 3]| Vec3::from_array(values.map(|value| value as f32));
    MtlMaterial {
        line,
        diffuse: material.diffuse.map(colour),
        emissive: material.emissive.map(colour),
        diffuse_map: material
            .diffuse_texture
            .as_deref()
            .and_then(texture_reference),
        emissive_map: parameter("map_Ke").and_then(|text| texture_reference(text)),
        name: material.name,
    }
}

/// Rewrites an MTL file as the few statements that are used, all of them valid.
struct MtlCleaner<'a> {
    file: &'a str,
    log: &'a mut WarningLog,
    clean: String,
    /// Line of each `newmtl` kept.
    lines: Vec<usize>,
}

impl MtlCleaner<'_> {
    fn read(&mut self, source: impl BufRead) -> std::io::Result<()> {
        let mut lines = LogicalLines::new(source);
        let mut in_material = false;
        while let Some(line) = lines.advance(self.log, self.file)? {
            let (keyword, rest) = split_keyword(&lines.text);
            if keyword == b"newmtl" {
                in_material = !rest.is_empty();
            }
            let kept = if in_material {
                self.statement(keyword, rest, line)
            } else {
                // Statements before the first material have nothing to belong to.
                keyword.is_empty() || keyword[0] == b'#'
            };
            if !kept {
                let shown = decode(keyword).chars().take(20).collect::<String>();
                let message = format!("skipped a material line that cannot be used ({shown})");
                self.log
                    .note(WarningKind::LineSkipped, &message, self.file, line);
            }
        }
        Ok(())
    }

    /// Copy one statement if it is used; false if it is used but not valid.
    fn statement(&mut self, keyword: &[u8], rest: &[u8], line: usize) -> bool {
        let argument = match keyword.to_ascii_lowercase().as_slice() {
            b"newmtl" => {
                self.lines.push(line);
                Some(("newmtl", decode(rest).into_owned()))
            }
            b"kd" => colour(rest).map(|text| ("Kd", text)),
            b"ke" => colour(rest).map(|text| ("Ke", text)),
            b"d" => last_number(rest).map(|text| ("d", text)),
            b"tr" => last_number(rest).map(|text| ("Tr", text)),
            b"illum" => words(rest)
                .next()
                .and_then(|word| decode(word).parse::<u8>().ok())
                .map(|model| ("illum", model.to_string())),
            b"map_kd" => file_argument(rest).map(|text| ("map_Kd", text)),
            b"map_ke" | b"map_emissive" => file_argument(rest).map(|text| ("map_Ke", text)),
            b"map_d" => file_argument(rest).map(|text| ("map_d", text)),
            _ => return true,
        };
        if let Some((name, text)) = &argument {
            self.clean.push_str(name);
            self.clean.push(' ');
            self.clean.push_str(text);
            self.clean.push('\n');
        }
        argument.is_some()
    }
}

/// One or three numbers as three; `spectral` and `xyz` are not numbers.
fn colour(rest: &[u8]) -> Option<String> {
    let values = words(rest).take(3).map(decode).collect::<Vec<_>>();
    let numbers = values.iter().all(|value| value.parse::<f64>().is_ok());
    match values.as_slice() {
        [grey] if numbers => Some(format!("{grey} {grey} {grey}")),
        [_, _, _] if numbers => Some(values.join(" ")),
        _ => None,
    }
}

/// The last word if it is a number: `d -halo 0.5` has an option before it.
fn last_number(rest: &[u8]) -> Option<String> {
    let word = words(rest).last()?;
    (Number::of(word) == Number::Finite).then(|| decode(word).into_owned())
}

fn file_argument(rest: &[u8]) -> Option<String> {
    let text = decode(rest);
    // The parser and this program must see the same lines and words.
    texture_reference(&text).map(|_| text.into_owned())
}

/// Options and name of a texture statement; nothing if there is no name.
fn texture_reference(text: &str) -> Option<TextureReference> {
    let mut reference = TextureReference {
        name: String::new(),
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        ignored: None,
    };
    let mut rest = text.trim();
    while rest.starts_with('-') {
        let (option, after) = next_word(rest);
        let limit = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            "-bm" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-texres"
            | "-boost" | "-type" => 1,
            _ => break,
        };
        let numeric = matches!(option, "-s" | "-o" | "-t" | "-mm");
        let mut values = Vec::new();
        rest = after;
        while values.len() < limit {
            let (word, after) = next_word(rest);
            if word.is_empty() || numeric && word.parse::<f64>().is_err() {
                break;
            }
            values.push(word);
            rest = after;
        }
        reference.apply(option, &values);
    }
    reference.name = rest.trim_matches('"').trim().to_owned();
    (!reference.name.is_empty()).then_some(reference)
}

impl TextureReference {
    fn apply(&mut self, option: &str, values: &[&str]) {
        let number = |index: usize, default: f64| {
            values
                .get(index)
                .and_then(|word: &&str| word.parse::<f64>().ok())
                .filter(|value| value.is_finite())
                .unwrap_or(default)
        };
        match option {
            "-s" => self.scale = DVec2::new(number(0, 1.0), number(1, 1.0)),
            "-o" => self.offset = DVec2::new(number(0, 0.0), number(1, 0.0)),
            "-t" | "-mm" | "-clamp" if values.first() != Some(&"off") => {
                self.ignored.get_or_insert_with(|| option.to_owned());
            }
            _ => {}
        }
    }
}

fn next_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> (Vec<MtlMaterial>, Vec<String>) {
        let mut log = WarningLog::default();
        let materials = read_mtl(text, "x.mtl", &mut log).unwrap();
        let warnings = log
            .into_warnings()
            .iter()
            .map(ToString::to_string)
            .collect();
        (materials, warnings)
    }

    #[test]
    fn one_value_means_grey() {
        let (materials, warnings) = read(b"newmtl a\nKd 0.5\nKe 2\n");
        assert_eq!(materials[0].diffuse, Some(Vec3::splat(0.5)));
        assert_eq!(materials[0].emissive, Some(Vec3::splat(2.0)));
        assert!(warnings.is_empty());
    }

    #[test]
    fn bad_lines_do_not_cost_the_others() {
        let (materials, warnings) = read(
            b"Kd 1 1 1\nnewmtl a\nillum 2.0\nKd spectral a.rfl\nKd 0.1 0.2\nmap_Kd\nNs\nnewmtl b\nKd 0.1 0.2 0.3\n",
        );
        assert_eq!(materials.len(), 2);
        assert_eq!(materials[0].diffuse, None);
        assert_eq!(materials[1].diffuse, Some(Vec3::new(0.1, 0.2, 0.3)));
        let expected = "x.mtl:1: skipped a material line that cannot be used (Kd) (3 times)";
        assert_eq!(warnings[0], expected);
        assert_eq!(warnings.len(), 3);
    }

    #[test]
    fn texture_options_come_before_the_name() {
        let reference =
            texture_reference("-s 2 3 1 -o 0.5 -clamp on -bm 1 my tex-ture 2.png").unwrap();
        assert_eq!(reference.name, "my tex-ture 2.png");
        assert_eq!(reference.scale, DVec2::new(2.0, 3.0));
        assert_eq!(reference.offset, DVec2::new(0.5, 0.0));
        assert_eq!(reference.ignored.as_deref(), Some("-clamp"));
        assert_eq!(texture_reference("-s 1 1 1"), None);
        assert_eq!(texture_reference("-odd.png").unwrap().name, "-odd.png");
    }

    #[test]
    fn transparency_is_named() {
        for text in ["d 0.5", "Tr 0.5", "illum 7", "d -halo 0.2", "map_d a.png"] {
            let (_, warnings) = read(format!("newmtl a\n{text}\n").as_bytes());
            assert!(warnings[0].contains("treated as opaque"), "{text}");
        }
        let (_, warnings) = read(b"newmtl a\nd 1\nTr 1\nKa 1 1 1\nillum 2\n");
        assert!(warnings.is_empty());
    }

    #[test]
    fn ambient_colour_is_no_light() {
        let (materials, _) = read(b"newmtl a\nKa 9 9 9\n");
        assert_eq!(materials[0].emissive, None);
    }
}
