//! The sides of a region by height, for areas that are asked about many places.
//!
//! The sides of all rings are sorted into horizontal bands, each into all that it runs through: what a
//! point or a segment can meet lies in its own bands. Answers are those of the methods of the same names
//! of [`Region`], which look at every side. What they cost grows with the sides of a band alone, and the
//! memory with all sides, however tall.

use nalgebra::Point2;

use crate::grid::mm;
use crate::region::{Part, Region, parts, ring_sides, segments_cross};

/// A region whose sides are sorted by height.
#[derive(Debug, Clone, Default)]
pub struct Bands {
    /// The sides of each band, one band after the other, mm.
    sides: Vec<[Point2<f64>; 2]>,
    /// Where the sides of each band begin in that list, and its end; none for an empty region.
    begins: Vec<u32>,
    /// The least y, mm.
    low: f64,
    /// How many bands there are in a millimetre.
    per_mm: f64,
}

/// Bands hold a few sides each, where sides are short.
const SIDES_PER_BAND: usize = 4;

/// Nor are there more than so many.
const MOST_BANDS: usize = 256;

/// Nor so many that sides lie in more than these on the average, beside the one that they begin in: a side
/// as high as the region lies in all of them, and memory is not to grow with both.
const BANDS_PER_SIDE: f64 = 4.0;

impl Bands {
    /// Sorts the sides of a region.
    #[must_use]
    pub fn of(region: &Region) -> Self {
        let Some(bounds) = region.bounds() else { return Self::default() };
        let (low, high) = (mm(bounds.min).y, mm(bounds.max).y);
        let height = (high - low).max(f64::MIN_POSITIVE);
        let sides =
            || region.rings().flat_map(|ring| ring_sides(ring)).map(|(a, b)| [mm(a), mm(b)]);
        let climb: f64 = sides().map(|[a, b]| (b.y - a.y).abs()).sum();
        let affordable = BANDS_PER_SIDE * region.point_count() as f64 * height / climb;
        let most = MOST_BANDS.min(affordable as usize).max(1);
        let count = (region.point_count() / SIDES_PER_BAND).clamp(1, most);
        let per_mm = count as f64 / height;
        let mut bands = Self { sides: Vec::new(), begins: vec![0; count + 1], low, per_mm };
        for side in sides() {
            for band in bands.met_by(&side) {
                bands.begins[band + 1] += 1;
            }
        }
        for band in 0..count {
            bands.begins[band + 1] += bands.begins[band];
        }
        let mut next = bands.begins.clone();
        bands.sides = vec![[Point2::origin(); 2]; next[count] as usize];
        for side in sides() {
            for band in bands.met_by(&side) {
                bands.sides[next[band] as usize] = side;
                next[band] += 1;
            }
        }
        bands
    }

    /// The bands that a segment runs through; places above or below the region are in the nearest.
    fn met_by(&self, [a, b]: &[Point2<f64>; 2]) -> std::ops::RangeInclusive<usize> {
        self.band(a.y.min(b.y))..=self.band(a.y.max(b.y))
    }

    fn band(&self, y: f64) -> usize {
        // The same for all that is asked: what a side and a point have in common is in one band, whatever
        // the division makes of it.
        (((y - self.low) * self.per_mm).max(0.0) as usize).min(self.begins.len() - 2)
    }

    fn in_band(&self, band: usize) -> &[[Point2<f64>; 2]] {
        &self.sides[self.begins[band] as usize..self.begins[band + 1] as usize]
    }

    /// Returns whether the point (mm) lies inside; undecided exactly on a ring.
    #[must_use]
    pub fn contains(&self, p: &Point2<f64>) -> bool {
        if self.begins.is_empty() {
            return false;
        }
        let mut inside = false;
        for [a, b] in self.in_band(self.band(p.y)) {
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                inside ^= p.x < x;
            }
        }
        inside
    }

    /// Returns whether the whole segment from `a` to `b` (mm) lies inside.
    #[must_use]
    pub fn contains_segment(&self, a: &Point2<f64>, b: &Point2<f64>) -> bool {
        if !self.contains(a) {
            return false;
        }
        let (left, right) = (a.x.min(b.x), a.x.max(b.x));
        let (low, high) = (a.y.min(b.y), a.y.max(b.y));
        let may_meet = |[c, d]: &&[Point2<f64>; 2]| {
            c.x.max(d.x) >= left
                && c.x.min(d.x) <= right
                && c.y.max(d.y) >= low
                && c.y.min(d.y) <= high
        };
        let sides = self.met_by(&[*a, *b]).flat_map(|band| self.in_band(band));
        !sides.filter(may_meet).any(|[c, d]| segments_cross(a, b, c, d))
    }

    /// Returns the segment from `a` to `b` (mm) cut where it meets a ring, in order.
    #[must_use]
    pub fn parts(&self, a: &Point2<f64>, b: &Point2<f64>) -> Vec<Part> {
        if self.begins.is_empty() {
            return vec![Part { from: *a, to: *b, inside: false }];
        }
        let met = self.met_by(&[*a, *b]);
        let first = *met.start();
        let sides = met.flat_map(|band| {
            // Each in the first band that it shares with the segment, and only there.
            let is_new =
                move |side: &&[Point2<f64>; 2]| band == first.max(*self.met_by(side).start());
            self.in_band(band).iter().filter(is_new).copied()
        });
        parts(a, b, sides, |p| self.contains(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::Fill;

    /// A star with a hole, an island in it, and a frame around all.
    fn region() -> Region {
        let star = |radius: f64, count: u32| -> Vec<Point2<f64>> {
            let point = |k: u32| {
                let angle = f64::from(k) * std::f64::consts::TAU / f64::from(count);
                let reach = if k.is_multiple_of(2) { radius } else { 0.6 * radius };
                Point2::new(reach * angle.cos(), reach * angle.sin())
            };
            (0..count).map(point).collect()
        };
        let square = |half: f64| {
            [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from).to_vec()
        };
        let of = |ring: Vec<Point2<f64>>| Region::from_rings([ring.as_slice()], Fill::NonZero);
        let frame = of(square(14.0)).difference(&of(square(12.0)));
        frame.union(&of(star(10.0, 400)).difference(&of(star(5.0, 31)))).union(&of(square(2.0)))
    }

    /// Places all over a square of twice the size.
    fn places(count: u32) -> impl Iterator<Item = Point2<f64>> {
        let place = |k: u32| {
            let part = |step: f64| 40.0 * (f64::from(k) * step).fract() - 20.0;
            Point2::new(part(0.754_877_666), part(0.569_840_291))
        };
        (0..count).map(place)
    }

    #[test]
    fn places_are_where_the_region_has_them() {
        let region = region();
        let bands = Bands::of(&region);
        let mut inside = 0;
        for p in places(5000) {
            assert_eq!(bands.contains(&p), region.contains(&p), "{p}");
            inside += u32::from(bands.contains(&p));
        }
        assert!((500..3000).contains(&inside), "{inside}");
        assert!(!Bands::of(&Region::default()).contains(&Point2::origin()));
        assert!(!Bands::default().contains_segment(&Point2::origin(), &Point2::new(1.0, 1.0)));
    }

    #[test]
    fn tall_sides_take_no_more_memory_than_short_ones() {
        // A comb of teeth as high as itself.
        let mut ring = vec![Point2::new(1000.0, -1.0), Point2::new(0.0, -1.0)];
        ring.reverse();
        for k in (0..1000).map(f64::from).rev() {
            let teeth = [[k + 1.0, 0.0], [k + 0.5, 100.0], [k, 0.0]];
            ring.extend(teeth.map(Point2::from));
        }
        let comb = Region::from_rings([ring.as_slice()], Fill::NonZero);
        for region in [comb, region()] {
            let (bands, sides) = (Bands::of(&region), region.point_count());
            assert!(bands.sides.len() <= 6 * sides, "{} of {sides}", bands.sides.len());
            let p = Point2::new(700.5, 50.0);
            assert_eq!(bands.contains(&p), region.contains(&p));
        }
    }

    #[test]
    fn segments_are_inside_where_the_region_has_them() {
        let region = region();
        let bands = Bands::of(&region);
        let mut inside = 0;
        for (a, b) in places(5000).zip(places(5300).skip(300)) {
            for b in [b, a + (b - a) * 0.1, Point2::new(b.x, a.y), Point2::new(a.x, b.y), a] {
                let expected = region.contains_segment(&a, &b);
                assert_eq!(bands.contains_segment(&a, &b), expected, "{a} {b}");
                inside += u32::from(expected);
                assert_eq!(bands.parts(&a, &b), region.parts(&a, &b), "{a} {b}");
            }
        }
        assert!((500..9000).contains(&inside), "{inside}");
    }
}
