//! Which moved sides of a ring bound anything.
//!
//! A side shorter than what its corners take from it has its ends in the wrong order once it is
//! moved, and the raw ring makes a small loop there. Where its two neighbours meet before they
//! reach it, the side bounds nothing and may be left out: of three half planes whose borders turn
//! the same way by less than half a circle, the middle one is then redundant. The result is the
//! same without the loop, and a raw ring without loops seldom crosses anything.

/// What becomes of sides so short that their moved ends have changed places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShortSides {
    /// They make small loops of negative winding, which take nothing away from the result.
    Loop,
    /// Their neighbours meet instead, wherever the result is the same.
    LeftOut,
}

/// The sides of one ring, moved; in order round the ring. Places on them are lengths along the
/// side, from where its first corner lay before it was moved.
#[derive(Debug, Clone)]
pub struct MovedSides {
    /// Whether the sides at a corner end at their crossing; corner `i` is before side `i`.
    meet: Vec<bool>,
    from: Vec<f64>,
    to: Vec<f64>,
    before: Vec<usize>,
    after: Vec<usize>,
    left_out: Vec<bool>,
}

impl MovedSides {
    /// `lost[i]` says what the sides before and after corner `i` lose when both end at their
    /// crossing, negative for what they gain; `None` where they do not meet, but end beside the
    /// corner. Corner `i` is before side `i`.
    ///
    /// # Panics
    ///
    /// When there are not as many corners as sides.
    #[must_use]
    pub fn new(lengths: &[f64], lost: &[Option<[f64; 2]>]) -> Self {
        assert_eq!(lengths.len(), lost.len(), "a corner before every side");
        let count = lengths.len();
        let at = |corner: usize, side: usize| lost[corner].map_or(0.0, |lost| lost[side]);
        Self {
            meet: lost.iter().map(Option::is_some).collect(),
            from: (0..count).map(|i| at(i, 1)).collect(),
            to: (0..count).map(|i| lengths[i] - at((i + 1) % count, 0)).collect(),
            before: (0..count).map(|i| (i + count - 1) % count).collect(),
            after: (0..count).map(|i| (i + 1) % count).collect(),
            left_out: vec![false; count],
        }
    }

    /// Leaves out sides that bound nothing. `crossing(one, other)` says where two sides that are not
    /// neighbours meet, on each of them; `None` where they are too nearly parallel for that.
    pub fn leave_out_short(&mut self, crossing: impl Fn(usize, usize) -> Option<[f64; 2]>) {
        let mut left = self.from.len();
        let mut short: Vec<usize> = (0..left).filter(|&side| !self.fits(side)).collect();
        while let Some(side) = short.pop() {
            let (before, after) = (self.before[side], self.after[side]);
            let ends_at_crossings = self.meet[side] && self.meet[after];
            // Two sides bound no ring, and whether three do is not to be told from their ends.
            if left <= 3 || self.left_out[side] || self.fits(side) || !ends_at_crossings {
                continue;
            }
            let Some([to, from]) = crossing(before, after) else { continue };
            // They must meet before either of them reaches the side between.
            if to > self.to[before] || from < self.from[after] {
                continue;
            }
            left -= 1;
            self.left_out[side] = true;
            (self.to[before], self.after[before]) = (to, after);
            (self.from[after], self.before[after]) = (from, before);
            short.extend([before, after]);
        }
    }

    /// Returns the sides that are not left out.
    pub fn kept(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.from.len()).filter(|&side| !self.left_out[side])
    }

    /// Returns the kept side before a kept side.
    #[must_use]
    pub fn before(&self, side: usize) -> usize {
        self.before[side]
    }

    /// Returns the corners between a kept side and the kept one before it: one, when no side
    /// between was left out.
    pub fn corners(&self, side: usize) -> impl Iterator<Item = usize> + '_ {
        let count = self.from.len();
        let first = (self.before[side] + 1) % count;
        let more = (side + count - first) % count;
        (0..=more).map(move |k| (first + k) % count)
    }

    /// Whether a kept side meets the one before it at a crossing found after sides between them were
    /// left out.
    #[must_use]
    pub fn meets_across(&self, side: usize) -> bool {
        (self.before[side] + 1) % self.from.len() != side
    }

    /// Returns where a side begins.
    #[must_use]
    pub fn from(&self, side: usize) -> f64 {
        self.from[side]
    }

    /// Returns where a side ends.
    #[must_use]
    pub fn to(&self, side: usize) -> f64 {
        self.to[side]
    }

    /// Returns whether a side begins before it ends.
    #[must_use]
    pub fn fits(&self, side: usize) -> bool {
        self.from[side] <= self.to[side]
    }

    /// Returns whether no side has its ends in the wrong order.
    #[must_use]
    pub fn all_fit(&self) -> bool {
        (0..self.from.len()).all(|side| self.fits(side))
    }

    /// Returns whether both sides at a corner fit: a kept side and the kept one before it.
    #[must_use]
    pub fn fit_around(&self, side: usize) -> bool {
        self.fits(self.before[side]) && self.fits(side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_left_out_only_when_its_neighbours_meet_before_they_reach_it() {
        // Side 1 would begin at 2 and end at 0.5; side 0 reaches it at 8, side 2 leaves it at 0.5.
        let lost = [None, Some([2.0, 2.0]), Some([0.5, 0.5]), None];
        let kept = |meeting: [f64; 2]| {
            let mut sides = MovedSides::new(&[10.0, 1.0, 10.0, 10.0], &lost);
            sides.leave_out_short(|_, _| Some(meeting));
            sides.kept().collect::<Vec<_>>()
        };
        assert_eq!(kept([7.5, 1.0]), [0, 2, 3]);
        assert_eq!(kept([9.0, 1.0]), [0, 1, 2, 3]);
        assert_eq!(kept([7.5, 0.1]), [0, 1, 2, 3]);
    }
}
