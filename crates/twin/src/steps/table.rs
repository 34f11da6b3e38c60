//! A prescribed movement as a table of control points.
//!
//! ```text
//! # remarks
//! t_s,x_mm,y_mm,z_mm
//! 0,0,0,0
//! 1.5,8,0,0
//! ```
//!
//! The first row is the start point; each row after it says where the axes are to be at what time,
//! which grows from row to row. The header is as it stands here.

use super::count::Counts;
use super::{Axes, Interval, MOST_AXES};

/// The first line that is no remark.
pub const HEADER: &str = "t_s,x_mm,y_mm,z_mm";

/// The source's example: a motor `DSh-4-6B` on a screw of 3 mm, measured to move each axis by 1.6 mm a
/// pulse. The points are ours: two layers of a square frame with its diagonal.
pub const EXAMPLE: &str = include_str!("dsh-4-6b.csv");

/// A row: when, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Its line in the table, counted from 1.
    pub line: usize,
    /// s.
    pub time: f64,
    /// X, Y and Z, mm.
    pub at: [f64; 3],
}

/// Why a table cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// Another first line.
    #[error("line {0}: the header {HEADER} is expected")]
    Header(usize),
    /// Not four numbers.
    #[error("line {0}: four numbers of ordinary size are expected")]
    Row(usize),
    /// Not after the row before.
    #[error("line {0}: its time is not after that of the row before")]
    Time(usize),
    /// No start point.
    #[error("the table has no points")]
    Empty,
}

/// Greatest time, s, and distance, mm.
const MOST: f64 = 1e9;

/// Reads a table.
///
/// # Errors
///
/// [`TableError`] with the line.
pub fn read(text: &str) -> Result<Vec<Point>, TableError> {
    let rows = (1..).zip(text.lines()).map(|(line, text)| (line, text.trim()));
    let mut rows = rows.filter(|(_, text)| !text.is_empty() && !text.starts_with('#'));
    let (line, header) = rows.next().ok_or(TableError::Empty)?;
    if header.replace(' ', "") != HEADER {
        return Err(TableError::Header(line));
    }
    let mut points: Vec<Point> = Vec::new();
    for (line, text) in rows {
        let point = row(line, text).ok_or(TableError::Row(line))?;
        if points.last().is_some_and(|last| last.time >= point.time) {
            return Err(TableError::Time(line));
        }
        points.push(point);
    }
    if points.is_empty() { Err(TableError::Empty) } else { Ok(points) }
}

fn row(line: usize, text: &str) -> Option<Point> {
    let mut numbers = text.split(',').map(|n| n.trim().parse::<f64>().ok());
    let mut next = || numbers.next()?.filter(|n| n.abs() <= MOST);
    let (time, at) = (next()?, [next()?, next()?, next()?]);
    numbers.next().is_none().then_some(Point { line, time, at })
}

/// Returns where the motors stand at the start point, and the intervals between the points.
#[must_use]
pub fn intervals(points: &[Point], axes: &Axes) -> ([i64; MOST_AXES], Vec<Interval>) {
    let place = |point: &Point| [point.at[0], point.at[1], point.at[2], 0.0];
    let Some(first) = points.first() else { return ([0; MOST_AXES], Vec::new()) };
    let mut counts = Counts::new(*axes, place(first));
    let start = counts.count();
    let go = |pair: &[Point]| counts.go(pair[1].line, place(&pair[1]), pair[1].time - pair[0].time);
    (start, points.windows(2).map(go).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> Axes {
        Axes { names: &["X", "Y", "Z"], steps: [1.6, 1.6, 1.6, 1.0], turns: [false; MOST_AXES] }
    }

    #[test]
    fn the_sources_example_is_never_off_by_more_than_half_a_pulse() {
        let points = read(EXAMPLE).unwrap();
        let (start, intervals) = intervals(&points, &axes());
        assert_eq!((start, intervals.len()), ([0; 4], points.len() - 1));
        let mut by_differences = [0.0; 3];
        let mut worst: [f64; 2] = [0.0; 2];
        for interval in &intervals {
            for (k, sum) in by_differences.iter_mut().enumerate() {
                let error = interval.error(&axes(), k).abs();
                assert!(error <= 0.8 + 1e-12, "{interval:?}");
                *sum += ((interval.to[k] - interval.from[k]) / 1.6).round() * 1.6;
                worst = [worst[0].max(error), worst[1].max((*sum - interval.to[k]).abs())];
            }
        }
        // Rounding the differences, as the source does, is off by more than half a pulse.
        assert!(worst[0] <= 0.8 + 1e-12 && worst[1] > 0.8, "{worst:?}");
        // 10 mm are 6.25 pulses, 20 mm are 12.5, which is rounded away from zero.
        assert_eq!(intervals[0].pulses, [6, 0, 0, 0]);
        assert_eq!(intervals[1].pulses, [7, 0, 0, 0]);
        let last = intervals[intervals.len() - 1];
        assert_eq!([0, 1, 2].map(|k| last.count[k] + last.pulses[k]), [0, 0, 4]);
    }

    #[test]
    fn what_is_no_table() {
        for (text, error) in [
            ("", TableError::Empty),
            ("# only a remark\n", TableError::Empty),
            ("t_s,x_mm,y_mm,z_mm\n", TableError::Empty),
            ("\nx,y\n", TableError::Header(2)),
            ("t_s,x_mm,y_mm,z_mm\n0,0,0\n", TableError::Row(2)),
            ("t_s,x_mm,y_mm,z_mm\n0,0,0,0,0\n", TableError::Row(2)),
            ("t_s,x_mm,y_mm,z_mm\n0,0,0,nan\n", TableError::Row(2)),
            ("t_s,x_mm,y_mm,z_mm\n0,0,0,1e12\n", TableError::Row(2)),
            ("t_s,x_mm,y_mm,z_mm\n1,0,0,0\n1,2,0,0\n", TableError::Time(3)),
        ] {
            assert_eq!(read(text), Err(error), "{text:?}");
        }
    }
}
