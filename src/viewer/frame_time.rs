//! Processor time of the last frames.

use std::collections::VecDeque;

/// Frames remembered: about two seconds. Fewer jump about, more hide what just changed.
const FRAMES: usize = 120;

/// Seconds of the last frames.
#[derive(Clone, Debug, Default)]
pub struct FrameTimes(VecDeque<f32>);

impl FrameTimes {
    /// Take note of a frame.
    pub fn push(&mut self, secs: f32) {
        if self.0.len() == FRAMES {
            self.0.pop_front();
        }
        self.0.push_back(secs);
    }

    /// Middle and largest of the last frames, or `None` before the first.
    pub fn middle_and_most(&self) -> Option<[f32; 2]> {
        let mut sorted: Vec<f32> = self.0.iter().copied().collect();
        sorted.sort_by(f32::total_cmp);
        Some([*sorted.get(sorted.len() / 2)?, *sorted.last()?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_frames_are_forgotten() {
        let mut times = FrameTimes::default();
        assert_eq!(times.middle_and_most(), None);
        times.push(9.0);
        for _ in 0..FRAMES {
            times.push(1.0);
        }
        times.push(2.0);
        assert_eq!(times.middle_and_most(), Some([1.0, 2.0]));
    }
}
