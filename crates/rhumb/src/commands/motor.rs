//! `rhumb motor`: one turn of a stepper on its driver.

use std::fmt::Write as _;

use twin::motor::Motor;
use twin::motor::driver::Driver;
use twin::motor::turn::{Task, Turned, duration, turn};
use twin::picture::motor::motor_svg;

use super::{DONE, say, say_json, write_file};
use crate::args::{Manner, MotorTurn};
use crate::failure::Failure;

/// Most periods of the driver that a turn may take: some seconds of work.
const MOST_PERIODS: f64 = 2e7;

pub(super) fn run(arguments: &MotorTurn, manner: &Manner) -> Result<u8, Failure> {
    let (motor, driver, task) = parts(arguments)?;
    if let Some(path) = &arguments.output
        && path.extension().is_none_or(|extension| extension != "svg")
    {
        let what = format!("{} does not end in .svg", path.display());
        return Err(Failure::new("Usage", what).hint("the picture is written as SVG"));
    }
    let turned = turn(&motor, &driver, &task);
    if let Some(path) = &arguments.output {
        write_file(path, &[], motor_svg(&turned).as_bytes())?;
    }
    tell(&motor, &driver, &task, &turned, manner)?;
    Ok(DONE)
}

fn parts(arguments: &MotorTurn) -> Result<(Motor, Driver, Task), Failure> {
    let positive = [
        ("--speed", arguments.speed),
        ("--acceleration", arguments.acceleration),
        ("--supply", arguments.supply),
        ("--current", arguments.current),
        ("--pwm", arguments.pwm),
        ("--settling", arguments.settling),
    ];
    let usage = |what: String| Failure::new("Usage", what);
    for (name, value) in positive {
        if !(value.is_finite() && value > 0.0) {
            return Err(usage(format!("{name} {value} is not above 0")));
        }
    }
    for (name, value) in [("--inertia", arguments.inertia), ("--friction", arguments.friction)] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(usage(format!("{name} {value} is below 0")));
        }
    }
    if !(arguments.angle.is_finite() && arguments.load.is_finite()) {
        return Err(usage("--angle and --load must be numbers".into()));
    }
    let motor = Motor {
        inertia: Motor::NEMA_17.inertia + arguments.inertia,
        friction: arguments.friction,
        ..Motor::NEMA_17
    };
    let driver = Driver {
        supply: arguments.supply,
        current: arguments.current,
        frequency: arguments.pwm,
        microsteps: arguments.microsteps,
    };
    let task = Task {
        angle: arguments.angle.to_radians(),
        speed: arguments.speed.to_radians(),
        acceleration: arguments.acceleration.to_radians(),
        load: arguments.load,
        settling: arguments.settling,
        is_closed: !arguments.open_loop,
    };
    let periods = (duration(&task) + task.settling) * driver.frequency;
    if periods > MOST_PERIODS {
        return Err(Failure::new(
            "LimitExceeded",
            format!("the turn takes {periods:.0} periods of the driver, at most {MOST_PERIODS:.0}"),
        )
        .hint("turn faster or less"));
    }
    Ok((motor, driver, task))
}

fn tell(
    motor: &Motor,
    driver: &Driver,
    task: &Task,
    turned: &Turned,
    manner: &Manner,
) -> Result<(), Failure> {
    let load_angle = motor.load_angle(task.load, driver.current);
    let hertz = motor.resonance(driver.current) / std::f64::consts::TAU;
    if manner.json {
        return say_json(&serde_json::json!({
            "angle_deg": task.angle.to_degrees(),
            "final_error_deg": turned.error.to_degrees(),
            "worst_error_deg": turned.worst.to_degrees(),
            "peak_current_a": turned.peak_current,
            "pulses": turned.pulses,
            "profile_s": duration(task),
            "time_constant_s": motor.time_constant(),
            "holding_torque_nm": motor.holding_torque(driver.current),
            "resonance_hz": hertz,
            "load_angle_deg": load_angle.map(f64::to_degrees),
        }));
    }
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "turned by {}°: final error {:.4}°, on the way {:.3}° at most; {} pulses, {:.2} A at most",
        task.angle.to_degrees(),
        turned.error.to_degrees(),
        turned.worst.to_degrees(),
        turned.pulses,
        turned.peak_current
    );
    let _ = writeln!(
        out,
        "motor: time constant {:.2} ms, holds {:.3} N·m, resonance {hertz:.0} Hz{}",
        motor.time_constant() * 1e3,
        motor.holding_torque(driver.current),
        load_angle.map_or_else(
            || ", cannot hold this load".to_owned(),
            |angle| format!(", load angle {:.3}°", angle.to_degrees())
        )
    );
    say(&out)
}
