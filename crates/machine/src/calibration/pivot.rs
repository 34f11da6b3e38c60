//! The pivot of a head that tilts the nozzle, from touches of one fixed point.
//!
//! The tip touches a fixed point that turns with the bed (a pin, or a probe that switches) with the nozzle
//! tilted now one way and now another. The words of each touch say where an upright nozzle would have had
//! its tip. With `L` from the pivot to the tip, `(ox, oy)` how far the tip lies beside the line down from the
//! pivot, `R = Ry(B)·Rx(A)` and `Q` the point over the bed, every touch gives three equations that are
//! linear in all six:
//!
//! ```text
//! Rz(theta) · (nozzle(s, z) + [R·(ox, oy, −L)]xy − (ox, oy)) = Qxy
//! z + L + [R·(ox, oy, −L)]z                                  = Qz
//! ```
//!
//! The lift counts from where an upright nozzle touches the bed, so an upright touch alone says nothing of
//! `L`; a tilt by `B` tells it by `sin B`. `ox` shows in the heights at `B` and `−B`, `oy` only with tilts
//! about `A`. Heads with one axis have their tip below the pivot: of them `L` is found.
//!
//! A number is refused when a touch that is off by 1 mm could put it off by more than [`MOST_GAIN`] mm.

use nalgebra::{DMatrix, DVector, Dyn, Rotation2, SVD, Vector2, Vector3};

use super::fit::Estimate;
use crate::head::tilting::{Tilting, tilted};
use crate::kinematics::Alignment;
use crate::program::{BedTurn, Joints};

/// The words of a touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The line of the log, counted from 1.
    pub line: usize,
    /// Carriage, bed and lift.
    pub base: Joints,
    /// Tilt across the rail, radians.
    pub across: f64,
    /// Tilt along the rail, radians.
    pub along: f64,
}

/// What touches say of the pivot.
#[derive(Debug, Clone, PartialEq)]
pub struct Pivot {
    /// From the pivot to the tip, mm.
    pub length: Estimate,
    /// How far the tip lies beside the line down from the pivot, mm; of heads with two axes.
    pub offset: Option<[Estimate; 2]>,
    /// Root of the mean square of what touches miss the point by, a coordinate, mm.
    pub residual_rms: f64,
    /// The touch that misses it by most: its line, and by how much, mm.
    pub worst: (usize, f64),
}

/// How much more than a touch a number may be off by: tilts of ±30° give 1 or less, tilts of ±6° this.
pub const MOST_GAIN: f64 = 6.0;

/// Tilt of touches that tell most, degrees: more, and the carriage is in the way of many machines.
const GOOD_TILT_DEG: f64 = 30.0;

/// Why a log says nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PivotError {
    /// A line that cannot be read.
    #[error("line {line}: {what}")]
    Row {
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// Too few touches.
    #[error("{count} touches are too few: touch the point upright, and tilted both ways")]
    Few {
        /// How many there are.
        count: usize,
    },
    /// Tilts that tell too little.
    #[error(
        "the tilts of the log ({seen}) do not tell {what}: a touch that is off by 0.01 mm puts it off \
         by {off} mm; add touches of the same point at {add}"
    )]
    Blind {
        /// What is not told.
        what: &'static str,
        /// What tilts there are.
        seen: String,
        /// How far off it may be.
        off: String,
        /// What helps.
        add: String,
    },
}

/// Reads a log: `s_mm,theta_deg,z_mm,b_deg`, or with `a_deg` before `b_deg`; lines that begin with `#` are
/// remarks.
///
/// # Errors
///
/// [`PivotError::Row`].
pub fn parse(text: &str) -> Result<Vec<Touch>, PivotError> {
    let mut touches = Vec::new();
    let mut columns = None;
    for (index, row) in text.lines().enumerate() {
        let (line, row) = (index + 1, row.trim());
        let wrong = |what: String| PivotError::Row { line, what };
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let Some(count) = columns else {
            let header: String = row.chars().filter(|c| !c.is_whitespace()).collect();
            columns = Some(match header.as_str() {
                "s_mm,theta_deg,z_mm,b_deg" => 4,
                "s_mm,theta_deg,z_mm,a_deg,b_deg" => 5,
                _ => {
                    return Err(wrong(
                        "the header is neither s_mm,theta_deg,z_mm,b_deg nor \
                         s_mm,theta_deg,z_mm,a_deg,b_deg"
                            .into(),
                    ));
                }
            });
            continue;
        };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
        let numbers: Option<Vec<f64>> = row.split(',').map(number).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == count);
        let Some(numbers) = numbers else {
            return Err(wrong(format!("{count} numbers with a comma between them are wanted")));
        };
        let tilts = [numbers[count - 1], if count == 5 { numbers[3] } else { 0.0 }];
        if let Some(steep) = tilts.iter().find(|tilt| tilt.abs() >= 90.0) {
            return Err(wrong(format!("a nozzle tilted by {steep}° touches nothing")));
        }
        touches.push(Touch {
            line,
            base: Joints {
                s: numbers[0],
                turn: BedTurn::accumulated(numbers[1].to_radians()),
                z: numbers[2],
            },
            across: tilts[1].to_radians(),
            along: tilts[0].to_radians(),
        });
    }
    Ok(touches)
}

/// Finds the pivot of a head from touches of one point; `touch_sd` is what a touch is known to in each
/// coordinate, mm. The standard errors are those of `touch_sd`, or of what touches miss the point by where
/// that is more.
///
/// # Errors
///
/// [`PivotError::Few`] and [`PivotError::Blind`].
pub fn fit(
    touches: &[Touch],
    head: &Tilting,
    alignment: &Alignment,
    touch_sd: f64,
) -> Result<Pivot, PivotError> {
    let has_offset = head.axes.len() == 2;
    let head_unknowns = if has_offset { 3 } else { 1 };
    let unknowns = head_unknowns + 3;
    if 3 * touches.len() <= unknowns {
        return Err(PivotError::Few { count: touches.len() });
    }
    let mut lines = DMatrix::zeros(3 * touches.len(), unknowns);
    let mut wanted = DVector::zeros(3 * touches.len());
    for (k, touch) in touches.iter().enumerate() {
        let turned = Rotation2::new(alignment.bed.azimuth(touch.base.turn));
        let tilted = tilted(touch.across, touch.along);
        // What a millimetre of length and of offsets moves the tip by, beside that of an upright nozzle.
        let moved = [-Vector3::z(), Vector3::x(), Vector3::y()].map(|way| tilted * way - way);
        for (column, way) in moved.iter().take(head_unknowns).enumerate() {
            let over_bed = turned * way.xy();
            for (row, value) in [over_bed.x, over_bed.y, way.z].into_iter().enumerate() {
                lines[(3 * k + row, column)] = value;
            }
        }
        let nozzle: Vector2<f64> = turned * alignment.nozzle(&touch.base);
        for (row, value) in [nozzle.x, nozzle.y, touch.base.z].into_iter().enumerate() {
            lines[(3 * k + row, head_unknowns + row)] = -1.0;
            wanted[3 * k + row] = -value;
        }
    }
    let svd = lines.clone().svd(true, true);
    let gains: Vec<f64> = (0..head_unknowns).map(|column| gain(&svd, column)).collect();
    for (column, gain) in gains.iter().enumerate() {
        if *gain > MOST_GAIN || gain.is_nan() {
            return Err(blind(column, *gain, touches, head));
        }
    }
    let least = UNTOLD_SHARE * svd.singular_values.max();
    let Ok(found) = svd.solve(&wanted, least) else {
        return Err(blind(0, f64::INFINITY, touches, head));
    };
    let misses = &lines * &found - &wanted;
    let freedom = (3 * touches.len() - unknowns) as f64;
    let residual_rms = (misses.norm_squared() / freedom).sqrt();
    let sd = residual_rms.max(touch_sd);
    let estimate = |k: usize| Estimate { value: found[k], sd: sd * gains[k] };
    let by_touch = touches.iter().enumerate().map(|(k, touch)| {
        let miss = (0..3).map(|row| misses[3 * k + row].powi(2)).sum::<f64>().sqrt();
        (touch.line, miss)
    });
    let worst = by_touch.fold((0, 0.0), |worst, one| if one.1 > worst.1 { one } else { worst });
    Ok(Pivot {
        length: estimate(0),
        offset: has_offset.then(|| [estimate(1), estimate(2)]),
        residual_rms,
        worst,
    })
}

/// Ways that touches tell less of than this share of what they tell most of are not told at all: tilts in one
/// plane, to rounding.
const UNTOLD_SHARE: f64 = 1e-9;

/// An unknown has no part in a way by less than this: rounding.
const NO_PART: f64 = 1e-6;

/// How much more than a touch an unknown may be off by: the root of its place in the inverse of the normal
/// matrix.
fn gain(svd: &SVD<f64, Dyn, Dyn>, unknown: usize) -> f64 {
    let Some(v_t) = &svd.v_t else { return f64::INFINITY };
    let told = &svd.singular_values;
    let parts = v_t.column(unknown);
    let square = parts.iter().zip(told.iter()).map(|(part, told_by)| {
        let is_told = *told_by > UNTOLD_SHARE * told.max();
        match (is_told, part.abs() < NO_PART) {
            (true, _) => (part / told_by).powi(2),
            (false, true) => 0.0,
            (false, false) => f64::INFINITY,
        }
    });
    square.sum::<f64>().sqrt()
}

/// Says which touches would tell a number that the log does not.
fn blind(column: usize, gain: f64, touches: &[Touch], head: &Tilting) -> PivotError {
    let is_across = column == 2;
    let axis = head.axes.iter().find(|axis| axis.letter == if is_across { b'A' } else { b'B' });
    let [least, most] = axis.map_or([-GOOD_TILT_DEG, GOOD_TILT_DEG], |axis| {
        [axis.axis.min.to_degrees(), axis.axis.max.to_degrees()]
    });
    let letter = if is_across { 'A' } else { 'B' };
    let range = |tilt: fn(&Touch) -> f64| {
        let tilts = touches.iter().map(|touch| tilt(touch).to_degrees());
        let (low, high) =
            tilts.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        format!("{low:.1} to {high:.1}°")
    };
    let mut seen = format!("B {}", range(|touch| touch.along));
    if head.axes.len() == 2 {
        seen = format!("A {}, {seen}", range(|touch| touch.across));
    }
    PivotError::Blind {
        what: [
            "the length of the pivot",
            "the offset along the rail",
            "the offset across the rail",
        ][column],
        seen,
        off: if gain < 1e6 { format!("{:.2}", gain * 0.01) } else { "any number of".into() },
        add: format!(
            "{letter} = {:.0}° and {letter} = {:.0}°",
            least.max(-GOOD_TILT_DEG),
            most.min(GOOD_TILT_DEG)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::head::{Head, Pose};
    use crate::profile::Axis;
    use nalgebra::{Point3, UnitVector3};
    use std::f64::consts::TAU;

    const ANY: Axis = Axis { min: -1.2, max: 1.2, speed: 1.0, acceleration: 10.0 };

    const LEANING: Alignment =
        Alignment { a: 0.2, b: 0.35, a1: 0.0015, b1: -0.002, ..Alignment::IDEAL };

    fn two_axes(length: f64, offset: [f64; 2]) -> Tilting {
        Tilting { offset: Vector2::from(offset), ..Tilting::two_axes(length, ANY, ANY) }
    }

    /// The words at which the tip of a true head touches a point, leaning by `lean` to `sides` sides.
    fn touched(head: &Tilting, alignment: &Alignment, lean: f64, sides: u32) -> Vec<Touch> {
        let at = Point3::new(60.0, 15.0, 20.0);
        let upright = std::iter::once(Vector3::z());
        let leaning = (0..sides).map(|k| {
            let side = TAU * (f64::from(k) + 0.1) / f64::from(sides);
            Vector3::new(lean.sin() * side.cos(), lean.sin() * side.sin(), lean.cos())
        });
        let all = upright.chain(leaning).enumerate().map(|(k, axis)| {
            let pose = Pose { at, axis: UnitVector3::new_normalize(axis) };
            let head = Head::Tilting(head.clone());
            let stance = head.stance(&pose, BedTurn::default(), alignment).unwrap().stance;
            let across_first = head.axes().len() == 2;
            let [first, second] = [stance.head[0], stance.head[1]];
            let (across, along) = if across_first { (first, second) } else { (0.0, first) };
            Touch { line: k + 2, base: stance.base, across, along }
        });
        all.collect()
    }

    /// A number from −1 to 1 that looks random.
    fn chance(k: u64) -> f64 {
        let mut z = k.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    #[test]
    fn a_pivot_without_noise_is_found_to_a_nanometre() {
        let head = two_axes(45.3, [0.4, -0.7]);
        let touches = touched(&head, &LEANING, 0.5, 6);
        let found = fit(&touches, &two_axes(40.0, [0.0; 2]), &LEANING, 0.01).unwrap();
        assert!((found.length.value - 45.3).abs() < 1e-9, "{found:?}");
        let [x, y] = found.offset.unwrap();
        assert!((x.value - 0.4).abs() < 1e-9 && (y.value + 0.7).abs() < 1e-9, "{found:?}");
        let one = Tilting::one_axis(52.1, ANY);
        let along = touched(&one, &Alignment::IDEAL, 0.4, 2);
        let along: Vec<Touch> = along.into_iter().collect();
        let found = fit(&along, &Tilting::one_axis(45.0, ANY), &Alignment::IDEAL, 0.01).unwrap();
        // The tip of such a head leaves the point by the residual angle only.
        assert!((found.length.value - 52.1).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn with_noise_it_is_found_within_three_standard_errors() {
        // Even noise within ±√3 sd.
        let (sd, mut outside) = (0.01, 0);
        for seed in 0..200_u64 {
            let length = 40.0 + (seed % 17) as f64;
            let offset = [chance(seed * 7 + 1), chance(seed * 7 + 2)];
            let head = two_axes(length, offset);
            let mut touches = touched(&head, &LEANING, 0.35 + 0.01 * (seed % 20) as f64, 6);
            for (k, touch) in touches.iter_mut().enumerate() {
                let noise =
                    |which: u64| 3_f64.sqrt() * sd * chance(seed * 1000 + 10 * k as u64 + which);
                touch.base.s += noise(1);
                touch.base.z += noise(2);
                let across = noise(3) / touch.base.s;
                touch.base.turn = BedTurn::accumulated(touch.base.turn.radians() + across);
            }
            let found = fit(&touches, &two_axes(45.0, [0.0; 2]), &LEANING, sd).unwrap();
            let [x, y] = found.offset.unwrap();
            for (estimate, truth) in [(found.length, length), (x, offset[0]), (y, offset[1])] {
                outside += u32::from((estimate.value - truth).abs() > 3.0 * estimate.sd);
                assert!((estimate.value - truth).abs() < 4.5 * estimate.sd, "{seed} {estimate:?}");
                assert!(estimate.sd < 0.03, "{estimate:?}");
            }
        }
        assert!(outside <= 6, "{outside} of 600 are off by more than three standard errors");
    }

    #[test]
    fn logs_that_do_not_tell_say_which_touches_would() {
        let head = two_axes(45.0, [0.0; 2]);
        let error =
            |touches: &[Touch]| fit(touches, &head, &LEANING, 0.01).unwrap_err().to_string();
        let flat = error(&touched(&head, &LEANING, 0.03, 6));
        assert!(flat.contains("the length of the pivot"), "{flat}");
        assert!(flat.contains("B = -30° and B = 30°"), "{flat}");
        // Tilts along the rail alone.
        let along: Vec<Touch> = [0.0, 0.5, -0.5, 0.3]
            .map(|along| {
                let turn = BedTurn::default();
                let to_tip = tilted(0.0, along) * Vector3::new(0.0, 0.0, -45.0);
                let base = Joints { s: 60.0 - to_tip.x, turn, z: -45.0 - to_tip.z };
                Touch { line: 2, base, across: 0.0, along }
            })
            .to_vec();
        let ideal = fit(&along, &head, &Alignment::IDEAL, 0.01).unwrap_err().to_string();
        assert!(ideal.contains("across the rail"), "{ideal}");
        assert!(ideal.contains("A = -30° and A = 30°"), "{ideal}");
        let one = Tilting::one_axis(40.0, ANY);
        let found = fit(&along, &one, &Alignment::IDEAL, 0.01).unwrap();
        assert!((found.length.value - 45.0).abs() < 1e-9);
        assert!(matches!(
            fit(&along[..1], &one, &LEANING, 0.01),
            Err(PivotError::Few { count: 1 })
        ));
    }

    #[test]
    fn logs_are_read_or_refused_with_their_line() {
        let touches =
            parse("# a pin\ns_mm, theta_deg, z_mm, a_deg, b_deg\n60,90,1,5,-30\n\n").unwrap();
        assert_eq!(touches.len(), 1);
        assert!((touches[0].along + 0.5235987755982988).abs() < 1e-12);
        assert!((touches[0].across - 5_f64.to_radians()).abs() < 1e-12);
        assert_eq!(parse("s_mm,theta_deg,z_mm,b_deg\n1,2,3,4").unwrap()[0].across, 0.0);
        for text in [
            "s,t\n1,2",
            "s_mm,theta_deg,z_mm,b_deg\n1,2,3",
            "s_mm,theta_deg,z_mm,b_deg\n1,2,3,nan",
            "s_mm,theta_deg,z_mm,b_deg\n1,2,3,90",
        ] {
            assert!(matches!(parse(text), Err(PivotError::Row { .. })), "{text}");
        }
    }
}
