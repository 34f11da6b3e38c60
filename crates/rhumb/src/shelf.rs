//! Sections that are put by. What stands on all layers above, supports and branches, is found before any
//! layer is filled, from the same sections: those that there is room for are cut once.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

use geom::grid::GridPoint;
use geom::region::Region;
use slicer::section::Section;

/// How much is put by at most, bytes: a few hundred sections of a fine model.
const ROOM: usize = 8 << 20;

/// The section of a layer, and a thinned-out copy for comparing layers.
pub(crate) type Cut = (Section, Region);

/// The sections of a stage. Those that there is no room for are cut again when they are wanted again.
pub(crate) struct Shelf {
    cuts: Vec<Mutex<Option<Cut>>>,
    room: AtomicUsize,
}

/// How a shelf is used.
#[derive(Clone, Copy)]
pub(crate) enum Use<'a> {
    /// Not at all.
    Leave,
    /// By who looks ahead: others will want the same sections.
    PutBy(&'a Shelf),
    /// By the last who wants them.
    Empty(&'a Shelf),
}

impl Shelf {
    /// An empty one for so many layers.
    pub(crate) fn of(layers: usize) -> Self {
        let cuts = (0..layers).map(|_| Mutex::default()).collect();
        Self { cuts, room: AtomicUsize::new(ROOM) }
    }

    fn put(&self, k: usize, cut: &Cut) {
        let size = size_of::<GridPoint>() * (cut.0.region.point_count() + cut.1.point_count());
        let fits = |room: usize| room.checked_sub(size);
        if self.room.fetch_update(Relaxed, Relaxed, fits).is_ok() {
            *self.cuts[k].lock().unwrap_or_else(PoisonError::into_inner) = Some(cut.clone());
        }
    }
}

impl Use<'_> {
    /// Returns the section of layer `k`, from the shelf or newly cut.
    pub(crate) fn cut(&self, k: usize, anew: impl FnOnce() -> Cut) -> Cut {
        let lock = |shelf: &Shelf, take: bool| {
            let mut kept = shelf.cuts[k].lock().unwrap_or_else(PoisonError::into_inner);
            if take { kept.take() } else { kept.clone() }
        };
        match self {
            Self::Leave => anew(),
            Self::Empty(shelf) => lock(shelf, true).unwrap_or_else(anew),
            Self::PutBy(shelf) => lock(shelf, false).unwrap_or_else(|| {
                let cut = anew();
                shelf.put(k, &cut);
                cut
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_cut_once_and_handed_on() {
        let shelf = Shelf::of(3);
        let square = |half: f64| {
            let ring = [[-half, -half], [half, -half], [half, half], [-half, half]];
            let ring = ring.map(nalgebra::Point2::from);
            Region::from_rings([ring.as_slice()], geom::region::Fill::NonZero)
        };
        let cut = |half: f64| {
            let section = Section { region: square(half), ..Section::default() };
            (section.clone(), section.region)
        };
        let first = Use::PutBy(&shelf).cut(1, || cut(3.0));
        let again = Use::PutBy(&shelf).cut(1, || unreachable!("it is on the shelf"));
        let last = Use::Empty(&shelf).cut(1, || unreachable!("it is on the shelf"));
        assert!([again, last].iter().all(|cut| cut.1 == first.1 && cut.0 == first.0));
        assert_eq!(Use::Empty(&shelf).cut(1, || cut(4.0)).1.area(), 64.0, "it was handed out");
        assert_eq!(Use::Leave.cut(1, || cut(5.0)).1.area(), 100.0);
    }

    #[test]
    fn a_full_shelf_takes_no_more() {
        let shelf = Shelf { room: AtomicUsize::new(0), ..Shelf::of(1) };
        let ring = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(nalgebra::Point2::from);
        let region = Region::from_rings([ring.as_slice()], geom::region::Fill::NonZero);
        let mut times = 0;
        for _ in 0..2 {
            let (_, cover) = Use::PutBy(&shelf).cut(0, || {
                times += 1;
                (Section::default(), region.clone())
            });
            assert_eq!(cover, region);
        }
        assert_eq!(times, 2);
    }
}
