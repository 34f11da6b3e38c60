//! Booleans of rings, without a sweep where the rings allow it.
//!
//! Most offsets and most comparisons of neighbouring layers lay rings beside or inside each other,
//! or let them cross in a few places. Then every ring, or every arc between two crossings, is kept
//! whole or dropped, by the windings on its two sides. Telling where rings cross costs a small part
//! of the sweep that would cut all of them.

mod boundary;
mod crossing;
mod nesting;
mod simple;

use crate::grid::GridPoint;
use crate::region::Island;

use simple::Simple;

/// Whose ring it is in a boolean of two regions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The region before the operator.
    Subject,
    /// The region behind it.
    Clip,
}

/// How often places are wound round by the rings of either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Windings {
    pub(crate) subject: i32,
    pub(crate) clip: i32,
}

impl Windings {
    /// Adds those of `other`, `times` over.
    fn add(&mut self, other: Self, times: i32) {
        self.subject += times * other.subject;
        self.clip += times * other.clip;
    }
}

impl Side {
    /// What a ring of this side adds to the places that it winds round once.
    fn weight(self) -> Windings {
        match self {
            Self::Subject => Windings { subject: 1, clip: 0 },
            Self::Clip => Windings { subject: 0, clip: 1 },
        }
    }
}

/// Returns the islands of all places whose windings `is_inside` accepts; `None` when rings touch
/// or overlap, others or themselves, or when kept places meet in a point. Rings that are equal, as
/// those of upright walls in neighbouring layers, count as one.
///
/// The result is the overlay engine's up to the rounding of crossings: outer rings in the order of their least
/// points (by x, then y), so are their holes, and no point lies on a straight line between its
/// neighbours.
pub(crate) fn resolved<'a>(
    rings: impl Iterator<Item = (&'a [GridPoint], Side)>,
    is_inside: impl Fn(Windings) -> bool,
) -> Option<Vec<Island>> {
    let mut placed = Vec::new();
    for (ring, side) in rings {
        if let Some(ring) = Simple::new(ring, side.weight())? {
            placed.push(ring);
        }
    }
    let placed = simple::merged(placed);
    let crossings = crossing::crossings(&placed)?;
    if crossings.is_empty() {
        return Some(nesting::islands(&placed, is_inside));
    }
    let mut resolved = Vec::new();
    for ring in boundary::uncrossed(&placed, &crossings, is_inside)? {
        if let Some(ring) = Simple::new(&ring, Side::Subject.weight())? {
            resolved.push(ring);
        }
    }
    // Crossings moved to the grid, and their sides with them.
    let is_done = crossing::crossings(&resolved)?.is_empty();
    is_done.then(|| nesting::islands(&resolved, |windings| windings.subject > 0))
}
