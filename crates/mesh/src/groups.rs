//! Groups of things that belong together, joined pair by pair.
//!
//! Union-find with path halving (R. Tarjan, J. van Leeuwen (1984), "Worst-case analysis of set
//! union algorithms", J. ACM 31(2)). A group goes by its least member, so that the answer does not
//! depend on the order of the pairs; without balancing that costs a logarithm at worst.

/// Things `0..n` in groups.
pub(crate) struct Groups {
    /// A thing of the same group with a lower number, or itself.
    lower: Vec<u32>,
}

impl Groups {
    /// Returns `n` groups of one.
    ///
    /// # Panics
    ///
    /// When `n` is more than 2³².
    pub(crate) fn new(n: usize) -> Self {
        let n = u32::try_from(n).expect("things are numbered in 32 bits");
        Self { lower: (0..n).collect() }
    }

    /// Makes the groups of two things one.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.leader(a), self.leader(b));
        self.lower[a.max(b)] = a.min(b) as u32;
    }

    /// Returns the least member of the group of a thing.
    pub(crate) fn leader(&mut self, mut i: usize) -> usize {
        while self.lower[i] as usize != i {
            self.lower[i] = self.lower[self.lower[i] as usize];
            i = self.lower[i] as usize;
        }
        i
    }

    /// Returns the group of each thing, numbered by their least members, and how many there are.
    pub(crate) fn numbered(mut self) -> (Vec<u32>, u32) {
        let mut n_groups = 0;
        for i in 0..self.lower.len() {
            // Entries before `i` hold numbers already, the others still members.
            let lower = self.lower[i] as usize;
            self.lower[i] = if lower == i { n_groups } else { self.lower[lower] };
            n_groups += u32::from(lower == i);
        }
        (self.lower, n_groups)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_go_by_their_least_member() {
        let mut groups = Groups::new(7);
        for (a, b) in [(5, 3), (6, 5), (2, 6), (1, 4), (4, 1)] {
            groups.join(a, b);
        }
        let leaders: Vec<usize> = (0..7).map(|i| groups.leader(i)).collect();
        assert_eq!(leaders, [0, 1, 2, 2, 1, 2, 2]);
        assert_eq!(groups.numbered(), (vec![0, 1, 2, 2, 1, 2, 2], 3));
    }
}
