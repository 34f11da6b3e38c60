//! How far whole steps of the motors put the nozzle off, over the bed.
//!
//! A carriage with a step of `ds` and a bed with a step of `dθ` bring the nozzle to the corners of a net
//! whose meshes at radius `r` are `ds × r·dθ`; what lies in the middle of a mesh is missed by
//! `½·hypot(ds, r·dθ)`. That is the disc on the left. On the right is what a program makes of it: of
//! every square of the bed the place that is missed by most, among the ends of lines that lay material.
//! Source of the formula: own derivation, see the calibration of a polar printer's centre, step
//! quantisation. mm.

use machine::gcode::decimal;
use machine::kinematics::Alignment;
use machine::program::{BedTurn, Joints, Role};
use nalgebra::{Point2, Vector2};

use super::palette::{INK, of_height};
use super::svg::{Canvas, Pen};
use crate::steps::program::{Step, joints_at};
use crate::steps::{Axes, Interval};

/// Squares from the middle of the bed to its rim.
const SQUARES: usize = 60;

/// The side of each of the two pictures, pixels.
const SIDE: f64 = 520.0;

/// Room around a disc, pixels.
const MARGIN: f64 = 20.0;

/// Room below, pixels.
const FOOT: f64 = 84.0;

/// Rings of the disc on the left.
const RINGS: u32 = 52;

/// Gathers how far a program's places are missed.
#[derive(Debug, Clone)]
pub struct StepMap {
    axes: Axes,
    alignment: Alignment,
    radius: f64,
    /// The worst of each square, µm; `None` where nothing is laid.
    squares: Vec<Option<f64>>,
    worst: f64,
    square_sum: f64,
    places: usize,
}

impl StepMap {
    /// Returns an empty map of a bed of this radius, mm.
    #[must_use]
    pub fn new(axes: Axes, alignment: Alignment, radius: f64) -> Self {
        let squares = vec![None; 4 * SQUARES * SQUARES];
        Self { axes, alignment, radius, squares, worst: 0.0, square_sum: 0.0, places: 0 }
    }

    /// Looks at a step of a program.
    pub fn add(&mut self, step: &Step) {
        let Some(segment) = &step.segment else { return };
        if !step.ends_line || !segment.extrudes() || segment.role == Role::Custom {
            return;
        }
        let off = self.off(&step.interval).norm();
        if !off.is_finite() {
            return;
        }
        self.worst = self.worst.max(off);
        self.square_sum += off * off;
        self.places += 1;
        if let Some(square) = self.square(&segment.part[1].xy()) {
            let worst = &mut self.squares[square];
            *worst = Some(worst.map_or(off, |worst| worst.max(off)));
        }
    }

    /// Returns the greatest distance of a place from where it should be, mm.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// Returns the root of the mean square of these distances, mm.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.square_sum / self.places.max(1) as f64).sqrt()
    }

    /// Returns how far a place at a distance from the axis can be missed, mm.
    #[must_use]
    pub fn bound(&self, radius: f64) -> f64 {
        0.5 * self.axes.steps[0].hypot(radius * self.axes.steps[1])
    }

    /// From where the nozzle should be to where it is, over the part.
    fn off(&self, interval: &Interval) -> Vector2<f64> {
        let count = std::array::from_fn(|k| interval.count[k] + interval.pulses[k]);
        let is = joints_at(&self.axes, count);
        let [s, turn, z, _] = interval.to;
        let wanted = Joints { s, turn: BedTurn::accumulated(turn), z };
        (self.alignment.part_from_joints(&is) - self.alignment.part_from_joints(&wanted)).xy()
    }

    fn square(&self, at: &Point2<f64>) -> Option<usize> {
        let index = |c: f64| {
            let index = ((c / self.radius + 1.0) * SQUARES as f64).floor();
            (0.0..2.0 * SQUARES as f64).contains(&index).then_some(index as usize)
        };
        Some(index(at.y)? * 2 * SQUARES + index(at.x)?)
    }

    /// Returns the picture.
    #[must_use]
    pub fn draw(&self) -> String {
        let most = self.bound(self.radius).max(f64::MIN_POSITIVE);
        let mut canvas = Canvas::new(2.0 * SIDE, SIDE + FOOT);
        let disc = SIDE / 2.0 - MARGIN;
        let ring = disc / f64::from(RINGS);
        for k in 0..RINGS {
            let middle = (f64::from(k) + 0.5) / f64::from(RINGS);
            let colour = of_height(self.bound(middle * self.radius) / most);
            // Neighbours overlap by a tenth, so that no gap shines through.
            let pen = Pen::new(colour, 1.1 * ring);
            canvas.circle(SIDE / 2.0, SIDE / 2.0, middle * disc, &pen);
        }
        let side = disc / SQUARES as f64;
        for (k, off) in self.squares.iter().enumerate() {
            let Some(off) = off else { continue };
            let (column, row) = (k % (2 * SQUARES), k / (2 * SQUARES));
            let x = SIDE + MARGIN + column as f64 * side;
            let y = SIDE - MARGIN - (row + 1) as f64 * side;
            canvas.cell([x, y], [side, side], of_height(off / most));
        }
        canvas.circle(1.5 * SIDE, SIDE / 2.0, disc, &Pen::new(INK, 1.0).faint(0.6));
        self.legend(&mut canvas, most);
        canvas.finish()
    }

    fn legend(&self, canvas: &mut Canvas, most: f64) {
        let um = |mm: f64| decimal(mm * 1e3, 1);
        let [rail, bed] = [0, 1].map(|k| self.axes.in_unit(k, self.axes.steps[k]));
        let text = format!(
            "possible: {} µm at the axis to {} µm at {} mm; steps {} mm and {}°",
            um(self.bound(0.0)),
            um(most),
            decimal(self.radius, 0),
            decimal(rail, 5),
            decimal(bed, 5)
        );
        canvas.label(MARGIN, SIDE + 20.0, 14.0, &text);
        let text =
            format!("this program: {} µm at most, {} µm rms", um(self.worst), um(self.rms()));
        canvas.label(SIDE + MARGIN, SIDE + 20.0, 14.0, &text);
        let parts = 60_u32;
        let width = 5.0;
        for k in 0..parts {
            let at = [MARGIN + f64::from(k) * width, SIDE + 36.0];
            canvas.cell(at, [width, 12.0], of_height(f64::from(k) / f64::from(parts - 1)));
        }
        canvas.label(MARGIN, SIDE + 66.0, 14.0, "0");
        let text = format!("{} µm", um(most));
        canvas.label(MARGIN + f64::from(parts) * width - 12.0, SIDE + 66.0, 14.0, &text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::printer;
    use crate::steps::program::Stepper;
    use machine::gcode::dialect::POLAR;

    #[test]
    fn no_place_is_missed_by_more_than_the_bound() {
        let axes = Axes {
            names: &["R", "theta", "Z", "E"],
            steps: [0.0125, 0.0225_f64.to_radians(), 0.0025, 0.01],
            turns: [false, true, false, false],
        };
        let mut map = StepMap::new(axes, Alignment::IDEAL, 120.0);
        let mut stepper = Stepper::new(&printer(), POLAR, axes).unwrap();
        stepper.line(b";TYPE:Perimeter", |_| {});
        let mut near: f64 = 0.0;
        for k in 0..2000 {
            let share = |step: f64| (f64::from(k) * step).fract();
            let text = format!(
                "G1 R{:.3} T{:.4} E0.1 F600",
                60.0 + share(0.618),
                360.0 * share(0.377_123)
            );
            stepper.line(text.as_bytes(), |step| {
                map.add(step);
                near = near.max(map.worst());
            });
        }
        let bound = map.bound(61.0);
        assert!((map.bound(0.0) - 0.00625).abs() < 1e-12);
        assert!(map.worst() <= bound && map.worst() > 0.9 * bound, "{} {bound}", map.worst());
        // Evenly spread errors have a root mean square of hypot/sqrt(12).
        let even = 2.0 * map.bound(60.5) / 12.0_f64.sqrt();
        assert!((map.rms() / even - 1.0).abs() < 0.05, "{} {even}", map.rms());
        let picture = map.draw();
        assert!(picture.contains("this program: ") && picture.ends_with("</svg>\n"));
    }
}
