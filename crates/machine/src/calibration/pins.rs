//! Print and measure: the nozzle's own `a` and `b` from the distances between printed pins.
//!
//! A magnet run finds where the *sensor* passes the axis. Where the nozzle passes it only a print
//! can tell. Four pins `A` stand at radius `L`, azimuths 0°, 90°, 180°, 270°; four pins `C` at the
//! smaller radius `l`. Printed as if the rail were perfect, each pin lands at
//! `Rz(azimuth)·(radius + a, b)`, all shrunk by `k`, so the distances between their middles obey
//! exactly
//!
//! ```text
//! |A(x) C(x+90)|² − |A(x) C(x−90)|² = 4·k²·b·(L − l)
//! |A(0) A(180)| = 2·k·√((L + a)² + b²)        |C(0) C(180)| = 2·k·√((l + a)² + b²)
//! ```
//!
//! With `L = l` the first would be blind to `b`: two radii are needed. What a print with an earlier
//! calibration shows is what is left of `a` and `b`, to be added to it.
//!
//! A caliper measures over the pins, or between them, or both; of both the mean is free of the
//! width of the bead.

use super::fit::Estimate;
use super::log::shown;

/// The pins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Artefact {
    /// Radius on which the pins `A` stand, mm.
    pub outer: f64,
    /// Radius on which the pins `C` stand, mm.
    pub inner: f64,
    /// Radius of a pin, mm.
    pub pin: f64,
}

impl Default for Artefact {
    fn default() -> Self {
        Self { outer: 60.0, inner: 15.0, pin: 3.0 }
    }
}

/// A distance between the middles of two pins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Which.
    pub of: Measure,
    /// mm.
    pub mm: f64,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// From an outer pin to the inner pin a quarter turn counter-clockwise of it.
    Ahead,
    /// From an outer pin to the inner pin a quarter turn clockwise of it.
    Behind,
    /// Across, between two outer pins.
    Outer,
    /// Across, between two inner pins.
    Inner,
}

/// What the pins say of the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// True minus commanded radius, mm, beyond what the print allowed for.
    pub a: Estimate,
    /// By how much the nozzle misses the axis, mm, beyond what the print allowed for.
    pub b: Estimate,
    /// What the print shrank by: 1 is not at all.
    pub shrinkage: Estimate,
}

/// Why readings say nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PinsError {
    /// A line that cannot be read.
    #[error("line {line}: {what}")]
    Row {
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// One of the four measures has no reading.
    #[error("there is no reading {0}")]
    Missing(&'static str),
    /// No machine prints pins at these distances.
    #[error("the readings are not of this artefact: they would shrink it to {scale:.3}")]
    OtherArtefact {
        /// What it would have shrunk by.
        scale: f64,
    },
    /// The two radii are too near to each other, or no radii.
    #[error(
        "the outer pins must stand at least 5 mm outside of the inner ones, and those on a circle"
    )]
    Radii,
}

/// No caliper shows more, mm.
const MOST_MM: f64 = 10_000.0;

/// A print never shrinks or grows by more.
const MOST_SHRINKAGE: f64 = 0.05;

/// Reads `from,to,over_mm,between_mm`: two pins and what the caliper showed over them and between
/// them; one of the two may be empty. Pins are called `A0` to `A270` and `C0` to `C270`.
///
/// # Errors
///
/// [`PinsError::Row`].
pub fn parse(text: &str, artefact: &Artefact) -> Result<Vec<Distance>, PinsError> {
    let mut distances = Vec::new();
    let mut has_header = false;
    for (index, row) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let wrong = |what: String| PinsError::Row { line: index + 1, what };
        let values: Vec<&str> = row.split(',').map(str::trim).collect();
        match values.as_slice() {
            [""] => {}
            [first, ..] if first.starts_with('#') => {}
            ["from", "to", "over_mm", "between_mm"] if !has_header => has_header = true,
            _ if !has_header => {
                return Err(wrong("the header is not from,to,over_mm,between_mm".to_owned()));
            }
            [from, to, over, between] => {
                let of = measure(from, to).ok_or_else(|| {
                    let pins = format!("{} to {}", shown(from), shown(to));
                    wrong(format!("no distance of the artefact goes from {pins}"))
                })?;
                let mm = middle(over, between, artefact.pin).map_err(wrong)?;
                distances.push(Distance { of, mm });
            }
            _ => return Err(wrong("a row has four values".to_owned())),
        }
    }
    Ok(distances)
}

fn measure(from: &str, to: &str) -> Option<Measure> {
    let (from, to) =
        if from.starts_with('C') && to.starts_with('A') { (to, from) } else { (from, to) };
    let azimuth = |pin: &str| match pin.get(1..)? {
        "0" => Some(0),
        "90" => Some(90),
        "180" => Some(180),
        "270" => Some(270),
        _ => None,
    };
    let turn = (azimuth(to)? - azimuth(from)? + 360) % 360;
    match (from.get(..1)?, to.get(..1)?, turn) {
        ("A", "C", 90) => Some(Measure::Ahead),
        ("A", "C", 270) => Some(Measure::Behind),
        ("A", "A", 180) => Some(Measure::Outer),
        ("C", "C", 180) => Some(Measure::Inner),
        _ => None,
    }
}

fn middle(over: &str, between: &str, pin: f64) -> Result<f64, String> {
    let read = |text: &str| -> Result<Option<f64>, String> {
        if text.is_empty() {
            return Ok(None);
        }
        let value: f64 = text.parse().map_err(|_| format!("{} is no reading", shown(text)))?;
        let in_range = 0.0 < value && value < MOST_MM;
        if in_range {
            Ok(Some(value))
        } else {
            Err(format!("{value:?} mm is not 0 to {MOST_MM:?}"))
        }
    };
    match (read(over)?, read(between)?) {
        (Some(over), Some(between)) => Ok((over + between) / 2.0),
        (Some(over), None) => Ok(over - 2.0 * pin),
        (None, Some(between)) => Ok(between + 2.0 * pin),
        (None, None) => Err("a row has no reading".to_owned()),
    }
}

/// Returns what the distances say; `sd` is the standard deviation of one reading, mm.
///
/// # Errors
///
/// [`PinsError`], where they say nothing.
pub fn evaluate(
    artefact: &Artefact,
    distances: &[Distance],
    sd: f64,
) -> Result<Printed, PinsError> {
    let is_sound = artefact.inner > 0.0 && artefact.outer >= artefact.inner + 5.0;
    if !is_sound || !artefact.outer.is_finite() {
        return Err(PinsError::Radii);
    }
    let mut means = [0.0; 4];
    let mut sds = [0.0; 4];
    for (k, (of, name)) in [
        (Measure::Ahead, "from an outer pin to the inner one a quarter turn ahead, as A0 to C90"),
        (
            Measure::Behind,
            "from an outer pin to the inner one a quarter turn behind, as A0 to C270",
        ),
        (Measure::Outer, "across the outer pins, as A0 to A180"),
        (Measure::Inner, "across the inner pins, as C0 to C180"),
    ]
    .into_iter()
    .enumerate()
    {
        let of_it: Vec<f64> = distances.iter().filter(|d| d.of == of).map(|d| d.mm).collect();
        if of_it.is_empty() {
            return Err(PinsError::Missing(name));
        }
        means[k] = of_it.iter().sum::<f64>() / of_it.len() as f64;
        sds[k] = sd / (of_it.len() as f64).sqrt();
    }
    let [a, b, k] = solve(artefact, &means)?;
    let mut squares = [0.0; 3];
    for index in 0..4 {
        let mut moved = means;
        moved[index] += sds[index];
        let other = solve(artefact, &moved)?;
        for (square, off) in squares.iter_mut().zip([other[0] - a, other[1] - b, other[2] - k]) {
            *square += off * off;
        }
    }
    let estimate = |value: f64, square: f64| Estimate { value, sd: square.sqrt() };
    Ok(Printed {
        a: estimate(a, squares[0]),
        b: estimate(b, squares[1]),
        shrinkage: estimate(k, squares[2]),
    })
}

/// `a`, `b` and the scale `k` from the four mean distances.
fn solve(
    artefact: &Artefact,
    [ahead, behind, outer, inner]: &[f64; 4],
) -> Result<[f64; 3], PinsError> {
    let span = artefact.outer - artefact.inner;
    let miss = |k: f64| (ahead * ahead - behind * behind) / (4.0 * k * k * span);
    // Radius of a pin along the rail, from the distance across.
    let along =
        |across: f64, k: f64| ((across / (2.0 * k)).powi(2) - miss(k).powi(2)).max(0.0).sqrt();
    let excess = |k: f64| along(*outer, k) - along(*inner, k) - span;
    let mut k = (outer - inner) / (2.0 * span);
    // The excess is all but linear in 1/k: each step squares the error.
    for _ in 0..20 {
        let is_possible = (k - 1.0).abs() <= MOST_SHRINKAGE;
        if !is_possible {
            return Err(PinsError::OtherArtefact { scale: k });
        }
        k *= 1.0 + excess(k) / span;
    }
    Ok([along(*outer, k) - artefact.outer, miss(k), k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation2, Vector2};
    use std::f64::consts::FRAC_PI_2;

    /// All sixteen distances on a print by a machine with this rail.
    fn printed(a: f64, b: f64, k: f64) -> Vec<Distance> {
        let at = |radius: f64, quarter: usize| {
            k * (Rotation2::new(FRAC_PI_2 * quarter as f64) * Vector2::new(radius + a, b))
        };
        let mut all = Vec::new();
        for quarter in 0..4 {
            let of = |of, p: Vector2<f64>, q: Vector2<f64>| Distance { of, mm: (p - q).norm() };
            all.push(of(Measure::Ahead, at(60.0, quarter), at(15.0, quarter + 1)));
            all.push(of(Measure::Behind, at(60.0, quarter), at(15.0, quarter + 3)));
            if quarter < 2 {
                all.push(of(Measure::Outer, at(60.0, quarter), at(60.0, quarter + 2)));
                all.push(of(Measure::Inner, at(15.0, quarter), at(15.0, quarter + 2)));
            }
        }
        all
    }

    #[test]
    fn the_rail_comes_out_of_the_distances() {
        for (a, b, k) in [(0.2, 0.35, 0.997), (-0.7, -1.2, 1.01), (0.0, 0.0, 1.0)] {
            let said = evaluate(&Artefact::default(), &printed(a, b, k), 0.03).unwrap();
            assert!((said.a.value - a).abs() < 1e-9, "{said:?}");
            assert!((said.b.value - b).abs() < 1e-9, "{said:?}");
            assert!((said.shrinkage.value - k).abs() < 1e-11, "{said:?}");
            // Published for a caliper of 30 µm: 15 µm each.
            assert!(
                (said.a.sd - 0.015).abs() < 0.004 && (said.b.sd - 0.015).abs() < 0.004,
                "{said:?}"
            );
        }
    }

    #[test]
    fn readings_over_and_between_pins() {
        let text = "# pins\nfrom,to,over_mm,between_mm\nA0,C90,68,\nC270,A0,,56\nA0,A180,126,114\n";
        let distances = parse(text, &Artefact::default()).unwrap();
        let expected = [(Measure::Ahead, 62.0), (Measure::Behind, 62.0), (Measure::Outer, 120.0)];
        assert_eq!(distances, expected.map(|(of, mm)| Distance { of, mm }));
        let error = evaluate(&Artefact::default(), &distances, 0.03).unwrap_err();
        assert!(matches!(error, PinsError::Missing(_)));
    }

    #[test]
    fn nonsense_is_refused() {
        let line = |text: &str| match parse(text, &Artefact::default()).unwrap_err() {
            PinsError::Row { line, .. } => line,
            other => panic!("{other}"),
        };
        assert_eq!(line("A0,C90,1,1"), 1);
        for row in [
            "A0,C0,1,1",
            "A0,B90,1,1",
            "A0,C90,,",
            "A0,C90,x,1",
            "A0,C90,nan,",
            "A0,C90",
            "é,C90,1,1",
        ] {
            assert_eq!(line(&format!("from,to,over_mm,between_mm\n{row}")), 2, "{row}");
        }
        let mut other = printed(0.0, 0.0, 1.0);
        other.iter_mut().for_each(|distance| distance.mm *= 1.5);
        let error = evaluate(&Artefact::default(), &other, 0.03).unwrap_err();
        assert!(matches!(error, PinsError::OtherArtefact { .. }));
        let flat = Artefact { outer: 15.0, ..Artefact::default() };
        assert_eq!(evaluate(&flat, &other, 0.03), Err(PinsError::Radii));
    }
}
