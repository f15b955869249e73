//! Materials of an MTL file, statement by statement: what cannot be used is skipped and named with its line.
//!
//! Used are `Kd`, `Ke`, `Ks`, `Ns`, `illum`, `Ni`, `Pr`, `Pm`, `map_Kd`, `map_Ke`, `d`, `Tr`, `Tf` and `map_d`; what else makes
//! surfaces gloss or uneven is named.
//! `Ka` is never light.

use std::io::BufRead;

use glam::Vec3;

use super::lines::{LogicalLines, Notation, Number, decode, split_keyword, words};
use super::texture_statement::TextureStatement;
use super::warning::{WarningKind, WarningLog};

/// A material as the file gives it; values are not yet checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    /// The argument of `newmtl`, without ASCII spaces around it.
    pub(super) name: String,
    /// Line of `newmtl`.
    pub(super) line: usize,
    /// `Kd`.
    pub(super) diffuse: Option<Vec3>,
    /// `Ke`.
    pub(super) emissive: Option<Vec3>,
    /// `map_Kd`.
    pub(super) diffuse_map: Option<TextureStatement>,
    /// `map_Ke`.
    pub(super) emissive_map: Option<TextureStatement>,
    /// `d`: 1 is opaque.
    pub(super) dissolve: Option<f64>,
    /// `Tr`: 0 is opaque.
    pub(super) transparency: Option<f64>,
    /// `Tf`: what is left of the light that passes.
    pub(super) filter: Option<Vec3>,
    /// `map_d`.
    pub(super) dissolve_map: Option<TextureStatement>,
    /// `Ks`.
    pub(super) specular: Option<Vec3>,
    /// `Ns`: exponent of the highlight.
    pub(super) exponent: Option<f32>,
    /// `illum`: the model of illumination.
    pub(super) model: Option<u8>,
    /// `Ni`: index of refraction.
    pub(super) index: Option<f32>,
    /// `Pr`: roughness as painted, the square root of that of the lobe.
    pub(super) roughness: Option<f32>,
    /// `Pm`: part that is metal.
    pub(super) metalness: Option<f32>,
    /// Statements that ask for gloss or relief, each once, in the order of the file.
    pub(super) uncomputed: Vec<String>,
}

/// Opacity above which nothing passes: less than a step of 8 bits is missing.
const OPAQUE: f64 = 1.0 - 1.0 / 255.0;

impl MtlMaterial {
    /// The opacity below 1 that the material states, and how.
    pub(super) fn opacity(&self) -> Option<(&'static str, f64)> {
        let (statement, opacity) = match (self.dissolve, self.transparency) {
            // Each denies the other.
            (Some(dissolve), Some(transparency)) if dissolve <= 0.0 && transparency <= 0.0 => {
                return None;
            }
            // Some exporters write both with the same meaning, so `d` decides where it is given.
            (Some(dissolve), _) => ("d", dissolve),
            (None, transparency) => ("Tr", 1.0 - transparency?),
        };
        (opacity < OPAQUE).then_some((statement, opacity.max(0.0)))
    }

    /// Whether it states that nothing of it is there.
    pub(super) fn is_invisible(&self) -> bool {
        self.opacity().is_some_and(|(_, opacity)| opacity <= 0.0)
    }

    fn note_uncomputed(&mut self, statement: String) {
        if !self.uncomputed.contains(&statement) {
            self.uncomputed.push(statement);
        }
    }
}

/// Read all materials of a file; `file` is its name for messages.
///
/// # Errors
/// Those of the system, where the file cannot be read to its end.
pub(super) fn read_mtl(
    source: impl BufRead,
    file: &str,
    log: &mut WarningLog,
) -> std::io::Result<Vec<MtlMaterial>> {
    let mut lines = LogicalLines::new(source);
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut in_material = false;
    while let Some(line) = lines.advance(log, file)? {
        let (keyword, rest) = split_keyword(&lines.text);
        let skipped = if keyword.eq_ignore_ascii_case(b"newmtl") {
            in_material = !rest.is_empty();
            if in_material {
                materials.push(MtlMaterial {
                    name: decode(rest).into_owned(),
                    line,
                    ..MtlMaterial::default()
                });
            }
            (!in_material).then_some(Number::Malformed)
        } else {
            match materials.last_mut() {
                Some(material) if in_material => statement(material, keyword, rest).err(),
                // Statements without a material have nothing to belong to.
                _ => (!matches!(keyword, [] | [b'#', ..])).then_some(Number::Malformed),
            }
        };
        if let Some(trouble) = skipped {
            let shown = decode(keyword).chars().take(20).collect::<String>();
            let message = match trouble.notation() {
                Some(Notation { name, cure }) => {
                    format!("skipped a material line with {name} ({shown}); {cure}")
                }
                None => format!("skipped a material line that cannot be used ({shown})"),
            };
            log.note(WarningKind::LineSkipped, &message, file, line);
        }
    }
    Ok(materials)
}

/// Take over one statement if it is used; the error is what a word is instead of the number that it should be.
fn statement(material: &mut MtlMaterial, keyword: &[u8], rest: &[u8]) -> Result<(), Number> {
    let texture = || TextureStatement::of(&decode(rest)).ok_or(Number::Malformed);
    match keyword.to_ascii_lowercase().as_slice() {
        b"kd" => material.diffuse = Some(colour(rest)?),
        b"ke" => material.emissive = Some(colour(rest)?),
        b"d" => material.dissolve = Some(last_number(rest)?),
        b"tr" => material.transparency = Some(last_number(rest)?),
        b"tf" => material.filter = Some(colour(rest)?),
        b"illum" => material.model = Some(illumination(rest).ok_or(Number::Malformed)?),
        b"ks" => material.specular = Some(colour(rest)?),
        b"ns" => material.exponent = Some(first_number(rest)?),
        b"ni" => material.index = Some(first_number(rest)?),
        b"pr" => material.roughness = Some(first_number(rest)?),
        b"pm" => material.metalness = Some(first_number(rest)?),
        b"map_kd" => material.diffuse_map = Some(texture()?),
        b"map_ke" | b"map_emissive" => material.emissive_map = Some(texture()?),
        b"map_d" => material.dissolve_map = Some(texture()?),
        name if let Some(shown) = uncomputed(name) => {
            let is_off = words(rest).all(|word| number(word) == Ok(0.0));
            if !is_off {
                material.note_uncomputed(shown.to_owned());
            }
        }
        _ => {}
    }
    Ok(())
}

/// Statements that ask for gloss or relief of kinds that are not computed.
const UNCOMPUTED: [&str; 15] = [
    "Ps", "Pc", "Pcr", "aniso", "map_Ks", "map_Ns", "map_Pr", "map_Pm", "map_Ps", "map_Pc", "refl",
    "norm", "bump", "map_Bump", "disp",
];

/// One of these by its name in lower case.
fn uncomputed(name: &[u8]) -> Option<&'static str> {
    let is_meant = |known: &&str| known.as_bytes().eq_ignore_ascii_case(name);
    UNCOMPUTED.into_iter().find(is_meant)
}

/// One or three numbers as three; `spectral` and `xyz` are not numbers.
fn colour(rest: &[u8]) -> Result<Vec3, Number> {
    let mut values = [0.0; 3];
    let mut count = 0;
    for (value, word) in values.iter_mut().zip(words(rest)) {
        *value = number(word)?;
        count += 1;
    }
    match count {
        1 => Ok(Vec3::splat(values[0])),
        3 => Ok(Vec3::from_array(values)),
        _ => Err(Number::Malformed),
    }
}

/// A number of any size; what is not finite is cured later.
fn number(word: &[u8]) -> Result<f32, Number> {
    decode(word).parse().map_err(|_| Number::of(word))
}

/// The first word if it is a number.
fn first_number(rest: &[u8]) -> Result<f32, Number> {
    number(words(rest).next().ok_or(Number::Malformed)?)
}

/// The last word if it is a number: `d -halo 0.5` has an option before it.
fn last_number(rest: &[u8]) -> Result<f64, Number> {
    let word = words(rest).last().ok_or(Number::Malformed)?;
    match Number::of(word) {
        Number::Finite => decode(word).parse().map_err(|_| Number::Malformed),
        trouble => Err(trouble),
    }
}

fn illumination(rest: &[u8]) -> Option<u8> {
    decode(words(rest).next()?).parse().ok()
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
        assert_eq!(warnings.len(), 4);
    }

    #[test]
    fn numbers_in_other_notations_are_named() {
        let (materials, warnings) =
            read(b"newmtl a\nKd 0,5 0,5 0,5\nKe 1.5D+01 0 0\nd 0,5\nKd 0.5 0.5 0.5 # not 0,7\n");
        assert_eq!(materials[0].diffuse, Some(Vec3::splat(0.5)));
        assert_eq!(materials[0].emissive, None);
        let expected = [
            "x.mtl:2: skipped a material line with a decimal comma (Kd); export with decimal points",
            "x.mtl:3: skipped a material line with a D exponent (Ke); export with E exponents",
            "x.mtl:4: skipped a material line with a decimal comma (d); export with decimal points",
        ];
        assert_eq!(warnings, expected);
    }

    #[test]
    fn names_keep_their_spaces_that_are_not_ascii() {
        let text = "newmtl \u{3000}\nKd 1\nNEWMTL ランプ\u{a0}\r\nnewmtl lamp # 60 W \n";
        let (materials, warnings) = read(text.as_bytes());
        let names: Vec<&str> = materials.iter().map(|material| &*material.name).collect();
        assert_eq!(names, ["\u{3000}", "ランプ\u{a0}", "lamp # 60 W"]);
        assert!(warnings.is_empty());
    }

    #[test]
    fn opacity_is_told_by_d_and_else_by_tr() {
        for (text, expected) in [
            ("d 0.5", Some(("d", 0.5))),
            ("Tr 0.25", Some(("Tr", 0.75))),
            ("illum 7", None),
            ("d -halo 0.25", Some(("d", 0.25))),
            ("d 0\nillum 4", Some(("d", 0.0))),
            ("d 0\nTr 0", None),
            ("d 0.25\nTr 0.25", Some(("d", 0.25))),
            ("d 1\nTr 1\nKa 1 1 1\nillum 2", None),
            ("d 0.999", None),
            ("Tr 7", Some(("Tr", 0.0))),
        ] {
            let (materials, warnings) = read(format!("newmtl a\n{text}\n").as_bytes());
            assert_eq!(materials[0].opacity(), expected, "{text}");
            assert!(warnings.is_empty(), "{text}");
        }
        let (materials, _) = read(b"newmtl a\nTf 0.5 1 0\nmap_d -s 2 2 1 leaf.png\n");
        assert_eq!(materials[0].filter, Some(Vec3::new(0.5, 1.0, 0.0)));
        assert!(materials[0].dissolve_map.is_some());
    }

    #[test]
    fn gloss_and_relief_are_named_unless_they_are_off() {
        let (materials, warnings) = read(
            b"newmtl a\nPs 0\nPc 0.4\nNs 250\nnewmtl b\nillum 5\nmap_ks a.png\nmap_Ks b.png\nmap_bump -bm 1 a.png\n",
        );
        assert_eq!(materials[0].uncomputed, ["Pc"]);
        assert_eq!(materials[1].uncomputed, ["map_Ks", "map_Bump"]);
        assert!(warnings.is_empty());
    }

    #[test]
    fn ambient_colour_is_no_light() {
        let (materials, _) = read(b"newmtl a\nKa 9 9 9\n");
        assert_eq!(materials[0].emissive, None);
    }
}
