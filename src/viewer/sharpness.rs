//! How far the traced picture of a view is.

/// How far the traced picture of the view is, for people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sharpness {
    /// Samples of a pixel at most.
    pub samples: u32,
    /// Estimated noise of a pixel, relative to the mean light of the picture; `None` before it is known.
    pub noise: Option<f32>,
    /// Whether no finer picture follows.
    pub is_done: bool,
}

impl Sharpness {
    /// For the line at the bottom.
    pub fn label(&self) -> String {
        let noise = self.noise.map_or_else(String::new, |noise| {
            format!(", noise {:.1} %", 100.0 * noise)
        });
        let more = if self.is_done { "" } else { " …" };
        match self.samples {
            0 => "Tracing …".to_owned(),
            samples => format!("Traced: {samples} samples{noise}{more}"),
        }
    }
}
