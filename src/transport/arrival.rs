//! The part of weighted rays that arrives.

/// Summed weights of all rays and of the visible ones.
#[derive(Clone, Copy, Debug, Default)]
struct Arrival {
    sent: f32,
    arrived: f32,
}

impl Arrival {
    fn part(&self) -> Option<f32> {
        (self.sent > 0.0).then(|| self.arrived / self.sent)
    }
}

/// The visible part of a weighted number of rays, in two halves of alternate rays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Share {
    halves: [Arrival; 2],
    count: usize,
}

impl Share {
    /// Count a ray of which a part arrives, 0…1.
    pub(super) fn count(&mut self, weight: f32, part: f32) {
        let half = &mut self.halves[self.count % 2];
        half.sent += weight;
        half.arrived += weight * part;
        self.count += 1;
    }

    /// The visible part, 0…1.5; `None` without weight. The ratio of two sums over few rays is too small on average,
    /// since large weights often belong to visible rays. The halves have twice the bias of the whole, which gives its
    /// size (Quenouille 1956).
    pub(super) fn part(&self) -> Option<f32> {
        let [first, second] = self.halves;
        let whole = Arrival {
            sent: first.sent + second.sent,
            arrived: first.arrived + second.arrived,
        };
        let part = whole.part()?;
        let halves = first.part().zip(second.part());
        Some(halves.map_or(part, |(a, b)| (2.0 * part - 0.5 * (a + b)).max(0.0)))
    }
}
