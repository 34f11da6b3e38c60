//! One turn from rest to rest, period by period of the driver's sawtooth.
//!
//! A profile of constant acceleration, constant speed and constant deceleration says where the rotor is
//! to be; STEP is given whenever the nearest microstep changes. With the loop closed a sensor on the
//! shaft is read every ms and what it lacks is added up, so that in the end the rotor is where it should
//! be in spite of load, friction and detent: to half a microstep and the sensor's own error.

use super::driver::{Driver, Regulator};
use super::{Motor, State};

/// What is turned, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Radians.
    pub angle: f64,
    /// Greatest speed, rad/s.
    pub speed: f64,
    /// rad/s².
    pub acceleration: f64,
    /// Torque against which it turns, N·m.
    pub load: f64,
    /// How long it is watched after the profile has ended, s.
    pub settling: f64,
    /// Whether the position is fed back.
    pub is_closed: bool,
}

/// A moment of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// s.
    pub time: f64,
    /// Where the rotor is to be, radians.
    pub wanted: f64,
    /// What it does.
    pub state: State,
}

/// What came of a turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Turned {
    /// Moments, evenly over time, at most [`MOST_SAMPLES`] of them.
    pub samples: Vec<Sample>,
    /// Mean angle over the last [`AT_REST`] s less the one wanted, radians.
    pub error: f64,
    /// Greatest distance from where the rotor was to be on the way, radians.
    pub worst: f64,
    /// Greatest current of a phase, A.
    pub peak_current: f64,
    /// Pulses on STEP, in either direction.
    pub pulses: u64,
}

/// Moments that are kept: more than a picture shows.
pub const MOST_SAMPLES: usize = 2400;

/// The end of a turn over which its angle is taken, s: some swings of the rotor.
pub const AT_REST: f64 = 0.01;

/// Time between readings of the sensor on the shaft, s.
const SENSED: f64 = 1e-3;

/// What is made up of a lack in a second, as a share of it. Slow against the swing of the rotor (about
/// 300 Hz), quick against the settling time.
const FEEDBACK: f64 = 60.0;

/// Longest step of the integration, s: a hundredth of the swing's period at most.
const LONGEST_STEP: f64 = 1e-5;

/// The place that the profile wants after `time`.
fn wanted(task: &Task, time: f64) -> f64 {
    let way = task.angle.abs();
    let speed = task.speed.min((way * task.acceleration).sqrt());
    let ramp = speed / task.acceleration;
    let whole = if speed > 0.0 { way / speed + ramp } else { 0.0 };
    let to_go = whole - time;
    let done = if to_go <= 0.0 {
        way
    } else if time < ramp {
        0.5 * task.acceleration * time * time
    } else if to_go < ramp {
        way - 0.5 * task.acceleration * to_go * to_go
    } else {
        speed * (time - 0.5 * ramp)
    };
    done * task.angle.signum()
}

/// Returns how long the profile takes, s.
#[must_use]
pub fn duration(task: &Task) -> f64 {
    let way = task.angle.abs();
    let speed = task.speed.min((way * task.acceleration).sqrt());
    if speed > 0.0 { way / speed + speed / task.acceleration } else { 0.0 }
}

/// Runs a turn from rest at zero.
#[must_use]
pub fn turn(motor: &Motor, driver: &Driver, task: &Task) -> Turned {
    let period = 1.0 / driver.frequency;
    let periods = ((duration(task) + task.settling) / period).ceil() as usize;
    let every = periods.div_ceil(MOST_SAMPLES).max(1);
    let microstep = driver.microstep(motor);
    let mut state = State { currents: driver.wanted(0), ..State::default() };
    let mut regulators = [Regulator::default(); 2];
    let mut turned =
        Turned { samples: Vec::new(), error: 0.0, worst: 0.0, peak_current: 0.0, pulses: 0 };
    let (mut count, mut added, mut sensed_at) = (0_i64, 0.0, 0.0);
    let (mut sum, mut summed) = (0.0, 0_u32);
    for k in 0..=periods {
        let time = k as f64 * period;
        let goal = wanted(task, time);
        if task.is_closed && time >= sensed_at {
            sensed_at += SENSED;
            added += FEEDBACK * SENSED * (goal - state.angle);
        }
        let next = ((goal + added) / microstep).round() as i64;
        turned.pulses += next.abs_diff(count);
        count = next;
        if k % every == 0 {
            turned.samples.push(Sample { time, wanted: goal, state });
        }
        turned.worst = turned.worst.max((state.angle - goal).abs());
        let peak = state.currents[0].abs().max(state.currents[1].abs());
        turned.peak_current = turned.peak_current.max(peak);
        if time >= periods as f64 * period - AT_REST {
            (sum, summed) = (sum + state.angle, summed + 1);
        }
        state = one_period(motor, driver, task.load, &mut regulators, count, &state);
    }
    turned.error = sum / f64::from(summed.max(1)) - task.angle;
    turned
}

/// One period of the sawtooth: each phase is on from its begin, for as long as its duty says.
fn one_period(
    motor: &Motor,
    driver: &Driver,
    load: f64,
    regulators: &mut [Regulator; 2],
    count: i64,
    state: &State,
) -> State {
    let period = 1.0 / driver.frequency;
    let wanted = driver.wanted(count);
    let duty = [0, 1].map(|k| regulators[k].duty(driver, motor, wanted[k], state.currents[k]));
    let mut ends = [duty[0].abs() * period, duty[1].abs() * period, period];
    ends.sort_by(f64::total_cmp);
    let mut state = *state;
    let mut begin = 0.0;
    for end in ends {
        let volts = duty.map(|duty| {
            let is_on = duty.abs() * period > begin;
            if is_on { driver.supply * duty.signum() } else { 0.0 }
        });
        let steps = ((end - begin) / LONGEST_STEP).ceil().max(1.0);
        for _ in 0..steps as u32 {
            state = state.after(motor, volts, load, (end - begin) / steps);
        }
        begin = end;
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    const TASK: Task = Task {
        angle: 10.0 * std::f64::consts::PI / 180.0,
        speed: 3.0,
        acceleration: 100.0,
        load: 0.0,
        settling: 0.1,
        is_closed: true,
    };

    #[test]
    fn ten_degrees_end_within_the_sources_error() {
        let turned = turn(&Motor::NEMA_17, &Driver::SOURCE, &TASK);
        assert!(turned.error.to_degrees().abs() < 0.02, "{}°", turned.error.to_degrees());
        assert!(turned.peak_current < 1.05 * 2.5, "{} A", turned.peak_current);
        assert!(turned.pulses >= 1422, "{}", turned.pulses);
        assert!(turned.samples.len() > 1000 && turned.samples.len() <= MOST_SAMPLES + 1);
    }

    #[test]
    fn a_closed_loop_makes_up_for_load_and_friction_and_an_open_one_does_not() {
        let motor = Motor { friction: 0.02, ..Motor::NEMA_17 };
        let task = Task { load: 0.1, settling: 0.25, ..TASK };
        let closed = turn(&motor, &Driver::SOURCE, &task).error.to_degrees();
        let open =
            turn(&motor, &Driver::SOURCE, &Task { is_closed: false, ..task }).error.to_degrees();
        assert!(closed.abs() < 0.02 && open.abs() > 0.1, "{closed}° {open}°");
    }

    #[test]
    fn a_load_turns_the_rotor_by_its_load_angle() {
        let motor = Motor { detent: 0.0, ..Motor::NEMA_17 };
        let task = Task { angle: 0.0, load: 0.2, settling: 0.2, is_closed: false, ..TASK };
        let turned = turn(&motor, &Driver::SOURCE, &task);
        let expected = -motor.load_angle(0.2, 2.5).unwrap();
        assert!((turned.error / expected - 1.0).abs() < 0.01, "{} {expected}", turned.error);
    }

    #[test]
    fn the_rotor_swings_at_its_resonance() {
        let motor = Motor { detent: 0.0, damping: 1e-4, ..Motor::NEMA_17 };
        let driver = Driver::SOURCE;
        // Off by a tenth of a degree, and let go.
        let mut state =
            State { currents: driver.wanted(0), angle: 0.1_f64.to_radians(), speed: 0.0 };
        let mut regulators = [Regulator::default(); 2];
        let (mut crossings, mut before) = (Vec::new(), state.angle);
        for k in 0..1500_u32 {
            state = one_period(&motor, &driver, 0.0, &mut regulators, 0, &state);
            if before > 0.0 && state.angle <= 0.0 {
                let share = before / (before - state.angle);
                crossings.push((f64::from(k) + share) / driver.frequency);
            }
            before = state.angle;
        }
        let swings = (crossings.len() - 1) as f64;
        let found = swings / (crossings[crossings.len() - 1] - crossings[0]);
        let expected = motor.resonance(2.5) / std::f64::consts::TAU;
        assert!((expected - 312.0).abs() < 1.0, "{expected}");
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
    }

    #[test]
    fn the_profile_begins_and_ends_where_it_should() {
        for angle in [10.0_f64, -10.0, 0.01, 720.0] {
            let task = Task { angle: angle.to_radians(), ..TASK };
            let end = duration(&task);
            assert!(wanted(&task, 0.0).abs() < 1e-12);
            assert!((wanted(&task, end) - task.angle).abs() < 1e-9);
            let half = wanted(&task, end / 2.0);
            assert!((half - task.angle / 2.0).abs() < 1e-9, "{angle}");
        }
        assert_eq!(duration(&Task { angle: 0.0, ..TASK }), 0.0);
    }
}
