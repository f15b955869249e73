//! Rectangles packed into a square from the top down, each where it reaches least far down (the skyline of Lodi, Martello and
//! Vigo, "Heuristic Algorithms for the Three-Dimensional Bin Packing Problem", 2002, in two dimensions).

/// Where the rectangles of these widths and heights lie in a square, by their upper left corners; `None` where there is no
/// room.
pub(super) fn pack(sizes: &[[u32; 2]], side: u32) -> Option<Vec<[u32; 2]>> {
    let area: u64 = sizes
        .iter()
        .map(|[width, height]| u64::from(*width) * u64::from(*height))
        .sum();
    if area > u64::from(side).pow(2) {
        return None;
    }
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    // Those that are alike follow each other, so that few steps are left between them.
    order.sort_by_key(|&at| std::cmp::Reverse((sizes[at][1], sizes[at][0])));
    let mut places = vec![[0; 2]; sizes.len()];
    let mut skyline = Skyline::new(side);
    for at in order {
        places[at] = skyline.place(sizes[at])?;
    }
    Some(places)
}

/// The lower edge of what is packed: steps from the left, each with the row from which on it is free.
struct Skyline {
    side: u32,
    /// Column at which a step begins, and its row.
    steps: Vec<[u32; 2]>,
}

impl Skyline {
    fn new(side: u32) -> Self {
        Self {
            side,
            steps: vec![[0, 0]],
        }
    }

    /// Put a rectangle where its lower edge is highest; of such places the first.
    fn place(&mut self, [width, height]: [u32; 2]) -> Option<[u32; 2]> {
        let mut best: Option<(u32, usize)> = None;
        for step in 0..self.steps.len() {
            let Some(row) = self.row(step, width, best.map(|(row, _)| row)) else {
                continue;
            };
            if row + height <= self.side {
                best = Some((row, step));
            }
        }
        let (row, step) = best?;
        let column = self.steps[step][0];
        self.cover(step, column + width, row + height);
        Some([column, row])
    }

    /// The row at which a rectangle of this width lies that begins at a step; `None` where it reaches out of the square, or
    /// not above a row.
    fn row(&self, step: usize, width: u32, above: Option<u32>) -> Option<u32> {
        let end = self.steps[step][0].checked_add(width)?;
        if end > self.side {
            return None;
        }
        let mut row = 0;
        for [column, free] in &self.steps[step..] {
            if *column >= end {
                break;
            }
            row = row.max(*free);
            if above.is_some_and(|above| row >= above) {
                return None;
            }
        }
        Some(row)
    }

    /// What begins at a step and ends before a column reaches down to a row.
    fn cover(&mut self, step: usize, end: u32, row: u32) {
        let after = self.steps[step..].iter();
        let covered = after.take_while(|[column, _]| *column < end).count();
        let last = self.steps[step + covered - 1];
        let next = self.steps.get(step + covered).map(|[column, _]| *column);
        let begin = [self.steps[step][0], row];
        // What is left of the last one goes on.
        let rest = (end < next.unwrap_or(self.side)).then_some([end, last[1]]);
        self.steps
            .splice(step..step + covered, [begin].into_iter().chain(rest));
        if step > 0 && self.steps[step - 1][1] == row {
            self.steps.remove(step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    #[test]
    fn rectangles_lie_apart_inside_the_square_and_fill_it_well() {
        for seed in 0..20 {
            let mut random = Random::new(seed, 0);
            let mut side = || 1 + (random.uniform().powi(3) * 60.0) as u32;
            let sizes: Vec<[u32; 2]> = (0..200).map(|_| [side(), side()]).collect();
            let area: u32 = sizes.iter().map(|[width, height]| width * height).sum();
            let square = (f64::from(area) / 0.8).sqrt() as u32 + 20;
            let places = pack(&sizes, square).unwrap();
            let mut taken = vec![false; (square * square) as usize];
            for ([column, row], [width, height]) in places.into_iter().zip(&sizes) {
                for at in 0..width * height {
                    let [x, y] = [column + at % width, row + at / width];
                    assert!(x < square && y < square, "{seed}");
                    let texel = &mut taken[(y * square + x) as usize];
                    assert!(!*texel, "{seed}: two rectangles at {x} {y}");
                    *texel = true;
                }
            }
        }
    }

    #[test]
    fn what_has_no_room_is_refused() {
        assert_eq!(pack(&[[4, 4]], 4), Some(vec![[0, 0]]));
        assert_eq!(pack(&[[3, 2], [3, 2]], 4), Some(vec![[0, 0], [0, 2]]));
        for sizes in [&[[5, 1]][..], &[[1, 5]], &[[3, 3], [2, 2]]] {
            assert_eq!(pack(sizes, 4), None, "{sizes:?}");
        }
        assert_eq!(pack(&[], 4), Some(vec![]));
    }
}
