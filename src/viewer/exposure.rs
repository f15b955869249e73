//! Automatic exposure: from the luminances of the pixels of a picture to EV, and how the window follows it.

use super::{camera::Camera, render::Metered};

/// Display value that the middle of the light is exposed to. Brighter washes out, darker hides the corners.
const MIDDLE_GRAY: f64 = 0.24;
/// Display value that the bright end of the light stays below. Lower dims a room for the patch of light under a lamp,
/// higher burns out what is lit straight.
const BRIGHT_END: f64 = 1.6;
/// The part of the light's pixels that lie below its bright end.
const BRIGHT_SHARE: f64 = 0.95;
/// Pixels this many times darker than the bright end count half, and darker ones less: exposed by the bright end, they
/// are within a few steps of 255 from black. A smaller ratio ignores dim rooms; a larger one lets light
/// that nobody can see, such as a leak of a thousandth, decide about the picture.
const CONTRAST: f64 = 500.0;

/// Bins of the histogram to one EV. Coarser, and the exposure jumps by a bin; finer than the rounding changes nothing.
const BINS_PER_EV: f64 = 16.0;
/// EV that the histogram spans on each side of 1 W/(sr·m²): all that single precision holds.
const SPAN_EV: f64 = 150.0;

/// The exposure in EV that shows a metered picture well, in tenths; `None` while there is no light in it. Lamps count only
/// where nothing else is lit: the brightest is then shown just below white.
pub fn of(metered: &Metered) -> Option<f32> {
    if metered.reflected.is_empty() {
        let brightest = metered.emitted.iter().copied().fold(0.0, f32::max);
        return (brightest > 0.0).then(|| rounded(-f64::from(brightest).log2()));
    }
    let histogram = Histogram::of(&metered.reflected);
    // The bright end of all light, however many pixels are nearly black.
    let floor = histogram.quantile(BRIGHT_SHARE, |luminance| luminance) / CONTRAST;
    let weight = |luminance: f64| luminance / (luminance + floor);
    let middle = histogram.quantile(0.5, weight);
    let bright = histogram.quantile(BRIGHT_SHARE, weight);
    Some(rounded(
        (MIDDLE_GRAY / middle).min(BRIGHT_END / bright).log2(),
    ))
}

/// Tenths of EV, so that adapters which round differently agree.
fn rounded(exposure: f64) -> f32 {
    ((exposure * 10.0).round() / 10.0) as f32
}

/// Pixels by the logarithm of their luminance.
struct Histogram(Vec<u32>);

impl Histogram {
    fn of(luminances: &[f32]) -> Self {
        let mut counts = vec![0; (2.0 * SPAN_EV * BINS_PER_EV) as usize];
        let last = counts.len() - 1;
        for luminance in luminances {
            let at = (f64::from(*luminance).log2() + SPAN_EV) * BINS_PER_EV;
            counts[(at.max(0.0) as usize).min(last)] += 1;
        }
        Self(counts)
    }

    /// Luminance below which pixels have this share of the weight of all; a pixel is weighted by its luminance.
    fn quantile(&self, share: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let luminance = |bin: usize| ((bin as f64 + 0.5) / BINS_PER_EV - SPAN_EV).exp2();
        let weights: Vec<f64> = self
            .0
            .iter()
            .enumerate()
            .map(|(bin, count)| f64::from(*count) * weight(luminance(bin)))
            .collect();
        let wanted = share * weights.iter().sum::<f64>();
        let mut sum = 0.0;
        let found = weights.iter().position(|weight| {
            sum += weight;
            sum > 0.0 && sum >= wanted
        });
        luminance(found.unwrap_or(0))
    }
}

/// How the exposure of the window follows what was metered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Follower {
    /// The last metering; `None` before the first light of a scene.
    pub target: Option<f32>,
    /// Whether only lamps were lit in it, as before their light has arrived anywhere.
    pub shows_lamps_only: bool,
}

impl Follower {
    /// Time constant in seconds. Shorter flickers with each step of the light, longer looks broken.
    const GLIDE_SECS: f32 = 0.25;
    /// Differences below this many EV are not seen.
    const NEAR: f32 = 0.02;

    /// Take note of a metered picture; one without light changes nothing.
    pub fn note(&mut self, metered: &Metered) {
        self.target = of(metered).or(self.target);
        self.shows_lamps_only = metered.reflected.is_empty();
    }

    /// Exposure after a time, and whether it is still on its way.
    pub fn advance(&self, exposure: f32, seconds: f32) -> (f32, bool) {
        let Some(target) = self.target else {
            return (exposure, false);
        };
        let gap = target - exposure;
        let left = gap * (-seconds.max(0.0) / Self::GLIDE_SECS).exp();
        if left.abs() < Self::NEAR {
            (target, false)
        } else {
            (target - left, true)
        }
    }
}

/// Whether a camera shows so much else than before that the exposure is to be metered again.
pub fn shows_other_things(camera: &Camera, before: &Camera) -> bool {
    /// Part of the picture's height that a camera may move. Less, and the picture breathes while one looks around; more,
    /// and one who walks from a bright room into a dark one sees nothing.
    const FREEDOM: f32 = 0.3;
    let height = before.height_at_pivot().max(f32::MIN_POSITIVE);
    let turned = camera.backward().angle_between(before.backward()) / before.fov_y_radians;
    let moved = (camera.eye() - before.eye()).length() / height;
    let zoomed = (camera.height_at_pivot() / height).ln().abs();
    let has_other_lens = camera.orthographic != before.orthographic
        || camera.fov_y_radians != before.fov_y_radians
        || camera.up != before.up;
    has_other_lens || turned.max(moved).max(zoomed) > FREEDOM
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn reflected(pixels: &[(f32, usize)]) -> Option<f32> {
        let reflected = pixels
            .iter()
            .flat_map(|&(luminance, count)| std::iter::repeat_n(luminance, count))
            .collect();
        let metered = Metered {
            reflected,
            emitted: vec![1e6; 500],
        };
        of(&metered)
    }

    /// Expected exposures are within a bin and the rounding.
    fn assert_near(found: Option<f32>, expected: f64, what: &str) {
        let found = found.expect("there is light");
        assert!(
            (f64::from(found) - expected).abs() < 0.12,
            "{what}: {found} for {expected}"
        );
    }

    #[test]
    fn even_light_is_shown_in_middle_gray_however_bright() {
        for luminance in [1e-9, 0.02, 1.0, 3e7] {
            let expected = (MIDDLE_GRAY / f64::from(luminance)).log2();
            assert_near(reflected(&[(luminance, 900)]), expected, "even light");
        }
    }

    #[test]
    fn a_bright_end_is_not_burnt_out() {
        let found = reflected(&[(1.0, 800), (100.0, 200)]);
        assert_near(found, (BRIGHT_END / 100.0).log2(), "a fifth in the sun");
        // A lamp's spot on the wall is not the bright end.
        let found = reflected(&[(1.0, 990), (100.0, 10)]);
        assert_near(found, MIDDLE_GRAY.log2(), "a hundredth in the sun");
    }

    #[test]
    fn darkness_with_or_without_a_leak_changes_nothing() {
        let lit = reflected(&[(1.0, 300)]);
        for leak in [1e-9, 1e-6, 1e-5] {
            assert_eq!(reflected(&[(leak, 3000), (1.0, 300)]), lit, "{leak}");
        }
    }

    #[test]
    fn lamps_count_only_where_nothing_else_is_lit() {
        assert_eq!(
            of(&Metered {
                reflected: Vec::new(),
                emitted: vec![0.5, 8.0]
            }),
            Some(-3.0)
        );
        assert_eq!(of(&Metered::default()), None);
        // Metered again once their light has arrived somewhere.
        let mut follower = Follower::default();
        for (reflected, shows_lamps_only) in [(Vec::new(), true), (vec![0.25], false)] {
            let emitted = vec![8.0];
            follower.note(&Metered { reflected, emitted });
            assert_eq!(follower.shows_lamps_only, shows_lamps_only);
        }
    }

    #[test]
    fn the_exposure_glides_to_what_was_metered_and_rests() {
        let follower = Follower {
            target: Some(-3.0),
            ..Follower::default()
        };
        let (mut exposure, mut frames, mut is_moving) = (2.0, 0, true);
        while is_moving {
            let before = exposure;
            (exposure, is_moving) = follower.advance(exposure, 1.0 / 60.0);
            assert!(before - exposure < 0.5, "no jump: {before} to {exposure}");
            frames += 1;
        }
        assert_eq!(exposure, -3.0);
        assert!((20..200).contains(&frames), "{frames}");
        assert_eq!(Follower::default().advance(1.5, 1.0), (1.5, false));
    }

    #[test]
    fn small_moves_keep_the_exposure_and_large_ones_do_not() {
        let before = Camera::default();
        let moved = |change: &dyn Fn(&mut Camera)| {
            let mut camera = before;
            change(&mut camera);
            shows_other_things(&camera, &before)
        };
        assert!(!moved(&|camera| camera.orbit(Vec2::new(8.0, 4.0))));
        assert!(!moved(&|camera| camera.distance *= 0.9));
        assert!(moved(&|camera| camera.orbit(Vec2::new(90.0, 0.0))));
        assert!(moved(&|camera| camera.distance *= 0.5));
        assert!(moved(&|camera| camera.look(Vec2::new(120.0, 0.0))));
        assert!(moved(&|camera| camera.orthographic = true));
    }
}
