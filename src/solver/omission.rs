//! Omissions: the parts that a solve may omit, and the setting that requires them.

use serde::{Deserialize, Serialize};

/// A part that a solve may omit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Omission {
    /// Patches that no light can reach, and emitters that light nothing.
    Unlit,
    /// Rays, where nothing can occlude.
    Rays,
    /// Elements where light varies linearly, in scenes without shadows.
    Elements,
    /// Clusters, where there are few patches and nothing can occlude.
    Clusters,
    /// The sky and the sun, where no surface sees them.
    Outside,
}

impl Omission {
    /// All omissions, in the order of the plan.
    pub const ALL: [Self; 5] = [
        Self::Unlit,
        Self::Rays,
        Self::Elements,
        Self::Clusters,
        Self::Outside,
    ];

    /// The name in flags and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unlit => "unlit",
            Self::Rays => "rays",
            Self::Elements => "elements",
            Self::Clusters => "clusters",
            Self::Outside => "outside",
        }
    }
}

/// The parts that must not be omitted. Serialised as a list of names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Vec<Omission>", into = "Vec<Omission>")]
pub struct Keep(u8);

impl Keep {
    /// Every part: nothing is omitted.
    pub const ALL: Self = Self((1 << Omission::ALL.len()) - 1);

    /// No part: everything is omitted that the scene does not need.
    pub const NONE: Self = Self(0);

    /// Whether this part must not be omitted.
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
    fn required_parts_survive_a_file_and_unknown_names_are_refused() {
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
