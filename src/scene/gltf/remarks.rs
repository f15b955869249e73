//! What is to be said of parts of a file, each kind once with the names that it is said of.

use crate::scene::WarningKind;
use crate::scene::listed::{MOST_LISTED, listed};
use crate::scene::warning::WarningLog;

/// Names by what is said of them, in the order in which each was first met.
#[derive(Debug, Default)]
pub(super) struct Remarks {
    groups: Vec<Group>,
}

#[derive(Debug)]
struct Group {
    kind: WarningKind,
    what: &'static str,
    names: Vec<String>,
}

impl Remarks {
    /// Say this of one more; once of each name.
    pub(super) fn add(&mut self, kind: WarningKind, what: &'static str, name: &str) {
        let known = self.groups.iter_mut().find(|group| group.what == what);
        match known {
            Some(group) if group.names.last().is_some_and(|last| last == name) => {}
            Some(group) => group.names.push(name.to_owned()),
            None => self.groups.push(Group {
                kind,
                what,
                names: vec![name.to_owned()],
            }),
        }
    }

    /// Put them into the log.
    pub(super) fn tell(self, log: &mut WarningLog) {
        for Group { kind, what, names } in self.groups {
            let names = listed(names.iter().map(String::as_str), MOST_LISTED);
            log.note(kind, &format!("{what}: {names}"), "", 0);
        }
    }
}
