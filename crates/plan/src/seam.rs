//! Where closed lines begin.

use nalgebra::{Point2, distance};

/// How the begin of a wall is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SeamPosition {
    /// Where the nozzle is nearest: least travel, seams anywhere.
    Nearest,
    /// Above the seam of the layer below; on a new wall in its sharpest corner.
    Aligned,
    /// Farthest in one direction, radians from +x of the slicer's frame.
    Rear(f64),
    /// Anywhere: no line of seams, a dot here and there. The same in every run.
    Random,
    /// In the sharpest corner that points into the part, or the sharpest of all; above the seam below
    /// where there is none.
    Corner,
}

impl SeamPosition {
    /// Returns the same in a frame that is turned by `angle` (radians) against this one.
    #[must_use]
    pub fn seen_from(self, angle: f64) -> Self {
        match self {
            Self::Rear(direction) => Self::Rear(direction - angle),
            other => other,
        }
    }
}

/// Where on a closed line its begin is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begin {
    /// The point before it.
    pub after: usize,
    /// The share of the way to the next point; 0 at the point itself.
    pub share: f64,
}

impl Begin {
    /// At a point of the line.
    #[must_use]
    pub fn at(after: usize) -> Self {
        Self { after, share: 0.0 }
    }

    /// Returns the place on a closed line.
    #[must_use]
    pub fn on(&self, points: &[Point2<f64>]) -> Point2<f64> {
        let (from, to) = (points[self.after], points[(self.after + 1) % points.len()]);
        from + (to - from) * self.share
    }
}

/// How far a seam may move from one layer to the next and still follow the one below, mm. Walls of
/// a steep cone move by a few millimetres; beyond, the wall belongs to something else.
const LARGEST_STEP_MM: f64 = 5.0;

/// Turns below this are part of a curve, radians (30°): no place to hide a seam.
const LEAST_CORNER: f64 = 0.52;

/// The way on both sides of a corner over which its turn is measured, mm: longer than the arc of half a
/// bead's radius by which a wall goes round a corner into the part.
const CORNER_MM: f64 = 0.5;

/// The seams of the layer below and of the one at hand.
#[derive(Debug, Clone, Default)]
pub struct SeamMemory {
    below: Vec<Point2<f64>>,
    here: Vec<Point2<f64>>,
    /// Seams chosen so far, in the whole print.
    count: u64,
}

impl SeamMemory {
    /// A new layer begins.
    pub fn next_layer(&mut self) {
        self.below = std::mem::take(&mut self.here);
    }

    /// Returns where a closed line (mm, material to the left) begins, and remembers it.
    pub fn choose(
        &mut self,
        points: &[Point2<f64>],
        nozzle: &Point2<f64>,
        position: SeamPosition,
    ) -> Begin {
        let begin = match position {
            SeamPosition::Nearest => Begin::at(nearest(points, nozzle).0),
            SeamPosition::Aligned => Begin::at(self.aligned(points)),
            SeamPosition::Rear(direction) => Begin::at(farthest(points, direction)),
            SeamPosition::Random => at_length(points, part_of_one(self.count)),
            SeamPosition::Corner => {
                let corner = sharpest_corner(points);
                let is_one = hides(points, corner) > 0.0;
                Begin::at(if is_one { corner } else { self.aligned(points) })
            }
        };
        self.count += 1;
        self.here.push(begin.on(points));
        begin
    }

    fn aligned(&self, points: &[Point2<f64>]) -> usize {
        let above_a_seam = self
            .below
            .iter()
            .map(|seam| nearest(points, seam))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        match above_a_seam {
            Some((index, step)) if step <= LARGEST_STEP_MM => index,
            _ => sharpest_corner(points),
        }
    }
}

/// The point nearest to `to` and its distance; the first of equals.
pub(crate) fn nearest(points: &[Point2<f64>], to: &Point2<f64>) -> (usize, f64) {
    points
        .iter()
        .map(|p| distance(p, to))
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
        .expect("lines have points")
}

/// The point farthest in a direction, radians from +x. Of points that are equally far to a thousandth of
/// a millimetre, as on a side across that direction, the last counter-clockwise.
fn farthest(points: &[Point2<f64>], direction: f64) -> usize {
    let (sin, cos) = direction.sin_cos();
    let along = |p: &Point2<f64>| ((p.x * cos + p.y * sin) * 1e3).round();
    let aside = |p: &Point2<f64>| p.y * cos - p.x * sin;
    let better = |a: &usize, b: &usize| {
        let (a, b) = (&points[*a], &points[*b]);
        along(a).total_cmp(&along(b)).then(aside(a).total_cmp(&aside(b)))
    };
    (0..points.len()).max_by(better).expect("lines have points")
}

/// The place after a share of the length of a closed line.
fn at_length(points: &[Point2<f64>], share: f64) -> Begin {
    let side = |i: usize| distance(&points[i], &points[(i + 1) % points.len()]);
    let mut left = share * (0..points.len()).map(side).sum::<f64>();
    for i in 0..points.len() {
        let length = side(i);
        if left < length {
            return Begin { after: i, share: left / length };
        }
        left -= length;
    }
    Begin::at(0)
}

/// A number from 0 to 1 that looks random and depends on `index` alone: splitmix64 (G. Steele, D. Lea,
/// C. Flood, 2014).
fn part_of_one(index: u64) -> f64 {
    let mut z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// How well a corner hides a seam; 0 where there is none. Walls go round corners that point into the part
/// in small steps, so the turn is that between the ways over [`CORNER_MM`] before and behind.
fn hides(points: &[Point2<f64>], i: usize) -> f64 {
    let count = points.len();
    let away = |step: usize| {
        let (mut at, mut gone) = (i, 0.0);
        for _ in 1..count {
            let next = (at + step) % count;
            gone += distance(&points[at], &points[next]);
            at = next;
            if gone >= CORNER_MM {
                break;
            }
        }
        points[at]
    };
    let (u, v) = (points[i] - away(count - 1), away(1) - points[i]);
    let turn = u.perp(&v).atan2(u.dot(&v));
    // Any corner that points into the part hides a seam better than those that point out.
    let bonus = if turn < 0.0 { std::f64::consts::PI } else { 0.0 };
    if turn.abs() < LEAST_CORNER { 0.0 } else { turn.abs() + bonus }
}

fn sharpest_corner(points: &[Point2<f64>]) -> usize {
    // Without a corner, and among equal ones: the point farthest along +x, which in the frame of
    // the slicer turns with the part. Equal to a hundredth of a radian: steps are not all alike.
    let weighed = (0..points.len()).map(|i| (i, (hides(points, i) * 1e2).round()));
    let better = |(a, weight): &(usize, f64), (b, other): &(usize, f64)| {
        let (a, b) = (points[*a], points[*b]);
        weight.total_cmp(other).then(a.x.total_cmp(&b.x)).then(a.y.total_cmp(&b.y))
    };
    weighed.max_by(better).expect("lines have points").0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(list: &[[f64; 2]]) -> Vec<Point2<f64>> {
        list.iter().map(|&p| Point2::from(p)).collect()
    }

    #[test]
    fn nearest_begins_at_the_nozzle() {
        let square = points(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        let mut memory = SeamMemory::default();
        let index = memory.choose(&square, &Point2::new(5.0, 3.5), SeamPosition::Nearest);
        assert_eq!(index, Begin::at(2));
    }

    #[test]
    fn aligned_hides_in_a_notch_and_stays_there() {
        let notched = points(&[[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [4.0, 5.0], [0.0, 8.0]]);
        let mut memory = SeamMemory::default();
        let nozzle = Point2::new(100.0, 0.0);
        assert_eq!(memory.choose(&notched, &nozzle, SeamPosition::Aligned), Begin::at(3));
        memory.next_layer();
        let moved: Vec<_> = notched.iter().map(|p| p + nalgebra::Vector2::new(0.3, 0.1)).collect();
        assert_eq!(memory.choose(&moved, &nozzle, SeamPosition::Aligned), Begin::at(3));
    }

    #[test]
    fn a_circle_without_corners_gets_one_line_of_seams() {
        let circle: Vec<_> = (0..100)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 100.0;
                Point2::new(10.0 * angle.cos(), 10.0 * angle.sin())
            })
            .collect();
        let mut memory = SeamMemory::default();
        assert_eq!(
            memory.choose(&circle, &Point2::new(-50.0, 0.0), SeamPosition::Aligned),
            Begin::at(0)
        );
    }

    #[test]
    fn rear_is_the_farthest_point_in_its_direction() {
        let square = points(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        let mut memory = SeamMemory::default();
        let mut at = |degrees: f64| {
            let position = SeamPosition::Rear(f64::to_radians(degrees));
            memory.choose(&square, &Point2::origin(), position).after
        };
        assert_eq!([at(45.0), at(100.0), at(190.0), at(-80.0), at(90.0)], [2, 3, 0, 1, 3]);
        let quarter = std::f64::consts::FRAC_PI_2;
        assert_eq!(SeamPosition::Rear(quarter).seen_from(quarter), SeamPosition::Rear(0.0));
    }

    #[test]
    fn random_seams_are_everywhere_and_the_same_every_time() {
        let square = points(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]);
        let run = || {
            let mut memory = SeamMemory::default();
            let choose = |_| memory.choose(&square, &Point2::origin(), SeamPosition::Random);
            (0..400).map(choose).collect::<Vec<Begin>>()
        };
        let seams = run();
        assert_eq!(seams, run());
        for side in 0..4 {
            let count = seams.iter().filter(|begin| begin.after == side).count();
            assert!((70..130).contains(&count), "{count} on side {side}");
        }
        let middle = seams.iter().filter(|begin| (0.25..0.75).contains(&begin.share)).count();
        assert!((160..240).contains(&middle), "{middle}");
    }

    #[test]
    fn the_corner_is_found_again_on_every_layer_and_the_deepest_wins() {
        let two_notches = |shift: f64| {
            points(&[
                [0.0, 0.0],
                [8.0, 0.0],
                [8.0, 8.0],
                [6.0, 7.0],
                [4.0, 8.0],
                [2.0 + shift, 2.0],
                [0.0, 8.0],
            ])
        };
        let mut memory = SeamMemory::default();
        for layer in 0..3 {
            let line = two_notches(0.1 * f64::from(layer));
            let begin = memory.choose(&line, &Point2::origin(), SeamPosition::Corner);
            assert_eq!(begin, Begin::at(5));
            memory.next_layer();
        }
    }
}
