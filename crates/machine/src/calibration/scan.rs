//! The search for the centre on a machine.
//!
//! `home → search → near side → far side, or inner magnets from both sides → fit → verify → park`.
//!
//! The carriage steps inwards while the bed sweeps to and fro until a magnet shows. From there on
//! whole turns, both ways, at carriage positions a millimetre apart, until no magnet shows any
//! more: each magnet's circle is cut several times, from both directions, always after a move of
//! the carriage in the same direction. No hill is climbed. At the end three magnets are sought where
//! the result says that they are; only a machine that finds them there is calibrated.

use super::detect;
use super::fit::{Estimate, Fate, Fit, FitError, fit_log};
use super::known::Known;
use super::log::{Edge, Log, Rows};
use super::rig::{Rig, RigError, sweep};
use super::{Sighting, wrap};
use crate::kinematics::{Alignment, Branch};
use crate::program::BedTurn;
use nalgebra::{Point2, Point3};
use std::f64::consts::TAU;

/// What is known before the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Reach of the carriage, mm.
    pub rail: [f64; 2],
    /// The magnets; a ring's radius and number must be known.
    pub known: Known,
}

/// How far a search has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Driving to the end-stop.
    Home,
    /// Looking for the first magnet.
    Search,
    /// Scanning the ring from the near side.
    Near,
    /// Scanning inner magnets.
    Inner,
    /// Scanning from beyond the axis.
    Far,
    /// Looking whether magnets are where they should be.
    Verify,
}

/// What a search ends with.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The result.
    pub fit: Fit,
    /// All that the sensor saw.
    pub log: Log,
    /// By how much the magnets missed their predicted places at the end, mm.
    pub verified: Vec<f64>,
}

/// Why a search ends without a result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// The machine.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The plan lacks the ring.
    #[error("the radius of the ring and the number of its magnets must be given")]
    NoDrawing,
    /// The sensor sees nothing.
    #[error("no magnet was found between {from:.1} and {to:.1} mm on the rail")]
    NoMagnet {
        /// mm.
        from: f64,
        /// mm.
        to: f64,
    },
    /// The sensor does not let go.
    #[error("the sensor stays on at {s:.1} mm on the rail")]
    StuckSensor {
        /// mm.
        s: f64,
    },
    /// Too little of the ring.
    #[error("only {found} magnets of the ring were found, {least} are needed")]
    TooFewOnRing {
        /// How many.
        found: usize,
        /// How many there must be.
        least: usize,
    },
    /// The rail's miss cannot be seen.
    #[error("no magnet was seen from both sides of the axis")]
    OneSided,
    /// The log says nothing.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A number is known too badly.
    #[error("the scan does not determine {0}")]
    Undetermined(String),
    /// The mechanics.
    #[error(
        "the rail misses the axis by {miss:.3} mm, {most} mm are the most that can be allowed for"
    )]
    RailTooFar {
        /// mm.
        miss: f64,
        /// mm.
        most: f64,
    },
    /// The result predicts wrongly.
    #[error("magnets are up to {worst:.3} mm from where they should be, {most} mm are allowed")]
    NotVerified {
        /// mm.
        worst: f64,
        /// mm.
        most: f64,
    },
}

/// A rail that misses the axis by more must be put right with a spanner, mm.
const GREATEST_MISS_MM: f64 = 1.5;

/// Fewer magnets of the ring leave it in doubt.
const FEWEST_ON_RING: usize = 5;

/// A magnet farther from its prediction says that something slipped, mm.
const WORST_PREDICTION_MM: f64 = 0.05;

/// Step of the search, mm: less than the circle in which a sensor sees a magnet.
const SEARCH_STEP_MM: f64 = 2.0;

/// How far outside and inside of the drawn ring the search goes, mm.
const SEARCH_MARGIN_MM: f64 = 15.0;

/// Step of the levels, mm.
const LEVEL_STEP_MM: f64 = 1.0;

/// Most levels: a ring more eccentric than that does not lie in its place.
const MOST_LEVELS: usize = 24;

/// How much more than a turn is swept: a magnet on the seam is seen whole once.
const OVERLAP: f64 = 0.35;

/// A carriage backs off so far before it approaches the next place, so that it always comes from
/// the same side, mm.
const APPROACH_MM: f64 = 1.0;

/// How far beyond the ring levels the carriage can be wrong about the axis, mm.
const GREATEST_ZERO_ERROR_MM: f64 = 5.0;

/// Told how far the search has come; returns whether to go on.
pub type Watch<'a> = &'a mut dyn FnMut(Stage, f64) -> bool;

/// Searches, and parks the machine however it ends.
///
/// # Errors
///
/// [`ScanError`]
pub fn scan(rig: &mut dyn Rig, plan: &Plan, watch: Watch<'_>) -> Result<Found, ScanError> {
    let found = Search { rig, plan, watch, edges: Vec::new(), forth: true }.run();
    let parked = rig.park();
    let found = found?;
    parked?;
    Ok(found)
}

struct Search<'a, 'w> {
    rig: &'a mut dyn Rig,
    plan: &'a Plan,
    watch: &'a mut (dyn FnMut(Stage, f64) -> bool + 'w),
    edges: Vec<Edge>,
    /// Whether the next short sweep goes forth.
    forth: bool,
}

/// Carriage positions at which magnets were seen, from and to, mm.
type Span = [f64; 2];

impl Search<'_, '_> {
    fn run(mut self) -> Result<Found, ScanError> {
        let (Some(radius), Some(count)) = (self.plan.known.ring_radius, self.plan.known.magnets)
        else {
            return Err(ScanError::NoDrawing);
        };
        self.goes_on(Stage::Home, 0.0)?;
        self.rig.home()?;
        let first = self.search(radius, count)?;
        // The first sight may be of an alien outside of the ring; one level more costs little.
        let near = self.levels(Stage::Near, (first + SEARCH_STEP_MM).min(self.plan.rail[1]))?;
        let has_both = self.far_side(near, radius)?;
        let log = Log { known: self.plan.known, rows: Rows::Edges(self.edges.clone()) };
        let fit = fit_log(&log)?;
        judge(&fit, has_both)?;
        let verified = self.verify(&fit)?;
        Ok(Found { fit, log, verified })
    }

    fn goes_on(&mut self, stage: Stage, share: f64) -> Result<(), ScanError> {
        if (self.watch)(stage, share) { Ok(()) } else { Err(RigError::Stopped.into()) }
    }

    /// Steps inwards until the sensor sees a magnet; returns where.
    fn search(&mut self, radius: f64, count: u32) -> Result<f64, ScanError> {
        let from = (radius + SEARCH_MARGIN_MM).min(self.plan.rail[1]);
        let to = (radius - SEARCH_MARGIN_MM).max(self.plan.rail[0]);
        // Three pitches show a magnet even where two are missing.
        let arc = (3.0 * TAU / f64::from(count)).min(TAU);
        let mut s = from;
        while s >= to {
            self.goes_on(Stage::Search, (from - s) / (from - to).max(SEARCH_STEP_MM))?;
            self.rig.carriage_to(s)?;
            let (start, end) = if self.forth { (0.0, arc) } else { (arc, 0.0) };
            self.forth = !self.forth;
            if self.rig.is_on()? && self.rig.turn_until(false, end)?.is_none() {
                return Err(ScanError::StuckSensor { s });
            }
            if !sweep(self.rig, s, start, end)?.is_empty() {
                return Ok(s);
            }
            self.rig.turn_to(end)?;
            s -= SEARCH_STEP_MM;
        }
        Err(ScanError::NoMagnet { from, to })
    }

    /// Scans whole turns at falling carriage positions from `start` on, until magnets have shown
    /// and show no more; returns where they did.
    fn levels(&mut self, stage: Stage, start: f64) -> Result<Option<Span>, ScanError> {
        let mut span: Option<Span> = None;
        let backed = (start + APPROACH_MM).min(self.plan.rail[1]);
        self.rig.carriage_to(backed)?;
        for level in 0..MOST_LEVELS {
            let s = start - LEVEL_STEP_MM * level as f64;
            if s < self.plan.rail[0] {
                break;
            }
            self.goes_on(stage, level as f64 / MOST_LEVELS as f64)?;
            let edges = self.turn_around(s)?;
            let is_empty = edges.is_empty();
            self.edges.extend(edges);
            match (&mut span, is_empty) {
                (Some(span), false) => span[1] = s,
                (None, false) => span = Some([s, s]),
                // Aliens outside of the ring show before it does.
                (Some([from, to]), true) if *from - *to >= 3.0 * LEVEL_STEP_MM => break,
                _ => {}
            }
        }
        Ok(span)
    }

    /// A whole turn and a bit, forth and back, the carriage standing.
    fn turn_around(&mut self, s: f64) -> Result<Vec<Edge>, ScanError> {
        self.rig.carriage_to(s)?;
        self.rig.turn_to(0.0)?;
        let end = TAU + OVERLAP;
        let mut edges = sweep(self.rig, s, 0.0, end)?;
        self.rig.turn_to(end)?;
        edges.extend(sweep(self.rig, s, end, 0.0)?);
        Ok(edges)
    }

    /// Scans what can be seen from both sides; returns whether anything can.
    fn far_side(&mut self, near: Option<Span>, radius: f64) -> Result<bool, ScanError> {
        let reach = self.plan.rail[0];
        if let Some([outer, inner]) = near {
            let start = -(inner - GREATEST_ZERO_ERROR_MM);
            if -(outer + GREATEST_ZERO_ERROR_MM) >= reach {
                return Ok(self.levels(Stage::Far, start)?.is_some());
            }
        }
        let Some(inner) = self.plan.known.inner_radius.filter(|&inner| inner < radius) else {
            return Ok(false);
        };
        // A sensor sees a magnet some millimetres off.
        let margin = GREATEST_ZERO_ERROR_MM + 3.0;
        let Some([outermost, innermost]) = self.levels(Stage::Inner, inner + margin)? else {
            return Ok(false);
        };
        let middle = (outermost + innermost) / 2.0;
        let start = -(middle - margin).max(0.0);
        Ok(start > reach && self.levels(Stage::Far, start)?.is_some())
    }

    /// Seeks three magnets where they should be; returns by how much they are not.
    fn verify(&mut self, fit: &Fit) -> Result<Vec<f64>, ScanError> {
        let value = |estimate: Option<Estimate>| estimate.map_or(0.0, |estimate| estimate.value);
        let rail = Alignment { a: value(fit.a), b: value(fit.b), ..Alignment::IDEAL };
        let ring: Vec<_> = fit
            .sightings
            .iter()
            .filter(|one| matches!(one.fate, Fate::Ring(_)) && one.seen.s > 0.0)
            .collect();
        let mut misses = Vec::new();
        for k in 0..3 {
            self.goes_on(Stage::Verify, f64::from(k) / 3.0)?;
            let Some(one) = ring.get(ring.len() * k as usize / 3) else { break };
            let at = Point3::new(one.at.x, one.at.y, 0.0);
            let near = BedTurn::accumulated(std::f64::consts::PI);
            let Ok(joints) = rail.joints_from_part(&at, Branch::Near, near) else { continue };
            let predicted = Sighting::new(joints.s, joints.turn.radians());
            let miss = match self.look(&predicted, &rail)? {
                Some(seen) => {
                    let across = wrap(seen.theta - predicted.theta) * one.at.norm();
                    (seen.s - predicted.s).hypot(across)
                }
                None => f64::INFINITY,
            };
            misses.push(miss);
        }
        let worst = misses.iter().copied().fold(0.0, f64::max);
        if misses.len() < 3 || worst > WORST_PREDICTION_MM {
            return Err(ScanError::NotVerified { worst, most: WORST_PREDICTION_MM });
        }
        Ok(misses)
    }

    /// Scans about a place; returns where a magnet is.
    fn look(&mut self, place: &Sighting, rail: &Alignment) -> Result<Option<Sighting>, ScanError> {
        // A few millimetres either way; at a small radius that is a large angle.
        let arc = (8.0 / place.s.abs()).min(0.5);
        self.rig.carriage_to((place.s + 2.0 + APPROACH_MM).min(self.plan.rail[1]))?;
        let mut edges = Vec::new();
        for offset in [2.0, 1.0, 0.0, -1.0, -2.0] {
            let s = place.s + offset;
            if s > self.plan.rail[1] {
                continue;
            }
            self.rig.carriage_to(s)?;
            let (from, to) = (place.theta - arc, place.theta + arc);
            self.rig.turn_to(from)?;
            edges.extend(sweep(self.rig, s, from, to)?);
            self.rig.turn_to(to)?;
            edges.extend(sweep(self.rig, s, to, from)?);
        }
        let log = Log { known: self.plan.known, rows: Rows::Edges(edges) };
        let off = |seen: &Sighting| {
            Point2::from(seen.over_bed(rail.a, rail.b) - place.over_bed(rail.a, rail.b))
                .coords
                .norm()
        };
        let seen = detect::magnets(&log, rail.a, rail.b).sightings;
        Ok(seen.into_iter().min_by(|p, q| off(p).total_cmp(&off(q))))
    }
}

/// Refuses what must not be stored.
fn judge(fit: &Fit, has_both: bool) -> Result<(), ScanError> {
    let found = fit.n_ring();
    if found < FEWEST_ON_RING {
        return Err(ScanError::TooFewOnRing { found, least: FEWEST_ON_RING });
    }
    if !has_both || fit.n_pairs == 0 {
        return Err(ScanError::OneSided);
    }
    let (Some(_), Some(b)) = (fit.a, fit.b) else {
        let what = fit.undetermined.iter().map(ToString::to_string).collect::<Vec<_>>();
        return Err(ScanError::Undetermined(what.join("; ")));
    };
    if b.value.abs() > GREATEST_MISS_MM {
        return Err(ScanError::RailTooFar { miss: b.value, most: GREATEST_MISS_MM });
    }
    Ok(())
}
