//! Settings of the view: mode, exposure, tone map, false-colour range, overlays.
//! Nothing here changes what is computed.

use serde::{Deserialize, Serialize};

use crate::export::ToneMap;

pub use super::overlay::{
    ClusterColor, ClusterCut, ClusterOverlay, ClusterRequest, LinkColor, LinkEnd, LinkOverlay,
};

/// The view mode of surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ViewMode {
    /// Radiance towards the viewer: emitted, and reflected as ρE/π.
    #[default]
    Radiance,
    /// Irradiance over π: the light without the surfaces' colours.
    LightOnly,
    /// Radiance from light that came straight from emitters.
    DirectOnly,
    /// Diffuse reflectance.
    Reflectance,
    /// Unit normals, −1…1 mapped to 0…1.
    Normals,
    /// The elements as a grey solid with their edges.
    Elements,
    /// Fronts blue, backs red.
    FaceOrientation,
    /// Luminance of irradiance, in false colour.
    FalseIrradiance,
    /// Luminance of radiance, in false colour.
    FalseRadiance,
    /// Estimated error of the reflected radiance, pooled over the surfaces, in false colour with its sign.
    EstimatedError,
    /// Measured error of radiance against the reference, in false colour.
    Error,
}

impl ViewMode {
    /// All modes in the order of their keys.
    pub const ALL: [Self; 11] = [
        Self::Radiance,
        Self::LightOnly,
        Self::DirectOnly,
        Self::Reflectance,
        Self::Normals,
        Self::Elements,
        Self::FaceOrientation,
        Self::FalseIrradiance,
        Self::FalseRadiance,
        Self::EstimatedError,
        Self::Error,
    ];

    /// The modes that can be shown, with or without a reference.
    pub fn offered(has_reference: bool) -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(move |mode| has_reference || *mode != Self::Error)
    }

    /// Label in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Radiance => "Radiance",
            Self::LightOnly => "Light only",
            Self::DirectOnly => "Direct light",
            Self::Reflectance => "Reflectance",
            Self::Normals => "Normals",
            Self::Elements => "Element mesh",
            Self::FaceOrientation => "Face orientation",
            Self::FalseIrradiance => "False colour: irradiance",
            Self::FalseRadiance => "False colour: radiance",
            Self::Error => "Measured error",
            Self::EstimatedError => "Estimated error",
        }
    }

    /// One sentence about it.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Radiance => "What a camera sees: emitted and reflected light.",
            Self::LightOnly => "Irradiance over π, without the colours of the surfaces.",
            Self::DirectOnly => "Only light that comes straight from the emitters.",
            Self::Reflectance => "Diffuse reflectance, without light.",
            Self::Normals => "Direction of each surface as a colour.",
            Self::Elements => "The mesh that carries the light.",
            Self::FaceOrientation => "Fronts are blue, backs are red.",
            Self::FalseIrradiance => "Luminance of the irradiance in W/m², as false colour.",
            Self::FalseRadiance => "Luminance of the radiance in W/(sr·m²), as false colour.",
            Self::Error => {
                "Difference of radiance from the path-traced reference, in per cent of its root mean square."
            }
            Self::EstimatedError => {
                "Where the light is too bright or too dark, in per cent of its root mean square, from rays at random points; grey where no error is told from their noise."
            }
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Radiance => "radiance",
            Self::LightOnly => "irradiance",
            Self::DirectOnly => "direct",
            Self::Reflectance => "reflectance",
            Self::Normals => "normals",
            Self::Elements => "elements",
            Self::FaceOrientation => "orientation",
            Self::FalseIrradiance => "false-irradiance",
            Self::FalseRadiance => "false-radiance",
            Self::Error => "error",
            Self::EstimatedError => "estimated-error",
        }
    }

    /// The mode of a name on the command line.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }

    /// Whether the colours are light, which exposure and tone map apply to.
    pub fn is_light(self) -> bool {
        matches!(self, Self::Radiance | Self::LightOnly | Self::DirectOnly)
    }

    /// Unit of the legend where the mode is a false-colour one.
    pub fn false_color_unit(self) -> Option<&'static str> {
        match self {
            Self::FalseIrradiance => Some("W/m²"),
            Self::FalseRadiance => Some("W/(sr·m²)"),
            Self::Error | Self::EstimatedError => Some("% of RMS"),
            _ => None,
        }
    }

    /// The name in the legend, where the mode is a false-colour one.
    pub fn false_color_quantity(self) -> &'static str {
        match self {
            Self::FalseIrradiance => "Irradiance",
            Self::FalseRadiance => "Radiance",
            Self::Error => "Measured error",
            Self::EstimatedError => "Estimated error",
            _ => "",
        }
    }

    /// Whether false colours have a sign: their range is as far below 0 as above it, and never logarithmic.
    pub fn is_signed(self) -> bool {
        self == Self::EstimatedError
    }

    /// Whether it shows errors at the vertices, which may not be known.
    pub(crate) fn shows_errors(self) -> bool {
        matches!(self, Self::Error | Self::EstimatedError)
    }

    /// Number by which the shader knows the mode.
    pub(crate) fn shader_number(self) -> u8 {
        Self::ALL
            .iter()
            .position(|mode| *mode == self)
            .map_or(0, |index| index as u8)
    }

    /// Whether edges of elements are drawn, over the light or in its place; `edges` are those over the light.
    pub fn shows_edges(self, edges: bool) -> bool {
        edges || self == Self::Elements
    }
}

/// Everything about the picture but the camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewSettings {
    /// The view mode of surfaces.
    pub mode: ViewMode,
    /// Factor on all emission, and with it on all light. Light is linear in emission, so this is exact and
    /// nothing is computed anew.
    pub emission_scale: f32,
    /// Exposure in EV: radiance is multiplied by 2^EV. Kept within [`ViewSettings::EXPOSURE_RANGE`].
    pub exposure: f32,
    /// Whether the exposure follows the light.
    pub auto_exposure: bool,
    /// Tone map of the light modes.
    pub tone_map: ToneMap,
    /// Whether false colours are spaced logarithmically.
    pub logarithmic: bool,
    /// Range of false colours; `None` follows the light.
    pub fixed_range: Option<[f32; 2]>,
    /// Whether the edges of the elements are drawn over the light.
    pub edges: bool,
    /// Whether backs of one-sided faces are drawn, dark, instead of being looked through.
    pub backs: bool,
    /// Whether what stands between the viewer and the inside of a room is left out.
    pub see_through: bool,
    /// Whether textures show in detail, and not only as the mean of each element.
    pub texture_detail: bool,
    /// Whether what mirrors, gloss and glass send to the eye is added to the light at vertices.
    pub gloss: bool,
    /// Whether a view at rest sharpens to a traced picture.
    pub traced: bool,
    /// The cluster boxes.
    pub clusters: ClusterOverlay,
    /// The links of what is selected.
    pub links: LinkOverlay,
    /// Whether the scene's unit of length is the metre, which OBJ files do not say: only then are powers in watts.
    pub is_in_metres: bool,
}

impl ViewSettings {
    /// Exposures outside this leave the range of the picture's half floats.
    pub const EXPOSURE_RANGE: std::ops::RangeInclusive<f32> = -20.0..=20.0;

    /// The first value out of its range, as one sentence.
    ///
    /// # Errors
    /// Where there is one.
    pub fn check(&self) -> Result<(), String> {
        let sentence = |name: &str, value: f32, range: &str| {
            Err(format!("{name} is {value}, but must be {range}"))
        };
        // Written so that a NaN is out of every range.
        if !(0.0..=f32::MAX).contains(&self.emission_scale) {
            return sentence(
                "emission_scale",
                self.emission_scale,
                "a number of at least 0",
            );
        }
        // Those outside the range that can be shown are brought into it where they are used.
        if !self.exposure.is_finite() {
            return sentence("exposure", self.exposure, "a number");
        }
        if let Some(end) = self
            .fixed_range
            .and_then(|ends| ends.into_iter().find(|end| !end.is_finite()))
        {
            return sentence("fixed_range", end, "two numbers");
        }
        if !ClusterOverlay::SIZE_RANGE.contains(&self.clusters.size) {
            return sentence("clusters.size", self.clusters.size, "within 0.001 and 1");
        }
        if !LinkOverlay::MOST_RANGE.contains(&self.links.most) {
            let most = self.links.most;
            return Err(format!(
                "links.most is {most}, but must be within 1 and 4096"
            ));
        }
        Ok(())
    }

    /// Factor on the quantity of a mode, before exposure.
    pub fn light_factor(&self) -> f32 {
        match self.mode {
            ViewMode::FalseIrradiance | ViewMode::FalseRadiance => self.emission_scale,
            mode if mode.is_light() => self.emission_scale,
            _ => 1.0,
        }
    }

    /// Whether gloss is seen: only radiance has any.
    pub fn shows_gloss(&self) -> bool {
        self.gloss && self.mode == ViewMode::Radiance
    }

    /// Factor of the exposure on radiance.
    pub fn exposure_factor(&self) -> f32 {
        self.exposure
            .clamp(*Self::EXPOSURE_RANGE.start(), *Self::EXPOSURE_RANGE.end())
            .exp2()
    }
}

/// How the light is to be shown, as far as it was asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewRequest {
    /// The view mode of surfaces.
    pub mode: Option<ViewMode>,
    /// Factor on all emission.
    pub emission_scale: Option<f32>,
    /// Exposure in EV, instead of the automatic one.
    pub exposure: Option<f32>,
    /// Tone map.
    pub tone_map: Option<ToneMap>,
    /// Whether logarithmic false colours were asked for.
    pub logarithmic: bool,
    /// Range of the false colours.
    pub fixed_range: Option<[f32; 2]>,
    /// Whether edges were asked for.
    pub edges: bool,
    /// Whether no gloss was asked for.
    pub lacks_gloss: bool,
    /// Whether what stands before a room was asked for.
    pub shows_all: bool,
    /// Which cluster boxes.
    pub clusters: Option<ClusterRequest>,
}

impl ViewRequest {
    /// A view with what was asked for put in.
    pub fn apply(&self, view: &ViewSettings) -> ViewSettings {
        ViewSettings {
            mode: self.mode.unwrap_or(view.mode),
            emission_scale: self.emission_scale.unwrap_or(view.emission_scale),
            exposure: self.exposure.unwrap_or(view.exposure),
            auto_exposure: view.auto_exposure && self.exposure.is_none(),
            tone_map: self.tone_map.unwrap_or(view.tone_map),
            logarithmic: view.logarithmic || self.logarithmic,
            fixed_range: self.fixed_range.or(view.fixed_range),
            edges: view.edges || self.edges,
            gloss: view.gloss && !self.lacks_gloss,
            see_through: view.see_through && !self.shows_all,
            clusters: self
                .clusters
                .map_or(view.clusters, |asked| asked.apply(view.clusters)),
            ..view.clone()
        }
    }
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            mode: ViewMode::Radiance,
            emission_scale: 1.0,
            exposure: 0.0,
            auto_exposure: true,
            tone_map: ToneMap::Neutral,
            logarithmic: false,
            fixed_range: None,
            edges: false,
            backs: false,
            see_through: true,
            texture_detail: true,
            gloss: true,
            traced: true,
            clusters: ClusterOverlay::default(),
            links: LinkOverlay::default(),
            is_in_metres: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_known_by_their_names() {
        for mode in ViewMode::ALL {
            assert_eq!(ViewMode::from_name(mode.name()), Some(mode));
            // False colours have a legend with quantity and unit, the others none.
            let is_named = !mode.false_color_quantity().is_empty();
            assert_eq!(is_named, mode.false_color_unit().is_some(), "{mode:?}");
        }
    }

    #[test]
    fn errors_are_relative_whatever_the_emission() {
        for mode in ViewMode::ALL.into_iter().filter(|mode| mode.shows_errors()) {
            let view = ViewSettings {
                mode,
                emission_scale: 3.0,
                ..ViewSettings::default()
            };
            assert_eq!(view.light_factor(), 1.0);
            assert_eq!(mode.false_color_unit(), Some("% of RMS"));
        }
    }
}
