//! Checks of pictures that are drawn without a window.

#![allow(dead_code, reason = "each test uses some of it")]

use vecrad::viewer::headless::HeadlessError;

/// Steps of 255 by which a rounded half float may be off after the sRGB curve.
const TOLERANCE: i32 = 2;

pub(crate) fn assert_near(seen: [u8; 3], expected: [u8; 3], what: &str) {
    let near = seen
        .iter()
        .zip(expected)
        .all(|(a, b)| (i32::from(*a) - i32::from(b)).abs() <= TOLERANCE);
    assert!(near, "{what}: {seen:?} instead of {expected:?}");
}

/// The picture, or `None` on a machine that cannot draw; CI must be able to.
pub(crate) fn unless_no_adapter<T>(drawn: Result<T, HeadlessError>) -> Option<T> {
    match drawn {
        Ok(picture) => Some(picture),
        Err(HeadlessError::NoAdapter(reason)) => {
            assert!(std::env::var_os("CI").is_none(), "CI must draw: {reason}");
            eprintln!("skipped, no graphics adapter: {reason}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}
