//! How fast the axes can follow: the duration of every move.
//!
//! A move may be slower than wanted for two reasons. No axis may exceed its speed; and from one move
//! to the next no axis may change its speed faster than it can be accelerated: the difference of the
//! two mean speeds, over the time between the middles of the two moves, is at most the axis's
//! acceleration. The second rule holds between all neighbouring moves, at corners and at starts as
//! much as along curves, so a program in which every move simply runs at its `F` asks nothing
//! impossible of the bed, whatever the firmware knows of it.
//!
//! The axes are carriage, bed and lift, and the nozzle along its path over the part. Of the nozzle
//! only the speed counts, not where it turns to: what must be turned round is carriage and bed. The
//! extruder has a speed alone; filament is as light as its gear is strong.
//!
//! Method: durations start at the speed limits and are lengthened, to and fro along the layer, until
//! the rule holds everywhere; of two moves the one that is faster in the violated axis gives way.
//! Durations only ever grow, and doubling both of a pair quarters what it violates, so this ends.

use std::borrow::Cow;

use machine::gcode::Dialect;
use machine::gcode::dialect::Space;
use machine::gcode::speed_word::SpeedWord;
use machine::head::{HEAD_AXES, Head, Stance};
use machine::profile::Printer;
use machine::program::Joints;

use crate::resample::Leg;
use crate::route::Kind;

/// What the speed of a program must respect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Greatest speed and acceleration, in mm and radians.
    axes: [AxisLimit; MOST_AXES],
    /// mm of filament a second, either way.
    extruder_speed: f64,
    least_duration: f64,
    /// Whether rail and bed are driven by this program at all.
    polar: bool,
    /// Whether the bed's drive takes up its play where the bed turns back, everything else standing.
    stops_to_turn_back: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct AxisLimit {
    speed: f64,
    acceleration: f64,
}

/// Carriage, bed, lift, and the nozzle along its path.
const AXES: usize = 4;

/// The same and the axes of a head that turns the nozzle. The law is the same for any number; few are
/// quick.
pub(crate) const MOST_AXES: usize = AXES + HEAD_AXES;

/// The carriage among the axes.
const RAIL: usize = 0;

/// The bed.
const BED: usize = 1;

/// The lift.
const LIFT: usize = 2;

/// The nozzle along its path.
const PATH: usize = 3;

/// Share of a limit that is used. Positions are rounded before they come here; what is left is the
/// rounding of `F`, and readers who measure an arc by its chord.
const USED_SHARE: f64 = 0.99;

/// The same where the firmware moves straight over the part: within a move the bed's speed then
/// differs from its mean by up to a tenth.
const USED_SHARE_UNEVEN: f64 = 0.9;

/// Times that durations are gone over before the rest is left as it is. Each pass brings a change of
/// speed one move further; 200 moves at 15° are eight turns of the bed.
const MOST_PASSES: usize = 200;

/// Share by which the acceleration may be exceeded and still count as kept; below the margin of
/// [`USED_SHARE`].
const SLACK: f64 = 1e-3;

/// The speeds of the axes in a move, and how long it lasts: what the next move joins on to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    speeds: [f64; MOST_AXES],
    duration: f64,
    /// The way that the bed turned last: 1 or −1.
    direction: f64,
}

impl Pace {
    /// Standing still, for as long as one likes.
    pub const REST: Self = Self { speeds: [0.0; MOST_AXES], duration: 0.0, direction: 1.0 };
}

impl Limits {
    /// Returns the limits of a printer for moves that are straight in `space`; over the part, only
    /// the speeds of lift and extruder and the command rate count.
    #[must_use]
    pub fn of(printer: &Printer, space: Space) -> Self {
        let share = if space == Space::IdealPlane { USED_SHARE_UNEVEN } else { USED_SHARE };
        let limit = |speed: f64, acceleration: f64| AxisLimit {
            speed: speed * share,
            acceleration: acceleration * share,
        };
        let none = AxisLimit { speed: f64::INFINITY, acceleration: f64::INFINITY };
        let mut axes = [none; MOST_AXES];
        axes[..AXES].copy_from_slice(&[
            limit(printer.rail.speed, printer.rail.acceleration),
            limit(printer.bed.speed, printer.bed.acceleration),
            AxisLimit {
                speed: printer.lift.speed * USED_SHARE,
                acceleration: printer.lift.acceleration * USED_SHARE,
            },
            // How fast the nozzle is to be is said with each leg.
            AxisLimit {
                speed: f64::INFINITY,
                acceleration: printer.path_acceleration * USED_SHARE,
            },
        ]);
        let head = printer.head.as_ref().map(Head::axes).unwrap_or_default();
        for (place, of_head) in axes[AXES..].iter_mut().zip(head) {
            *place = limit(of_head.axis.speed, of_head.axis.acceleration);
        }
        Self {
            axes,
            extruder_speed: printer.extruder_speed * USED_SHARE,
            least_duration: 1.0 / printer.moves_per_second,
            polar: space != Space::Part,
            stops_to_turn_back: space != Space::Part && printer.alignment.bed.backlash > 0.0,
        }
    }
}

/// How rail, bed and lift move in each leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Travel {
    /// Rail (mm) and bed (radians).
    pub(crate) axes: [f64; 2],
    /// mm.
    pub(crate) lift: f64,
}

/// Returns what the axes do in each leg that begins where the one before ends.
pub(crate) fn travels(legs: &[Leg], start: Joints) -> Vec<Travel> {
    let mut from = start;
    legs.iter()
        .map(|leg| {
            let travel = Travel {
                axes: [leg.to.s - from.s, leg.to.turn.radians() - from.turn.radians()],
                lift: leg.to.z - from.z,
            };
            from = leg.to;
            travel
        })
        .collect()
}

/// How long the firmware will take for each leg.
pub(crate) struct Taken<'a> {
    /// As planned, but where the firmware sets the pace itself, s.
    pub(crate) times: Cow<'a, [f64]>,
    /// Length of the beads of which it does, mm.
    pub(crate) paced: f64,
}

/// Returns how long the firmware will take for each leg that begins where the one before ends.
pub(crate) fn taken<'a>(
    legs: &[Leg],
    start: Joints,
    planned: &'a [f64],
    dialect: &Dialect,
) -> Taken<'a> {
    if !matches!(dialect.speed, SpeedWord::MarlinPolar(_)) {
        return Taken { times: planned.into(), paced: 0.0 };
    }
    let (mut from, mut paced) = (start, 0.0);
    let times = legs.iter().zip(planned).map(|(leg, &duration)| {
        let way = dialect.way(&from, &leg.to, leg.path, leg.filament);
        from = leg.to;
        if !dialect.speed.sets_the_pace(&way) {
            return duration;
        }
        paced += if leg.kind == Kind::Print { leg.path } else { 0.0 };
        dialect.speed.duration(&way, dialect.speed.word(&way, duration))
    });
    let times = times.collect();
    Taken { times, paced }
}

/// What the axes of the law do in a leg.
fn distances(leg: &Leg, travel: &Travel) -> [f64; AXES] {
    [travel.axes[0], travel.axes[1], travel.lift, leg.path]
}

/// The limits, and how fast the nozzle may be sped up in each leg, mm/s²: where nothing is said, as fast
/// as the machine can.
struct Law<'a> {
    limits: &'a Limits,
    accelerations: &'a [f64],
}

impl Law<'_> {
    /// The acceleration of an axis in a leg.
    fn of(&self, axis: usize, leg: usize) -> f64 {
        let limit = self.limits.axes[axis].acceleration;
        match self.accelerations.get(leg) {
            Some(wanted) if axis == PATH => limit.min(wanted * USED_SHARE),
            _ => limit,
        }
    }

    /// The acceleration of an axis between a leg and the next.
    fn between(&self, axis: usize, leg: usize) -> f64 {
        self.of(axis, leg).min(self.of(axis, leg + 1))
    }
}

/// Returns the duration of every leg, s, and the pace of the last.
#[must_use]
pub(crate) fn durations(
    legs: &[Leg],
    travels: &[Travel],
    before: Pace,
    limits: &Limits,
) -> (Vec<f64>, Pace) {
    gentle_durations(legs, travels, before, limits, &[])
}

/// Like [`durations`], where the nozzle is to be sped up no faster than is said of each leg, mm/s².
#[must_use]
pub(crate) fn gentle_durations(
    legs: &[Leg],
    travels: &[Travel],
    before: Pace,
    limits: &Limits,
    accelerations: &[f64],
) -> (Vec<f64>, Pace) {
    let law = Law { limits, accelerations };
    let moves: Vec<[f64; AXES]> =
        legs.iter().zip(travels).map(|(leg, travel)| distances(leg, travel)).collect();
    durations_of(legs, &moves, before, &law)
}

/// The same of legs with a head that turns the nozzle: what every drive does in each is given.
#[must_use]
pub(crate) fn posed_durations(
    legs: &[Leg],
    (start, stances): (&Stance, &[Stance]),
    before: Pace,
    limits: &Limits,
    accelerations: &[f64],
) -> (Vec<f64>, Pace) {
    let law = Law { limits, accelerations };
    let mut from = start;
    let moves: Vec<[f64; MOST_AXES]> = legs
        .iter()
        .zip(stances)
        .map(|(leg, to)| {
            let mut axes = [0.0; MOST_AXES];
            axes[RAIL] = to.base.s - from.base.s;
            axes[BED] = to.base.turn.radians() - from.base.turn.radians();
            axes[LIFT] = to.base.z - from.base.z;
            axes[PATH] = leg.path;
            for k in 0..HEAD_AXES {
                axes[AXES + k] = to.head[k] - from.head[k];
            }
            from = to;
            axes
        })
        .collect();
    durations_of(legs, &moves, before, &law)
}

fn durations_of<const N: usize>(
    legs: &[Leg],
    moves: &[[f64; N]],
    before: Pace,
    law: &Law<'_>,
) -> (Vec<f64>, Pace) {
    let limits = law.limits;
    let mut durations: Vec<f64> =
        legs.iter().zip(moves).map(|(leg, axes)| at_speed(leg, axes, limits)).collect();
    let mut direction = before.direction;
    if limits.stops_to_turn_back {
        direction = stop_to_turn_back(&mut durations, moves, direction, law);
    }
    if limits.polar {
        keep_accelerations(&mut durations, moves, before, law);
    }
    let last = match (moves.last(), durations.last()) {
        (Some(axes), Some(&duration)) => {
            let mut speeds = [0.0; MOST_AXES];
            for (speed, distance) in speeds.iter_mut().zip(axes) {
                *speed = distance / duration;
            }
            Pace { speeds, duration, direction }
        }
        _ => before,
    };
    (durations, last)
}

/// The least duration in which no axis exceeds its speed.
fn at_speed<const N: usize>(leg: &Leg, axes: &[f64; N], limits: &Limits) -> f64 {
    let fed = leg.filament.abs();
    let distance = if leg.path > 0.0 { leg.path } else { fed };
    let of_axis = |k: usize| axes[k].abs() / limits.axes[k].speed;
    let mut duration = (distance / leg.speed).max(fed / limits.extruder_speed).max(of_axis(LIFT));
    if limits.polar {
        duration = duration.max(of_axis(RAIL)).max(of_axis(BED));
        duration = (AXES..N).map(of_axis).fold(duration, f64::max);
    }
    duration.max(limits.least_duration)
}

/// Makes the moves on both sides of a reversal of the bed slow enough to end and to begin at rest, and
/// returns the direction in the end. Between them the drive takes up its play in a move of its own,
/// in which nothing else moves.
fn stop_to_turn_back<const N: usize>(
    durations: &mut [f64],
    moves: &[[f64; N]],
    before: f64,
    law: &Law<'_>,
) -> f64 {
    let mut direction = before;
    for i in 0..durations.len() {
        if moves[i][BED] * direction >= 0.0 {
            continue;
        }
        direction = -direction;
        // The last move of a run ends at rest anyhow.
        for k in i.saturating_sub(1)..=i {
            durations[k] = durations[k].max(from_rest(k, &moves[k], law));
        }
    }
    direction
}

/// The least duration of a move that begins or ends at rest.
fn from_rest<const N: usize>(leg: usize, axes: &[f64; N], law: &Law<'_>) -> f64 {
    let needed = |k: usize| slowed(axes[k], 0.0, 0.0, law.of(k, leg));
    (0..N).map(needed).fold(0.0, f64::max)
}

fn keep_accelerations<const N: usize>(
    durations: &mut [f64],
    moves: &[[f64; N]],
    before: Pace,
    law: &Law<'_>,
) {
    // Pairs of neighbours of which one changed since they were found to agree; most never change.
    let count = durations.len().saturating_sub(1);
    let mut open = Open::all(count);
    for _ in 0..MOST_PASSES {
        let mut changed = join_on(before, durations, moves, law);
        if changed && count > 0 {
            open.insert(0);
        }
        let mut place = 0;
        while let Some(i) = open.next(place) {
            changed |= look_again(i, &mut open, durations, moves, law);
            place = i + 1;
        }
        let rests = come_to_rest(durations, moves, law);
        if rests && count > 0 {
            open.insert(count - 1);
        }
        changed |= rests;
        let mut place = count;
        while let Some(i) = open.last_before(place) {
            changed |= look_again(i, &mut open, durations, moves, law);
            place = i;
        }
        if !changed {
            return;
        }
    }
}

/// Makes moves `i` and `i + 1` agree where need be; returns whether anything changed.
fn look_again<const N: usize>(
    i: usize,
    open: &mut Open,
    durations: &mut [f64],
    moves: &[[f64; N]],
    law: &Law<'_>,
) -> bool {
    let changed = agree(i, durations, moves, law);
    if changed {
        for neighbour in i.saturating_sub(1)..=(i + 1).min(open.count - 1) {
            open.insert(neighbour);
        }
    } else {
        open.remove(i);
    }
    changed
}

/// A set of numbers below a count; what is in it is found in words of 64.
struct Open {
    words: Vec<u64>,
    count: usize,
}

impl Open {
    /// All numbers.
    fn all(count: usize) -> Self {
        let mut words = vec![u64::MAX; count.div_ceil(64)];
        if let Some(last) = words.last_mut().filter(|_| !count.is_multiple_of(64)) {
            *last = (1 << (count % 64)) - 1;
        }
        Self { words, count }
    }

    fn insert(&mut self, number: usize) {
        self.words[number / 64] |= 1 << (number % 64);
    }

    fn remove(&mut self, number: usize) {
        self.words[number / 64] &= !(1 << (number % 64));
    }

    /// The least that is at least `from`.
    fn next(&self, from: usize) -> Option<usize> {
        let first = from / 64;
        let of_word = self.words.get(first)? & (u64::MAX << (from % 64));
        let after = || (first + 1..self.words.len()).find(|&k| self.words[k] != 0);
        let (k, word) =
            if of_word != 0 { (first, of_word) } else { after().map(|k| (k, self.words[k]))? };
        Some(64 * k + word.trailing_zeros() as usize)
    }

    /// The greatest below `end`.
    fn last_before(&self, end: usize) -> Option<usize> {
        let last = end.checked_sub(1)?;
        let of_word = self.words[last / 64] & (u64::MAX >> (63 - last % 64));
        let before = || (0..last / 64).rev().find(|&k| self.words[k] != 0);
        let (k, word) = if of_word != 0 {
            (last / 64, of_word)
        } else {
            before().map(|k| (k, self.words[k]))?
        };
        Some(64 * k + 63 - word.leading_zeros() as usize)
    }
}

/// Makes the first move agree with what ran before it, which can no longer change.
fn join_on<const N: usize>(
    before: Pace,
    durations: &mut [f64],
    moves: &[[f64; N]],
    law: &Law<'_>,
) -> bool {
    let (Some(duration), Some(axes)) = (durations.first_mut(), moves.first()) else {
        return false;
    };
    let mut changed = false;
    for (k, &distance) in axes.iter().enumerate() {
        let acceleration = law.of(k, 0);
        let excess = |duration: f64| {
            let between = f64::midpoint(before.duration, duration);
            (distance / duration - before.speeds[k]).abs() / (between * acceleration)
        };
        if excess(*duration) <= 1.0 + SLACK {
            continue;
        }
        *duration =
            slowed(distance, before.speeds[k], before.duration, acceleration).max(*duration);
        // Where the earlier move turned the other way or faster, only time helps.
        while excess(*duration) > 1.0 + SLACK {
            *duration *= 1.1;
        }
        changed = true;
    }
    changed
}

/// Makes the last move slow enough to be followed by anything: what comes next, often a retraction
/// that should be fast, can then keep its speed.
fn come_to_rest<const N: usize>(durations: &mut [f64], moves: &[[f64; N]], law: &Law<'_>) -> bool {
    let last = durations.len().saturating_sub(1);
    let (Some(duration), Some(axes)) = (durations.last_mut(), moves.last()) else {
        return false;
    };
    let needed = from_rest(last, axes, law);
    let changed = needed > *duration * (1.0 + SLACK);
    *duration = duration.max(needed);
    changed
}

/// Makes moves `i` and `i + 1` agree; returns whether anything changed.
fn agree<const N: usize>(
    i: usize,
    durations: &mut [f64],
    moves: &[[f64; N]],
    law: &Law<'_>,
) -> bool {
    let mut changed = false;
    let (here, next) = (moves[i], moves[i + 1]);
    for (k, (&here, next)) in here.iter().zip(next).enumerate() {
        let acceleration = law.between(k, i);
        let distances = [here, next];
        let between = f64::midpoint(durations[i], durations[i + 1]);
        // Both sides of `change of speed <= acceleration * time`, times both durations.
        let change = (distances[1] * durations[i] - distances[0] * durations[i + 1]).abs();
        let allowed = between * acceleration * durations[i] * durations[i + 1];
        if change <= allowed * (1.0 + SLACK) {
            continue;
        }
        changed = true;
        let speeds = [distances[0] / durations[i], distances[1] / durations[i + 1]];
        let faster = usize::from(speeds[1].abs() > speeds[0].abs());
        let slower = 1 - faster;
        let wanted = slowed(distances[faster], speeds[slower], durations[i + slower], acceleration);
        if distances[faster].abs() / wanted >= speeds[slower].abs() {
            durations[i + faster] = durations[i + faster].max(wanted);
        } else {
            // They run against each other: both give way alike.
            let stretch = (change / allowed).sqrt();
            durations[i] *= stretch;
            durations[i + 1] *= stretch;
        }
    }
    changed
}

/// The duration of a move of `distance` next to one at speed `other` for `other_duration`, in which
/// the speeds differ by just what the acceleration allows: the positive root of
/// `a/2·t² + (a/2·t₀ + v₀)·t − d = 0`, `v₀` positive where both run the same way.
fn slowed(distance: f64, other: f64, other_duration: f64, acceleration: f64) -> f64 {
    let along = other * distance.signum();
    let b = acceleration * other_duration / 2.0 + along;
    let root = (b * b + 2.0 * acceleration * distance.abs()).sqrt();
    (root - b) / acceleration
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resample::{ResampleParams, Resampler};
    use crate::route::Stroke;
    use crate::testing::printer;
    use nalgebra::Point3;

    #[test]
    fn open_pairs_are_found_in_both_directions() {
        for count in [0, 1, 63, 64, 65, 200] {
            let mut open = Open::all(count);
            let ahead = |open: &Open| -> Vec<usize> {
                std::iter::successors(open.next(0), |i| open.next(i + 1)).collect()
            };
            let back = |open: &Open| -> Vec<usize> {
                std::iter::successors(open.last_before(count), |i| open.last_before(*i)).collect()
            };
            assert_eq!(ahead(&open), (0..count).collect::<Vec<_>>());
            assert_eq!(back(&open), (0..count).rev().collect::<Vec<_>>());
            for i in (0..count).filter(|i| i % 7 != 3) {
                open.remove(i);
            }
            let left: Vec<usize> = (0..count).filter(|i| i % 7 == 3).collect();
            assert_eq!(ahead(&open), left);
            assert_eq!(back(&open), left.into_iter().rev().collect::<Vec<_>>());
        }
    }

    fn planned(points: &[[f64; 2]], speed: f64) -> (Vec<Leg>, Vec<Travel>, Vec<f64>) {
        let printer = printer();
        let params = ResampleParams {
            chord: 0.005,
            travel_chord: 0.1,
            dialect: machine::gcode::dialect::POLAR,
            azimuth: 0.0,
        };
        let mut resampler = Resampler::new(&printer, params);
        let start = resampler.joints();
        let strokes: Vec<Stroke> = points
            .iter()
            .enumerate()
            .map(|(i, p)| Stroke {
                kind: if i == 0 { Kind::Travel } else { Kind::Print },
                to: Point3::new(p[0], p[1], 5.0),
                filament: 0.0,
                speed,
                continues: false,
            })
            .collect();
        let legs: Vec<Leg> = resampler.legs(&strokes).unwrap().into_iter().flatten().collect();
        let travels = travels(&legs, start);
        let limits = Limits::of(&printer, Space::Joints);
        let (durations, _) = durations(&legs, &travels, Pace::REST, &limits);
        (legs, travels, durations)
    }

    fn check(legs: &[Leg], travels: &[Travel], durations: &[f64]) {
        let printer = printer();
        let limits = [
            (printer.rail.speed, printer.rail.acceleration),
            (printer.bed.speed, printer.bed.acceleration),
            (printer.lift.speed, printer.lift.acceleration),
            (f64::INFINITY, printer.path_acceleration),
        ];
        let moves: Vec<[f64; 4]> =
            legs.iter().zip(travels).map(|(leg, travel)| distances(leg, travel)).collect();
        for (k, (speed, acceleration)) in limits.into_iter().enumerate() {
            let mut before = (0.0, 0.0);
            for (axes, &duration) in moves.iter().zip(durations) {
                let now = axes[k] / duration;
                assert!(now.abs() <= speed, "axis {k}: {now} > {speed}");
                let change = (now - before.0).abs() / f64::midpoint(before.1, duration);
                assert!(change <= acceleration, "axis {k}: {change} > {acceleration}");
                before = (now, duration);
            }
        }
    }

    #[test]
    fn speed_and_acceleration_hold_everywhere() {
        let star: Vec<[f64; 2]> = (0..60)
            .map(|i| {
                let angle = f64::from(i) * 2.2;
                let radius = 0.3 + f64::from(i % 7) * 3.0;
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        let zigzag: Vec<[f64; 2]> = (0..80)
            .map(|i| [f64::from(i / 2) * 0.4 - 8.0, f64::from((i + 1) / 2 % 2) * 9.0 - 4.0])
            .collect();
        for points in [star, zigzag, vec![[-40.0, 0.1], [40.0, 0.1]], vec![[-9.0, 0.0], [9.0, 0.0]]]
        {
            let (legs, travels, durations) = planned(&points, 100.0);
            check(&legs, &travels, &durations);
        }
    }

    #[test]
    fn a_loose_drive_finds_everything_at_rest_where_the_bed_turns_back() {
        let zigzag: Vec<[f64; 2]> = (0..40)
            .map(|i| [30.0 + f64::from(i) * 0.5, f64::from((i + 1) / 2 % 2) * 9.0 - 4.0])
            .collect();
        let (legs, travels, _) = planned(&zigzag, 60.0);
        let mut printer = printer();
        printer.alignment.bed.backlash = 0.001;
        let limits = Limits::of(&printer, Space::Joints);
        let (durations, last) = durations(&legs, &travels, Pace::REST, &limits);
        check(&legs, &travels, &durations);
        let (mut direction, mut reversals) = (1.0, 0);
        for i in 0..travels.len() {
            if travels[i].axes[1] * direction < 0.0 {
                direction = -direction;
                reversals += 1;
                for k in i.saturating_sub(1)..=i {
                    let speed = travels[k].axes[0].abs() / durations[k];
                    let reached = printer.rail.acceleration * durations[k] / 2.0;
                    assert!(speed <= reached, "move {k}: {speed} > {reached}");
                }
            }
        }
        assert!(reversals > 15 && last.direction == direction);
    }

    /// Legs along the rail, by their way, lift and filament, with what they last.
    fn along_the_rail(legs: &[[f64; 3]], speed: f64) -> (Vec<Leg>, Vec<Travel>, Vec<f64>) {
        use machine::program::BedTurn;
        let mut to = Joints { s: 20.0, turn: BedTurn::default(), z: 1.0 };
        let start = to;
        let legs: Vec<Leg> = legs
            .iter()
            .map(|&[way, lift, filament]| {
                to = Joints { s: to.s + way, z: to.z + lift, ..to };
                let path = way.hypot(lift);
                let kind = if path > 0.0 { Kind::Print } else { Kind::Filament };
                Leg { kind, to, at: Point3::new(to.s, 0.0, to.z), filament, path, speed }
            })
            .collect();
        let travels = travels(&legs, start);
        let limits = Limits::of(&printer(), Space::Joints);
        let (durations, _) = durations(&legs, &travels, Pace::REST, &limits);
        (legs, travels, durations)
    }

    #[test]
    fn the_lift_is_sped_up_and_braked_as_it_can_be() {
        let hop = vec![[0.0, 0.2, 0.0], [30.0, 0.0, 0.0], [0.0, -0.2, 0.0]];
        let waves = (0..60).map(|i| [1.0, 0.3 * f64::from(i % 3 - 1), 0.03]).collect();
        for ways in [hop, waves] {
            let (legs, travels, durations) = along_the_rail(&ways, 100.0);
            check(&legs, &travels, &durations);
        }
    }

    #[test]
    fn the_nozzle_is_sped_up_and_braked_at_the_ends_of_a_line_only() {
        let ways = vec![[0.5, 0.0, 0.02]; 100];
        let (legs, travels, durations) = along_the_rail(&ways, 60.0);
        check(&legs, &travels, &durations);
        // 60 mm/s are reached within 1.2 mm.
        assert!(durations[5..95].iter().all(|duration| (duration - 0.5 / 60.0).abs() < 1e-9));
        assert!(durations[0] > 1.5 * durations[5] && durations[99] > 1.5 * durations[5]);
    }

    #[test]
    fn filament_is_fed_no_faster_than_its_gear_turns() {
        let printer = printer();
        let (_, _, durations) = along_the_rail(&[[0.0, 0.0, -3.0], [0.5, 0.0, 30.0]], 200.0);
        for (fed, duration) in [3.0, 30.0].iter().zip(&durations) {
            let speed = fed / duration;
            assert!(speed <= printer.extruder_speed && speed > 0.98 * printer.extruder_speed);
        }
    }

    #[test]
    fn far_from_the_axis_nothing_is_slowed() {
        let (legs, _, durations) = planned(&[[80.0, -20.0], [80.0, 20.0]], 40.0);
        let line: Vec<usize> = (0..legs.len()).filter(|&i| legs[i].kind == Kind::Print).collect();
        // But for the first and last moves, which start and stop.
        for &i in &line[3..line.len() - 3] {
            assert!((legs[i].path / durations[i] - 40.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_line_past_the_axis_is_slow_only_there() {
        let (legs, _, durations) = planned(&[[-40.0, 0.5], [40.0, 0.5]], 60.0);
        let total: f64 = legs
            .iter()
            .zip(&durations)
            .filter(|(leg, _)| leg.kind == Kind::Print)
            .map(|(_, duration)| duration)
            .sum();
        // 80 mm at 60 mm/s are 1.33 s, the half turn takes half a second; at one speed all along
        // it would be 25 s.
        assert!((1.6..2.2).contains(&total), "{total}");
    }
}
