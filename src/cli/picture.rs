//! `--screenshot` and what it shows: the window's own picture, drawn without a window.

use std::{path::PathBuf, str::FromStr, sync::Arc};

use anyhow::{Context as _, Result, bail};
use clap::Args;
use glam::{DVec3, Vec3};

use super::{RunFlags, UsageError, output};
use crate::{
    geometry::RayTree,
    picture::Exposure,
    scene::{Scene, builtin},
    solver::{Cancel, Snapshot},
    viewer::{
        CameraRequest,
        first_look::first_look,
        headless::{self, Subject},
        loader,
        stderr::StderrCapture,
        traced,
        view::{ClusterOverlay, ClusterRequest, ViewMode, ViewRequest, ViewSettings},
    },
};

/// Content and camera of a picture.
#[derive(Clone, Debug, Args)]
pub struct ViewFlags {
    /// What the surfaces show [default: radiance]
    #[arg(long, value_name = "MODE", value_parser = view_mode(), help_heading = "Picture")]
    pub view: Option<String>,
    /// Draw cluster boxes: of a level of the tree; with size=PART the largest below this part of the scene's extent; with
    /// used those at the ends of links
    #[arg(long, value_name = "LEVEL", help_heading = "Picture")]
    pub clusters: Option<Clusters>,
    /// Draw the edges of the elements
    #[arg(long, help_heading = "Picture")]
    pub edges: bool,
    /// Leave out what mirrors, gloss and glass send to the eye where light at vertices is drawn
    #[arg(long, help_heading = "Picture")]
    pub no_gloss: bool,
    /// Draw what stands before a room that is looked into from outside
    #[arg(long, help_heading = "Picture")]
    pub no_see_through: bool,
    /// Logarithmic scale for false colours
    #[arg(long, help_heading = "Picture")]
    pub logarithmic: bool,
    /// Range of the false colours [default: that of the light]
    #[arg(long, value_name = "LOW,HIGH", help_heading = "Picture")]
    pub range: Option<Range>,
    /// Camera position in the file's units
    #[arg(
        long,
        value_name = "X,Y,Z",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub camera_position: Option<Point>,
    /// Look-at point of the camera in the file's units
    #[arg(
        long,
        value_name = "X,Y,Z",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub camera_focal_point: Option<Point>,
    /// Up direction of the camera [default: the scene's up axis]
    #[arg(
        long,
        value_name = "X,Y,Z",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub camera_view_up: Option<Direction>,
    /// Vertical field of view in degrees, 1 to 170
    #[arg(long, value_name = "DEGREES", value_parser = view_angle, help_heading = "Picture")]
    pub camera_view_angle: Option<f32>,
}

/// Names of the view modes.
fn view_mode() -> clap::builder::PossibleValuesParser {
    ViewMode::ALL.map(ViewMode::name).into()
}

impl ViewFlags {
    /// How the light is to be shown.
    pub fn request(&self, run_flags: &RunFlags) -> ViewRequest {
        ViewRequest {
            mode: self.mode(),
            emission_scale: run_flags.emission_scale,
            exposure: run_flags.exposure,
            tone_map: run_flags.tonemap,
            logarithmic: self.logarithmic,
            fixed_range: self.range.map(|range| range.0),
            edges: self.edges,
            lacks_gloss: self.no_gloss,
            shows_all: self.no_see_through,
            clusters: self.clusters.map(|clusters| clusters.0),
        }
    }

    /// Whether nothing but the light of surfaces is asked for.
    fn shows_light_only(&self) -> bool {
        let is_radiance = self.mode().is_none_or(|mode| mode == ViewMode::Radiance);
        is_radiance && !self.edges && self.clusters.is_none()
    }

    fn mode(&self) -> Option<ViewMode> {
        self.view.as_deref().and_then(ViewMode::from_name)
    }

    /// From where.
    pub fn camera(&self) -> CameraRequest {
        CameraRequest {
            position: self.camera_position.map(|point| point.0),
            focal_point: self.camera_focal_point.map(|point| point.0),
            view_angle_degrees: self.camera_view_angle,
            up: self.camera_view_up.map(|direction| direction.0),
        }
    }
}

/// Flags of the picture that `solve` writes.
#[derive(Clone, Debug, Args)]
pub struct PictureFlags {
    /// Draw a picture of the light (.png as seen, .exr with linear radiance)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub screenshot: Option<PathBuf>,
    /// Size of the picture in pixels
    #[arg(
        long,
        value_name = "WxH",
        default_value = "1280x720",
        help_heading = "Picture"
    )]
    pub size: Size,
    /// How the picture is made: traced[=SAMPLES] by rays from the eye, SAMPLES at most through a pixel (needs no graphics
    /// adapter), or vertex, as the window draws it [default: traced=16 for radiance without overlays, else vertex]
    #[arg(
        long,
        value_name = "HOW",
        requires = "screenshot",
        help_heading = "Picture"
    )]
    pub quality: Option<Quality>,
    /// Transparent background: straight alpha in a PNG, premultiplied alpha in an EXR
    #[arg(long, requires = "screenshot", help_heading = "Picture")]
    pub transparent: bool,
    /// What it shows
    #[command(flatten)]
    pub view: ViewFlags,
}

impl PictureFlags {
    /// Refuse what cannot be written.
    pub fn check(&self) -> Result<()> {
        let Some(path) = &self.screenshot else {
            return Ok(());
        };
        let known = path.extension().is_some_and(|ending| {
            ["png", "exr"]
                .iter()
                .any(|known| ending.eq_ignore_ascii_case(known))
        });
        if !known {
            let message = format!("the picture must end in .png or .exr: {}", path.display());
            bail!(UsageError(message));
        }
        let traced = matches!(self.quality, Some(Quality::Traced(_)));
        if traced && !self.view.shows_light_only() {
            let message = "traced pictures show radiance alone: leave out --view, --edges and --clusters, or add --quality vertex";
            bail!(UsageError(message.to_owned()));
        }
        let Size([width, height]) = self.size;
        let pixels = u64::from(width) * u64::from(height);
        if self.traced_samples().is_some() && pixels > MOST_TRACED_PIXELS {
            let message = format!(
                "a traced picture has at most {MOST_TRACED_PIXELS} pixels; choose a smaller --size, or --quality vertex"
            );
            bail!(UsageError(message));
        }
        output::check(path)
    }

    /// Samples of a traced picture; `None` for one that is drawn.
    fn traced_samples(&self) -> Option<u32> {
        match self.quality {
            Some(Quality::Traced(samples)) => Some(samples),
            Some(Quality::Vertex) => None,
            None => self
                .view
                .shows_light_only()
                .then_some(Quality::DEFAULT_SAMPLES),
        }
    }

    /// Refuse a picture that this machine cannot draw.
    pub fn check_size(&self) -> Result<()> {
        if self.screenshot.is_some() && self.traced_samples().is_none() {
            let _capture = StderrCapture::begin();
            headless::check(self.size.0, self.transparent)?;
        }
        Ok(())
    }

    /// Whether a picture of the measured error is asked for.
    pub fn shows_errors(&self) -> bool {
        self.screenshot.is_some() && self.view.mode() == Some(ViewMode::Error)
    }

    /// Draw and write the picture, if one is asked for.
    pub fn write(
        &self,
        scene: &Arc<Scene>,
        builtin_name: Option<&str>,
        snapshot: &Snapshot,
        errors: Option<&Arc<Vec<f32>>>,
        run_flags: &RunFlags,
        seed: u64,
    ) -> Result<()> {
        let Some(path) = &self.screenshot else {
            return Ok(());
        };
        let Size(size) = self.size;
        let rays = RayTree::new(scene);
        let look = first_look(scene, &rays);
        let opening = match builtin_name.and_then(builtin::find_builtin) {
            Some(found) => loader::builtin_camera(found, scene),
            None => loader::file_cameras(scene, &rays)
                .first()
                .copied()
                .unwrap_or(look.camera),
        };
        let camera = self.view.camera().apply(opening, &scene.frame);
        let view = self.view.request(run_flags).apply(&ViewSettings::default());
        if !camera.is_valid() {
            bail!(UsageError(
                "the camera is too far from the scene or in what it looks at; move --camera-position or --camera-focal-point"
                    .to_owned()
            ));
        }
        let subject = Subject {
            scene,
            snapshot,
            errors,
            interior: look.interior,
            is_dark: scene.has_light() && !look.is_lit,
        };
        let traced = self.traced_samples().map(|samples| Exposure {
            size,
            samples,
            seed,
        });
        let encoded = if let Some(exposure) = traced {
            let cancel = Cancel::default();
            let traced = traced::trace(subject, &rays, &camera, &view, &exposure, &cancel)
                .context("the picture was cancelled")?;
            match self.transparent {
                true => traced.cutout().encode(path),
                false => traced.picture().encode(path),
            }
        } else {
            let _capture = StderrCapture::begin();
            if self.transparent {
                headless::cutout(subject, &camera, &view, size)?.encode(path)
            } else {
                headless::picture(subject, &camera, &view, size)?.encode(path)
            }
        };
        let bytes = encoded.with_context(|| format!("cannot write {}", path.display()))?;
        output::write_whole(path, |out| out.write_all(&bytes))
    }
}

/// Most pixels of a traced picture: they take about 6 GiB of memory.
const MOST_TRACED_PIXELS: u64 = 1 << 26;

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// By rays from the eye, so many at most through a pixel.
    Traced(u32),
    /// From the light at vertices, by the graphics adapter.
    Vertex,
}

impl Quality {
    const DEFAULT_SAMPLES: u32 = 16;
    const MOST_SAMPLES: u32 = 4096;
}

impl FromStr for Quality {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let samples = match text.split_once('=') {
            None if text == "vertex" => return Ok(Self::Vertex),
            None if text == "traced" => Some(Self::DEFAULT_SAMPLES),
            Some(("traced", samples)) => samples.parse().ok(),
            _ => None,
        };
        samples
            .filter(|samples| (1..=Self::MOST_SAMPLES).contains(samples))
            .map(Self::Traced)
            .ok_or_else(|| {
                format!(
                    "expected vertex, traced, or traced=SAMPLES with 1 to {} samples",
                    Self::MOST_SAMPLES
                )
            })
    }
}

/// A point in the file's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point(pub DVec3);

impl FromStr for Point {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers::<3>(text)
            .map(|numbers| Self(DVec3::from_array(numbers)))
            .ok_or_else(|| "expected three numbers such as 1,2,3".to_owned())
    }
}

/// A direction of any length but 0, as a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction(pub Vec3);

impl FromStr for Direction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers::<3>(text)
            .and_then(|numbers| DVec3::from_array(numbers).try_normalize())
            .map(|direction| Self(direction.as_vec3()))
            .ok_or_else(|| "expected a direction such as 0,0,1".to_owned())
    }
}

/// Ends of the false colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range(pub [f32; 2]);

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers::<2>(text)
            .map(|ends| ends.map(|end| end as f32))
            .filter(|[low, high]| *low >= 0.0 && high > low && high.is_finite())
            .map(Self)
            .ok_or_else(|| "expected two rising numbers such as 0,10".to_owned())
    }
}

/// Which cluster boxes are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clusters(pub ClusterRequest);

impl FromStr for Clusters {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let request = match text.split_once('=') {
            None if text == "used" => Some(ClusterRequest::Used),
            None => text.parse().ok().map(ClusterRequest::Level),
            Some(("size", part)) => part
                .parse()
                .ok()
                .filter(|part| ClusterOverlay::SIZE_RANGE.contains(part))
                .map(ClusterRequest::Size),
            Some(_) => None,
        };
        request.map(Self).ok_or_else(|| {
            "expected a level such as 4, size=PART with a part within 0.001 and 1, or used"
                .to_owned()
        })
    }
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once('x')
            .and_then(|(width, height)| Some(Self([width.parse().ok()?, height.parse().ok()?])))
            .filter(|Self(size)| size.iter().all(|side| (1..=32768).contains(side)))
            .ok_or_else(|| "expected a size such as 1280x720".to_owned())
    }
}

fn view_angle(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|degrees| (1.0..=170.0).contains(degrees))
        .ok_or_else(|| "must be within 1 and 170".to_owned())
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let values: Vec<f64> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
        })
        .collect::<Option<_>>()?;
    values.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_sizes_are_read() {
        assert_eq!("1,-2,3.5".parse(), Ok(Point(DVec3::new(1.0, -2.0, 3.5))));
        assert_eq!("640x480".parse(), Ok(Size([640, 480])));
        for wrong in ["", "1,2", "1,2,nan", "a,b,c"] {
            assert!(wrong.parse::<Point>().is_err(), "{wrong}");
        }
        for wrong in ["640", "0x2", "99999x1", "axb"] {
            assert!(wrong.parse::<Size>().is_err(), "{wrong}");
        }
        assert!("3,1".parse::<Range>().is_err());
        let clusters = |text: &str| text.parse::<Clusters>().ok().map(|clusters| clusters.0);
        assert_eq!(clusters("4"), Some(ClusterRequest::Level(4)));
        assert_eq!(clusters("size=0.25"), Some(ClusterRequest::Size(0.25)));
        assert_eq!(clusters("used"), Some(ClusterRequest::Used));
        for wrong in ["", "-1", "size=0", "size=nan", "level=3", "used=1"] {
            assert_eq!(clusters(wrong), None, "{wrong}");
        }
        assert_eq!("traced=64".parse(), Ok(Quality::Traced(64)));
        assert_eq!("vertex".parse(), Ok(Quality::Vertex));
        for wrong in ["", "fine", "traced=0", "traced=5000", "vertex=2"] {
            assert!(wrong.parse::<Quality>().is_err(), "{wrong}");
        }
        assert_eq!("0,-2,0".parse(), Ok(Direction(Vec3::NEG_Y)));
        assert!("0,0,0".parse::<Direction>().is_err());
    }
}
