//! Parallel lines.

use geom::grid::mm;
use geom::region::Region;
use nalgebra::{Point2, Rotation2};

use super::{Chord, RimPoint};

/// How far the outermost of evenly spread lines keep from the rim, mm: exactly on it, whether they
/// are found would be a matter of rounding.
const OFF_RIM_MM: f64 = 1e-3;

/// Returns lines `spacing` apart whose pattern is fixed to the axis: the first lies `first` mm from
/// it. Lines of all layers then stand on each other.
pub(super) fn rows_at(core: &Region, first: f64, spacing: f64, angle: f64) -> Vec<Chord> {
    chords(core, &Rows { first, spacing, count: None }, angle).0
}

/// Lines that fill an area evenly.
pub(super) struct Even {
    /// Where they run: half a spacing inside the area.
    pub(super) core: Region,
    /// The lines, by row and then along it.
    pub(super) chords: Vec<Chord>,
    /// The row of each, and where it begins and ends along it, mm.
    pub(super) rows: Vec<(i64, [f64; 2])>,
    /// Their distance, mm.
    pub(super) spacing: f64,
}

/// Returns lines about `wanted` mm apart, spread so that the first and the last run along the far
/// sides of the area, which should be a single island.
pub(super) fn evenly(area: &Region, wanted: f64, angle: f64) -> Even {
    // How far apart the outermost lines are when there are `gaps` between them depends on how far
    // inside they run, and so on the spacing itself; that the extent shrinks evenly settles it.
    let whole = across(area, angle);
    let within = across(&area.inset(wanted / 2.0), angle);
    let shrinking = (whole - within) / wanted;
    let gaps = (within / wanted).round();
    let spacing = if gaps < 1.0 { whole } else { whole / (gaps + shrinking) };
    let spacing = spacing.clamp(wanted * NARROWEST, wanted * WIDEST);
    let core = area.inset(spacing / 2.0);
    let (low, high) = extent(&core, angle);
    let (low, high) = (low + OFF_RIM_MM, high - OFF_RIM_MM);
    // A narrow tongue may be left inside by one distance and not by another a little different.
    let gaps = if gaps < 1.0 { 0.0 } else { ((high - low) / spacing).round() };
    let rows = if gaps < 1.0 {
        Rows { first: f64::midpoint(low, high), spacing, count: Some(1) }
    } else {
        Rows { first: low, spacing: (high - low) / gaps, count: Some(gaps as i64 + 1) }
    };
    let spacing = rows.spacing;
    let (chords, rows) = chords(&core, &rows, angle);
    Even { core, chords, rows, spacing }
}

/// The narrowest and the widest that lines may be for their area, as shares of their spacing.
const NARROWEST: f64 = 0.7;
const WIDEST: f64 = 1.5;

fn across(region: &Region, angle: f64) -> f64 {
    let (low, high) = extent(region, angle);
    (high - low).max(0.0)
}

/// The least and greatest coordinate across the lines.
fn extent(region: &Region, angle: f64) -> (f64, f64) {
    let (sin, cos) = angle.sin_cos();
    region.rings().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &p| {
        let p = mm(p);
        let v = -sin * p.x + cos * p.y;
        (low.min(v), high.max(v))
    })
}

/// Lines across: row `k` runs at `first + k·spacing`.
struct Rows {
    first: f64,
    spacing: f64,
    /// `None` for rows without end on both sides.
    count: Option<i64>,
}

impl Rows {
    /// The rows `v` with `low <= v < high`. Half-open, so that a ring is crossed an even number of
    /// times by every row.
    fn between(&self, low: f64, high: f64) -> std::ops::Range<i64> {
        let row = |v: f64| ((v - self.first) / self.spacing).ceil() as i64;
        let (from, to) = (row(low), row(high));
        match self.count {
            Some(count) => from.max(0)..to.min(count),
            None => from..to,
        }
    }
}

struct Crossing {
    row: i64,
    along: f64,
    rim: RimPoint,
}

fn chords(core: &Region, rows: &Rows, angle: f64) -> (Vec<Chord>, Vec<(i64, [f64; 2])>) {
    let to_rows = Rotation2::new(-angle);
    let mut crossings = Vec::new();
    for (ring, points) in core.rings().enumerate() {
        let points: Vec<Point2<f64>> = points.iter().map(|&p| to_rows * mm(p)).collect();
        for side in 0..points.len() {
            let (a, b) = (points[side], points[(side + 1) % points.len()]);
            for row in rows.between(a.y.min(b.y), a.y.max(b.y)) {
                let v = rows.first + row as f64 * rows.spacing;
                let share = ((v - a.y) / (b.y - a.y)).clamp(0.0, 1.0);
                let along = a.x + (b.x - a.x) * share;
                crossings.push(Crossing { row, along, rim: RimPoint { ring, side, share } });
            }
        }
    }
    crossings.sort_unstable_by(|a, b| {
        (a.row.cmp(&b.row))
            .then(a.along.total_cmp(&b.along))
            .then((a.rim.ring, a.rim.side).cmp(&(b.rim.ring, b.rim.side)))
    });
    let back = to_rows.inverse();
    crossings
        .chunks_exact(2)
        .filter(|pair| pair[0].row == pair[1].row)
        .map(|pair| {
            let v = rows.first + pair[0].row as f64 * rows.spacing;
            let chord = Chord {
                points: [&pair[0], &pair[1]].map(|c| back * Point2::new(c.along, v)).to_vec(),
                ends: [Some(pair[0].rim), Some(pair[1].rim)],
            };
            (chord, (pair[0].row, [pair[0].along, pair[1].along]))
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;

    #[test]
    fn lines_stay_about_as_far_apart_as_wanted() {
        let wanted = 0.43;
        for k in 0..200 {
            // A low block with a tongue that is about as narrow as a line.
            let tongue = 0.3 + 0.002 * f64::from(k);
            for height in [0.5, 1.0, 1.7] {
                let ring = [
                    [0.0, 0.0],
                    [10.0, 0.0],
                    [10.0, height],
                    [3.0 + tongue, height],
                    [3.0 + tongue * 0.9, height + 4.0],
                    [3.0, height + 4.0],
                    [3.0, height],
                    [0.0, height],
                ];
                let area = Region::from_rings([ring.map(Point2::from).as_slice()], Fill::NonZero);
                let spacing = evenly(&area, wanted, 0.0).spacing / wanted;
                assert!((0.5..1.6).contains(&spacing), "{tongue} {height}: {spacing}");
            }
        }
    }
}
