//! `rhumb calibrate scan`: the search on a machine, or on a simulated one.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use machine::calibration::fit::{Fit, fit};
use machine::calibration::known::Known;
use machine::calibration::log::{Log, Rows};
use machine::calibration::rig::{Rig, RigError};
use machine::calibration::scan::{Plan, ScanError, Stage, scan};
use machine::calibration::stepwise::{self, Steps};
use nalgebra::Vector2;
use twin::magnets::{Chance, Layout, Machine, SimulatedRig};

use super::fit::{draft, offset, report, status};
use super::serial::{self, SerialRig};
use crate::args::{CalibrateScan, Manner, Procedure};
use crate::commands::{say, settings, write_file};
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::progress::{Bars, Progress, Silent};
use crate::settings::Job;

/// Steps of the bar of a stage.
const BAR: u64 = 100;

pub(super) fn run(arguments: &CalibrateScan, manner: &Manner) -> Result<u8, Failure> {
    let interrupt = Interrupt::on_signals();
    let (_, job) = settings(&arguments.settings)?;
    let offset = offset(arguments.pins.as_ref())?;
    let plan = plan(arguments, &job)?;
    let mut bars = Bars::default();
    let mut silent = Silent;
    let progress: &mut dyn Progress = if manner.quiet { &mut silent } else { &mut bars };
    let (fit, log) = match (&arguments.port, arguments.simulate) {
        (Some(port), _) => {
            let speech = speech(arguments, &job)?;
            let mut rig = SerialRig::open(port, arguments.baud, speech, interrupt.clone())?;
            search(&mut rig, &plan, arguments, progress, &interrupt)?
        }
        (None, Some(seed)) => {
            let mut rig = SimulatedRig::new(simulated(&plan, seed), seed);
            let found = search(&mut rig, &plan, arguments, progress, &interrupt)?;
            if !manner.quiet && !manner.json {
                say(&truth(&plan, seed, &rig))?;
            }
            found
        }
        (None, None) => {
            return Err(Failure::new("Usage", "neither --port nor --simulate is given"));
        }
    };
    drop(bars);
    if let Some(path) = &arguments.log {
        write_file(path, &[], written(&log).as_bytes())?;
    }
    let target = arguments.output.clone().unwrap_or_else(|| PathBuf::from("calibration.toml"));
    draft(&fit, offset).write(&target, &[])?;
    if let Some(path) = &arguments.picture {
        write_file(path, &[], twin::picture::fit::draw(&fit).as_bytes())?;
    }
    if target != Path::new("-") {
        report(&fit, &target, manner)?;
    }
    Ok(status(&fit))
}

fn plan(arguments: &CalibrateScan, job: &Job) -> Result<Plan, Failure> {
    let is_length = |mm: f64| (1.0..=2000.0).contains(&mm);
    if !is_length(arguments.ring_radius) || !arguments.inner_radius.is_none_or(is_length) {
        return Err(Failure::new("Usage", "a radius is out of range"));
    }
    let known = Known {
        ring_radius: Some(arguments.ring_radius),
        magnets: Some(u32::from(arguments.magnets)),
        inner_radius: arguments.inner_radius,
        ..Known::default()
    };
    Ok(Plan { rail: [job.printer.rail.min, job.printer.rail.max], known })
}

fn speech(arguments: &CalibrateScan, job: &Job) -> Result<serial::Manner, Failure> {
    let letters = match job.dialect.name {
        "polar" => ['R', 'T'],
        "rrf-direct" => ['X', 'C'],
        other => {
            return Err(Failure::new(
                "ConfigConflict",
                format!("{other} has no words for carriage and bed alone"),
            )
            .hint("choose --dialect polar (R, T) or rrf-direct (X, C) for the scan"));
        }
    };
    let in_range = |value: f64, most: f64| 0.1 <= value && value <= most;
    if !in_range(arguments.timeout, 3600.0) || !in_range(arguments.speed, 3600.0) {
        return Err(Failure::new("Usage", "--timeout or --speed is out of range"));
    }
    Ok(serial::Manner {
        letters,
        is_reversed: job.printer.alignment.bed.is_reversed,
        rail_speed: job.printer.rail.speed.min(100.0),
        bed_speed: arguments.speed.to_radians().min(job.printer.bed.speed),
        park: job.printer.rail.max,
        patience: Duration::from_secs_f64(arguments.timeout),
    })
}

/// Searches by the procedure that was asked for.
fn search(
    rig: &mut dyn Rig,
    plan: &Plan,
    arguments: &CalibrateScan,
    progress: &mut dyn Progress,
    interrupt: &Interrupt,
) -> Result<(Fit, Log), Failure> {
    let mut last = None;
    let mut done = 0;
    let mut watch = |stage: Stage, share: f64| {
        if last != Some(stage) {
            (last, done) = (Some(stage), 0);
            progress.stage(name(stage), BAR);
        }
        let now = (share.clamp(0.0, 1.0) * BAR as f64) as u64;
        progress.advance(now.saturating_sub(done));
        done = done.max(now);
        interrupt.check().is_ok()
    };
    match arguments.procedure {
        Procedure::Fast => {
            let found = scan(rig, plan, &mut watch).map_err(|error| failed(&error))?;
            Ok((found.fit, found.log))
        }
        Procedure::Stepwise => {
            let steps = Steps {
                rail: arguments.rail_step,
                bed: arguments.bed_step.to_radians(),
                fires_at: arguments.fires_at,
            };
            if !(steps.rail >= 0.001 && steps.bed >= 1e-5 && steps.rail < 10.0 && steps.bed < 0.1) {
                return Err(Failure::new("Usage", "--rail-step or --bed-step is out of range"));
            }
            let seen = stepwise::search(rig, plan, &steps, &mut watch).map_err(|e| failed(&e))?;
            let found = fit(&seen, &plan.known).map_err(|error| failed(&error.into()))?;
            Ok((found, Log { known: plan.known, rows: Rows::Peaks(seen) }))
        }
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Home => "home",
        Stage::Search => "search",
        Stage::Near => "near",
        Stage::Inner => "inner",
        Stage::Far => "far",
        Stage::Verify => "verify",
    }
}

fn failed(error: &ScanError) -> Failure {
    let class = match error {
        ScanError::Rig(RigError::Stopped) => "Interrupted",
        ScanError::Rig(RigError::Silent(_) | RigError::Gone(_) | RigError::Garbled(..)) => {
            "PrinterSilent"
        }
        _ => "ScanFailed",
    };
    let failure = Failure::new(class, format!("{error}; nothing was written"));
    match error {
        ScanError::NoMagnet { .. } => failure.hint("check --ring-radius, the gap and the sensor"),
        ScanError::StuckSensor { .. } => failure.hint("check the sensor's threshold and its wires"),
        ScanError::OneSided => failure.hint(
            "the rail must pass the axis: let it reach the ring's far side, or put a magnet at \
             10 to 30 mm from the axis and give --inner-radius",
        ),
        ScanError::RailTooFar { .. } => failure.hint("shim the rail so that it passes the axis"),
        ScanError::NotVerified { .. } => failure.hint("something slips: check belts and couplings"),
        _ => failure,
    }
}

/// A random machine with all that the plan needs.
fn simulated(plan: &Plan, seed: u64) -> Machine {
    let mut chance = Chance::new(seed);
    let (a, b) = (chance.uniform(-1.0, 1.0), chance.uniform(-1.0, 1.0));
    let inner = plan.known.inner_radius;
    let layout = Layout {
        count: plan.known.magnets.unwrap_or(16),
        radius: plan.known.ring_radius.unwrap_or(100.0),
        centre: Vector2::new(chance.uniform(-1.0, 1.0), chance.uniform(-1.0, 1.0)),
        angle: chance.uniform(-0.1, 0.1),
        missing: Vec::new(),
        others: inner.into_iter().flat_map(|r| [[r, 0.3], [r, 1.9]]).collect(),
        placement: 0.05,
    };
    Machine { a, b, magnets: layout.magnets(&mut chance), ..Machine::default() }
}

fn truth(plan: &Plan, seed: u64, rig: &SimulatedRig) -> String {
    let machine = simulated(plan, seed);
    format!(
        "simulated machine {seed}: really a {:.4} mm for a carriage that comes from outside, \
         b {:.4} mm; {} moves in {:.0} s\n",
        machine.a + machine.rail_play / 2.0,
        machine.b,
        rig.n_moves(),
        rig.time()
    )
}

/// The log as a file.
fn written(log: &Log) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    if let (Some(radius), Some(count)) = (log.known.ring_radius, log.known.magnets) {
        let _ = writeln!(text, "# ring_radius_mm = {radius}\n# magnets = {count}");
    }
    match &log.rows {
        Rows::Peaks(peaks) => {
            text.push_str("s_mm,theta_deg\n");
            for seen in peaks {
                let _ = writeln!(text, "{:.5},{:.6}", seen.s, seen.theta.to_degrees());
            }
        }
        Rows::Edges(edges) => {
            text.push_str("s_mm,theta_deg,edge,direction\n");
            for edge in edges {
                let state = if edge.is_on { "on" } else { "off" };
                let (s, theta_deg) = (edge.s, edge.theta.to_degrees());
                let _ = writeln!(text, "{s:.5},{theta_deg:.6},{state},{}", edge.direction.word());
            }
        }
        Rows::Samples(samples) => {
            text.push_str("s_mm,theta_deg,level\n");
            for sample in samples {
                let (s, theta_deg) = (sample.s, sample.theta.to_degrees());
                let _ = writeln!(text, "{s:.5},{theta_deg:.6},{}", sample.level);
            }
        }
    }
    text
}
