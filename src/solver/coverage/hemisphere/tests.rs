use super::*;
use crate::geometry::Random;

fn color(random: &mut Random) -> Vec3 {
    Vec3::from_array([(); 3].map(|()| random.uniform()))
}

#[test]
fn light_is_multiplied_by_the_factor_where_all_radiosities_are_equal() {
    let mut random = Random::new(3, 0);
    for _ in 0..200 {
        let (radiosity, row, share) =
            (color(&mut random), 1.5 * random.uniform(), random.uniform());
        let coverage = HemisphereCoverage::estimated(share, 0.0, 1.0);
        let light = (radiosity * row).extend(row);
        let scaled = coverage.scaled(light, (1.0, row), radiosity);
        let expected = radiosity * row * coverage.factor(row, 1.0);
        assert!((scaled.color() - expected).abs().max_element() < 1e-5);
        assert_eq!(scaled.form_factor_sum(), row);
    }
}

#[test]
fn missing_light_is_as_bright_as_the_darker_of_the_neighbourhood_and_the_mean() {
    let mut random = Random::new(4, 0);
    for _ in 0..200 {
        let (seen, nearby) = (color(&mut random), color(&mut random));
        let row = 0.3 + 0.7 * random.uniform();
        let light = (seen * row).extend(row);
        let whole = HemisphereCoverage::ENCLOSED.scaled(light, (1.0, row), nearby);
        let luminance = |color: Vec3| luminance(color.extend(0.0));
        let lacking = luminance(whole.color() - seen * row) / (1.0 - row).max(1e-6);
        let least = luminance(seen).min(luminance(nearby));
        assert!(
            (lacking - least).abs() < 1e-3 || row > 0.999,
            "{lacking} {least}"
        );
        assert!(whole.min_element() >= 0.0);
    }
}

/// The coverage where an even sky fills a part, known up to a deviation, and everything else is lit.
fn beside_sky(share: f32, deviation: f32, radiosity: f32) -> HemisphereCoverage {
    let sky = SkyShare { share, deviation };
    HemisphereCoverage::ENCLOSED.beside_sky(sky, 1.0, radiosity)
}

#[test]
fn surfaces_as_bright_as_the_sky_complete_it_whatever_the_noise() {
    let mut random = Random::new(5, 0);
    for _ in 0..200 {
        let (share, deviation, radiosity) = (
            0.9 * random.uniform(),
            0.2 * random.uniform(),
            2.0 * random.uniform(),
        );
        let row = (1.0 - share) * (0.5 + random.uniform());
        let light = Vec3::splat(radiosity * row).extend(row);
        let coverage = beside_sky(share, deviation, radiosity);
        let scaled = coverage.scaled(light, (0.0, 0.0), Vec3::splat(radiosity));
        let all = scaled.x + radiosity * share;
        assert!((all - radiosity).abs() < 1e-4 * radiosity, "{share} {row}");
        // Rays that met any part of it find the same.
        let control = coverage.control(scaled.truncate().extend(1.0 - share), 16);
        let met = (16.0 * random.uniform()).floor() / 16.0;
        let found = met * (radiosity - control.radiosity.x) + control.irradiance.x;
        assert!((found - scaled.x).abs() < 1e-4 * radiosity, "{found}");
    }
}

#[test]
fn noise_of_a_dark_sky_does_not_change_the_light_of_bright_surfaces() {
    let light = Vec3::splat(30.0).extend(0.3);
    let factor = |sky: f32, deviation: f32| {
        beside_sky(0.65, deviation, sky)
            .scaled(light, (0.0, 0.0), Vec3::splat(100.0))
            .x
            / 30.0
    };
    assert!((factor(1e-3, 0.2) - 1.0).abs() < 0.02, "within the noise");
    assert!((factor(1e-3, 1e-4) - 0.35 / 0.3).abs() < 1e-3, "beyond it");
    assert!((factor(100.0, 0.2) - 0.35 / 0.3).abs() < 1e-3, "cancelled");
    // Without a sky nothing is known better than the rays do.
    let control = HemisphereCoverage::estimated(0.5, 0.1, 1.0).control(light, 16);
    assert_eq!(control.radiosity, Vec4::ZERO);
}

#[test]
fn light_with_far_too_large_form_factors_is_scaled_as_a_whole() {
    let light = Vec4::new(2.0, 1.0, 0.5, 2.0);
    let scaled = HemisphereCoverage::ENCLOSED.scaled(light, (1.0, 2.0), Vec3::splat(9.0));
    assert_eq!(scaled, Vec4::new(1.0, 0.5, 0.25, 2.0));
}
