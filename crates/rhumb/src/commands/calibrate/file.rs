//! Writing calibration files. What is not known is left out, never written as 0.

use std::path::Path;

use crate::calibration::Calibration;
use crate::commands::{display_name, write_file};
use crate::failure::Failure;

/// Decimals of lengths, mm, and of angles, degrees: far below what any measurement gives.
const DECIMALS: usize = 5;

/// A calibration file in the making: tables in the order of their first keys.
#[derive(Debug, Default)]
pub(super) struct Draft {
    tables: Vec<(&'static str, String)>,
}

impl Draft {
    /// Returns what is known of a machine already.
    pub(super) fn kept(before: &Calibration) -> Self {
        let mut draft = Self::default();
        let (rail, column, plate, bed) = (&before.rail, &before.column, &before.plate, &before.bed);
        for (table, key, value) in [
            ("rail", "a_mm", rail.a_mm),
            ("rail", "b_mm", rail.b_mm),
            ("column", "a1", column.a1),
            ("column", "b1", column.b1),
            ("plate", "ex_mm", plate.ex_mm),
            ("plate", "ey_mm", plate.ey_mm),
            ("plate", "psi_deg", plate.psi_deg),
            ("bed", "theta_zero_deg", bed.theta_zero_deg),
            ("bed", "backlash_deg", bed.backlash_deg),
        ] {
            draft.number(table, key, Some(value).filter(|value| *value != 0.0));
        }
        if let Some(shift) = plate.shift_mm {
            draft.pair("plate", "shift_mm", shift);
        }
        if !bed.probes.is_empty() {
            draft.triples("bed", "probes", &bed.probes);
        }
        for (key, value) in &before.quality {
            // What was said of an earlier pivot is said anew.
            if !key.starts_with("pivot_") {
                draft.line("quality", key, &value.to_string());
            }
        }
        draft
    }

    /// Adds the pivot of an earlier calibration.
    pub(super) fn keep_head(&mut self, before: &Calibration) {
        self.number("head", "pivot_length_mm", before.head.pivot_length_mm);
        if let Some(offset) = before.head.offset_mm {
            self.pair("head", "offset_mm", offset);
        }
    }

    /// Adds a number, where there is one.
    pub(super) fn number(&mut self, table: &'static str, key: &str, value: Option<f64>) {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            // A zero without a sign.
            let value = if value == 0.0 { 0.0 } else { value };
            self.line(table, key, &format!("{value:.DECIMALS$}"));
        }
    }

    /// Adds a whole number.
    pub(super) fn count(&mut self, table: &'static str, key: &str, value: usize) {
        self.line(table, key, &value.to_string());
    }

    /// Adds words.
    pub(super) fn words(&mut self, table: &'static str, key: &str, value: &str) {
        self.line(table, key, &toml::Value::from(value).to_string());
    }

    /// Adds a pair of numbers.
    pub(super) fn pair(&mut self, table: &'static str, key: &str, [x, y]: [f64; 2]) {
        self.line(table, key, &format!("[{x:.DECIMALS$}, {y:.DECIMALS$}]"));
    }

    /// Adds a list of three numbers each.
    pub(super) fn triples(&mut self, table: &'static str, key: &str, values: &[[f64; 3]]) {
        let rows: Vec<String> = values
            .iter()
            .map(|[x, y, z]| format!("[{x:.DECIMALS$}, {y:.DECIMALS$}, {z:.DECIMALS$}]"))
            .collect();
        self.line(table, key, &format!("[{}]", rows.join(", ")));
    }

    fn line(&mut self, table: &'static str, key: &str, value: &str) {
        let line = format!("{key} = {value}\n");
        match self.tables.iter_mut().find(|(name, _)| *name == table) {
            Some((_, lines)) => lines.push_str(&line),
            None => self.tables.push((table, line)),
        }
    }

    /// Returns the text.
    pub(super) fn text(&self) -> String {
        let tables: Vec<String> =
            self.tables.iter().map(|(name, lines)| format!("[{name}]\n{lines}")).collect();
        tables.join("\n")
    }

    /// Writes the file, whole or not at all, and only if it can be read again.
    ///
    /// # Errors
    ///
    /// `ConfigRange` for a rail that must be put right with a spanner, and what writing can meet.
    pub(super) fn write(&self, target: &Path, inputs: &[&Path]) -> Result<(), Failure> {
        let text = self.text();
        Calibration::read(text.as_bytes(), &display_name(target))?;
        write_file(target, inputs, text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_can_be_read() {
        let mut draft = Draft::default();
        draft.number("rail", "a_mm", Some(0.123_456_78));
        draft.number("quality", "a_sd_mm", Some(-0.0));
        draft.number("rail", "b_mm", None);
        draft.words("quality", "method", "two \"sides\"");
        draft.pair("quality", "sensor_offset_mm", [0.1, -0.2]);
        let text = draft.text();
        assert!(
            text.starts_with("[rail]\na_mm = 0.12346\n\n[quality]\na_sd_mm = 0.00000\n"),
            "{text}"
        );
        let calibration = Calibration::read(text.as_bytes(), "c").unwrap();
        assert_eq!(calibration.rail.a_mm, 0.12346);
        assert_eq!(calibration.quality["method"].as_str(), Some("two \"sides\""));
        assert!(!text.contains("b_mm"));
    }
}
