//! Hemisphere coverage: the cosine-weighted part of a surface's hemisphere that lit surfaces fill.
//!
//! It is 1 in an enclosed room, and less where rays leave the scene or meet backs. The sum of form factors of each leaf
//! must equal it, so their ratio gives the joint error of the kernel and the visibility of its links, by which light is
//! scaled.
//!
//! Form factors that are missing from the sum mostly belong to near surfaces: coarse links see a whole cluster from its
//! centre, and tables see surfaces beside it edge-on. Simple scaling would take these surfaces for as bright as the far
//! ones, and folds and undersides would glow. So the missing light has the radiosity of the neighbourhood of the leaf,
//! if that is darker. (Trimmed error after the second step of `normal`: `room-42879` 5.8 → 4.7 %, `room-8621` 5.6 → 4.7
//! %; always with that of the neighbourhood: 5.0 % both, and lit hilltops up to twice too bright.)

use glam::{Vec3, Vec4};

use crate::{hierarchy::Channels as _, transport::luminance};

/// Smallest sum of form factors by which light is scaled up, as a share of the coverage. Larger, and the errors of
/// coarse links remain; smaller, and the noise of a few rays is amplified.
const LEAST_ROW: f32 = 0.3;

/// Excess of the sum of form factors over an estimated coverage, as a share of it, of which half is scaled away; of a
/// smaller excess less, since it may come from dark faces and faces inside solids alone. Smaller, and light is lost
/// about faces inside solids; larger, and coarse links stay too bright.
const SURPLUS: f32 = 0.1;

/// Factors above this, up to 1, count as noise: like missing light, surplus light has the radiosity of the
/// neighbourhood if that is darker. Smaller, and real surplus is scaled too little; larger, and light is lost on
/// average (halls of sheets 3.5 % too dark at `draft` with 1, 2.4 % with 0.8).
const SLIGHT: f32 = 0.8;

/// The part of a hemisphere that an even sky fills, cosine-weighted.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SkyShare {
    /// The part, 0…1.
    pub(crate) share: f32,
    /// Standard error of the part.
    pub(crate) deviation: f32,
}

/// The part of a cell's hemisphere that lit surfaces fill, cosine-weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HemisphereCoverage {
    /// The part, 0…1.
    pub(super) share: f32,
    /// Standard error of the part; 0 if it is exact.
    deviation: f32,
    /// The lit part of all that fills the hemisphere, backs of surfaces included, 0…1.
    lit: f32,
    /// If the part is the complement of that of an even sky, the radiosity (luminance) of a surface as bright; else 0.
    sky: f32,
}

impl HemisphereCoverage {
    /// Enclosed by lit surfaces.
    pub(super) const ENCLOSED: Self = Self {
        share: 1.0,
        deviation: 0.0,
        lit: 1.0,
        sky: 0.0,
    };

    /// Unknown: light is not scaled.
    pub(super) const UNKNOWN: Self = Self {
        share: 0.0,
        deviation: f32::INFINITY,
        ..Self::ENCLOSED
    };

    /// Inside a solid, where no light arrives.
    pub(super) const INSIDE_SOLID: Self = Self {
        share: 0.0,
        deviation: 0.0,
        lit: 0.0,
        sky: 0.0,
    };

    /// An estimate of the part, with its standard error; `lit` is the lit part of all that fills the hemisphere.
    pub(super) fn estimated(share: f32, deviation: f32, lit: f32) -> Self {
        Self {
            share,
            deviation,
            lit,
            sky: 0.0,
        }
    }

    /// The complement of what an even sky of this radiosity (luminance) fills, of which a part is `lit`. What is exact
    /// without the sky stays as it is.
    pub(super) fn beside_sky(self, sky: SkyShare, lit: f32, radiosity: f32) -> Self {
        if self == Self::INSIDE_SOLID || self == Self::UNKNOWN {
            return self;
        }
        Self {
            share: (1.0 - sky.share).clamp(0.0, 1.0) * lit,
            deviation: sky.deviation * lit,
            lit,
            sky: radiosity,
        }
    }

    /// The mean of the parts at three corners.
    pub(crate) fn mean(corners: [Self; 3]) -> Self {
        let [first, ..] = corners;
        if corners == [first; 3] {
            return first;
        }
        let mean = |of: fn(&Self) -> f32| corners.iter().map(of).sum::<f32>() / 3.0;
        Self {
            share: mean(|corner| corner.share),
            deviation: mean(|corner| corner.deviation),
            lit: mean(|corner| corner.lit),
            sky: first.sky,
        }
    }

    /// Whether it is the complement of an even sky.
    pub(super) fn is_beside_sky(&self) -> bool {
        self.sky > 0.0
    }

    /// The lit part of all that fills the hemisphere.
    pub(super) fn lit(&self) -> f32 {
        self.lit
    }

    /// Weight of the part beside another estimate of it, 0…1: `trust` by their errors alone, 0…1, and more where the sky
    /// fills the rest, since an error of both cancels as far as the surfaces, of this radiosity (luminance), are as bright
    /// as the sky. (The weight for which the variance of the irradiance is least.)
    fn weight(&self, trust: f32, radiosity: f32) -> f32 {
        let cancelled = if self.sky > 0.0 {
            (self.sky / radiosity.max(f32::MIN_POSITIVE)).min(1.0)
        } else {
            0.0
        };
        trust + (1.0 - trust) * cancelled
    }

    /// For an estimate of an irradiance by this number of rays, given that over links: the radiosity to subtract from what
    /// each ray meets and to add times the part. Where the mean radiosity is known better than which rays meet something,
    /// that removes their noise (a control variate); 0 where no sky gives the part.
    pub(crate) fn control(&self, linked: Vec4, rays: u32) -> Control {
        if self.sky <= 0.0 {
            return Control::default();
        }
        let filled = self.share.max(linked.form_factor_sum());
        let radiosity = linked.color() / filled.max(f32::MIN_POSITIVE);
        let (own, others) = (
            self.deviation * self.deviation,
            self.share * (1.0 - self.share) / rays.max(1) as f32,
        );
        let trust = if own + others > 0.0 {
            others / (own + others)
        } else {
            0.0
        };
        let radiosity = radiosity * self.weight(trust, luminance(radiosity.extend(0.0)));
        Control {
            radiosity: radiosity.extend(0.0),
            irradiance: (radiosity * self.share).extend(0.0),
        }
    }

    /// Whether the part is exact, and so the same for all elements of the cell.
    fn is_certain(&self) -> bool {
        self.deviation == 0.0
    }

    /// Factor of an irradiance with this sum of form factors and mean radiosity (luminance), at least 0. Where the
    /// coverage is an estimate, a sum within its error is changed little.
    fn factor(&self, row_sum: f32, radiosity: f32) -> f32 {
        let gap = self.share - row_sum;
        let doubt = 2.0 * self.deviation;
        let trust = if self.is_certain() {
            1.0
        } else {
            let surplus = if gap < 0.0 { SURPLUS * self.share } else { 0.0 };
            gap * gap / (gap * gap + doubt * doubt + surplus * surplus)
        };
        let target = row_sum + self.weight(trust, radiosity) * gap;
        let row_sum = row_sum.max(LEAST_ROW * self.share);
        if row_sum > 0.0 { target / row_sum } else { 1.0 }
    }

    /// Irradiance of a leaf, with the sum of its form factors in the fourth channel, scaled so that these add to the
    /// coverage. `sums` are the area of the cell and the sum of form factors times area over the cell; `nearby` is the
    /// mean radiosity of the neighbourhood.
    pub(crate) fn scaled(&self, light: Vec4, sums: (f32, f32), nearby: Vec3) -> Vec4 {
        multiplied(light, self.factor_for(light, sums), nearby)
    }

    /// The factor for one leaf with this irradiance. An estimate by rays holds for the mean over the cell, whose elements
    /// may differ.
    pub(super) fn factor_for(&self, light: Vec4, (area, weighted): (f32, f32)) -> f32 {
        let row_sum = light.form_factor_sum();
        let radiosity = luminance(light.color().extend(0.0)) / row_sum.max(f32::MIN_POSITIVE);
        let is_own = self.is_certain() || self.sky > 0.0 || area <= 0.0;
        self.factor(if is_own { row_sum } else { weighted / area }, radiosity)
    }
}

/// See [`HemisphereCoverage::control`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Control {
    /// Radiosity to subtract from that of each surface that a ray meets, W/m².
    pub(crate) radiosity: Vec4,
    /// Irradiance to add, W/m².
    pub(crate) irradiance: Vec4,
}

/// Irradiance times a factor; the missing light has the radiosity `nearby` if that is darker. The sum of form factors
/// in the fourth channel is unchanged.
pub(super) fn multiplied(light: Vec4, factor: f32, nearby: Vec3) -> Vec4 {
    let (color, row_sum) = (light.color(), light.form_factor_sum());
    if factor <= SLIGHT || row_sum <= 0.0 {
        return (color * factor).extend(row_sum);
    }
    let mean = color / row_sum;
    let is_darker = luminance(nearby.extend(0.0)) < luminance(mean.extend(0.0));
    let missing = if is_darker { nearby } else { mean };
    let complete = color + missing * ((factor - 1.0) * row_sum);
    complete.max(Vec3::ZERO).extend(row_sum)
}

#[cfg(test)]
mod tests;
