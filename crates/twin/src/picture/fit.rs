//! How well a ring of magnets fits: where the sensor saw each magnet, and by how much that misses
//! its place, a hundred times enlarged.
//!
//! On the bed, x to the right, y upwards, the rotation axis in the middle.

use machine::calibration::fit::{Estimate, Fate, Fit, Judged};
use machine::gcode::decimal;

use super::palette::{AXIS, Colour, INK};
use super::svg::{Canvas, Pen};

/// The side of the square, pixels.
const SIDE: f64 = 700.0;

/// Room below it for words, pixels.
const FOOT: f64 = 96.0;

/// How much larger than the ring misses are drawn.
const ENLARGED: f64 = 100.0;

const GOOD: Colour = Colour([0x2a, 0x82, 0xb8]);
const REJECTED: Colour = Colour([0xe8, 0x6a, 0x33]);
const INNER: Colour = Colour([0x3f, 0xb6, 0x8b]);

/// Returns the picture.
#[must_use]
pub fn draw(fit: &Fit) -> String {
    let reach = fit.sightings.iter().map(|one| one.at.norm()).fold(1.0, f64::max) * 1.15;
    let scale = SIDE / (2.0 * reach);
    let pixel = |x: f64, y: f64| [SIDE / 2.0 + x * scale, SIDE / 2.0 - y * scale];
    let mut canvas = Canvas::new(SIDE, SIDE + FOOT);
    let [x, y] = pixel(0.0, 0.0);
    let axis = Pen::new(AXIS, 1.5);
    canvas.line([x - 9.0, y], [x + 9.0, y], &axis);
    canvas.line([x, y - 9.0], [x, y + 9.0], &axis);
    if let (Some([ex, ey]), Some(radius)) = (fit.centre, ring_radius(fit)) {
        let [cx, cy] = pixel(ex.value, ey.value);
        canvas.circle(cx, cy, radius * scale, &Pen::new(INK, 1.0).faint(0.6).dashed(4.0, 4.0));
        let cross = Pen::new(INK, 1.0);
        canvas.line([cx - 5.0, cy - 5.0], [cx + 5.0, cy + 5.0], &cross);
        canvas.line([cx - 5.0, cy + 5.0], [cx + 5.0, cy - 5.0], &cross);
    }
    for one in &fit.sightings {
        magnet(&mut canvas, one, &pixel, scale);
    }
    words(&mut canvas, fit);
    canvas.finish()
}

fn ring_radius(fit: &Fit) -> Option<f64> {
    let of_ring = fit.sightings.iter().find_map(|one| Some(one.at - one.miss?))?;
    let [ex, ey] = fit.centre?;
    Some((of_ring.x - ex.value).hypot(of_ring.y - ey.value))
}

fn magnet(canvas: &mut Canvas, one: &Judged, pixel: &dyn Fn(f64, f64) -> [f64; 2], scale: f64) {
    let [x, y] = pixel(one.at.x, one.at.y);
    match one.fate {
        Fate::Rejected => {
            let pen = Pen::new(REJECTED, 2.0);
            canvas.line([x - 7.0, y - 7.0], [x + 7.0, y + 7.0], &pen);
            canvas.line([x - 7.0, y + 7.0], [x + 7.0, y - 7.0], &pen);
        }
        Fate::Inner => canvas.circle(x, y, 6.0, &Pen::new(INNER, 2.0)),
        Fate::Ring(label) => {
            // Seen from beyond the axis: a second, larger circle.
            let radius = if one.seen.s < 0.0 { 8.0 } else { 5.0 };
            canvas.circle(x, y, radius, &Pen::new(GOOD, 1.5));
            if let Some(miss) = one.miss {
                let tip = [x + miss.x * scale * ENLARGED, y - miss.y * scale * ENLARGED];
                canvas.line([x, y], tip, &Pen::new(REJECTED, 1.5));
            }
            if one.seen.s > 0.0 {
                canvas.label(x + 10.0, y - 8.0, 11.0, &label.to_string());
            }
        }
    }
}

fn words(canvas: &mut Canvas, fit: &Fit) {
    let said = |name: &str, estimate: Option<Estimate>| {
        estimate.map_or_else(
            || format!("{name} not determined"),
            |e| format!("{name} {} ± {} mm", decimal(e.value, 4), decimal(e.sd, 4)),
        )
    };
    let lines = [
        format!("{},   {}", said("a", fit.a), said("b", fit.b)),
        format!(
            "{} of {} sightings used, rms {} mm, {}",
            fit.n_used(),
            fit.sightings.len(),
            decimal(fit.residual_rms, 4),
            fit.method()
        ),
        "blue: ring (large: from beyond the axis), green: inner magnets, crossed out: rejected"
            .to_owned(),
        "orange lines: what a magnet misses its place by, 100 times enlarged".to_owned(),
    ];
    for (k, line) in lines.iter().enumerate() {
        canvas.label(16.0, SIDE + 18.0 + 22.0 * k as f64, 14.0, line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::calibration::Sighting;
    use machine::calibration::fit::fit;
    use machine::calibration::known::Known;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn every_sighting_is_drawn_and_the_rejected_one_crossed_out() {
        let mut seen: Vec<Sighting> = (0..8)
            .flat_map(|k| {
                let theta = TAU * f64::from(k) / 8.0;
                [Sighting::new(100.0, theta), Sighting::new(-100.0, theta + PI)]
            })
            .collect();
        seen.push(Sighting::new(70.0, 1.0));
        let known = Known { magnets: Some(8), ring_radius: Some(100.0), ..Known::default() };
        let text = draw(&fit(&seen, &known).unwrap());
        // The ring and sixteen sightings.
        assert_eq!(text.matches("<ellipse").count(), 17);
        assert!(text.contains("16 of 17 sightings used"), "{text}");
        assert_eq!(text.matches("stroke-width=\"2\"").count(), 2);
    }
}
