//! Calibration logs: what a sensor saw of the magnets, as text.
//!
//! Comma-separated, one observation a line, the header says which kind:
//!
//! | header | a row is |
//! | --- | --- |
//! | `s_mm,theta_deg` | one located magnet |
//! | `s_mm,theta_deg,level` | one reading of an analogue sensor |
//! | `s_mm,theta_deg,edge,direction` | one switching of a digital sensor |
//!
//! Edges are `on` or `off`; directions `cw` and `ccw` for a bed that turns, `in` and `out` for a
//! carriage that runs towards or away from the axis. Magnets seen from beyond the axis have a
//! negative `s_mm`. Lines that begin with `#` carry settings, [`Known`]; others of them are
//! remarks.

use super::Sighting;
use super::known::Known;

/// A log.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// What it says about the ring and the sensor.
    pub known: Known,
    /// What was seen.
    pub rows: Rows,
}

/// The rows of a log, in their order.
#[derive(Debug, Clone, PartialEq)]
pub enum Rows {
    /// Magnets that something else has located.
    Peaks(Vec<Sighting>),
    /// Readings of an analogue sensor.
    Samples(Vec<Sample>),
    /// Switchings of a digital sensor.
    Edges(Vec<Edge>),
}

/// A reading of an analogue sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Carriage, mm.
    pub s: f64,
    /// Azimuth of the rail seen from the bed, radians, accumulated.
    pub theta: f64,
    /// In whatever unit the sensor has.
    pub level: f64,
}

/// A switching of a digital sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Carriage, mm.
    pub s: f64,
    /// Azimuth of the rail seen from the bed, radians, accumulated.
    pub theta: f64,
    /// Whether the sensor came on.
    pub is_on: bool,
    /// What moved, and which way.
    pub direction: Direction,
}

/// What moved while the sensor switched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The bed, clockwise.
    Clockwise,
    /// The bed, counter-clockwise.
    CounterClockwise,
    /// The carriage, its position falling.
    In,
    /// The carriage, its position growing.
    Out,
}

impl Direction {
    /// Returns whether the bed turned, the carriage standing.
    #[must_use]
    pub fn is_turn(self) -> bool {
        matches!(self, Self::Clockwise | Self::CounterClockwise)
    }

    /// Returns whether this is the first of the two directions of its axis.
    #[must_use]
    pub fn is_first(self) -> bool {
        matches!(self, Self::Clockwise | Self::In)
    }

    /// Returns the word of the log.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Clockwise => "cw",
            Self::CounterClockwise => "ccw",
            Self::In => "in",
            Self::Out => "out",
        }
    }

    fn from_word(word: &str) -> Option<Self> {
        [Self::Clockwise, Self::CounterClockwise, Self::In, Self::Out]
            .into_iter()
            .find(|direction| direction.word() == word)
    }
}

/// Why a text is no log.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// The first line that is no remark is no known header.
    #[error(
        "line {line}: the header is none of s_mm,theta_deg; s_mm,theta_deg,level; \
         s_mm,theta_deg,edge,direction"
    )]
    Header {
        /// Counted from 1.
        line: usize,
    },
    /// There is nothing but remarks.
    #[error("the log has no header")]
    Empty,
    /// A row that cannot be read.
    #[error("line {line}: {what}")]
    Row {
        /// Counted from 1.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
    /// A setting out of its range.
    #[error("line {line}: {key} {what}")]
    Setting {
        /// Counted from 1.
        line: usize,
        /// Its name.
        key: &'static str,
        /// What is wrong with it.
        what: String,
    },
}

/// Farthest carriage position that is no mistake, mm.
const FARTHEST_MM: f64 = 10_000.0;

/// Largest accumulated turn that is no mistake, degrees.
const MOST_DEG: f64 = 1e7;

#[derive(Debug, Clone, Copy)]
enum Kind {
    Peaks,
    Samples,
    Edges,
}

/// Reads a log.
///
/// # Errors
///
/// [`LogError`], at the first line that cannot be understood.
pub fn parse(text: &str) -> Result<Log, LogError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut known = Known::default();
    let mut kind = None;
    let (mut peaks, mut samples, mut edges) = (Vec::new(), Vec::new(), Vec::new());
    for (index, row) in text.lines().enumerate() {
        let (line, row) = (index + 1, row.trim());
        if let Some(remark) = row.strip_prefix('#') {
            known.read(remark).map_err(|(key, what)| LogError::Setting { line, key, what })?;
        } else if !row.is_empty() {
            match kind {
                None => kind = Some(header(row).ok_or(LogError::Header { line })?),
                Some(kind) => {
                    let wrong = |what: String| LogError::Row { line, what };
                    let (s, theta, rest) = place(row).map_err(wrong)?;
                    match (kind, rest.as_slice()) {
                        (Kind::Peaks, []) => peaks.push(Sighting::new(s, theta)),
                        (Kind::Samples, [level]) => {
                            let level = number(level, f64::MAX).map_err(wrong)?;
                            samples.push(Sample { s, theta, level });
                        }
                        (Kind::Edges, [edge, direction]) => {
                            let (is_on, direction) = switching(edge, direction).map_err(wrong)?;
                            edges.push(Edge { s, theta, is_on, direction });
                        }
                        _ => {
                            let what = "the row has not as many values as the header";
                            return Err(wrong(what.to_owned()));
                        }
                    }
                }
            }
        }
    }
    let mut rows = match kind.ok_or(LogError::Empty)? {
        Kind::Peaks => Rows::Peaks(peaks),
        Kind::Samples => Rows::Samples(samples),
        Kind::Edges => Rows::Edges(edges),
    };
    if known.bed_is_reversed {
        rows.mirror();
    }
    Ok(Log { known, rows })
}

impl Rows {
    /// Returns how many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Peaks(rows) => rows.len(),
            Self::Samples(rows) => rows.len(),
            Self::Edges(rows) => rows.len(),
        }
    }

    /// Returns whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A bed that counts the other way: its growing count is a falling azimuth.
    fn mirror(&mut self) {
        match self {
            Self::Peaks(rows) => rows.iter_mut().for_each(|row| row.theta = -row.theta),
            Self::Samples(rows) => rows.iter_mut().for_each(|row| row.theta = -row.theta),
            Self::Edges(rows) => rows.iter_mut().for_each(|row| row.theta = -row.theta),
        }
    }
}

fn header(row: &str) -> Option<Kind> {
    let names: Vec<&str> = row.split(',').map(str::trim).collect();
    match names.as_slice() {
        ["s_mm", "theta_deg"] => Some(Kind::Peaks),
        ["s_mm", "theta_deg", "level"] => Some(Kind::Samples),
        ["s_mm", "theta_deg", "edge", "direction"] => Some(Kind::Edges),
        _ => None,
    }
}

fn place(row: &str) -> Result<(f64, f64, Vec<&str>), String> {
    let mut values = row.split(',').map(str::trim);
    let mut next = |most| {
        let value = values.next().ok_or_else(|| "the row is too short".to_owned())?;
        number(value, most)
    };
    let (s, theta_deg) = (next(FARTHEST_MM)?, next(MOST_DEG)?);
    Ok((s, theta_deg.to_radians(), values.collect()))
}

fn number(text: &str, most: f64) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{} is no number", shown(text)))?;
    // What is not a number is in no range.
    let in_range = value.abs() <= most;
    if in_range { Ok(value) } else { Err(format!("{value:?} is not within ±{most:?}")) }
}

/// A word of a file, for people.
pub(super) fn shown(text: &str) -> String {
    const MOST: usize = 30;
    let start: String = text.chars().filter(|c| !c.is_control()).take(MOST).collect();
    format!("\"{start}\"")
}

fn switching(edge: &str, direction: &str) -> Result<(bool, Direction), String> {
    let is_on = match edge {
        "on" => true,
        "off" => false,
        _ => return Err(format!("the edge {} is neither on nor off", shown(edge))),
    };
    let direction = Direction::from_word(direction)
        .ok_or_else(|| format!("the direction {} is none of cw, ccw, in, out", shown(direction)))?;
    Ok((is_on, direction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_read() {
        let text =
            "\u{feff}# ring_radius_mm = 100\r\n# Sunday\r\ns_mm , theta_deg\r\n\r\n1,180\r\n";
        let log = parse(text).unwrap();
        assert_eq!(log.known.ring_radius, Some(100.0));
        assert_eq!(log.rows, Rows::Peaks(vec![Sighting::new(1.0, std::f64::consts::PI)]));
        let log = parse("s_mm,theta_deg,level\n-2,0,-3.5\n").unwrap();
        assert_eq!(log.rows, Rows::Samples(vec![Sample { s: -2.0, theta: 0.0, level: -3.5 }]));
        let log = parse("s_mm,theta_deg,edge,direction\n1,0,on,ccw\n1,0,off,in").unwrap();
        let Rows::Edges(edges) = log.rows else { panic!("edges") };
        assert_eq!(edges[0].direction, Direction::CounterClockwise);
        assert!(edges[0].is_on && !edges[1].is_on);
    }

    #[test]
    fn a_reversed_bed_counts_the_other_way() {
        let log = parse("# bed_reversed = true\ns_mm,theta_deg\n1,180").unwrap();
        assert_eq!(log.rows, Rows::Peaks(vec![Sighting::new(1.0, -std::f64::consts::PI)]));
    }

    #[test]
    fn nonsense_is_refused_with_its_line() {
        let line = |text: &str| match parse(text).unwrap_err() {
            LogError::Header { line } => line,
            LogError::Row { line, .. } | LogError::Setting { line, .. } => line,
            LogError::Empty => 0,
        };
        assert_eq!(line("# nothing"), 0);
        assert_eq!(line("\nr,phi\n1,2"), 2);
        assert_eq!(line("s_mm,theta_deg\n1,2\n1"), 3);
        assert_eq!(line("s_mm,theta_deg\n1,2,3"), 2);
        assert_eq!(line("s_mm,theta_deg\n1,nan"), 2);
        assert_eq!(line("s_mm,theta_deg\n1e9,0"), 2);
        assert_eq!(line("s_mm,theta_deg,edge,direction\n1,0,up,cw"), 2);
        assert_eq!(line("s_mm,theta_deg,edge,direction\n1,0,on,left"), 2);
        assert_eq!(line("# magnets = 2\ns_mm,theta_deg"), 1);
    }
}
