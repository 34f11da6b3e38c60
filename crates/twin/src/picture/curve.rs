//! A bare curve on a sphere, from its upper pole and from the side.

use nalgebra::Point3;

use super::palette::{AXIS, Colour, INK};
use super::svg::{Canvas, DECIMALS, PathData, Pen};

/// Size of a view, pixels.
const VIEW: f64 = 420.0;

/// Around and between views, pixels.
const MARGIN: f64 = 40.0;

/// Colour of the curve.
const CURVE: Colour = Colour([0x2a, 0x82, 0xb8]);

/// How much is seen of what lies behind the sphere.
const BEHIND: f64 = 0.25;

/// Returns the picture of a curve on the sphere about the origin with this radius (mm); z points to the
/// upper pole.
#[must_use]
pub fn curve_svg(points: &[Point3<f64>], radius: f64, title: &str) -> String {
    let mut canvas = Canvas::new(2.0 * VIEW + 3.0 * MARGIN, VIEW + 3.0 * MARGIN);
    // Each view: right, up and towards the eye.
    type View = (&'static str, fn(&Point3<f64>) -> [f64; 3]);
    let views: [View; 2] =
        [("from above", |p| [p.x, p.y, p.z]), ("from the side, -y", |p| [p.x, p.z, -p.y])];
    for (k, (name, seen)) in views.into_iter().enumerate() {
        let centre = [MARGIN + VIEW / 2.0 + k as f64 * (VIEW + MARGIN), MARGIN + VIEW / 2.0];
        let scale = VIEW / 2.0 / radius;
        canvas.circle(centre[0], centre[1], VIEW / 2.0, &Pen::new(INK, 0.8));
        let at = |p: &Point3<f64>| {
            let [right, up, near] = seen(p);
            ([centre[0] + right * scale, centre[1] - up * scale], near)
        };
        let places: Vec<([f64; 2], f64)> = points.iter().map(at).collect();
        canvas.path(&half(&places, false), &Pen::new(CURVE, 1.0).faint(BEHIND));
        canvas.path(&half(&places, true), &Pen::new(CURVE, 1.0));
        canvas.label(centre[0] - VIEW / 2.0, VIEW + 1.75 * MARGIN, 14.0, name);
    }
    let side = MARGIN * 2.0 + VIEW * 1.5;
    canvas.line(
        [side, MARGIN * 0.5],
        [side, VIEW + MARGIN * 1.5],
        &Pen::new(AXIS, 0.8).dashed(6.0, 4.0),
    );
    canvas.label(MARGIN, VIEW + 2.5 * MARGIN, 14.0, title);
    canvas.finish()
}

/// The chords whose middle lies on this side.
fn half(places: &[([f64; 2], f64)], is_near: bool) -> PathData {
    let mut data = PathData::with_decimals(DECIMALS);
    let mut is_open = false;
    for pair in places.windows(2) {
        let ((from, near), (to, next)) = (pair[0], pair[1]);
        if (near + next >= 0.0) != is_near {
            is_open = false;
            continue;
        }
        if !is_open {
            data.move_to(from[0], from[1]);
        }
        data.line_to(to[0], to[1]);
        is_open = true;
    }
    data
}
