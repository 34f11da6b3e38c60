//! Pieces of the Archimedean spiral about the axis.

use geom::grid::mm;
use geom::region::Region;
use geom::spiral::Spiral;
use nalgebra::Point2;

use super::{Chord, RimPoint};

/// The pieces of a spiral inside an area, in order outwards.
pub(super) struct Turns {
    spiral: Spiral,
    /// The parameter and the place on the rim of both ends of each.
    pieces: Vec<[(f64, Option<RimPoint>); 2]>,
}

impl Turns {
    /// Every place where the spiral meets a ring is found exactly and sorted along the spiral: from
    /// each odd one to the next it runs inside. An odd number of places means that it begins inside.
    pub(super) fn inside(core: &Region, spiral: Spiral) -> Self {
        let mut meetings: Vec<(f64, Option<RimPoint>)> = Vec::new();
        for (ring, points) in core.rings().enumerate() {
            let points: Vec<Point2<f64>> = points.iter().map(|&p| mm(p)).collect();
            for side in 0..points.len() {
                let (a, b) = (&points[side], &points[(side + 1) % points.len()]);
                meetings.extend(
                    spiral
                        .crossings(a, b)
                        .into_iter()
                        .map(|c| (c.tau, Some(RimPoint { ring, side, share: c.share }))),
                );
            }
        }
        if meetings.len() % 2 == 1 {
            meetings.push((0.0, None));
        }
        meetings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let pieces = meetings.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        Self { spiral, pieces }
    }

    /// Each piece as a chord that lies no farther than `tolerance` from it, mm.
    pub(super) fn chords(&self, tolerance: f64) -> Vec<Chord> {
        let chord = |[from, to]: &[(f64, Option<RimPoint>); 2]| Chord {
            points: self.spiral.flatten(from.0, to.0, tolerance),
            ends: [from.1, to.1],
        };
        self.pieces.iter().map(chord).collect()
    }

    /// The distance of the turns, mm.
    pub(super) fn pitch(&self) -> f64 {
        self.spiral.pitch
    }

    /// Returns whether a piece passes less than half a pitch from a place, along the ray through it.
    pub(super) fn pass(&self, p: &Point2<f64>) -> bool {
        let tau = self.spiral.nearest_turn(p);
        let next = self.pieces.partition_point(|[from, _]| from.0 <= tau);
        next.checked_sub(1).is_some_and(|k| tau <= self.pieces[k][1].0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use geom::spiral::Turning;
    use serde_json::Value;

    /// The vectors, from a `shared/vectors` folder beside the repository; `None` in a plain clone.
    fn vectors() -> Option<Value> {
        let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let path = manifest.ancestors().nth(3)?.join("shared/vectors/spirals.json");
        serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
    }

    /// Length of the spiral from the origin to `tau`.
    fn length(b: f64, tau: f64) -> f64 {
        b / 2.0 * (tau * (1.0 + tau * tau).sqrt() + tau.asinh())
    }

    #[test]
    fn published_clippings() {
        let Some(vectors) = vectors() else { return };
        let cases = vectors["clip"].as_array().unwrap();
        assert!(cases.len() > 20);
        for case in cases {
            let rings: Vec<Vec<Point2<f64>>> = case["rings"]
                .as_array()
                .unwrap()
                .iter()
                .map(|ring| {
                    let point =
                        |p: &Value| Point2::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap());
                    ring.as_array().unwrap().iter().map(point).collect()
                })
                .collect();
            let core = Region::from_rings(rings.iter().map(Vec::as_slice), Fill::NonZero);
            let spiral = Spiral {
                pitch: case["h"].as_f64().unwrap(),
                phase: case["phase"].as_f64().unwrap(),
                turning: match case["chi"].as_i64() {
                    Some(1) => Turning::CounterClockwise,
                    _ => Turning::Clockwise,
                },
            };
            let pieces = Turns::inside(&core, spiral).pieces;
            assert_eq!(pieces.len() as u64, case["n_pieces"].as_u64().unwrap(), "{}", case["id"]);
            let b = spiral.pitch / std::f64::consts::TAU;
            let total: f64 =
                pieces.iter().map(|[from, to]| length(b, to.0) - length(b, from.0)).sum();
            let expected = case["chart_length"].as_f64().unwrap();
            // The grid moves rims by up to 5 nm.
            assert!((total / expected - 1.0).abs() < 2e-6, "{}: {total} {expected}", case["id"]);
            let taus: Vec<f64> = pieces.iter().flatten().map(|end| end.0).collect();
            for (tau, expected) in taus.iter().zip(case["first_taus"].as_array().unwrap()) {
                assert!((tau - expected.as_f64().unwrap()).abs() < 1e-4, "{}: {tau}", case["id"]);
            }
        }
    }

    #[test]
    fn a_disc_about_the_axis_is_one_piece_from_the_centre() {
        let ring: Vec<Point2<f64>> = (0..120)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 120.0;
                Point2::new(10.0 * angle.cos(), 10.0 * angle.sin())
            })
            .collect();
        let disc = Region::from_rings([ring.as_slice()], Fill::NonZero);
        let spiral = Spiral { pitch: 0.4, phase: 0.0, turning: Turning::CounterClockwise };
        let turns = Turns::inside(&disc, spiral);
        let chords = turns.chords(0.002);
        assert!(chords[0].ends[0].is_none() && chords[0].ends[1].is_some());
        assert!(geom::polyline::length(&chords[0].points) > 750.0);
        // The outermost turn passes everywhere inside, but not beyond the disc.
        assert!((0..40).all(|k| turns.pass(&Point2::new(0.24 * f64::from(k), 0.1))));
        assert!(!turns.pass(&Point2::new(0.0, 10.3)));
    }
}
