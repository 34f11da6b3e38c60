//! A lens: how near its face comes to the sphere that it stands for.

use crate::program::{Motion, motions};
use crate::run::{say, sliced};

/// Radius of the face, radius of the lens, and its height on the axis, mm.
const CURVATURE: f64 = 60.0;
const RADIUS: f64 = 20.0;
const RIM: f64 = 1.0;

/// Height of the centre of the face.
fn centre() -> f64 {
    RIM - (CURVATURE * CURVATURE - RADIUS * RADIUS).sqrt()
}

/// What the upper side of a bead follows beside where the tip ran.
#[derive(Clone, Copy)]
enum Family {
    Planar,
    Conical(f64),
    Spherical,
}

impl Family {
    /// The height over `r` of the layer through a tip.
    fn height(self, [x, y, z]: [f64; 3], r: f64) -> f64 {
        let at = x.hypot(y);
        match self {
            Self::Planar => z,
            Self::Conical(slope) => z + slope * (at - r),
            Self::Spherical => {
                let square = at * at + (z - centre()).powi(2);
                centre() + (square - r * r).sqrt()
            }
        }
    }
}

/// Side of the cells of the table below, mm.
const CELL: f64 = 0.5;

/// Cells from the axis to the end of the table.
const CELLS: usize = 50;

/// The greatest and the mean square distance of what was laid from the face, mm, within `radius`.
fn errors(text: &str, family: Family, radius: f64) -> (f64, f64) {
    let motions = motions(text);
    let mut table = vec![Vec::new(); 4 * CELLS * CELLS];
    let cell = |c: f64| ((c / CELL).floor() + CELLS as f64) as usize;
    for motion in motions.iter().filter(|m| m.lays() && m.role != "Skirt/Brim") {
        let pieces = (motion.path() / 0.05).ceil().max(1.0) as u32;
        for k in 0..=pieces {
            let at = motion.at(f64::from(k) / f64::from(pieces));
            if at[0].hypot(at[1]) < RADIUS + 2.0 {
                table[cell(at[1]) * 2 * CELLS + cell(at[0])].push((at, motion.width / 2.0));
            }
        }
    }
    let (mut greatest, mut sum, mut count): (f64, f64, u32) = (0.0, 0.0, 0);
    for k in 0..4000_u32 {
        let (r, angle) = (radius * (f64::from(k) / 4000.0).sqrt(), f64::from(k) * 2.4);
        let (x, y) = (r * angle.cos(), r * angle.sin());
        let near = (cell(y) - 1..=cell(y) + 1)
            .flat_map(|row| (cell(x) - 1..=cell(x) + 1).map(move |column| row * 2 * CELLS + column))
            .flat_map(|place| &table[place]);
        let top = near
            .filter(|(at, half)| (at[0] - x).hypot(at[1] - y) <= *half)
            .map(|(at, _)| family.height(*at, r))
            .fold(f64::NEG_INFINITY, f64::max);
        let out = r.hypot(top - centre()) - CURVATURE;
        assert!(out.is_finite(), "nothing was laid at {x} {y}");
        greatest = greatest.max(out.abs());
        sum += out * out;
        count += 1;
    }
    (greatest, (sum / f64::from(count)).sqrt())
}

fn spherical() -> Vec<String> {
    let centre = format!("--sphere-centre={}", centre());
    let mut all = vec!["--layers=spherical".to_owned(), centre];
    all.extend(["--set", "fill_density=100%", "--orient", "keep"].map(str::to_owned));
    all
}

fn lens(arguments: &[String]) -> String {
    sliced("lens", &arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn the_face_of_a_lens_is_one_layer_and_within_ten_micrometres_of_its_sphere() {
    let (greatest, rms) = errors(&lens(&spherical()), Family::Spherical, RADIUS - 1.0);
    assert!(greatest < 0.010, "{greatest} mm, rms {rms}");
    let solid = ["--set", "fill_density=100%", "--orient", "keep"].map(str::to_owned);
    let (planar, _) = errors(&lens(&solid), Family::Planar, RADIUS - 1.0);
    assert!(planar > 0.05, "planar layers are stairs: {planar}");
}

#[test]
fn curved_layers_begin_where_they_are_asked_to() {
    let mut arguments = spherical();
    arguments.extend(["--set", "curved_from_mm=1"].map(str::to_owned));
    let text = lens(&arguments);
    let curved = text.find("layer surface = spherical").unwrap();
    let below = text[..curved].lines().filter_map(|line| line.strip_prefix(";Z:")).next_back();
    let below: f64 = below.unwrap().parse().unwrap();
    assert!((0.8..=1.0).contains(&below), "{below}");
    let (greatest, _) = errors(&text, Family::Spherical, RADIUS - 2.0);
    assert!(greatest < 0.010, "{greatest}");
}

/// The table of docs/tilt.md:
/// `cargo test --release -p rhumb --test main lens -- --ignored --nocapture`.
#[test]
#[ignore = "prints a table"]
fn table() {
    let solid = ["--set", "fill_density=100%", "--orient", "keep"].map(str::to_owned);
    let cone = ["--layers=conical", "--cone-angle=9.6"].map(str::to_owned);
    let slope = 9.6_f64.to_radians().tan();
    let cases = [
        ("planar", solid.to_vec(), Family::Planar),
        ("conical, 9.6°", [&cone[..], &solid[..]].concat(), Family::Conical(slope)),
        ("spherical", spherical(), Family::Spherical),
    ];
    say(
        "| layers | face off its sphere, greatest (rms) | time | bed turns |\n| --- | --- | --- | --- |\n",
    );
    for (name, arguments, family) in cases {
        let text = lens(&arguments);
        let (greatest, rms) = errors(&text, family, RADIUS - 1.0);
        let turns: f64 =
            motions(&text).iter().map(|m: &Motion| (m.to[1] - m.from[1]).abs() / 360.0).sum();
        let time = text.lines().find_map(|line| line.split("normal mode) = ").nth(1)).unwrap();
        say(&format!(
            "| {name} | {:.1} µm ({:.1} µm) | {time} | {turns:.0} |\n",
            greatest * 1e3,
            rms * 1e3
        ));
    }
}
