//! Triangles to samples: a depth buffer in whole numbers.
//!
//! Corners are rounded to sixteenths of a sample and edges are tested in whole numbers, so that
//! neighbouring triangles share no sample and leave none out, and the same triangles give the same
//! samples on every machine. A sample belongs to a triangle that covers its middle; on an edge, to
//! the triangle on its upper or left side.

/// Parts of a sample that corners are rounded to.
const FINE: i32 = 16;

/// Farther out than this nothing is drawn, samples: products of two such places, in parts, still
/// fit into 64 bits many times over.
const FARTHEST: f64 = 1e6;

/// A corner on the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner {
    /// To the right, parts of a sample.
    x: i32,
    /// Downwards, parts of a sample.
    y: i32,
    /// Towards the eye.
    near: f32,
}

impl Corner {
    /// Returns the corner at a place on the screen, samples; `near` grows towards the eye.
    pub(super) fn new(x: f64, y: f64, near: f64) -> Self {
        // Places that are not numbers end up in a corner, where nothing is harmed.
        let fine = |v: f64| (v.clamp(-FARTHEST, FARTHEST) * f64::from(FINE)).round() as i32;
        Self { x: fine(x), y: fine(y), near: near as f32 }
    }
}

/// Samples with what is nearest to the eye in each.
#[derive(Debug, Clone)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    near: Vec<f32>,
    /// What a sample shows; nothing was drawn where it is [`Raster::BARE`].
    pub(super) paint: Vec<u32>,
}

impl Raster {
    /// What samples hold that nothing covers.
    pub(super) const BARE: u32 = u32::MAX;

    /// Returns a screen with nothing on it.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self { width, height, near: vec![f32::NEG_INFINITY; count], paint: vec![Self::BARE; count] }
    }

    /// Draws a triangle if its corners go counter-clockwise seen from the eye.
    pub(super) fn front(&mut self, corners: [Corner; 3], paint: impl Fn() -> u32) {
        let [a, b, c] = corners;
        if edge(&a, &b, c.x, c.y) < 0 {
            self.triangle(corners, paint);
        }
    }

    /// Draws a triangle, whichever side it shows. `paint` is asked only for triangles that are seen:
    /// on fine meshes few are.
    pub(super) fn triangle(&mut self, corners: [Corner; 3], paint: impl Fn() -> u32) {
        let [a, mut b, mut c] = corners;
        let twice_area = edge(&a, &b, c.x, c.y);
        if twice_area == 0 {
            return;
        }
        if twice_area < 0 {
            (b, c) = (c, b);
        }
        let Some([left, right]) = covered([a.x, b.x, c.x], self.width) else { return };
        let Some([top, bottom]) = covered([a.y, b.y, c.y], self.height) else { return };
        let mut painted = None;
        let edges = [Edge::new(&b, &c), Edge::new(&c, &a), Edge::new(&a, &b)];
        let scale = 1.0 / twice_area.unsigned_abs() as f32;
        let slope = [(b.near - a.near) * scale, (c.near - a.near) * scale];
        let (from_x, from_y) = (middle(left), middle(top));
        let mut row = edges.map(|e| e.at(from_x, from_y));
        for y in top..=bottom {
            let mut inside = row;
            let start = y * self.width;
            for k in start + left..=start + right {
                if inside[0] | inside[1] | inside[2] >= 0 {
                    // The edges' shares of the corners, without what decides about ties.
                    let near = a.near
                        + slope[0] * (inside[1] + edges[1].tie) as f32
                        + slope[1] * (inside[2] + edges[2].tie) as f32;
                    if near > self.near[k] {
                        self.near[k] = near;
                        self.paint[k] = *painted.get_or_insert_with(&paint);
                    }
                }
                for (value, e) in inside.iter_mut().zip(&edges) {
                    *value += e.right;
                }
            }
            for (value, e) in row.iter_mut().zip(&edges) {
                *value += e.down;
            }
        }
    }
}

/// One side of a triangle as a function that is not negative inside.
#[derive(Debug, Clone, Copy)]
struct Edge {
    from: Corner,
    to: Corner,
    /// How it grows from sample to sample.
    right: i64,
    down: i64,
    /// Taken off where the edge itself is not part of the triangle.
    tie: i64,
}

impl Edge {
    fn new(from: &Corner, to: &Corner) -> Self {
        let (dx, dy) = (i64::from(to.x - from.x), i64::from(to.y - from.y));
        // Inside lies to the right of the way along the edge, as y points downwards.
        let is_upper_or_left = dy < 0 || (dy == 0 && dx > 0);
        let fine = i64::from(FINE);
        Self {
            from: *from,
            to: *to,
            right: -dy * fine,
            down: dx * fine,
            tie: i64::from(!is_upper_or_left),
        }
    }

    fn at(&self, x: i32, y: i32) -> i64 {
        edge(&self.from, &self.to, x, y) - self.tie
    }
}

/// Twice the area of a triangle, positive when its corners go clockwise on the screen.
fn edge(a: &Corner, b: &Corner, x: i32, y: i32) -> i64 {
    i64::from(b.x - a.x) * i64::from(y - a.y) - i64::from(b.y - a.y) * i64::from(x - a.x)
}

/// The middle of a sample, in parts.
fn middle(sample: usize) -> i32 {
    sample as i32 * FINE + FINE / 2
}

/// The first and last sample whose middle lies between the extremes.
fn covered(places: [i32; 3], count: usize) -> Option<[usize; 2]> {
    let [a, b, c] = places;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let first = (low - FINE / 2 + FINE - 1).div_euclid(FINE).max(0);
    let last = (high - FINE / 2).div_euclid(FINE).min(count as i32 - 1);
    (first <= last).then_some([first as usize, last as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn painted(raster: &Raster, paint: u32) -> usize {
        raster.paint.iter().filter(|p| **p == paint).count()
    }

    #[test]
    fn what_is_nearer_hides_what_is_farther_in_any_order() {
        let square = |near: f64| {
            let corner = |x: f64, y: f64| Corner::new(x, y, near);
            let [a, b, c, d] =
                [corner(1.0, 1.0), corner(5.0, 1.0), corner(5.0, 5.0), corner(1.0, 5.0)];
            [[a, b, c], [a, d, c]]
        };
        for order in [[1.0, 2.0], [2.0, 1.0]] {
            let mut raster = Raster::new(8, 8);
            for near in order {
                for t in square(near) {
                    raster.triangle(t, || near as u32);
                }
            }
            assert_eq!((painted(&raster, 2), painted(&raster, 1)), (16, 0));
            assert_eq!(painted(&raster, Raster::BARE), 48);
        }
    }

    #[test]
    fn a_front_goes_round_against_the_clock() {
        let [a, b, c] = [[1.0, 1.0], [1.0, 7.0], [7.0, 7.0]].map(|[x, y]| Corner::new(x, y, 0.0));
        let mut raster = Raster::new(8, 8);
        raster.front([a, c, b], || 1);
        raster.front([a, b, c], || 2);
        assert_eq!((painted(&raster, 1), painted(&raster, 2)), (0, 15));
    }

    #[test]
    fn a_slope_is_cut_where_it_meets_a_plane() {
        let mut raster = Raster::new(10, 10);
        let wide = |near: [f64; 3]| {
            [
                Corner::new(-10.0, 0.0, near[0]),
                Corner::new(20.0, 0.0, near[1]),
                Corner::new(5.0, 60.0, near[2]),
            ]
        };
        raster.triangle(wide([0.5, 0.5, 0.5]), || 1);
        // Rises from 0 at x = 0 to 1 at x = 10.
        raster.triangle(wide([-1.0, 2.0, 0.5]), || 2);
        for x in 0..10 {
            assert_eq!(raster.paint[x], if x < 5 { 1 } else { 2 }, "column {x}");
        }
    }

    proptest! {
        #[test]
        fn a_fan_covers_every_sample_once(x in 0.0..16.0_f64, y in 0.0..16.0_f64) {
            let rim = [[-3.0, -3.0], [20.0, -4.0], [19.0, 19.0], [-5.0, 21.0]];
            let rim = rim.map(|[x, y]| Corner::new(x, y, 0.0));
            let centre = Corner::new(x, y, 0.0);
            let mut count = 0;
            for k in 0..4 {
                let mut raster = Raster::new(16, 16);
                raster.triangle([centre, rim[k], rim[(k + 1) % 4]], || 1);
                count += painted(&raster, 1);
            }
            prop_assert_eq!(count, 256);
        }

        #[test]
        fn no_place_is_too_far(x in prop::num::f64::ANY, y in prop::num::f64::ANY, near in prop::num::f64::ANY) {
            let mut raster = Raster::new(4, 4);
            raster.triangle([Corner::new(x, y, near), Corner::new(y, x, 0.0), Corner::new(0.0, 3.0, near)], || 1);
        }
    }
}
