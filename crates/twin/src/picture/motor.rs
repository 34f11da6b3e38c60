//! Currents, speed and angle of a stepper over time, one above the other.

use machine::gcode::decimal;

use super::palette::{AXIS, Colour, INK};
use super::svg::{Canvas, DECIMALS, PathData, Pen};
use crate::motor::turn::{Sample, Turned};

/// Size of a graph, pixels.
const GRAPH: [f64; 2] = [760.0, 180.0];

/// Left, between graphs and below, pixels.
const MARGIN: f64 = 64.0;

/// Colours of the phases, of what is measured, and of what is wanted.
const PHASES: [Colour; 2] = [Colour([0xe8, 0x6a, 0x33]), Colour([0x5b, 0x9b, 0xd0])];

/// A line of a graph: its colour, and what it shows.
type Trace<'a> = (Colour, &'a dyn Fn(&Sample) -> f64);

/// Returns the picture of a turn.
#[must_use]
pub fn motor_svg(turned: &Turned) -> String {
    let height = 3.0 * (GRAPH[1] + MARGIN) + MARGIN;
    let mut canvas = Canvas::new(GRAPH[0] + 2.0 * MARGIN, height);
    let end = turned.samples.last().map_or(0.0, |sample| sample.time);
    graph(
        &mut canvas,
        turned,
        0,
        "phase currents, A: a (orange) and b (blue)",
        &[
            (PHASES[0], &|sample| sample.state.currents[0]),
            (PHASES[1], &|sample| sample.state.currents[1]),
        ],
    );
    graph(
        &mut canvas,
        turned,
        1,
        "speed, °/s",
        &[(PHASES[1], &|sample| sample.state.speed.to_degrees())],
    );
    graph(
        &mut canvas,
        turned,
        2,
        "angle, °: wanted (red) and measured (blue)",
        &[
            (AXIS, &|sample| sample.wanted.to_degrees()),
            (PHASES[1], &|sample| sample.state.angle.to_degrees()),
        ],
    );
    let foot = height - MARGIN / 2.0;
    canvas.label(MARGIN, foot, 14.0, "0 s");
    canvas.label(MARGIN + GRAPH[0] - 40.0, foot, 14.0, &format!("{} s", decimal(end, 3)));
    let error = decimal(turned.error.to_degrees(), 4);
    canvas.label(MARGIN + 240.0, foot, 14.0, &format!("final error {error}°"));
    canvas.finish()
}

fn graph(canvas: &mut Canvas, turned: &Turned, row: u32, title: &str, traces: &[Trace<'_>]) {
    let top = MARGIN + f64::from(row) * (GRAPH[1] + MARGIN);
    let (mut low, mut high, mut end) = (0.0_f64, 0.0_f64, 0.0_f64);
    for sample in &turned.samples {
        end = end.max(sample.time);
        for (_, value) in traces {
            (low, high) = (low.min(value(sample)), high.max(value(sample)));
        }
    }
    let span = if high > low { high - low } else { 1.0 };
    let pixel = |time: f64, value: f64| {
        let x = MARGIN + if end > 0.0 { time / end * GRAPH[0] } else { 0.0 };
        [x, top + GRAPH[1] - (value - low) / span * GRAPH[1]]
    };
    let zero = pixel(0.0, 0.0);
    canvas.line(zero, [MARGIN + GRAPH[0], zero[1]], &Pen::new(INK, 1.0).faint(0.6));
    canvas.line([MARGIN, top], [MARGIN, top + GRAPH[1]], &Pen::new(INK, 1.0).faint(0.6));
    for (colour, value) in traces {
        let mut data = PathData::with_decimals(DECIMALS);
        for (k, sample) in turned.samples.iter().enumerate() {
            let [x, y] = pixel(sample.time, value(sample));
            if k == 0 { data.move_to(x, y) } else { data.line_to(x, y) }
        }
        canvas.path(&data, &Pen::new(*colour, 1.5));
    }
    canvas.label(MARGIN, top - 10.0, 14.0, title);
    for value in [low, high] {
        canvas.label(8.0, pixel(0.0, value)[1] + 5.0, 12.0, &decimal(value, 2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::Motor;
    use crate::motor::driver::Driver;
    use crate::motor::turn::{Task, turn};

    #[test]
    fn all_lines_are_drawn() {
        let task = Task {
            angle: 0.1,
            speed: 3.0,
            acceleration: 100.0,
            load: 0.0,
            settling: 0.02,
            is_closed: true,
        };
        let picture = motor_svg(&turn(&Motor::NEMA_17, &Driver::SOURCE, &task));
        assert!(picture.matches("<path").count() >= 5, "{picture}");
        assert!(picture.contains("final error") && !picture.contains("NaN"));
    }
}
