//! Imports between the files and folders of one room.
//!
//! The children of a module are the files and folders that its `mod.rs` names. A child imports a sibling where a `use`,
//! or a path that begins with `crate`, `super` or `self`, leads to an item of that sibling or of something in it; items
//! that a `mod.rs` re-exports belong to the file that defines them. Following these imports never leads back.
//!
//! Items that a `mod.rs` defines itself belong to the folder as a whole: all that stands in the folder may import them,
//! and the `mod.rs` imports from its children. Neither counts.

use std::collections::{BTreeMap, BTreeSet};

use super::code_of;

/// Names of the folders and of the file below `src`; for a `mod.rs`, of the folders only.
pub(super) type ModulePath = Vec<String>;

/// Imports between children of a module: the importing child and the imported one.
pub(super) type SiblingImports = BTreeMap<ModulePath, BTreeSet<(String, String)>>;

/// A path of a `use` or of code, and whether it is re-exported.
struct Import {
    is_public: bool,
    path: Vec<String>,
}

/// All modules, with what they re-export.
struct Tree<'a> {
    modules: &'a BTreeMap<ModulePath, String>,
    /// By module and name of the item: the module that it comes from.
    re_exports: BTreeMap<(ModulePath, String), ModulePath>,
}

/// Imports between siblings, by the module whose children they are. `sources` are all files.
pub(super) fn sibling_imports(sources: &BTreeMap<ModulePath, String>) -> SiblingImports {
    let imports: Vec<(&ModulePath, Vec<Import>)> = sources
        .iter()
        .map(|(module, source)| (module, imports_of(&code_of(source))))
        .collect();
    let mut tree = Tree {
        modules: sources,
        re_exports: BTreeMap::new(),
    };
    for (module, imports) in &imports {
        for import in imports.iter().filter(|import| import.is_public) {
            if let Some((target, Some(item))) = tree.resolve(module, &import.path) {
                tree.re_exports.insert(((*module).clone(), item), target);
            }
        }
    }
    let mut found = SiblingImports::new();
    for (module, imports) in imports {
        for import in imports {
            let Some((target, item)) = tree.resolve(module, &import.path) else {
                continue;
            };
            let target = tree.origin(target, item);
            let shared = module.iter().zip(&target).take_while(|(a, b)| a == b);
            let shared = shared.count();
            if let (1.., Some(from), Some(to)) = (shared, module.get(shared), target.get(shared)) {
                let siblings = found.entry(module[..shared].to_vec()).or_default();
                siblings.insert((from.clone(), to.clone()));
            }
        }
    }
    found
}

impl Tree<'_> {
    /// The module that a path leads to, and the name of the item in it unless the path names the module itself.
    fn resolve(&self, from: &ModulePath, path: &[String]) -> Option<(ModulePath, Option<String>)> {
        let mut rest = path;
        let mut module = match path.first()?.as_str() {
            "crate" | "vecrad" => {
                rest = &path[1..];
                Vec::new()
            }
            "self" => {
                rest = &path[1..];
                from.clone()
            }
            "super" => {
                let mut module = from.clone();
                while rest.first().is_some_and(|name| name == "super") {
                    module.pop();
                    rest = &rest[1..];
                }
                module
            }
            // A child, or an outside crate.
            child => {
                let module = joined(from, child);
                self.modules.contains_key(&module).then_some(())?;
                rest = &path[1..];
                module
            }
        };
        while let Some((name, after)) = rest.split_first() {
            let child = joined(&module, name);
            if !self.modules.contains_key(&child) {
                break;
            }
            (module, rest) = (child, after);
        }
        let item = rest.first().filter(|name| *name != "self").cloned();
        Some((module, item))
    }

    /// Where an item comes from that may be re-exported.
    fn origin(&self, mut module: ModulePath, item: Option<String>) -> ModulePath {
        let Some(item) = item else { return module };
        let mut seen = BTreeSet::new();
        while seen.insert(module.clone()) {
            match self.re_exports.get(&(module.clone(), item.clone())) {
                Some(origin) => module = origin.clone(),
                None => break,
            }
        }
        module
    }
}

fn joined(module: &[String], child: &str) -> ModulePath {
    [module, &[child.to_owned()]].concat()
}

/// Paths of all `use` declarations, and those in code that begin with `crate`, `super` or `self`.
fn imports_of(code: &str) -> Vec<Import> {
    let mut imports = Vec::new();
    let mut others = String::new();
    for statement in code.split_inclusive(';') {
        // A declaration begins a line; what stands before it in the same piece is code.
        let start = statement
            .match_indices("use ")
            .map(|(at, _)| at)
            .find(|&at| {
                let line = statement[..at].rsplit('\n').next().unwrap_or("");
                let before = line.trim();
                before.is_empty()
                    || before == "pub"
                    || before.starts_with("pub(") && before.ends_with(')')
            });
        let Some(start) = start else {
            others += statement;
            continue;
        };
        let line = statement[..start].rsplit('\n').next().unwrap_or("");
        others += &statement[..start - line.len()];
        let tree: String = statement[start + "use ".len()..].replace(';', "");
        for path in paths_of(&tree.replace(char::is_whitespace, " ")) {
            imports.push(Import {
                is_public: line.trim().starts_with("pub"),
                path,
            });
        }
    }
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in others.match_indices(root) {
            let before = others[..at].chars().next_back();
            if before.is_some_and(|c| c == ':' || c == '_' || c.is_alphanumeric()) {
                continue;
            }
            let is_path = |c: char| c == ':' || c == '_' || c.is_alphanumeric();
            let length = others[at..].find(|c| !is_path(c));
            let path = &others[at..length.map_or(others.len(), |length| at + length)];
            imports.push(Import {
                is_public: false,
                path: names_of(path),
            });
        }
    }
    imports
}

/// The paths of a tree of imports such as `a::{b, c::{self, D}}`.
fn paths_of(tree: &str) -> Vec<Vec<String>> {
    let tree = tree.trim();
    let Some((prefix, group)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or("");
        return vec![names_of(path)];
    };
    let group = group.trim().strip_suffix('}').unwrap_or(group);
    let (mut depth, mut start, mut parts) = (0_usize, 0, Vec::new());
    for (at, character) in group.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                parts.push(&group[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&group[start..]);
    parts
        .into_iter()
        .filter(|part| !part.trim().is_empty())
        .flat_map(paths_of)
        .map(|path| [names_of(prefix), path].concat())
        .collect()
}

fn names_of(path: &str) -> Vec<String> {
    path.split("::")
        .map(str::trim)
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect()
}

/// A circle among imports, where there is one: names in the order in which they import each other, the first again last.
pub(super) fn circle(imports: &BTreeSet<(String, String)>) -> Option<Vec<String>> {
    /// Go on from the last name of a path; `done` are names from which no circle is reached.
    fn search(
        imports: &BTreeSet<(String, String)>,
        path: &mut Vec<String>,
        done: &mut BTreeSet<String>,
    ) -> bool {
        let Some(last) = path.last().cloned() else {
            return false;
        };
        for (_, to) in imports.iter().filter(|(from, _)| *from == last) {
            if let Some(at) = path.iter().position(|name| name == to) {
                path.push(to.clone());
                path.drain(..at);
                return true;
            }
            if done.contains(to) {
                continue;
            }
            path.push(to.clone());
            if search(imports, path, done) {
                return true;
            }
            path.pop();
        }
        done.insert(last);
        false
    }
    let mut done = BTreeSet::new();
    for (from, _) in imports {
        let mut path = vec![from.clone()];
        if !done.contains(from) && search(imports, &mut path, &mut done) {
            return Some(path);
        }
    }
    None
}

/// Imports against an order, in which each name may import those before it. Names that are not in the order are free.
pub(super) fn upward(
    imports: &BTreeSet<(String, String)>,
    order: &[&str],
) -> Vec<(String, String)> {
    let place = |name: &str| order.iter().position(|known| *known == name);
    imports
        .iter()
        .filter(
            |(from, to)| matches!((place(from), place(to)), (Some(from), Some(to)) if to > from),
        )
        .cloned()
        .collect()
}
