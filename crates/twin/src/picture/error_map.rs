//! What a print would miss on a machine whose misalignment is not allowed for.
//!
//! Each arrow goes from where the nozzle should be to where it would be, enlarged so that the
//! longest are as long as the arrows are apart; colour is length. Seen from above, x to the right.

use machine::gcode::decimal;
use machine::kinematics::{Alignment, Branch};
use machine::program::BedTurn;
use nalgebra::{Point2, Point3, Vector2};

use super::palette::{AXIS, INK, of_height};
use super::svg::{Canvas, Pen};

/// The side of the square, pixels.
const SIDE: f64 = 700.0;

/// Room below it, pixels.
const FOOT: f64 = 52.0;

/// Arrows from the middle to the rim.
const ARROWS: i32 = 9;

/// What would be missed, over a round bed.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// Where, and by how much, mm.
    pub at: Vec<(Point2<f64>, Vector2<f64>)>,
    /// The largest, mm.
    pub most: f64,
    /// Root of the mean square, mm.
    pub rms: f64,
}

/// Returns what a machine with this misalignment misses when it is driven as if it were ideal,
/// over a bed of this radius, mm. The axis itself, where the bed could stand anyhow, is left out.
#[must_use]
pub fn errors(alignment: &Alignment, radius: f64) -> Errors {
    let ideal = Alignment { bed: alignment.bed, ..Alignment::IDEAL };
    let mut at = Vec::new();
    for row in -ARROWS..=ARROWS {
        for column in -ARROWS..=ARROWS {
            let place =
                Point2::new(f64::from(column), f64::from(row)) * (radius / f64::from(ARROWS));
            if place.coords.norm() > radius || place == Point2::origin() {
                continue;
            }
            let wanted = Point3::new(place.x, place.y, 0.0);
            if let Ok(joints) = ideal.joints_from_part(&wanted, Branch::Near, BedTurn::default()) {
                at.push((place, (alignment.part_from_joints(&joints) - wanted).xy()));
            }
        }
    }
    let most = at.iter().map(|(_, error)| error.norm()).fold(0.0, f64::max);
    let square: f64 = at.iter().map(|(_, error)| error.norm_squared()).sum();
    let rms = (square / at.len().max(1) as f64).sqrt();
    Errors { at, most, rms }
}

/// Returns the picture of them.
#[must_use]
pub fn draw(errors: &Errors, radius: f64) -> String {
    let scale = 0.45 * SIDE / radius;
    let pixel = |p: Point2<f64>| [SIDE / 2.0 + p.x * scale, SIDE / 2.0 - p.y * scale];
    let mut canvas = Canvas::new(SIDE, SIDE + FOOT);
    let [x, y] = pixel(Point2::origin());
    canvas.circle(x, y, radius * scale, &Pen::new(INK, 1.0).faint(0.6));
    canvas.circle(x, y, 3.0, &Pen::new(AXIS, 1.5));
    let enlarged =
        if errors.most > 0.0 { 0.9 * radius / f64::from(ARROWS) / errors.most } else { 0.0 };
    for (place, error) in &errors.at {
        let share = if errors.most > 0.0 { error.norm() / errors.most } else { 0.0 };
        let pen = Pen::new(of_height(share), 1.5);
        canvas.line(pixel(*place), pixel(place + error * enlarged), &pen);
        let [x, y] = pixel(*place);
        canvas.circle(x, y, 1.5, &pen);
    }
    let text = format!(
        "missed without the calibration: {} mm at most, {} mm rms; arrows enlarged {} times",
        decimal(errors.most, 3),
        decimal(errors.rms, 3),
        decimal(enlarged, 0)
    );
    canvas.label(16.0, SIDE + 20.0, 14.0, &text);
    let text =
        format!("dots: where the nozzle should be, on a bed of {} mm radius", decimal(radius, 0));
    canvas.label(16.0, SIDE + 42.0, 14.0, &text);
    canvas.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rail_off_the_axis_misses_by_as_much_everywhere() {
        let found = errors(&Alignment { b: 0.5, ..Alignment::IDEAL }, 80.0);
        assert!(found.at.len() > 200);
        assert!((found.most - 0.5).abs() < 1e-12 && (found.rms - 0.5).abs() < 1e-12);
        let text = draw(&found, 80.0);
        assert!(text.contains("0.5 mm at most"), "{text}");
        assert!(errors(&Alignment::IDEAL, 80.0).most < 1e-12);
    }
}
