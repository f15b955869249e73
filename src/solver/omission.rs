//! What a solve may omit, and what settings say of it.

use serde::{Deserialize, Serialize};

/// What may be left out of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Omission {
    /// Patches that no light can reach, and emitters that nothing sees.
    Unlit,
    /// Rays, where nothing can stand between two surfaces.
    Rays,
    /// Elements where light does not bend, where nothing casts a shadow.
    Elements,
    /// Clusters, where there are few patches and nothing stands between them.
    Clusters,
}

impl Omission {
    /// All of them, in the order of the plan.
    pub const ALL: [Self; 4] = [Self::Unlit, Self::Rays, Self::Elements, Self::Clusters];

    /// As flags and reports call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unlit => "unlit",
            Self::Rays => "rays",
            Self::Elements => "elements",
            Self::Clusters => "clusters",
        }
    }
}

/// What must not be left out. As a list of names in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Vec<Omission>", into = "Vec<Omission>")]
pub struct Keep(u8);

impl Keep {
    /// Everything: nothing is left out.
    pub const ALL: Self = Self((1 << Omission::ALL.len()) - 1);

    /// Nothing: all is left out that can be.
    pub const NONE: Self = Self(0);

    /// Whether this is required.
    pub const fn has(self, omission: Omission) -> bool {
        self.0 & (1 << omission as u8) != 0
    }
}

impl From<Vec<Omission>> for Keep {
    fn from(required: Vec<Omission>) -> Self {
        let add = |bits: u8, omission: Omission| bits | (1 << omission as u8);
        Self(required.into_iter().fold(0, add))
    }
}

impl From<Keep> for Vec<Omission> {
    fn from(keep: Keep) -> Self {
        let required = Omission::ALL.into_iter();
        required.filter(|&omission| keep.has(omission)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_survives_a_file_and_unknown_names_do_not() {
        for required in [vec![], vec![Omission::Rays], Omission::ALL.to_vec()] {
            let keep = Keep::from(required.clone());
            assert_eq!(Vec::from(keep), required);
            let text = serde_json::to_string(&keep).unwrap();
            assert_eq!(serde_json::from_str::<Keep>(&text).unwrap(), keep);
            for omission in Omission::ALL {
                assert_eq!(keep.has(omission), required.contains(&omission));
            }
        }
        assert_eq!(Keep::from(Omission::ALL.to_vec()), Keep::ALL);
        assert!(serde_json::from_str::<Keep>(r#"["light"]"#).is_err());
    }
}
