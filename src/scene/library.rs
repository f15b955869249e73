//! The materials of all MTL files of a scene, found by the names that `usemtl` mentions.

use std::collections::HashMap;
use std::path::PathBuf;

use super::lines::spellings;
use super::mtl::MtlMaterial;

/// A material with the file it comes from.
#[derive(Debug)]
pub(super) struct Defined {
    /// The material as in the file.
    pub(super) material: MtlMaterial,
    /// Name of the file, without its folder.
    pub(super) file: String,
    /// Folder of the file, relative to that of the OBJ file.
    pub(super) folder: PathBuf,
}

/// Materials by name.
#[derive(Debug, Default)]
pub(super) struct Library {
    all: Vec<Defined>,
    /// By the name as it stands, the last definition of each.
    by_name: HashMap<String, usize>,
    /// By the other spellings of the name; nothing where several names share one.
    by_spelling: HashMap<String, Option<usize>>,
}

impl Library {
    /// Add a material; it replaces earlier ones of its name.
    pub(super) fn add(&mut self, defined: Defined) {
        let number = self.all.len();
        let name = &defined.material.name;
        let before = self.by_name.insert(name.clone(), number);
        for spelling in spellings(name).skip(1) {
            let known = self.by_spelling.entry(spelling.to_owned());
            known
                .and_modify(|known| {
                    if *known == before {
                        *known = Some(number);
                    } else {
                        *known = None;
                    }
                })
                .or_insert(Some(number));
        }
        self.all.push(defined);
    }

    /// The number of the material that a `usemtl` mentions: the one of exactly this name, else the only one that is the
    /// same without Unicode spaces around it or a comment behind it, on either side.
    pub(super) fn find(&self, mention: &str) -> Option<usize> {
        let exact = |name| self.by_name.get(name).copied();
        let alike = |name| self.by_spelling.get(name).copied().flatten();
        spellings(mention)
            .find_map(exact)
            .or_else(|| spellings(mention).find_map(alike))
    }

    /// A material by its number.
    pub(super) fn get(&self, number: usize) -> &Defined {
        &self.all[number]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The line of the material that is found, among materials of these names in lines from 1.
    fn found(names: &[&str], mention: &str) -> Option<usize> {
        let mut library = Library::default();
        for (name, line) in names.iter().zip(1..) {
            library.add(Defined {
                material: MtlMaterial {
                    name: (*name).to_owned(),
                    line,
                    ..MtlMaterial::default()
                },
                file: String::new(),
                folder: PathBuf::new(),
            });
        }
        library
            .find(mention)
            .map(|number| library.get(number).material.line)
    }

    #[test]
    fn spaces_and_comments_matter_only_where_they_tell_materials_apart() {
        for (names, mention, expected) in [
            (&["床　木　", "ランプ\u{a0}"][..], "ランプ\u{a0}", Some(2)),
            (&["床　木　", "ランプ"], "ランプ\u{a0}", Some(2)),
            (&["床　木　", "ランプ\u{2003}"], "ランプ", Some(2)),
            (&["\u{3000}", "a"], "\u{3000}", Some(1)),
            (&["lamp   # 60 W", "wall"], "lamp", Some(1)),
            (&["lamp", "wall"], "lamp # 60 W", Some(1)),
            (&["lamp # 60 W", "wall"], "lamp # warm", Some(1)),
            (&["lamp #2", "lamp #3"], "lamp #3", Some(2)),
            (&["lamp #2", "lamp #3"], "lamp", None),
            (&["lamp #2", "lamp", "lamp #2"], "lamp #2", Some(3)),
            (&["lamp # a", "lamp # a"], "lamp", Some(2)),
            (&["lamp", "lamp\u{3000}"], "lamp", Some(1)),
            (&["lamp"], "Lamp", None),
            (&[], "lamp", None),
        ] {
            assert_eq!(found(names, mention), expected, "{names:?} {mention:?}");
        }
    }
}
