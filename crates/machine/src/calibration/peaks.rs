//! The middle of a magnet's field in one scan.
//!
//! The field is flat at its top: within a tenth of a millimetre it falls by a thousandth, so the
//! largest reading says little of where the middle is, and climbing to it less. The whole bump is
//! scanned and its [`centroid`] taken, some fifty times better and indifferent to gain, offset and
//! saturation. [`threshold_midpoint`] and [`log_gauss`] are for comparison and for sensors that show
//! only a part of the bump. [`chord`] is for digital sensors, which switch on a circle about the
//! magnet: each scan cuts a chord out of it.
//!
//! `x` is whatever was scanned along, in growing order; results are in its unit.

/// Returns the centroid of what is above a threshold in the bump with the highest reading, each
/// reading standing for half the way to its neighbours. `None` where the scan does not come down to
/// the threshold on both sides.
#[must_use]
pub fn centroid(x: &[f64], level: &[f64], threshold: f64) -> Option<f64> {
    let (first, last) = bump(x, level, threshold)?;
    let (mut area, mut moment) = (0.0, 0.0);
    for k in first..=last {
        let share = (x[k + 1] - x[k - 1]) * (level[k] - threshold);
        area += share;
        moment += x[k] * share;
    }
    (area > 0.0).then(|| moment / area)
}

/// Returns the middle between the places where the highest bump crosses a threshold.
#[must_use]
pub fn threshold_midpoint(x: &[f64], level: &[f64], threshold: f64) -> Option<f64> {
    let (first, last) = bump(x, level, threshold)?;
    let crossing = |from: usize, to: usize| {
        let share = (threshold - level[from]) / (level[to] - level[from]);
        x[from] + share * (x[to] - x[from])
    };
    Some((crossing(first - 1, first) + crossing(last + 1, last)) / 2.0)
}

/// Returns the middle of the bell curve that fits the readings between two levels within `reach` of
/// `near`: least squares of a parabola to their logarithms, each weighted by its reading.
#[must_use]
pub fn log_gauss(x: &[f64], level: &[f64], window: [f64; 2], near: f64, reach: f64) -> Option<f64> {
    let mut matrix = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    let mut n_readings = 0;
    for (&x, &level) in x.iter().zip(level) {
        let is_inside = (x - near).abs() < reach && window[0] <= level && level <= window[1];
        if !is_inside || level <= 0.0 {
            continue;
        }
        let row = nalgebra::Vector3::new(1.0, x - near, (x - near).powi(2));
        let weight = level * level;
        matrix += row * row.transpose() * weight;
        right += row * (level.ln() * weight);
        n_readings += 1;
    }
    if n_readings < 3 {
        return None;
    }
    let fit = matrix.cholesky()?.solve(&right);
    (fit[2] < 0.0).then(|| near - fit[1] / (2.0 * fit[2]))
}

/// First and last reading above the threshold, of the bump with the highest one.
fn bump(x: &[f64], level: &[f64], threshold: f64) -> Option<(usize, usize)> {
    let n = x.len().min(level.len());
    let top = (0..n).max_by(|&i, &j| level[i].total_cmp(&level[j]))?;
    if level[top] <= threshold {
        return None;
    }
    let first = (1..=top).rev().find(|&k| level[k - 1] <= threshold)?;
    let last = (top..n.saturating_sub(1)).find(|&k| level[k + 1] <= threshold)?;
    Some((first, last))
}

/// One chord of the circle on which a digital sensor switches: the bed turned, the carriage stood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// Carriage, mm.
    pub s: f64,
    /// Half the turn between the edges, radians.
    pub half_angle: f64,
}

/// The circle out of its chords.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Carriage when the sensor is over the magnet, mm.
    pub s: f64,
    /// Distance of the magnet from the axis, mm.
    pub magnet_radius: f64,
    /// Distance from the magnet at which the sensor switches, mm.
    pub switch_radius: f64,
}

/// Returns the circle that fits chords at several carriage positions, all on one side of the axis.
///
/// With `r = hypot(s + a, b)` each chord obeys `r² = 2·r·cos(half)·r0 + (R² − r0²)`, linear in `r0`
/// and the rest. `None` for fewer than three chords and for what is no circle.
#[must_use]
pub fn chord(chords: &[Chord], a: f64, b: f64) -> Option<Circle> {
    let side = (chords.first()?.s + a).signum();
    if chords.len() < 3 {
        return None;
    }
    let terms: Vec<(f64, f64)> = chords
        .iter()
        .map(|chord| (chord.s + a).hypot(b))
        .zip(chords)
        .map(|(r, chord)| (2.0 * r * chord.half_angle.cos(), r * r))
        .collect();
    let n = terms.len() as f64;
    let mean_x = terms.iter().map(|(x, _)| x).sum::<f64>() / n;
    let mean_y = terms.iter().map(|(_, y)| y).sum::<f64>() / n;
    let cross: f64 = terms.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = terms.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let r0 = cross / square;
    let reach_square = mean_y - r0 * mean_x + r0 * r0;
    let u_square = r0 * r0 - b * b;
    (reach_square > 0.0 && u_square > 0.0 && r0 > 0.0).then(|| Circle {
        s: side * u_square.sqrt() - a,
        magnet_radius: r0,
        switch_radius: reach_square.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bell(middle: f64) -> (Vec<f64>, Vec<f64>) {
        let x: Vec<f64> = (-40..=40).map(|k| f64::from(k) * 0.2).collect();
        let level = x.iter().map(|x| 90.0 * (-(x - middle).powi(2) / 8.0).exp()).collect();
        (x, level)
    }

    #[test]
    fn every_estimator_finds_the_middle_of_a_bell() {
        let (x, level) = bell(0.137);
        assert!((centroid(&x, &level, 15.0).unwrap() - 0.137).abs() < 1e-3);
        assert!((threshold_midpoint(&x, &level, 45.0).unwrap() - 0.137).abs() < 1e-3);
        let fit = log_gauss(&x, &level, [20.0, 100.0], 0.3, 4.0).unwrap();
        assert!((fit - 0.137).abs() < 1e-12);
    }

    #[test]
    fn half_a_bump_has_no_middle() {
        let (x, level) = bell(0.0);
        assert_eq!(centroid(&x[41..], &level[41..], 15.0), None);
        assert_eq!(centroid(&x[..40], &level[..40], 15.0), None);
        assert_eq!(centroid(&x, &level, 95.0), None);
        assert_eq!(centroid(&[], &[], 1.0), None);
        assert_eq!(log_gauss(&[0.0, 1.0], &[3.0, 2.0], [1.0, 9.0], 0.0, 4.0), None);
    }
}
