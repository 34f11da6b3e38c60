//! A driver with STEP and DIR: microsteps in, voltages out.
//!
//! A count of microsteps is an angle `φ`, which asks for `I·cos(pφ)` and `I·sin(pφ)`. At the begin of
//! each period of a sawtooth the current of a phase is compared with what is asked for; a proportional
//! and integral regulator makes a voltage of the difference, and the bridge gives the whole supply, with
//! the sign of that voltage, for as long as the sawtooth lies below it, and nothing (the coil's ends
//! joined) for the rest. A relay keeps the bridge from driving a current farther beyond the limit.
//!
//! The regulator is set by the usual rule that its zero cancels the coil's pole: `k_p = L·ω_c`,
//! `k_i = R·ω_c` with a crossover `ω_c` of a tenth of the sawtooth's frequency.

use std::f64::consts::TAU;

use super::Motor;

/// The driver as facts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Driver {
    /// Supply, V.
    pub supply: f64,
    /// Amplitude of the currents, which is their limit, A.
    pub current: f64,
    /// Of the sawtooth, Hz.
    pub frequency: f64,
    /// Microsteps in a full step.
    pub microsteps: u32,
}

impl Driver {
    /// The source's: 12 V, 2.5 A, 50 kHz. Its microsteps are those to which common drivers
    /// interpolate.
    pub const SOURCE: Self = Self { supply: 12.0, current: 2.5, frequency: 5e4, microsteps: 256 };

    /// Returns a microstep, radians.
    #[must_use]
    pub fn microstep(&self, motor: &Motor) -> f64 {
        motor.full_step() / f64::from(self.microsteps)
    }

    /// Returns the currents that a count of microsteps asks for, A.
    #[must_use]
    pub fn wanted(&self, count: i64) -> [f64; 2] {
        // A turn of the currents is four full steps; the count is reduced first, so that it loses no
        // digits after many turns.
        let period = 4 * i64::from(self.microsteps);
        let phase = count.rem_euclid(period) as f64 / period as f64 * TAU;
        let (sin, cos) = phase.sin_cos();
        [self.current * cos, self.current * sin]
    }
}

/// Crossover of the current regulator, as a share of the sawtooth's circular frequency.
const CROSSOVER: f64 = 0.1;

/// How far beyond its limit a current may be before the relay opens, as a share.
const RELAY: f64 = 0.02;

/// The regulator of one phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Regulator {
    /// V.
    integral: f64,
}

impl Regulator {
    /// Returns the share of a period for which the bridge is on, with the sign of its voltage.
    pub fn duty(&mut self, driver: &Driver, motor: &Motor, wanted: f64, current: f64) -> f64 {
        let crossover = CROSSOVER * TAU * driver.frequency;
        let error = wanted - current;
        let volts = motor.inductance * crossover * error + self.integral;
        let duty = (volts / driver.supply).clamp(-1.0, 1.0);
        // While the bridge gives all it has, what it lacks must not add up.
        if duty.abs() < 1.0 {
            self.integral += motor.resistance * crossover * error / driver.frequency;
        }
        let is_beyond = current.abs() > (1.0 + RELAY) * driver.current;
        if is_beyond && duty * current > 0.0 { 0.0 } else { duty }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::State;

    #[test]
    fn currents_follow_the_microsteps() {
        let driver = Driver::SOURCE;
        for (count, wanted) in
            [(0, [2.5, 0.0]), (256, [0.0, 2.5]), (512, [-2.5, 0.0]), (-256, [0.0, -2.5])]
        {
            let is = driver.wanted(count);
            assert!((is[0] - wanted[0]).abs() < 1e-12 && (is[1] - wanted[1]).abs() < 1e-12);
        }
        assert_eq!(driver.wanted(1 << 40), driver.wanted(0));
    }

    #[test]
    fn a_regulated_current_settles_with_little_ripple() {
        let (driver, motor) = (Driver::SOURCE, Motor { inertia: 1e6, ..Motor::NEMA_17 });
        let (mut regulator, mut state) = (Regulator::default(), State::default());
        let period = 1.0 / driver.frequency;
        let (mut least, mut most, mut peak) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for k in 0..1000 {
            let duty = regulator.duty(&driver, &motor, 2.0, state.currents[0]);
            for (volts, time) in
                [(driver.supply * duty.signum(), duty.abs()), (0.0, 1.0 - duty.abs())]
            {
                state = state.after(&motor, [volts, 0.0], 0.0, time * period);
                peak = peak.max(state.currents[0]);
                if k >= 500 {
                    (least, most) = (least.min(state.currents[0]), most.max(state.currents[0]));
                }
            }
        }
        // On for R·I/V of a period: the ripple is (V − R·I)·duty·period/L.
        let ripple = (12.0 - 3.0) * (3.0 / 12.0) * period / motor.inductance;
        assert!(((most - least) / ripple - 1.0).abs() < 0.05, "{least} {most} {ripple}");
        assert!((least - 2.0).abs() < 2.0 * ripple && peak < 2.1, "{least} {peak}");
    }
}
