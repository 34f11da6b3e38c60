//! Groups of things that belong together, joined pair by pair.
//!
//! Union-find with path halving (R. Tarjan, J. van Leeuwen (1984), "Worst-case analysis of set
//! union algorithms", J. ACM 31(2)). A group goes by its least member, so that the answer does not
//! depend on the order of the pairs; without balancing that costs a logarithm at worst.

/// Things `0..n` in groups.
pub(crate) struct Groups {
    /// A thing of the same group with a lower number, or itself.
    lower: Vec<usize>,
}

impl Groups {
    /// Returns `n` groups of one.
    pub(crate) fn new(n: usize) -> Self {
        Self { lower: (0..n).collect() }
    }

    /// Makes the groups of two things one.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.leader(a), self.leader(b));
        self.lower[a.max(b)] = a.min(b);
    }

    /// Returns the least member of the group of a thing.
    pub(crate) fn leader(&mut self, mut i: usize) -> usize {
        while self.lower[i] != i {
            self.lower[i] = self.lower[self.lower[i]];
            i = self.lower[i];
        }
        i
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
    }
}
