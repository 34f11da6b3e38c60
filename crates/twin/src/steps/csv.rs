//! Pulses by interval as CSV.
//!
//! ```text
//! # rhumb steps 1
//! # axis R: 0.0125 mm a pulse, starts at 9600 pulses
//! line,time_s,duration_s,R,theta,Z,E
//! 42,0,0.1254,-120,433,0,12
//! ```
//!
//! Lines that begin with `#` are remarks: one for each axis says what a pulse moves (mm, or deg where it
//! turns) and where its motor stands before the first interval, in pulses from zero. A row is an interval:
//! the line of the program that commands it, when it begins and how long it takes (s, to 1 ns), and the
//! pulses of each motor, negative backwards. The sum of a column from the start, times a pulse, is where
//! the axis is, to half a pulse.

use std::io::{self, Write};

use super::{Axes, Interval, MOST_AXES};

/// Decimal places of times: 1 ns.
const TIME_DECIMALS: usize = 9;

/// Writes the head.
///
/// # Errors
///
/// What the writer reports.
pub fn head(out: &mut impl Write, axes: &Axes, start: [i64; MOST_AXES]) -> io::Result<()> {
    writeln!(out, "# rhumb steps 1")?;
    for (k, name) in axes.names.iter().enumerate() {
        let step = axes.step_in_unit(k);
        let unit = axes.unit(k);
        writeln!(out, "# axis {name}: {step} {unit} a pulse, starts at {} pulses", start[k])?;
    }
    writeln!(out, "line,time_s,duration_s,{}", axes.names.join(","))
}

/// Writes an interval.
///
/// # Errors
///
/// What the writer reports.
pub fn row(out: &mut impl Write, axes: &Axes, interval: &Interval) -> io::Result<()> {
    let [start, duration] = [interval.start, interval.duration].map(shortest);
    write!(out, "{},{start},{duration}", interval.line)?;
    for pulses in &interval.pulses[..axes.names.len()] {
        write!(out, ",{pulses}")?;
    }
    writeln!(out)
}

/// A time without zeros at the end.
fn shortest(time: f64) -> String {
    let mut text = format!("{time:.TIME_DECIMALS$}");
    text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::count::Counts;

    #[test]
    fn rows_as_they_are_documented() {
        let axes = Axes {
            names: &["R", "theta"],
            steps: [0.0125, 0.0225_f64.to_radians(), 1.0, 1.0],
            turns: [false, true, false, false],
        };
        let mut counts = Counts::new(axes, [120.0, 0.0, 0.0, 0.0]);
        let mut out = Vec::new();
        head(&mut out, &axes, counts.count()).unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        row(&mut out, &axes, &counts.go(7, [20.0, 0.0, 0.0, 0.0], 0.75)).unwrap();
        row(&mut out, &axes, &counts.go(8, [20.0, -quarter, 0.0, 0.0], 1.0 / 3.0)).unwrap();
        let expected = "# rhumb steps 1\n\
                        # axis R: 0.0125 mm a pulse, starts at 9600 pulses\n\
                        # axis theta: 0.0225 deg a pulse, starts at 0 pulses\n\
                        line,time_s,duration_s,R,theta\n\
                        7,0,0.75,-8000,0\n\
                        8,0.75,0.333333333,0,-4000\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }
}
