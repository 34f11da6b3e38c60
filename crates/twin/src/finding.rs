//! What the checks find, kept in bounded memory.

use std::fmt;

use nalgebra::Point3;

use crate::segment::Segment;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// Worth a look; the machine and the part are safe.
    Warning,
    /// The program must not be printed.
    Error,
}

/// Something that is not as it should be. [`Display`](fmt::Display) is the line for the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The name of the check, such as [`crate::check::reach::NAME`].
    pub check: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The line of the program, counted from 1.
    pub line: usize,
    /// The layer, when one had begun.
    pub layer: Option<usize>,
    /// What was measured, in the unit that the message names.
    pub measured: f64,
    /// What is allowed, in the same unit.
    pub limit: f64,
    /// What, where, measured and allowed, for people.
    pub message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.check, self.message)
    }
}

/// Findings that were counted and not kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Omitted {
    /// The name of the check.
    pub check: &'static str,
    /// How bad they are.
    pub severity: Severity,
    /// How many there are.
    pub count: usize,
}

impl fmt::Display for Omitted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: and {} more", self.check, self.count)
    }
}

/// Where something was found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) line: usize,
    pub(crate) layer: Option<usize>,
    /// In the part, mm.
    pub(crate) at: Option<Point3<f64>>,
}

impl Place {
    /// The place where a segment ends.
    pub(crate) fn end_of(segment: &Segment) -> Self {
        Self { line: segment.line, layer: segment.layer, at: Some(segment.part[1]) }
    }

    /// A line as such.
    pub(crate) fn line(line: usize, layer: Option<usize>) -> Self {
        Self { line, layer, at: None }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.line)?;
        if let Some(layer) = self.layer {
            write!(f, ", layer {layer}")?;
        }
        if let Some(at) = self.at {
            write!(f, ", x {:.3} y {:.3} z {:.3}", at.x, at.y, at.z)?;
        }
        Ok(())
    }
}

/// Findings that are kept of one check and severity. Fewer would hide where a fault begins and
/// ends; more would bury the findings of the other checks.
pub const MOST_KEPT: usize = 20;

/// All findings of a program. Checks add to it.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    kept: Vec<Finding>,
    counts: Vec<Omitted>,
}

impl Findings {
    /// Adds an error, with the place appended to the message.
    pub(crate) fn error(
        &mut self,
        check: &'static str,
        place: Place,
        (measured, limit): (f64, f64),
        what: impl FnOnce() -> String,
    ) {
        self.add(check, Severity::Error, place, (measured, limit), what);
    }

    /// Adds a warning, with the place appended to the message.
    pub(crate) fn warning(
        &mut self,
        check: &'static str,
        place: Place,
        (measured, limit): (f64, f64),
        what: impl FnOnce() -> String,
    ) {
        self.add(check, Severity::Warning, place, (measured, limit), what);
    }

    /// Adds a finding of this severity, with the place appended to the message.
    pub(crate) fn add(
        &mut self,
        check: &'static str,
        severity: Severity,
        place: Place,
        (measured, limit): (f64, f64),
        what: impl FnOnce() -> String,
    ) {
        if self.count(check, severity) <= MOST_KEPT {
            let message = format!("{} ({place})", what());
            let Place { line, layer, .. } = place;
            self.kept.push(Finding { check, severity, line, layer, measured, limit, message });
        }
    }

    /// Counts one more finding and returns how many there are now.
    fn count(&mut self, check: &'static str, severity: Severity) -> usize {
        let same = |known: &&mut Omitted| known.check == check && known.severity == severity;
        if let Some(known) = self.counts.iter_mut().find(same) {
            known.count += 1;
            return known.count;
        }
        self.counts.push(Omitted { check, severity, count: 1 });
        1
    }

    /// Returns whether nothing was found.
    pub(crate) fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Adds what a check found by itself, after all that it found before.
    pub(crate) fn append(&mut self, own: Self) {
        for count in own.counts {
            match self
                .counts
                .iter_mut()
                .find(|c| (c.check, c.severity) == (count.check, count.severity))
            {
                Some(known) => known.count += count.count,
                None => self.counts.push(count),
            }
        }
        self.kept.extend(own.kept);
    }

    /// Returns the findings that were kept, by line, and the counts of those that were not.
    pub(crate) fn into_parts(mut self) -> (Vec<Finding>, Vec<Omitted>) {
        // Stable: findings of one line stay in the order of the checks.
        self.kept.sort_by_key(|finding| finding.line);
        self.counts.retain_mut(|known| {
            known.count = known.count.saturating_sub(MOST_KEPT);
            known.count > 0
        });
        (self.kept, self.counts)
    }

    /// Returns the names of the checks that found something, for tests.
    #[cfg(test)]
    pub(crate) fn checks(&self) -> Vec<&'static str> {
        self.counts.iter().map(|known| known.check).collect()
    }

    /// Returns what was kept so far, for tests.
    #[cfg(test)]
    pub(crate) fn kept(&self) -> &[Finding] {
        &self.kept
    }
}

/// Returns whether `value` is above `limit`, or not a number.
pub(crate) fn exceeds(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan() || limit.is_nan()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_are_kept_and_the_rest_counted() {
        let mut findings = Findings::default();
        for line in (1..=332).rev() {
            findings.warning("reach", Place::line(line, None), (1.0, 0.0), || "far".into());
        }
        let place = Place { line: 7, layer: Some(2), at: Some(Point3::new(1.0, -2.0, 0.25)) };
        findings.error("reach", place, (131.2, 120.0), || "the carriage is off".into());
        let (kept, omitted) = findings.into_parts();
        assert_eq!(kept.len(), MOST_KEPT + 1);
        assert_eq!(kept[0].severity, Severity::Error);
        let text = "reach: the carriage is off (line 7, layer 2, x 1.000 y -2.000 z 0.250)";
        assert_eq!(kept[0].to_string(), text);
        assert!(kept.is_sorted_by_key(|finding| finding.line));
        assert_eq!(omitted.len(), 1);
        assert_eq!(omitted[0].to_string(), "reach: and 312 more");
    }

    #[test]
    fn what_is_not_a_number_exceeds_everything() {
        assert!(exceeds(2.0, 1.0) && exceeds(f64::NAN, 1.0) && exceeds(1.0, f64::NAN));
        assert!(!exceeds(1.0, 1.0) && !exceeds(1.0, f64::INFINITY));
    }
}
