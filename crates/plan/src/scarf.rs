//! Scarf seams: where the end of a wall lies over its begin in a long slope instead of against it.
//!
//! A wall begins with next to no thickness on the layer below and grows to its own over a stretch, runs
//! once round, and ends over that stretch at its own height, as thick as the begin leaves room. Both
//! slopes together are the bead that would lie there, so the volume is that of the plain wall, and no
//! place has a step higher than the begin.
//!
//! Heights are along the normal of the layer, on curved ones too. The middle of a bead stays straight above
//! or below that of the plain wall, whose outline is upright for all that is known here: the nozzle, which
//! runs half a thickness off along the normal, moves sideways by as much as that takes.

use nalgebra::{Point2, Point3, Vector3, distance};
use slicer::bead::Bead;
use slicer::toolpath::{Overhang, Role, Station};

use crate::order::OrderedLine;

/// Which walls have scarf seams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ScarfPlacement {
    /// None.
    #[default]
    Nowhere,
    /// Those round the outside of the part.
    Contours,
    /// Those round holes, too.
    Everywhere,
}

/// How scarf seams are made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScarfParams {
    /// Of which outer walls.
    pub placement: ScarfPlacement,
    /// Whether of those behind them, too.
    pub inner: bool,
    /// Thickness at the begin, as a share of the layer's.
    pub start: f64,
    /// Length of the slope, mm.
    pub length: f64,
    /// Whether it is as long as the wall.
    pub entire: bool,
    /// Longest piece of the slope of even thickness, mm.
    pub piece: f64,
}

impl ScarfParams {
    /// Returns whether a line is a wall that has such a seam.
    #[must_use]
    pub fn suits(&self, line: &OrderedLine) -> bool {
        let is_wall =
            line.role == Role::ExternalPerimeter || self.inner && line.role == Role::Perimeter;
        let is_closed = line.stations.len() > 3
            && line.stations.first().map(|s| s.at) == line.stations.last().map(|s| s.at);
        is_wall
            && is_closed
            && match self.placement {
                ScarfPlacement::Nowhere => false,
                ScarfPlacement::Contours => turns_left(&line.stations),
                ScarfPlacement::Everywhere => true,
            }
    }

    /// Returns the line with a scarf seam where it begins; `normal` is that of its layer, of length 1.
    #[must_use]
    pub fn scarfed(
        &self,
        line: &OrderedLine,
        normal: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> OrderedLine {
        let round = length(&line.stations);
        let slope = if self.entire { round } else { self.length.min(round / 2.0) };
        if slope < self.piece.min(SHORTEST_MM) || slope <= 0.0 {
            return line.clone();
        }
        let (over, rest) = self.cut(&line.stations, slope);
        if over.iter().any(|(_, station)| station.overhang >= Overhang::Half) {
            // A thin begin would hang in the air.
            return line.clone();
        }
        let share = |along: f64| self.start + (1.0 - self.start) * along / slope;
        let mut stations = Vec::with_capacity(rest.len() + 2 * over.len());
        for (along, station) in &over {
            let (up, missing) = (normal(&station.at), half_missing(station, share(*along)));
            let at = station.at - (up + Vector3::z() / up.z) * missing;
            stations.push(Station { at, ..thinned(station, share(*along)) });
        }
        stations.extend(rest.iter().skip(1));
        // At the seam the bead changes from the whole one to what the begin leaves free.
        stations.extend(over.iter().map(|(along, station)| {
            let free = 1.0 - share(*along);
            let (up, missing) = (normal(&station.at), half_missing(station, free));
            let at = station.at + (Vector3::z() / up.z - up) * missing;
            Station { at, ..thinned(station, free) }
        }));
        OrderedLine { stations, slopes: true, ..line.clone() }
    }

    /// The stations of the slope with their distance from the begin, and those from its end on.
    fn cut(&self, stations: &[Station], slope: f64) -> (Vec<(f64, Station)>, Vec<Station>) {
        let mut over = vec![(0.0, stations[0])];
        let mut along = 0.0;
        for (k, pair) in stations.windows(2).enumerate() {
            let step = distance(&pair[0].at, &pair[1].at);
            let end = (along + step).min(slope);
            let pieces = ((end - along) / self.piece.max(SHORTEST_PIECE_MM)).ceil().max(1.0);
            for piece in 1..=pieces as u32 {
                let to = along + (end - along) * f64::from(piece) / pieces;
                let part = if step > 0.0 { (to - along) / step } else { 1.0 };
                over.push((to, between(&pair[0], &pair[1], part)));
            }
            along += step;
            if along >= slope - ROUNDING_MM {
                let mut rest = vec![over[over.len() - 1].1];
                if along - slope > ROUNDING_MM {
                    rest.push(pair[1]);
                }
                rest.extend(&stations[(k + 2).min(stations.len())..]);
                return (over, rest);
            }
        }
        (over, Vec::new())
    }
}

/// A slope shorter than this is a step, mm.
const SHORTEST_MM: f64 = 1.0;

/// No firmware likes shorter pieces, mm.
const SHORTEST_PIECE_MM: f64 = 0.2;

/// What is nearer to the end of the slope is its end, mm: rounding of sums of lengths.
const ROUNDING_MM: f64 = 1e-6;

/// How far the middle of a bead with a share of the thickness lies from that of the whole one, mm along
/// the normal.
fn half_missing(station: &Station, share: f64) -> f64 {
    station.bead.thickness * (1.0 - share) / 2.0
}

/// The same place with a share of the material: of the thickness, beside neighbours as far away.
fn thinned(station: &Station, share: f64) -> Station {
    let thickness = station.bead.thickness * share;
    Station { bead: Bead::with_spacing(station.bead.spacing(), thickness), ..*station }
}

fn between(a: &Station, b: &Station, share: f64) -> Station {
    let blend = |from: f64, to: f64| from + (to - from) * share;
    if share >= 1.0 {
        return *b;
    }
    Station {
        at: Point3::from(a.at.coords.lerp(&b.at.coords, share)),
        bead: Bead {
            width: blend(a.bead.width, b.bead.width),
            thickness: blend(a.bead.thickness, b.bead.thickness),
        },
        overhang: a.overhang,
    }
}

fn length(stations: &[Station]) -> f64 {
    stations.windows(2).map(|pair| distance(&pair[0].at, &pair[1].at)).sum()
}

/// Whether a closed line runs counter-clockwise, as outlines of parts do.
fn turns_left(stations: &[Station]) -> bool {
    let plane = |station: &Station| -> Point2<f64> { station.at.xy() };
    let sides =
        stations.windows(2).map(|pair| plane(&pair[0]).coords.perp(&plane(&pair[1]).coords));
    sides.sum::<f64>() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall round a square or, as one, an octagon of 10 mm, which begins in the middle of a side.
    fn wall(sides: u32, z: impl Fn(&Point2<f64>) -> f64) -> OrderedLine {
        let corner = |k: u32| {
            let angle = f64::from(k) / f64::from(sides) * std::f64::consts::TAU;
            Point2::new(10.0 * angle.cos(), 10.0 * angle.sin())
        };
        let mut plane = vec![nalgebra::center(&corner(0), &corner(1))];
        plane.extend((1..=sides).map(corner));
        plane.push(plane[0]);
        let station = |p: &Point2<f64>| Station {
            at: Point3::new(p.x, p.y, z(p)),
            bead: Bead { width: 0.45, thickness: 0.2 },
            overhang: Overhang::None,
        };
        let stations = plane.iter().map(station).collect();
        OrderedLine { role: Role::ExternalPerimeter, stations, island: Some(0), slopes: false }
    }

    fn volume(line: &OrderedLine) -> f64 {
        let pieces = line.stations.windows(2).map(|pair| {
            let area = f64::midpoint(pair[0].bead.area(), pair[1].bead.area());
            area * distance(&pair[0].at.xy(), &pair[1].at.xy())
        });
        pieces.sum()
    }

    const PARAMS: ScarfParams = ScarfParams {
        placement: ScarfPlacement::Contours,
        inner: false,
        start: 0.0,
        length: 12.0,
        entire: false,
        piece: 1.0,
    };

    #[test]
    fn the_begin_rises_evenly_the_end_lies_over_it_and_no_volume_is_lost() {
        for (sides, start, entire) in [(4, 0.0, false), (8, 0.3, false), (60, 0.1, true)] {
            let plain = wall(sides, |_| 1.0);
            let params = ScarfParams { start, entire, ..PARAMS };
            assert!(params.suits(&plain));
            let scarfed = params.scarfed(&plain, |_| Vector3::z());
            assert!((volume(&scarfed) / volume(&plain) - 1.0).abs() < 1e-9, "{sides}");
            let slope = if entire { length(&plain.stations) } else { 12.0 };
            let (mut along, mut before) = (0.0, scarfed.stations[0]);
            assert!((before.at.z - (1.0 - 0.2 * (1.0 - start))).abs() < 1e-12);
            let round = length(&plain.stations);
            for station in &scarfed.stations[1..] {
                along += distance(&before.at.xy(), &station.at.xy());
                let up = (start + (1.0 - start) * along / slope).min(1.0);
                assert!((station.at.z - (0.8 + 0.2 * up)).abs() < 1e-9, "{along}: {station:?}");
                let down = (1.0 - start) * (1.0 - (along - round) / slope);
                let over = along > round + 1e-9;
                let thickness = if over { 0.2 * down } else { 0.2 * up };
                let is_seam = (along - round).abs() < 1e-9;
                assert!(is_seam || (station.bead.thickness - thickness).abs() < 1e-9, "{along}");
                assert!((station.at.z - before.at.z).abs() <= 0.2 / slope.floor() + 1e-9);
                before = *station;
            }
            assert!((along - round - slope).abs() < 1e-9);
            assert!(before.bead.thickness < 1e-12, "it ends in nothing");
        }
    }

    #[test]
    fn on_a_cone_both_slopes_fill_the_layer_straight_above_each_other() {
        let slope = 0.5_f64;
        let plain = wall(60, |p| 8.0 - p.coords.norm() * slope.tan());
        let normal = |p: &Point3<f64>| {
            let out = p.xy().coords.normalize() * slope.sin();
            Vector3::new(out.x, out.y, slope.cos())
        };
        let scarfed = PARAMS.scarfed(&plain, normal);
        let place = plain.stations[0];
        let up = normal(&place.at);
        let (first, last) = (scarfed.stations[0], scarfed.stations[scarfed.stations.len() - 1]);
        // The begin lies on the layer below, under the middle of the plain bead.
        let middle = place.at - up * 0.1;
        assert!(((first.at - place.at).dot(&up) + 0.2).abs() < 1e-12);
        assert!((first.at - middle).xy().norm() < 1e-12);
        // The end is at the height of the layer, over the same line.
        let out = 10.0 - 0.1 * slope.sin();
        assert!((last.at.xy().coords.norm() - out).abs() < 0.03);
        let level = |p: &Point3<f64>| p.z + p.xy().coords.norm() * slope.tan();
        assert!((level(&last.at) - 8.0).abs() < 0.01);
    }

    #[test]
    fn holes_inner_walls_and_lines_that_hang_stay_plain_unless_asked() {
        let mut hole = wall(8, |_| 1.0);
        hole.stations.reverse();
        assert!(!PARAMS.suits(&hole));
        assert!(ScarfParams { placement: ScarfPlacement::Everywhere, ..PARAMS }.suits(&hole));
        let mut inner = wall(8, |_| 1.0);
        inner.role = Role::Perimeter;
        assert!(!PARAMS.suits(&inner) && ScarfParams { inner: true, ..PARAMS }.suits(&inner));
        let mut hangs = wall(8, |_| 1.0);
        hangs.stations[1].overhang = Overhang::Whole;
        assert_eq!(PARAMS.scarfed(&hangs, |_| Vector3::z()), hangs);
    }
}
