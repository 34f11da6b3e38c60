//! How far walls hang over the layer below.
//!
//! Of a bead that runs `d` mm outside of what is below, the share `½ + d/width` hangs over. Lines
//! are cut where that share passes a quarter, a half, three quarters and one.

use std::sync::OnceLock;

use geom::region::Region;
use nalgebra::Point2;

use crate::bead::Bead;
use crate::chart::Chart;
use crate::infill::clip::Sides;
use crate::skins::SKIN_TOLERANCE_MM;
use crate::toolpath::Overhang;

/// A point of a line, its bead, and how the piece after it hangs over.
pub(crate) type Hanging = (Point2<f64>, Bead, Overhang);

/// What is below a layer, as beads of one width feel it.
#[derive(Clone)]
pub(crate) struct Below {
    /// For each degree but the least. Empty where no bead of the layer hangs over at all.
    carries: Vec<Ground>,
}

/// Where beads hang over by less than a degree.
#[derive(Clone)]
struct Ground {
    degree: Overhang,
    region: Region,
    /// Its sides, sorted when they are wanted; none where it is empty.
    sides: OnceLock<Option<Sides>>,
}

impl Ground {
    fn new(degree: Overhang, region: Region) -> Self {
        Self { degree, region, sides: OnceLock::new() }
    }
}

/// How far outside of what is below a bead runs that hangs over by the degree, in widths. The
/// outermost bead runs half a width inside of the outline.
const QUARTER: f64 = -0.25;
const MOST: f64 = 0.25;
const WHOLE: f64 = 0.5;

impl Below {
    /// `material` is the layer whose walls are judged, all islands at once, since each would look at all
    /// that is below; `below` the layer that it lies on (`None` for the bed), `width` that of the beads,
    /// mm.
    pub(crate) fn new(
        material: &Region,
        below: Option<&Region>,
        chart: &Chart,
        width: f64,
    ) -> Self {
        let grown = |shares: f64, from: &Region| chart.outset(from, shares * width);
        let mut carries = Vec::new();
        let Some(below) = below else { return Self { carries } };
        // Thinned out like what is below: then upright walls are equal to the last bit.
        let material = material.thinned(SKIN_TOLERANCE_MM);
        if material == *below {
            return Self { carries };
        }
        // As far as the outline reaches beyond what is below, less half a width, reaches the bead.
        let most = grown(MOST, below);
        let bare = material.difference(&most);
        if bare.is_empty() {
            return Self { carries };
        }
        carries.push(Ground::new(Overhang::Quarter, chart.inset(below, -QUARTER * width)));
        let whole = grown(WHOLE, below);
        if bare.difference(&whole).is_empty() {
            return Self { carries };
        }
        carries.push(Ground::new(Overhang::Half, below.clone()));
        carries.push(Ground::new(Overhang::Most, most));
        carries.push(Ground::new(Overhang::Whole, whole));
        Self { carries }
    }

    /// Returns how many points its outlines have.
    pub(crate) fn point_count(&self) -> usize {
        self.carries.iter().map(|ground| ground.region.point_count()).sum()
    }

    /// Returns whether anything can hang over.
    pub(crate) fn is_open(&self) -> bool {
        !self.carries.is_empty()
    }

    /// A closed line, cut where it comes to hang over by another degree.
    pub(crate) fn along(&self, line: &[(Point2<f64>, Bead)]) -> Vec<Hanging> {
        let mut cut: Vec<Hanging> =
            line.iter().map(|(at, bead)| (*at, *bead, Overhang::None)).collect();
        for ground in &self.carries {
            cut = beyond(&cut, ground);
        }
        cut
    }
}

/// Raises the pieces of a closed line that leave the ground to its degree.
fn beyond(line: &[Hanging], ground: &Ground) -> Vec<Hanging> {
    let Ground { degree, region, sides } = ground;
    let points: Vec<Point2<f64>> = line.iter().map(|(at, ..)| *at).collect();
    let Some(first) = points.first() else { return Vec::new() };
    let mut inside = region.contains(first);
    let crossings = match sides.get_or_init(|| Sides::of(region)) {
        Some(sides) => sides.crossings_of_ring(&points),
        None => Vec::new(),
    };
    let mut crossings = crossings.iter().peekable();
    let mut cut = Vec::with_capacity(line.len());
    for (piece, (at, bead, before)) in line.iter().enumerate() {
        let degree_now = |inside: bool| if inside { *before } else { *degree };
        cut.push((*at, *bead, degree_now(inside)));
        while let Some(crossing) = crossings.next_if(|crossing| crossing.piece == piece) {
            inside = crossing.enters;
            let next = line[(piece + 1) % line.len()].1;
            let blend = |a: f64, b: f64| a + (b - a) * crossing.along;
            let bead = Bead {
                width: blend(bead.width, next.width),
                thickness: blend(bead.thickness, next.thickness),
            };
            cut.push((crossing.at, bead, degree_now(inside)));
        }
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;

    fn square(half: f64) -> Vec<Point2<f64>> {
        [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from).to_vec()
    }

    fn region(half: f64) -> Region {
        Region::from_rings([square(half).as_slice()], Fill::NonZero)
    }

    const BEAD: Bead = Bead { width: 0.4, thickness: 0.2 };

    /// Length of the outermost wall of a square of 20 mm by degree, over a square.
    fn lengths(below: f64) -> [f64; 5] {
        let below = Below::new(&region(10.0), Some(&region(below)), &Chart::Plane, BEAD.width);
        let line: Vec<(Point2<f64>, Bead)> = square(9.8).iter().map(|p| (*p, BEAD)).collect();
        let cut = below.along(&line);
        let mut lengths = [0.0; 5];
        for (k, (at, _, degree)) in cut.iter().enumerate() {
            let next = cut[(k + 1) % cut.len()].0;
            let index = Overhang::ALL.iter().position(|d| d == degree).unwrap();
            lengths[index] += (next - at).norm();
        }
        lengths
    }

    #[test]
    fn a_wall_hangs_over_by_what_is_missing_below_it() {
        for (below, index) in [(10.0, 0), (9.95, 0), (9.85, 1), (9.75, 2), (9.65, 3), (9.5, 4)] {
            let lengths = lengths(below);
            assert!((lengths[index] - 78.4).abs() < 0.5, "{below}: {lengths:?}");
        }
    }

    #[test]
    fn a_wall_is_cut_where_it_leaves_the_ground() {
        let ring = [[-12.0, -12.0], [3.0, -12.0], [3.0, 12.0], [-12.0, 12.0]].map(Point2::from);
        let ground = Region::from_rings([ring.as_slice()], Fill::NonZero);
        let below = Below::new(&region(10.0), Some(&ground), &Chart::Plane, BEAD.width);
        let line: Vec<(Point2<f64>, Bead)> = square(9.8).iter().map(|p| (*p, BEAD)).collect();
        for (at, _, degree) in below.along(&line) {
            let expected = match at.x {
                x if x < 2.89 => Overhang::None,
                // Going along +x on the lower side and back on the upper one.
                x if x > 3.25 && at.y < 0.0 => Overhang::Whole,
                _ => continue,
            };
            assert_eq!(degree, expected, "{at}");
        }
    }
}
