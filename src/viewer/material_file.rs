//! Changed materials as an MTL file: the text of the scene's own, with other colours where materials were changed.

use std::{collections::BTreeSet, fs, io, path::PathBuf};

use super::{loader::SceneSource, materials::SavedMaterial};
use crate::scene::{Scene, srgb_from_linear, write_whole};

/// Write the materials of a scene, with these changes, beside it; returns where. The files that it was read from stay as
/// they are.
///
/// # Errors
/// One sentence for people.
pub fn save(
    source: &SceneSource,
    scene: &Scene,
    changes: &[SavedMaterial],
    is_srgb: bool,
) -> Result<PathBuf, String> {
    let path = source
        .path()
        .ok_or("a built-in scene has no file to save materials beside; open a scene from a file")?;
    let path = path.with_extension("vecrad.mtl");
    let is_mtl = |file: &&PathBuf| {
        let ending = file.extension();
        ending.is_some_and(|ending| ending.eq_ignore_ascii_case("mtl")) && **file != path
    };
    let mut text = Vec::new();
    for file in scene.files.iter().filter(is_mtl) {
        let cannot = |error: io::Error| format!("cannot read {}: {error}", file.display());
        text.extend(fs::read(file).map_err(cannot)?);
        text.push(b'\n');
    }
    let encode = |value: f32| {
        if is_srgb {
            srgb_from_linear(value)
        } else {
            value
        }
    };
    let shown: Vec<SavedMaterial> = changes
        .iter()
        .map(|change| SavedMaterial {
            name: change.name.clone(),
            reflectance: change.reflectance.map(encode),
            emission: change
                .emission
                .map(|value| encode(value * scene.radiance_unit)),
        })
        .collect();
    let text = changed(&text, &shown);
    write_whole(&path, |out| out.write_all(&text))
        .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(path)
}

/// The text of an MTL file with other reflectance and emission of some materials; those that it lacks stand at its end.
fn changed(text: &[u8], changes: &[SavedMaterial]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let mut present = None;
    let mut found = BTreeSet::new();
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        let trimmed = line.trim_ascii();
        let end = trimmed.iter().position(u8::is_ascii_whitespace);
        let (keyword, rest) = trimmed.split_at(end.unwrap_or(trimmed.len()));
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            let name = String::from_utf8_lossy(rest.trim_ascii());
            present = changes.iter().find(|change| change.name == name);
            out.extend_from_slice(line);
            if let Some(change) = present {
                found.insert(&change.name);
                out.extend(colors(change).into_bytes());
            }
        } else if present.is_none() || ![&b"Kd"[..], b"Ke"].contains(&keyword) {
            out.extend_from_slice(line);
        }
    }
    for change in changes
        .iter()
        .filter(|change| !found.contains(&change.name))
    {
        out.extend(format!("\nnewmtl {}\n{}", change.name, colors(change)).into_bytes());
    }
    out
}

/// The statements of a material's colours.
fn colors(change: &SavedMaterial) -> String {
    let [r, g, b] = change.reflectance;
    let diffuse = format!("Kd {r} {g} {b}\n");
    let [r, g, b] = change.emission;
    diffuse + &format!("Ke {r} {g} {b}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_changed_colours_are_replaced() {
        let text = b"# head\nnewmtl wall\nKd 1 1 1\nmap_Kd wall.png\nnewmtl lamp\r\n  Kd 0 0 0\r\nKe 5 5 5\r\nNs 10\r\n";
        let change = |name: &str| SavedMaterial {
            name: name.to_owned(),
            reflectance: [0.5, 0.25, 0.0],
            emission: [1.0, 2.0, 3.0],
        };
        let found = changed(text, &[change("lamp"), change("new")]);
        let expected = "# head\nnewmtl wall\nKd 1 1 1\nmap_Kd wall.png\nnewmtl lamp\r\nKd 0.5 0.25 0\nKe 1 2 3\nNs 10\r\n\
                        \nnewmtl new\nKd 0.5 0.25 0\nKe 1 2 3\n";
        assert_eq!(String::from_utf8_lossy(&found), expected);
        assert_eq!(changed(text, &[]), text);
    }
}
