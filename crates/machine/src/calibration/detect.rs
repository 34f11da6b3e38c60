//! The magnets in a log.
//!
//! A log is a sequence of scans: the bed turned while the carriage stood, or the carriage ran while
//! the bed stood. Each passage over a magnet gives the middle of what the sensor saw and
//! its extent. Passes that overlap are of one magnet. Its place across the rail is the mean of the
//! middles of both directions, so that play, delay and the sensor's hysteresis cancel; its place
//! along the rail comes from scans of the carriage where there are any, else from how the passes of
//! the turning bed grow and shrink from one carriage position to the next.

use super::log::{Direction, Edge, Log, Rows, Sample};
use super::peaks::{Chord, centroid, chord, log_gauss};
use super::{Sighting, wrap};
use std::f64::consts::PI;

/// What was found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detected {
    /// The magnets.
    pub sightings: Vec<Sighting>,
    /// Groups of passes that do not suffice to locate a magnet.
    pub unresolved: usize,
    /// Magnets that were scanned in one direction only: their place is off by hysteresis and delay,
    /// some 50 µm.
    pub one_way: usize,
    /// Passages over magnets.
    pub passes: usize,
}

/// More passages are no calibration; to sort them would take minutes.
pub const MOST_PASSES: usize = 20_000;

/// One passage over a magnet.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pass {
    /// Middle: carriage, mm, and azimuth, radians.
    s: f64,
    theta: f64,
    /// Half the extent: radians of a turn, mm of a run.
    half: f64,
    /// How much of a magnet was seen; grows towards its middle.
    strength: f64,
    direction: Direction,
    is_reversed: bool,
}

/// Passes whose middles are nearer than this are of one magnet, mm across the rail: less than half
/// the distance at which two magnets can be told apart.
const SAME_MAGNET_MM: f64 = 2.5;

/// Rows of one magnet lie no farther from its strongest, mm: a magnet shows no wider.
const SAME_ROWS_MM: f64 = 12.0;

/// Two scans at positions nearer than this are at the same one: below the step of any machine.
const SAME_PLACE_MM: f64 = 1e-3;
const SAME_PLACE_RAD: f64 = 1e-5;

/// The share of a bump's height above which its centroid is taken.
const FOOT_SHARE: f64 = 0.15;

/// A bump is a magnet when it is at least this share of the highest.
const BUMP_SHARE: f64 = 0.25;

/// Returns the magnets in a log on a machine whose rail is about `(a, b)`.
#[must_use]
pub fn magnets(log: &Log, a: f64, b: f64) -> Detected {
    let passes = match &log.rows {
        Rows::Peaks(peaks) => {
            return Detected { sightings: peaks.clone(), ..Detected::default() };
        }
        Rows::Samples(samples) => bumps(samples),
        Rows::Edges(edges) => chords(edges),
    };
    let is_digital = matches!(log.rows, Rows::Edges(_));
    let mut found = Detected { passes: passes.len(), ..Detected::default() };
    if passes.len() > MOST_PASSES {
        return found;
    }
    for group in grouped(&passes) {
        let is_one_way = [true, false].iter().any(|&turn| is_one_way(&group, turn));
        match locate(&group, is_digital, a, b) {
            Some(sighting) => {
                found.one_way += usize::from(is_one_way);
                found.sightings.push(sighting);
            }
            None => found.unresolved += 1,
        }
    }
    found
}

/// Passes between an `on` and the `off` that follows it.
fn chords(edges: &[Edge]) -> Vec<Pass> {
    let mut passes = Vec::new();
    let mut on: Option<&Edge> = None;
    for edge in edges {
        if edge.is_on {
            on = Some(edge);
            continue;
        }
        let Some(start) = on.take().filter(|start| start.direction == edge.direction) else {
            continue;
        };
        let (run, turn) = (edge.s - start.s, edge.theta - start.theta);
        let is_clean = if edge.direction.is_turn() {
            run.abs() < SAME_PLACE_MM && turn.abs() < PI
        } else {
            turn.abs() < SAME_PLACE_RAD
        };
        if is_clean {
            let half = if edge.direction.is_turn() { turn } else { run }.abs() / 2.0;
            passes.push(Pass {
                s: (start.s + edge.s) / 2.0,
                theta: (start.theta + edge.theta) / 2.0,
                half,
                strength: half,
                direction: edge.direction,
                is_reversed: false,
            });
        }
    }
    passes
}

/// Passes in the readings of an analogue sensor.
fn bumps(samples: &[Sample]) -> Vec<Pass> {
    let mut levels: Vec<f64> = samples.iter().map(|sample| sample.level).collect();
    levels.sort_by(f64::total_cmp);
    // Most readings of a log that goes round the bed see no magnet.
    let Some(&quiet) = levels.get(levels.len() / 2) else { return Vec::new() };
    let highest = levels.iter().map(|level| (level - quiet).abs()).fold(0.0, f64::max);
    let mut passes = Vec::new();
    for (scan, direction) in scans(samples) {
        for pole in [1.0, -1.0] {
            let level: Vec<f64> = scan.iter().map(|sample| pole * (sample.level - quiet)).collect();
            for range in peaks_above(&level, BUMP_SHARE * highest) {
                passes.extend(bump(&scan, &level, range, direction, pole < 0.0));
            }
        }
    }
    // The pole that most magnets show is the ordinary one.
    let n_reversed = passes.iter().filter(|pass| pass.is_reversed).count();
    if 2 * n_reversed > passes.len() {
        passes.iter_mut().for_each(|pass| pass.is_reversed = !pass.is_reversed);
    }
    passes
}

/// Runs of readings during which one axis moved in one direction, in growing order of that axis.
fn scans(samples: &[Sample]) -> Vec<(Vec<Sample>, Direction)> {
    let mut scans: Vec<(Vec<Sample>, Direction)> = Vec::new();
    let mut run: Vec<Sample> = Vec::new();
    let mut current = None;
    for pair in samples.windows(2) {
        let step = direction(&pair[0], &pair[1]);
        if step != current || run.is_empty() {
            finish(&mut scans, &mut run, current);
            run.push(pair[0]);
            current = step;
        }
        run.push(pair[1]);
    }
    finish(&mut scans, &mut run, current);
    scans
}

fn finish(
    scans: &mut Vec<(Vec<Sample>, Direction)>,
    run: &mut Vec<Sample>,
    direction: Option<Direction>,
) {
    let mut run = std::mem::take(run);
    // Fewer readings have no bump with both its feet.
    if let Some(direction) = direction.filter(|_| run.len() >= 5) {
        if matches!(direction, Direction::CounterClockwise | Direction::In) {
            run.reverse();
        }
        scans.push((run, direction));
    }
}

/// What moved between two readings; nothing where both axes did, or none.
fn direction(from: &Sample, to: &Sample) -> Option<Direction> {
    let (run, turn) = (to.s - from.s, to.theta - from.theta);
    match (run.abs() < SAME_PLACE_MM, turn.abs() < SAME_PLACE_RAD) {
        (true, false) if turn > 0.0 => Some(Direction::Clockwise),
        (true, false) => Some(Direction::CounterClockwise),
        (false, true) if run > 0.0 => Some(Direction::Out),
        (false, true) => Some(Direction::In),
        _ => None,
    }
}

/// Ranges of readings, each with one hump above `least` and down to its foot on both sides.
fn peaks_above(level: &[f64], least: f64) -> Vec<std::ops::Range<usize>> {
    let mut ranges = Vec::new();
    let mut k = 0;
    while k < level.len() {
        if level[k] <= least || least <= 0.0 {
            k += 1;
            continue;
        }
        let end = (k..level.len()).find(|&m| level[m] <= least).unwrap_or(level.len());
        let top = level[k..end].iter().copied().fold(0.0, f64::max);
        let foot = FOOT_SHARE * top;
        let first = (0..k).rev().find(|&m| level[m] <= foot);
        let last = (end..level.len()).find(|&m| level[m] <= foot);
        if let (Some(first), Some(last)) = (first, last) {
            ranges.push(first..last + 1);
        }
        k = end;
    }
    ranges.dedup();
    ranges
}

fn bump(
    scan: &[Sample],
    level: &[f64],
    range: std::ops::Range<usize>,
    direction: Direction,
    is_reversed: bool,
) -> Option<Pass> {
    let along = |sample: &Sample| if direction.is_turn() { sample.theta } else { sample.s };
    let x: Vec<f64> = scan[range.clone()].iter().map(along).collect();
    let y = &level[range.clone()];
    let top = y.iter().copied().fold(0.0, f64::max);
    let middle = centroid(&x, y, FOOT_SHARE * top)?;
    let area: f64 =
        x.windows(2).zip(y.windows(2)).map(|(x, y)| (x[1] - x[0]) * (y[0] + y[1]) / 2.0).sum();
    let at = scan[range.start];
    let half = (x.last()? - x.first()?) / 2.0;
    let (s, theta) = if direction.is_turn() { (at.s, middle) } else { (middle, at.theta) };
    Some(Pass { s, theta, half, strength: area, direction, is_reversed })
}

/// Passes of one magnet each.
fn grouped(passes: &[Pass]) -> Vec<Vec<Pass>> {
    let mut groups: Vec<Vec<Pass>> = Vec::new();
    for pass in passes {
        let is_same = |other: &Pass| {
            let across = wrap(pass.theta - other.theta).abs() * pass.s.abs();
            let along = (pass.s - other.s).abs();
            let reach = 2.0 * SAME_MAGNET_MM;
            let is_near = across < SAME_MAGNET_MM && along < reach;
            is_near && pass.s * other.s > 0.0 && pass.is_reversed == other.is_reversed
        };
        match groups.iter_mut().find(|group| group.iter().any(is_same)) {
            Some(group) => group.push(*pass),
            None => groups.push(vec![*pass]),
        }
    }
    groups
}

/// Whether the passes of one axis all went in the same direction.
fn is_one_way(group: &[Pass], is_turn: bool) -> bool {
    let mut passes = group.iter().filter(|pass| pass.direction.is_turn() == is_turn);
    passes.next().is_some_and(|first| passes.all(|pass| pass.direction == first.direction))
}

fn locate(group: &[Pass], is_digital: bool, a: f64, b: f64) -> Option<Sighting> {
    let turns: Vec<Pass> = group.iter().filter(|p| p.direction.is_turn()).copied().collect();
    let runs: Vec<Pass> = group.iter().filter(|p| !p.direction.is_turn()).copied().collect();
    let theta = both_ways(&turns, |pass| turns[0].theta + wrap(pass.theta - turns[0].theta))?;
    let rows = rows(&turns);
    let s = if !runs.is_empty() {
        // Off the magnet's azimuth the nearest point of the rail is nearer to the axis.
        both_ways(&runs, |pass| (pass.s + a) / wrap(pass.theta - theta).cos() - a)?
    } else if is_digital {
        let chords: Vec<Chord> =
            rows.iter().map(|&(s, half_angle)| Chord { s, half_angle }).collect();
        let middle = chord(&chords, a, b)?.s;
        is_between(&rows, middle).then_some(middle)?
    } else {
        let (x, y): (Vec<f64>, Vec<f64>) = rows.iter().copied().unzip();
        // Arcs, not angles, measure how much of a magnet was passed over.
        let y: Vec<f64> = y.iter().zip(&x).map(|(area, s)| area * (s + a).abs()).collect();
        // The rows are few and do not reach down to the foot on both sides: a bell curve through
        // them needs neither.
        let top = (0..y.len()).max_by(|&i, &j| y[i].total_cmp(&y[j]))?;
        let middle = log_gauss(&x, &y, [BUMP_SHARE * y[top], y[top]], x[top], SAME_ROWS_MM)?;
        is_between(&rows, middle).then_some(middle)?
    };
    Some(Sighting { s, theta, is_reversed: group[0].is_reversed })
}

/// Mean of the means of both directions, each pass by its extent.
fn both_ways(passes: &[Pass], value: impl Fn(&Pass) -> f64) -> Option<f64> {
    let mean = |is_first: bool| {
        let way = || passes.iter().filter(move |pass| pass.direction.is_first() == is_first);
        let weight: f64 = way().map(|pass| pass.half).sum();
        (weight > 0.0).then(|| way().map(|pass| pass.half * value(pass)).sum::<f64>() / weight)
    };
    match (mean(true), mean(false)) {
        (Some(one), Some(other)) => Some((one + other) / 2.0),
        (one, other) => one.or(other),
    }
}

/// Carriage position and mean strength of the passes there, in growing order of the position.
fn rows(turns: &[Pass]) -> Vec<(f64, f64)> {
    let mut sorted = turns.to_vec();
    sorted.sort_by(|p, q| p.s.total_cmp(&q.s));
    sorted
        .chunk_by(|p, q| (p.s - q.s).abs() < SAME_PLACE_MM)
        .map(|row| {
            let mean = row.iter().map(|pass| pass.strength).sum::<f64>() / row.len() as f64;
            (row[0].s, mean)
        })
        .collect()
}

/// A middle outside of what was scanned is a guess.
fn is_between(rows: &[(f64, f64)], middle: f64) -> bool {
    match (rows.first(), rows.last()) {
        (Some(first), Some(last)) => first.0 <= middle && middle <= last.0,
        _ => false,
    }
}
