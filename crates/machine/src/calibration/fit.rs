//! From a log to a calibration, with what the log does not say.

use nalgebra::Vector2;
use std::fmt;

use super::joint::{Magnet, Noise, PSI, Place, Prior, Problem, RHO, Unknowns};
use super::known::Known;
use super::log::Log;
use super::pairing::{Pair, huber_mean, match_sides};
use super::ring::{Drawing, Ring, find};
use super::{Sighting, detect, wrap};
use std::f64::consts::{SQRT_2, TAU};

/// A number and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error, in the same unit.
    pub sd: f64,
}

/// What became of a sighting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// A magnet of the ring, at this place from the index magnet.
    Ring(u32),
    /// A magnet elsewhere that says something of the rail.
    Inner,
    /// Nothing else agrees with it.
    Rejected,
}

/// A sighting and how it fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// What was seen.
    pub seen: Sighting,
    /// What became of it.
    pub fate: Fate,
    /// Where it lies on the bed with the fitted rail, mm from the axis.
    pub at: Vector2<f64>,
    /// By how much that misses its magnet's place, mm; none where it has no place.
    pub miss: Option<Vector2<f64>>,
}

/// Something that cannot be known from a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Undetermined {
    /// How far the rail misses the axis; the standard error that it would have, mm.
    Miss {
        /// mm; infinite where the log says nothing of it at all.
        sd: f64,
    },
    /// The rail's zero.
    RailZero {
        /// mm.
        sd: f64,
    },
    /// The ring: too few magnets lie on one.
    Ring,
    /// The plate's angle, but for whole pitches of so many magnets.
    IndexMagnet {
        /// Places round the ring.
        count: u32,
    },
    /// The plate's angle, because the rail's miss is unknown.
    PlateAngle,
}

/// What a log says.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// True minus commanded position along the rail, mm.
    pub a: Option<Estimate>,
    /// How far the rail misses the axis, mm.
    pub b: Option<Estimate>,
    /// Centre of the ring from the axis, on the bed, mm.
    pub centre: Option<[Estimate; 2]>,
    /// Radius of the ring, mm.
    pub radius: Option<Estimate>,
    /// Azimuth of the index magnet, radians; without one, of the magnet nearest to azimuth 0.
    pub angle: Option<Estimate>,
    /// Places round the ring.
    pub ring_count: Option<u32>,
    /// All sightings, in the order of the log.
    pub sightings: Vec<Judged>,
    /// Magnets seen from both sides.
    pub n_pairs: usize,
    /// Root of the mean square of what the sightings miss their magnets by, mm.
    pub residual_rms: f64,
    /// How many of the six unknowns the log determines, were all magnets where they belong.
    pub rank: usize,
    /// Condition of the problem, columns normalised.
    pub condition: f64,
    /// What it does not say.
    pub undetermined: Vec<Undetermined>,
    /// Magnets in the log that could not be located.
    pub unresolved: usize,
    /// Magnets that were scanned in one direction only.
    pub one_way: usize,
}

/// Why nothing can be made of a log.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There are too few sightings.
    #[error("the log shows {found} magnets, at least {least} are needed")]
    TooFew {
        /// How many there are.
        found: usize,
        /// How many there must be.
        least: usize,
    },
    /// There are more than any calibration has.
    #[error("the log shows {found} magnets, {most} are the most{}", hint(*.found))]
    TooMany {
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// The sensor switched more often than it passes magnets.
    #[error("the sensor saw something {found} times, {most} are the most")]
    TooManyPasses {
        /// How often.
        found: usize,
        /// How often it may have.
        most: usize,
    },
    /// Neither a ring nor a magnet seen from both sides.
    #[error("no ring of magnets fits the log, and no magnet was seen from both sides of the axis")]
    NothingFits,
}

fn hint(found: usize) -> &'static str {
    if found <= MOST_SIGHTINGS { "; say how many the ring has: # magnets = …" } else { "" }
}

/// Fewer sightings say nothing.
const FEWEST_SIGHTINGS: usize = 2;

/// More would take minutes; a ring of 72 seen from both sides, twice over, has as many.
const MOST_SIGHTINGS: usize = 288;

/// The same where the number of magnets must be found, too.
const MOST_UNCOUNTED: usize = 96;

/// A length with a larger standard error is not determined, mm: a print shows it.
pub const WORST_ERROR_MM: f64 = 0.1;

/// A sighting this near to a known place is of the magnet there, mm.
const NEAR_INNER_MM: f64 = 5.0;

/// Returns what a log says.
///
/// # Errors
///
/// [`FitError`], when it says nothing.
pub fn fit_log(log: &Log) -> Result<Fit, FitError> {
    let mut detected = detect::magnets(log, 0.0, 0.0);
    if detected.passes > detect::MOST_PASSES {
        let (found, most) = (detected.passes, detect::MOST_PASSES);
        return Err(FitError::TooManyPasses { found, most });
    }
    let mut fit = fit(&detected.sightings, &log.known)?;
    // Chords are circles only for the right rail; the second round is exact to a nanometre.
    for _ in 0..2 {
        let value = |estimate: Option<Estimate>| estimate.map_or(0.0, |estimate| estimate.value);
        detected = detect::magnets(log, value(fit.a), value(fit.b));
        fit = self::fit(&detected.sightings, &log.known)?;
    }
    fit.unresolved = detected.unresolved;
    fit.one_way = detected.one_way;
    Ok(fit)
}

/// Returns what sightings say.
///
/// # Errors
///
/// [`FitError`], when they say nothing.
pub fn fit(sightings: &[Sighting], known: &Known) -> Result<Fit, FitError> {
    check_count(sightings.len(), known)?;
    let pairs = match_sides(sightings);
    let (a, b) = rail(&pairs, known).unwrap_or_default();
    let spots = Spots::new(sightings, &pairs, a, b);
    let ring = find(&spots.at, &drawing(sightings, known));
    if ring.is_none() && pairs.is_empty() {
        return Err(FitError::NothingFits);
    }
    let ring = ring.map(|ring| turned_to_index(ring, sightings, &spots, known));
    let sorted = Sorted::new(sightings, &spots, ring.as_ref(), known, [a, b]);
    Ok(conclude(sightings, known, &pairs, ring.as_ref(), &sorted))
}

fn check_count(found: usize, known: &Known) -> Result<(), FitError> {
    let most = if known.magnets.is_some() { MOST_SIGHTINGS } else { MOST_UNCOUNTED };
    if found < FEWEST_SIGHTINGS {
        return Err(FitError::TooFew { found, least: FEWEST_SIGHTINGS });
    }
    if found > most { Err(FitError::TooMany { found, most }) } else { Ok(()) }
}

/// The rail out of the magnets seen from both sides.
fn rail(pairs: &[Pair], known: &Known) -> Option<(f64, f64)> {
    let of = |value: fn(&Pair) -> f64| pairs.iter().map(value).collect::<Vec<_>>();
    let a = huber_mean(&of(|pair| pair.a), known.rail_sd / SQRT_2)?;
    let b = huber_mean(&of(|pair| pair.b), known.cross_sd / SQRT_2)?;
    Some((a, b))
}

fn drawing(sightings: &[Sighting], known: &Known) -> Drawing {
    let mut radii: Vec<f64> = sightings.iter().map(|seen| seen.s.abs()).collect();
    radii.sort_by(f64::total_cmp);
    Drawing {
        count: known.magnets,
        radius: known.ring_radius.unwrap_or(radii[radii.len() / 2]),
        sd: known.ring_sd(),
    }
}

/// Places on the bed where there are magnets; one for both sightings of a pair.
#[derive(Debug)]
struct Spots {
    at: Vec<Vector2<f64>>,
    /// Indices of the sightings of each.
    seen: Vec<Vec<usize>>,
}

impl Spots {
    fn new(sightings: &[Sighting], pairs: &[Pair], a: f64, b: f64) -> Self {
        let mut spots = Self { at: Vec::new(), seen: Vec::new() };
        for pair in pairs {
            spots.at.push(pair.over_bed());
            spots.seen.push(vec![pair.near, pair.far]);
        }
        for (index, sighting) in sightings.iter().enumerate() {
            if !spots.seen.iter().any(|seen| seen.contains(&index)) {
                spots.at.push(sighting.over_bed(a, b));
                spots.seen.push(vec![index]);
            }
        }
        spots
    }
}

/// Counts the places from the index magnet, where it can be told from the others.
fn turned_to_index(mut ring: Ring, sightings: &[Sighting], spots: &Spots, known: &Known) -> Ring {
    let Some(index) = index_place(&ring, sightings, spots, known) else { return ring };
    let count = ring.count;
    for label in ring.labels.iter_mut().flatten() {
        *label = (*label + count - index) % count;
    }
    ring.angle = wrap(ring.angle + TAU * f64::from(index) / f64::from(count));
    ring
}

/// The place of the index magnet: the one that shows the other pole, or that stands where the log
/// says.
fn index_place(ring: &Ring, sightings: &[Sighting], spots: &Spots, known: &Known) -> Option<u32> {
    let reversed: Vec<u32> = ring
        .labels
        .iter()
        .zip(&spots.seen)
        .filter(|(_, seen)| seen.iter().all(|&index| sightings[index].is_reversed))
        .filter_map(|(label, _)| *label)
        .collect();
    if let [only] = reversed.as_slice() {
        return Some(*only);
    }
    let angle = known.index_theta.or(known.plate_angle)?;
    let places = (angle - ring.angle) / TAU * f64::from(ring.count);
    Some(places.round().rem_euclid(f64::from(ring.count)) as u32 % ring.count)
}

fn has_index(sightings: &[Sighting], known: &Known) -> bool {
    known.index_theta.is_some()
        || known.plate_angle.is_some()
        || sightings.iter().any(|seen| seen.is_reversed)
}

/// Magnets for the joint solution, and what became of each sighting.
#[derive(Debug)]
struct Sorted {
    magnets: Vec<Magnet>,
    fates: Vec<Fate>,
    start: Unknowns,
}

impl Sorted {
    fn new(
        sightings: &[Sighting],
        spots: &Spots,
        ring: Option<&Ring>,
        known: &Known,
        [a, b]: [f64; 2],
    ) -> Self {
        let start = ring.map_or_else(
            || Unknowns::new(a, b, 0.0, 0.0, 0.0, 0.0),
            |ring| Unknowns::new(a, b, ring.centre.x, ring.centre.y, ring.radius, ring.angle),
        );
        let mut sorted =
            Self { magnets: Vec::new(), fates: vec![Fate::Rejected; sightings.len()], start };
        for (index, (at, seen)) in spots.at.iter().zip(&spots.seen).enumerate() {
            let label = ring.and_then(|ring| ring.labels[index]);
            let Some((place, fate)) = place(at, label, seen.len(), ring, known) else { continue };
            let of_it = seen.iter().map(|&index| sightings[index]).collect();
            sorted.magnets.push(Magnet { place, sightings: of_it });
            seen.iter().for_each(|&index| sorted.fates[index] = fate);
        }
        sorted
    }
}

/// What a spot is; none where it says nothing.
fn place(
    at: &Vector2<f64>,
    label: Option<u32>,
    n_seen: usize,
    ring: Option<&Ring>,
    known: &Known,
) -> Option<(Place, Fate)> {
    if let (Some(label), Some(ring)) = (label, ring) {
        let azimuth = TAU * f64::from(label) / f64::from(ring.count);
        return Some((Place::Ring { azimuth }, Fate::Ring(label)));
    }
    let inner = ring.and_then(|ring| inner_place(at, ring, known));
    if let Some(place) = inner {
        return Some((place, Fate::Inner));
    }
    (n_seen == 2).then_some((Place::Free { at: *at }, Fate::Inner))
}

/// The known place of an inner magnet near a spot.
fn inner_place(at: &Vector2<f64>, ring: &Ring, known: &Known) -> Option<Place> {
    let (radius, first) = (known.inner_radius?, known.inner_angle?);
    let count = known.inner_magnets.unwrap_or(1);
    (0..count)
        .map(|k| first + TAU * f64::from(k) / f64::from(count))
        .find(|azimuth| {
            let angle = ring.angle + azimuth;
            let drawn = ring.centre + radius * Vector2::new(angle.cos(), angle.sin());
            (at - drawn).norm() < NEAR_INNER_MM
        })
        .map(|azimuth| Place::Fixed { radius, azimuth })
}

/// The problem as far as it is determined.
struct Determined {
    problem: Problem,
    errors: Unknowns,
    undetermined: Vec<Undetermined>,
}

fn conclude(
    sightings: &[Sighting],
    known: &Known,
    pairs: &[Pair],
    ring: Option<&Ring>,
    sorted: &Sorted,
) -> Fit {
    let mut start = sorted.start;
    let mut determined = determine(&mut start, known, ring.is_some(), &sorted.magnets);
    let x = if pairs.is_empty() {
        let solution = determined.problem.solve(&start);
        determined.errors = solution.errors;
        solution.unknowns
    } else {
        start
    };
    let scatter = scatter(pairs, known);
    let estimate = |index: usize, is_known: bool| {
        let spread = if index < 2 { scatter[index] } else { 1.0 };
        is_known.then(|| Estimate { value: x[index], sd: determined.errors[index] * spread })
    };
    let (rank, condition) = perfect(&determined.problem).rank_and_condition(&x);
    let mut undetermined = determined.undetermined;
    let says = |of: fn(&Undetermined) -> bool| !undetermined.iter().any(of);
    let has_b = says(|what| matches!(what, Undetermined::Miss { .. }));
    let has_a = says(|what| matches!(what, Undetermined::RailZero { .. }));
    let has_angle = ring.is_some() && has_b;
    if let Some(ring) = ring.filter(|_| has_angle && !has_index(sightings, known)) {
        undetermined.push(Undetermined::IndexMagnet { count: ring.count });
    }
    let judged = judge(sightings, &sorted.fates, ring, &x);
    Fit {
        a: estimate(0, has_a),
        b: estimate(1, has_b),
        centre: estimate(2, ring.is_some()).zip(estimate(3, true)).map(|(x, y)| [x, y]),
        radius: estimate(RHO, ring.is_some() && has_a),
        angle: estimate(PSI, has_angle),
        ring_count: ring.map(|ring| ring.count),
        residual_rms: residual_rms(&judged, pairs, &x),
        sightings: judged,
        n_pairs: pairs.len(),
        rank,
        condition,
        undetermined,
        unresolved: 0,
        one_way: 0,
    }
}

/// The same with magnets that are exactly where they belong, and all unknowns that there are.
fn perfect(problem: &Problem) -> Problem {
    let has_ring = problem.is_free[RHO] || problem.is_free[PSI] || problem.is_free[2];
    Problem {
        noise: Noise { placement: None, ..problem.noise },
        is_free: [true, true, has_ring, has_ring, has_ring, has_ring],
        ..problem.clone()
    }
}

/// Finds out what the sightings determine. What they do not is held at its best guess: a rail
/// through the axis, a carriage that stands where it says.
fn determine(
    start: &mut Unknowns,
    known: &Known,
    has_ring: bool,
    magnets: &[Magnet],
) -> Determined {
    let mut priors = Vec::new();
    if let (Some(value), Some(sd)) = (known.ring_radius, known.ring_radius_sd) {
        priors.push(Prior { index: RHO, value, sd });
    }
    if let (Some(value), Some(sd)) = (known.plate_angle, known.plate_angle_sd) {
        priors.push(Prior { index: PSI, value, sd });
    }
    if !has_ring {
        priors.clear();
    }
    let noise =
        Noise { rail: known.rail_sd, cross: known.cross_sd, placement: Some(known.placement_sd) };
    let is_free = [true, true, has_ring, has_ring, has_ring, has_ring];
    let mut problem = Problem { magnets: magnets.to_vec(), noise, priors, is_free };
    let mut undetermined = Vec::new();
    let sd = problem.errors(start)[1];
    // Not a number is not determined.
    if sd.is_nan() || sd > WORST_ERROR_MM {
        undetermined.push(Undetermined::Miss { sd });
        (problem.is_free[1], start[1]) = (false, 0.0);
        if has_ring {
            undetermined.push(Undetermined::PlateAngle);
        }
    }
    let sd = problem.errors(start)[0];
    if sd.is_nan() || sd > WORST_ERROR_MM {
        undetermined.push(Undetermined::RailZero { sd });
        (problem.is_free[0], start[0]) = (false, 0.0);
    }
    if !has_ring {
        undetermined.push(Undetermined::Ring);
    }
    let errors = problem.errors(start);
    Determined { problem, errors, undetermined }
}

/// By how much the pairs scatter more than assumed, for `a` and `b`; never less than 1.
fn scatter(pairs: &[Pair], known: &Known) -> [f64; 2] {
    // Fewer say nothing of their scatter.
    if pairs.len() < 4 {
        return [1.0; 2];
    }
    let over = |value: fn(&Pair) -> f64, sd: f64| {
        let values: Vec<f64> = pairs.iter().map(value).collect();
        let mean = huber_mean(&values, sd).unwrap_or_default();
        let mut offs: Vec<f64> = values.iter().map(|value| (value - mean).abs()).collect();
        offs.sort_by(f64::total_cmp);
        // Half of what is normally distributed is within 0.6745 standard deviations.
        (offs[offs.len() / 2] / 0.6745 / sd).max(1.0)
    };
    [over(|pair| pair.a, known.rail_sd / SQRT_2), over(|pair| pair.b, known.cross_sd / SQRT_2)]
}

fn judge(sightings: &[Sighting], fates: &[Fate], ring: Option<&Ring>, x: &Unknowns) -> Vec<Judged> {
    sightings
        .iter()
        .zip(fates)
        .map(|(&seen, &fate)| {
            let at = seen.over_bed(x[0], x[1]);
            let miss = match (fate, ring) {
                (Fate::Ring(label), Some(ring)) => {
                    let angle = x[PSI] + TAU * f64::from(label) / f64::from(ring.count);
                    let centre = Vector2::new(x[2], x[3]);
                    Some(at - centre - x[RHO] * Vector2::new(angle.cos(), angle.sin()))
                }
                _ => None,
            };
            Judged { seen, fate, at, miss }
        })
        .collect()
}

/// Misses from the ring; where there is none, of the pairs from each other.
fn residual_rms(judged: &[Judged], pairs: &[Pair], x: &Unknowns) -> f64 {
    let mut squares: Vec<f64> =
        judged.iter().filter_map(|one| one.miss).map(|miss| miss.norm_squared()).collect();
    if squares.is_empty() {
        squares.extend(pairs.iter().map(|pair| (pair.a - x[0]).powi(2) + (pair.b - x[1]).powi(2)));
    }
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

impl Fit {
    /// Returns how many sightings were used.
    #[must_use]
    pub fn n_used(&self) -> usize {
        self.sightings.iter().filter(|one| one.fate != Fate::Rejected).count()
    }

    /// Returns how many sightings nothing else agrees with.
    #[must_use]
    pub fn n_rejected(&self) -> usize {
        self.sightings.len() - self.n_used()
    }

    /// Returns how many places of the ring were seen.
    #[must_use]
    pub fn n_ring(&self) -> usize {
        let mut labels: Vec<u32> = self
            .sightings
            .iter()
            .filter_map(|one| match one.fate {
                Fate::Ring(label) => Some(label),
                _ => None,
            })
            .collect();
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }

    /// Returns the method in a few words.
    #[must_use]
    pub fn method(&self) -> &'static str {
        let from_both_sides = |of_ring: bool| {
            self.sightings.iter().any(|one| {
                one.seen.s < 0.0
                    && matches!(one.fate, Fate::Ring(_)) == of_ring
                    && one.fate != Fate::Rejected
            })
        };
        match (self.ring_count.is_some(), self.n_pairs > 0) {
            (true, true) if from_both_sides(true) => "two-sided ring",
            (true, true) => "ring and inner magnets from both sides",
            (true, false) => "one-sided ring",
            (false, _) => "magnets from both sides",
        }
    }
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let error = |sd: f64| {
            if sd.is_finite() && sd < 1000.0 {
                format!("its standard error would be {sd:.2} mm")
            } else {
                "the log does not depend on it".to_owned()
            }
        };
        match *self {
            Self::Miss { sd } => write!(
                f,
                "b, by how much the rail misses the axis: {}; let at least one magnet be seen from \
                 both sides of the axis",
                error(sd)
            ),
            Self::RailZero { sd } => write!(
                f,
                "a, the zero of the rail, and the radius of the ring: they appear only together, \
                 {}; let a magnet be seen from both sides, or give ring_radius_sd_mm",
                error(sd)
            ),
            Self::Ring => f.write_str(
                "where the plate lies: no three magnets lie on the ring; give ring_radius_mm and \
                 magnets",
            ),
            Self::IndexMagnet { count } => write!(
                f,
                "how the plate is turned, but for multiples of {:.4} degrees: the {count} magnets \
                 look alike; turn one over or give index_theta_deg",
                360.0 / f64::from(count)
            ),
            Self::PlateAngle => f.write_str("how the plate is turned: it cannot be told from b"),
        }
    }
}
