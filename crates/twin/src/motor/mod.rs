//! A two-phase hybrid stepper on a chopper driver.
//!
//! The rotor has `p` teeth; phases `a` and `b` lie a quarter of a tooth apart. With the rotor at `θ` and
//! its speed `ω`
//!
//! ```text
//! L·di_a/dt = v_a − R·i_a + K·ω·sin(pθ)        J·dω/dt = T − B·ω − friction − load
//! L·di_b/dt = v_b − R·i_b − K·ω·cos(pθ)        T = K·(i_b·cos(pθ) − i_a·sin(pθ)) − D·sin(4pθ)
//! ```
//!
//! Currents `I·cos(pφ)` and `I·sin(pφ)` give `T = K·I·sin(p(φ − θ))`: the rotor is held at `φ`, most
//! strongly a quarter of a tooth from it, with a stiffness of `p·K·I`, about which it swings at
//! `√(p·K·I/J)`. What holds against a load `T` stands off by the *load angle* `asin(T/(K·I))/p`.
//!
//! [`driver`] gives the voltages, [`turn`] runs both through a turn, [`lag`] is what the load angle makes
//! of a program. Sources: P. Acarnley, *Stepping Motors*, 4th ed., 2002, ch. 3 and 5; T. Kenjo and A.
//! Sugawara, *Stepping Motors and Their Microprocessor Controls*, 1994, ch. 4; the drive that is followed
//! is that of a thesis on the centring of a polar printer (Kharkiv National University of Radio
//! Electronics): 12 V, 2.5 A, 50 kHz, 10° of turn to within 0.02°.
//!
//! SI units and radians: V, A, Ω, H, N·m, kg·m², s.

pub mod driver;
pub mod lag;
pub mod turn;

/// The motor as facts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Teeth of the rotor; a full step is a quarter of one.
    pub teeth: f64,
    /// Of a phase, Ω.
    pub resistance: f64,
    /// Of a phase, H.
    pub inductance: f64,
    /// Torque for a current, N·m/A, which is also voltage for a speed, V·s.
    pub torque_constant: f64,
    /// Torque between magnets and teeth without current, N·m.
    pub detent: f64,
    /// Of the rotor and all that turns with it, kg·m².
    pub inertia: f64,
    /// Torque for a speed: bearings, iron and eddy currents, N·m·s.
    pub damping: f64,
    /// Dry friction, N·m.
    pub friction: f64,
}

impl Motor {
    /// A NEMA 17 motor of 40 mm, rated at 1.7 A in both phases with 0.40 N·m (data sheets of the type
    /// 17HS4401: 1.5 Ω, 2.8 mH, 54 g·cm², detent 22 mN·m). `K` is the rated torque over `√2·1.7 A`;
    /// damping is what makes it settle in some 10 ms, as such motors do unloaded.
    pub const NEMA_17: Self = Self {
        teeth: 50.0,
        resistance: 1.5,
        inductance: 2.8e-3,
        torque_constant: 0.166,
        detent: 0.022,
        inertia: 5.4e-6,
        damping: 1e-3,
        friction: 0.0,
    };

    /// Returns the torque on the rotor, before friction and load, N·m.
    #[must_use]
    pub fn torque(&self, angle: f64, currents: [f64; 2]) -> f64 {
        let (sin, cos) = (self.teeth * angle).sin_cos();
        let held = self.torque_constant * (currents[1] * cos - currents[0] * sin);
        held - self.detent * (4.0 * self.teeth * angle).sin()
    }

    /// Returns the most that the motor holds with this amplitude of its currents, N·m.
    #[must_use]
    pub fn holding_torque(&self, current: f64) -> f64 {
        self.torque_constant * current
    }

    /// Returns how far a load turns the rotor from where it is held, radians; `None` when the motor
    /// cannot hold it.
    #[must_use]
    pub fn load_angle(&self, torque: f64, current: f64) -> Option<f64> {
        let share = torque / self.holding_torque(current);
        (share.abs() <= 1.0).then(|| share.asin() / self.teeth)
    }

    /// Returns the circular frequency at which the rotor swings about where it is held, rad/s.
    #[must_use]
    pub fn resonance(&self, current: f64) -> f64 {
        (self.teeth * self.holding_torque(current) / self.inertia).sqrt()
    }

    /// Returns the time constant of a phase, s.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        self.inductance / self.resistance
    }

    /// Returns a full step, radians.
    #[must_use]
    pub fn full_step(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 / self.teeth
    }
}

/// Currents, speed and angle of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// A.
    pub currents: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// Radians.
    pub angle: f64,
}

/// Below this speed dry friction grows with the speed instead of jumping, rad/s: a hundredth of a
/// slow turn, so that a rotor at rest stays at rest.
const STICTION: f64 = 0.05;

impl State {
    fn plus(&self, rate: &Self, time: f64) -> Self {
        Self {
            currents: [0, 1].map(|k| self.currents[k] + rate.currents[k] * time),
            speed: self.speed + rate.speed * time,
            angle: self.angle + rate.angle * time,
        }
    }

    fn rate(&self, motor: &Motor, volts: [f64; 2], load: f64) -> Self {
        let (sin, cos) = (motor.teeth * self.angle).sin_cos();
        let [a, b] = self.currents;
        let back = motor.torque_constant * self.speed;
        let dry = motor.friction * (self.speed / STICTION).clamp(-1.0, 1.0);
        let torque = motor.torque(self.angle, self.currents) - motor.damping * self.speed;
        Self {
            currents: [
                (volts[0] - motor.resistance * a + back * sin) / motor.inductance,
                (volts[1] - motor.resistance * b - back * cos) / motor.inductance,
            ],
            speed: (torque - dry - load) / motor.inertia,
            angle: self.speed,
        }
    }

    /// Returns the state after `time` under constant voltages and a constant load, by one step of the
    /// classical Runge–Kutta method of fourth order.
    #[must_use]
    pub fn after(&self, motor: &Motor, volts: [f64; 2], load: f64, time: f64) -> Self {
        let first = self.rate(motor, volts, load);
        let second = self.plus(&first, time / 2.0).rate(motor, volts, load);
        let third = self.plus(&second, time / 2.0).rate(motor, volts, load);
        let fourth = self.plus(&third, time).rate(motor, volts, load);
        self.plus(&first, time / 6.0)
            .plus(&second, time / 3.0)
            .plus(&third, time / 3.0)
            .plus(&fourth, time / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_fills_with_its_time_constant() {
        // A rotor too heavy to move.
        let motor = Motor { inertia: 1e6, ..Motor::NEMA_17 };
        let mut state = State::default();
        let step = motor.time_constant() / 200.0;
        for _ in 0..200 {
            state = state.after(&motor, [12.0, 0.0], 0.0, step);
        }
        let share = state.currents[0] / (12.0 / motor.resistance);
        assert!((share - (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{share}");
        assert!((motor.time_constant() - 1.867e-3).abs() < 1e-6);
    }

    #[test]
    fn the_holding_torque_is_a_sine_of_four_steps() {
        let motor = Motor { detent: 0.0, ..Motor::NEMA_17 };
        for k in 0..64 {
            let off = f64::from(k) / 64.0 * 4.0 * motor.full_step();
            let at = 0.4;
            let currents = [(motor.teeth * at).cos(), (motor.teeth * at).sin()].map(|i| 2.5 * i);
            let expected = 0.415 * (motor.teeth * off).sin();
            assert!((motor.torque(at - off, currents) - expected).abs() < 1e-12, "{k}");
        }
        assert!((motor.holding_torque(2.5) - 0.415).abs() < 1e-12);
        // With both phases at the rated current it is the data sheet's.
        assert!((motor.holding_torque(1.7 * 2.0_f64.sqrt()) - 0.4).abs() < 2e-3);
        assert_eq!(motor.load_angle(0.42, 2.5), None);
        let quarter = motor.load_angle(0.415 * 0.5, 2.5).unwrap();
        assert!((quarter.to_degrees() - 30.0 / 50.0).abs() < 1e-9);
    }
}
