//! Lines over the light: which cluster boxes and links are drawn, and the quantities of their colours.

use serde::{Deserialize, Serialize};

/// The quantity of the colour of a cluster box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClusterColor {
    /// Power that leaves the cluster.
    #[default]
    Power,
    /// Area of its patches.
    Area,
    /// How much its normals disagree.
    Spread,
    /// Links that it receives over.
    Links,
    /// Estimated error of these links.
    Error,
}

impl ClusterColor {
    /// All, in menu order.
    pub const ALL: [Self; 5] = [
        Self::Power,
        Self::Area,
        Self::Spread,
        Self::Links,
        Self::Error,
    ];

    /// Label in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Power => "Power",
            Self::Area => "Area",
            Self::Spread => "Direction spread",
            Self::Links => "Links received",
            Self::Error => "Error bound",
        }
    }
}

/// Which clusters make up the picture of the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClusterCut {
    /// Those of a level, and leaves above it.
    #[default]
    Level,
    /// The largest that are no larger than a part of the scene.
    Size,
    /// Those that send or receive over a link.
    Used,
}

impl ClusterCut {
    /// All, with label and explanation, in menu order.
    pub const ALL: [(Self, &str, &str); 3] = [
        (Self::Level, "By level", "Clusters of a level of the tree"),
        (
            Self::Size,
            "By size",
            "The largest clusters below a part of the scene's extent",
        ),
        (
            Self::Used,
            "Used by links",
            "Clusters that light really leaves from or comes to as one",
        ),
    ];
}

/// Which clusters are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ClusterOverlay {
    /// Whether boxes are drawn at all.
    pub shown: bool,
    /// Which ones.
    pub cut: ClusterCut,
    /// Level of the tree whose boxes are drawn; leaves above it are drawn, too.
    pub level: u32,
    /// Largest extent of a box relative to that of the scene, 0…1; larger leaves are drawn, too.
    pub size: f32,
    /// The quantity of their colour.
    pub color: ClusterColor,
}

impl ClusterOverlay {
    /// Sizes that can be chosen.
    pub const SIZE_RANGE: std::ops::RangeInclusive<f32> = 0.001..=1.0;

    /// Whether another overlay draws the same boxes.
    pub fn has_same_boxes(&self, other: &Self) -> bool {
        self.cut == other.cut && self.level == other.level && self.size == other.size
    }

    /// Smaller clusters for a positive step, larger ones for a negative; no level below `deepest`.
    pub fn go_down(&mut self, step: i32, deepest: u32) {
        match self.cut {
            ClusterCut::Level => self.level = self.level.saturating_add_signed(step).min(deepest),
            ClusterCut::Size => {
                let (least, most) = (*Self::SIZE_RANGE.start(), *Self::SIZE_RANGE.end());
                self.size = (self.size * 0.5f32.powi(step)).clamp(least, most);
            }
            ClusterCut::Used => {}
        }
    }
}

/// Cluster boxes to be shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClusterRequest {
    /// Those of a level.
    Level(u32),
    /// The largest that are no larger than this part of the scene.
    Size(f32),
    /// Those that send or receive over a link.
    Used,
}

impl ClusterRequest {
    /// An overlay that shows them.
    pub fn apply(self, overlay: ClusterOverlay) -> ClusterOverlay {
        let shown = ClusterOverlay {
            shown: true,
            ..overlay
        };
        match self {
            Self::Level(level) => ClusterOverlay {
                cut: ClusterCut::Level,
                level,
                ..shown
            },
            Self::Size(size) => ClusterOverlay {
                cut: ClusterCut::Size,
                size,
                ..shown
            },
            Self::Used => ClusterOverlay {
                cut: ClusterCut::Used,
                ..shown
            },
        }
    }
}

impl Default for ClusterOverlay {
    fn default() -> Self {
        Self {
            shown: false,
            cut: ClusterCut::Level,
            level: 3,
            size: 0.1,
            color: ClusterColor::Power,
        }
    }
}

/// Whose links are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkEnd {
    /// Those of the element at the picked point.
    #[default]
    Element,
    /// Those of the selected cluster.
    Cluster,
}

/// The quantity of the colour of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkColor {
    /// How much light it brings.
    #[default]
    Strength,
    /// Which part gets through.
    Visibility,
}

/// Which links are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkOverlay {
    /// Whether links are drawn at all.
    pub shown: bool,
    /// Whose.
    pub of: LinkEnd,
    /// The quantity of their colour.
    pub color: LinkColor,
    /// How many at most, the strongest first.
    pub most: u32,
}

impl LinkOverlay {
    /// Links that can be drawn. More hide each other and the scene.
    pub const MOST_RANGE: std::ops::RangeInclusive<u32> = 1..=4096;
}

impl Default for LinkOverlay {
    fn default() -> Self {
        Self {
            shown: false,
            of: LinkEnd::Element,
            color: LinkColor::Strength,
            most: 64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn going_down_stays_within_the_tree() {
        let mut overlay = ClusterOverlay::default();
        overlay.go_down(-9, 5);
        assert_eq!(overlay.level, 0);
        overlay.go_down(9, 5);
        assert_eq!(overlay.level, 5);
        overlay.cut = ClusterCut::Size;
        overlay.go_down(1, 5);
        assert_eq!((overlay.level, overlay.size), (5, 0.05));
        overlay.go_down(-20, 5);
        assert_eq!(overlay.size, 1.0);
    }
}
