//! The calibration file: how one machine misses the ideal one.
//!
//! TOML with tables `rail`, `column`, `plate`, `bed`, `head` and `quality`; every key may be left out.
//! Lengths in mm, angles in degrees. `quality` says how the numbers were found and is for people.

use machine::head::Head;
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, BedScale};
use machine::plate_shift::PlateShift;
use machine::profile::Printer;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::failure::{Failure, shown};
use crate::report::Warning;

/// A calibration file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Calibration {
    /// Where the nozzle stands on the rail.
    pub rail: Rail,
    /// How the lift leans.
    pub column: Column,
    /// Where the plate lies on the bed.
    pub plate: Plate,
    /// How the bed counts and how high it lies.
    pub bed: Bed,
    /// Where the tip lies under the pivot of a head that tilts.
    #[serde(skip_serializing_if = "HeadTable::is_empty")]
    pub head: HeadTable,
    /// How good the numbers are.
    pub quality: toml::Table,
}

/// `[rail]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rail {
    /// True minus commanded radius.
    pub a_mm: f64,
    /// How far the rail misses the axis.
    pub b_mm: f64,
}

/// `[column]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Column {
    /// Lean along the rail, mm per mm.
    pub a1: f64,
    /// Lean across it.
    pub b1: f64,
}

/// `[plate]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plate {
    /// Where the plate's centre lies, seen from the axis.
    pub ex_mm: f64,
    /// The same across.
    pub ey_mm: f64,
    /// How the plate is turned.
    pub psi_deg: f64,
    /// A constant shift as older converters have it, taken off the coordinates; see
    /// [`PlateShift`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_mm: Option<[f64; 2]>,
}

/// `[bed]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bed {
    /// Azimuth of the rail where the bed counts zero.
    pub theta_zero_deg: f64,
    /// Play of the drive.
    pub backlash_deg: f64,
    /// Heights: x, y (on the bed, from the axis) and dz, each in mm.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub probes: Vec<[f64; 3]>,
}

/// `[head]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeadTable {
    /// From the pivot to the tip, mm; that of the printer profile where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pivot_length_mm: Option<f64>,
    /// How far the tip lies beside the line down from the pivot, along and across the rail, mm; of heads
    /// with two axes. Where an upright tip stands is told by `rail`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<[f64; 2]>,
}

impl HeadTable {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Puts it into the head of a printer.
    fn apply(&self, printer: &mut Printer) -> Result<(), Failure> {
        if self.is_empty() {
            return Ok(());
        }
        let Some(Head::Tilting(head)) = &mut printer.head else {
            return Err(Failure::new(
                "ConfigConflict",
                "head.pivot_length_mm: this printer has no head that tilts about a pivot"
                    .to_owned(),
            ));
        };
        head.pivot_length = self.pivot_length_mm.unwrap_or(head.pivot_length);
        if let Some(offset) = self.offset_mm {
            if head.axes.len() < 2 {
                return Err(Failure::new(
                    "ConfigConflict",
                    "head.offset_mm: heads with one tilt have their tip below the pivot".to_owned(),
                ));
            }
            head.offset = Vector2::from(offset);
        }
        Ok(())
    }
}

/// A rail that misses the axis by more must be put right with a spanner, mm.
const GREATEST_MISS_MM: f64 = 1.5;

/// Largest misplacement of anything else, mm, and lean, mm per mm: beyond it a number is a mistake.
const GREATEST_OFFSET_MM: f64 = 50.0;
const GREATEST_LEAN: f64 = 0.2;

/// Least and greatest distance from pivot to tip, mm, as the setting has them.
const LEAST_PIVOT_MM: f64 = 1.0;
const GREATEST_PIVOT_MM: f64 = 1000.0;

/// Greatest play of the bed's drive, degrees.
const GREATEST_PLAY_DEG: f64 = 10.0;

impl Calibration {
    /// Reads a calibration file; `name` is what messages call it.
    ///
    /// # Errors
    ///
    /// `ConfigSyntax` for what is no such file, `ConfigRange` for what no machine can be.
    pub fn read(text: &[u8], name: &str) -> Result<Self, Failure> {
        let text = std::str::from_utf8(text)
            .map_err(|_| Failure::new("ConfigSyntax", format!("{name}: the file is not UTF-8")))?;
        let calibration: Self = toml::from_str(text).map_err(|error| {
            let before = error.span().map_or(0, |span| span.start).min(text.len());
            let line = text.as_bytes()[..before].iter().filter(|&&c| c == b'\n').count() + 1;
            let message: String = error.message().chars().take(200).collect();
            Failure::new("ConfigSyntax", format!("{name}, line {line}: {message}"))
        })?;
        calibration.check(name)?;
        Ok(calibration)
    }

    fn check(&self, name: &str) -> Result<(), Failure> {
        let [sx, sy] = self.plate.shift_mm.unwrap_or_default();
        let [ox, oy] = self.head.offset_mm.unwrap_or_default();
        if let Some(length) = self.head.pivot_length_mm
            && !(LEAST_PIVOT_MM..=GREATEST_PIVOT_MM).contains(&length)
        {
            return Err(Failure::new(
                "ConfigRange",
                format!(
                    "{name}: head.pivot_length_mm = {} is out of range; it is from \
                     {LEAST_PIVOT_MM} to {GREATEST_PIVOT_MM}",
                    shown(length)
                ),
            ));
        }
        let bounded = [
            ("rail.a_mm", self.rail.a_mm, GREATEST_OFFSET_MM),
            ("rail.b_mm", self.rail.b_mm, GREATEST_MISS_MM),
            ("column.a1", self.column.a1, GREATEST_LEAN),
            ("column.b1", self.column.b1, GREATEST_LEAN),
            ("plate.ex_mm", self.plate.ex_mm, GREATEST_OFFSET_MM),
            ("plate.ey_mm", self.plate.ey_mm, GREATEST_OFFSET_MM),
            ("plate.shift_mm", sx, GREATEST_OFFSET_MM),
            ("plate.shift_mm", sy, GREATEST_OFFSET_MM),
            ("head.offset_mm", ox, GREATEST_OFFSET_MM),
            ("head.offset_mm", oy, GREATEST_OFFSET_MM),
            ("plate.psi_deg", self.plate.psi_deg, 360.0),
            ("bed.theta_zero_deg", self.bed.theta_zero_deg, 360.0),
            ("bed.backlash_deg", self.bed.backlash_deg, GREATEST_PLAY_DEG),
        ];
        for (key, value, most) in bounded {
            // What is not a number is in no range.
            let is_play = key == "bed.backlash_deg";
            let in_range = value.abs() <= most && !(is_play && value < 0.0);
            if !in_range {
                let failure = Failure::new(
                    "ConfigRange",
                    format!(
                        "{name}: {key} = {} is out of range; it is within {most}",
                        shown(value)
                    ),
                );
                return Err(if key == "rail.b_mm" {
                    failure.hint("shim the rail so that it passes the axis, then calibrate again")
                } else {
                    failure
                });
            }
        }
        Ok(())
    }

    /// Puts the calibration into a printer; `fade` is the height at which a probed bed is no longer
    /// corrected for, mm.
    ///
    /// # Errors
    ///
    /// `ConfigRange` for probes that are no map of a bed, `ConfigConflict` for play of a bed under a head
    /// that turns the nozzle, and for a pivot of a head that has none.
    pub fn apply(&self, printer: &mut Printer, fade: f64) -> Result<(), Failure> {
        if printer.head.is_some() && self.bed.backlash_deg != 0.0 {
            return Err(Failure::new(
                "ConfigConflict",
                format!(
                    "bed.backlash_deg = {}: play of the bed is not taken up under a head that turns \
                     the nozzle",
                    self.bed.backlash_deg
                ),
            ));
        }
        self.head.apply(printer)?;
        let shift = self.plate.shift_mm.unwrap_or_default();
        let shift = PlateShift { by: Vector2::from(shift) };
        printer.alignment = Alignment {
            a: self.rail.a_mm,
            b: self.rail.b_mm,
            a1: self.column.a1,
            b1: self.column.b1,
            plate_offset: Vector2::new(self.plate.ex_mm, self.plate.ey_mm)
                + shift.as_plate_offset(),
            plate_angle: self.plate.psi_deg.to_radians(),
            bed: BedScale {
                zero: self.bed.theta_zero_deg.to_radians(),
                backlash: self.bed.backlash_deg.to_radians(),
                ..printer.alignment.bed
            },
        };
        printer.bed_map = HeightMap::new(&self.bed.probes, fade)
            .map_err(|error| Failure::new("ConfigRange", format!("bed.probes: {error}")))?;
        Ok(())
    }
}

/// Returns what a user should know of a printer's calibration.
#[must_use]
pub fn warning(printer: &Printer) -> Option<Warning> {
    let miss = printer.alignment.b.abs();
    (miss > printer.nozzle_diameter / 2.0).then(|| Warning {
        code: "RailMissesAxis".into(),
        message: format!(
            "the rail misses the axis by {miss:.3} mm: a hole of that radius stays in the middle"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Job, Settings};

    const FILE: &str = "[rail]\na_mm = 0.213\nb_mm = 0.347\n[column]\na1 = 0.001\n\
        [plate]\nex_mm = 0.12\ney_mm = -0.05\npsi_deg = 3\n\
        [bed]\ntheta_zero_deg = 90\nbacklash_deg = 0.05\n\
        probes = [[50, 0, 0.1], [-50, 0, 0.3], [0, 50, 0.2]]\n\
        [quality]\na_sd_mm = 0.003\nmethod = \"two-sided ring\"\n";

    #[test]
    fn every_number_reaches_the_machine() {
        let calibration = Calibration::read(FILE.as_bytes(), "cal.toml").unwrap();
        let mut printer = Job::resolve(&Settings::defaults()).unwrap().printer;
        calibration.apply(&mut printer, 10.0).unwrap();
        let alignment = printer.alignment;
        assert_eq!(
            (alignment.a, alignment.b, alignment.a1, alignment.b1),
            (0.213, 0.347, 0.001, 0.0)
        );
        assert_eq!(alignment.plate_offset, Vector2::new(0.12, -0.05));
        assert!((alignment.plate_angle - 3_f64.to_radians()).abs() < 1e-15);
        assert!((alignment.bed.zero - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((alignment.bed.backlash - 0.05_f64.to_radians()).abs() < 1e-15);
        assert!((printer.bed_map.height(&Vector2::new(0.0, 0.0)) - 0.2).abs() < 1e-9);
        assert!(warning(&printer).is_some());
    }

    #[test]
    fn a_constant_shift_is_an_offset_of_the_plate() {
        let text = "[plate]\nshift_mm = [2, 1]";
        let calibration = Calibration::read(text.as_bytes(), "cal.toml").unwrap();
        let mut printer = Job::resolve(&Settings::defaults()).unwrap().printer;
        calibration.apply(&mut printer, 10.0).unwrap();
        assert_eq!(printer.alignment.plate_offset, Vector2::new(-2.0, -1.0));
        assert!(warning(&printer).is_none());
    }

    #[test]
    fn the_pivot_of_a_head_reaches_the_machine_or_is_refused() {
        let printer = |head: &str| {
            let mut settings = Settings::defaults();
            settings.set(&format!("head={head}")).unwrap();
            Job::resolve(&settings).unwrap().printer
        };
        let read = |text: &str| Calibration::read(text.as_bytes(), "c").unwrap();
        let both = read("[head]\npivot_length_mm = 47.3\noffset_mm = [0.2, -0.1]");
        let mut two = printer("two-axis");
        both.apply(&mut two, 0.0).unwrap();
        let Some(Head::Tilting(head)) = &two.head else { panic!() };
        assert_eq!((head.pivot_length, head.offset), (47.3, Vector2::new(0.2, -0.1)));
        let class = |calibration: &Calibration, head: &str| {
            calibration.apply(&mut printer(head), 0.0).unwrap_err().class()
        };
        assert_eq!(class(&both, "fixed"), "ConfigConflict");
        assert_eq!(class(&both, "tilt"), "ConfigConflict");
        assert!(read("[head]\npivot_length_mm = 47.3").apply(&mut printer("tilt"), 0.0).is_ok());
    }

    #[test]
    fn what_no_machine_can_be_is_refused() {
        let class = |text: &str| Calibration::read(text.as_bytes(), "c").unwrap_err().class();
        assert_eq!(class("[rail]\nb_mm = 1.6"), "ConfigRange");
        assert_eq!(class("[rail]\na_mm = nan"), "ConfigRange");
        assert_eq!(class("[bed]\nbacklash_deg = -1"), "ConfigRange");
        assert_eq!(class("[head]\npivot_length_mm = 0"), "ConfigRange");
        assert_eq!(class("[head]\npivot_length_mm = nan"), "ConfigRange");
        assert_eq!(class("[head]\noffset_mm = [0, 60]"), "ConfigRange");
        assert_eq!(class("[rail]\nc_mm = 1"), "ConfigSyntax");
        assert_eq!(class("[rails]\na_mm = 1"), "ConfigSyntax");
        assert_eq!(class("[rail"), "ConfigSyntax");
        assert_eq!(Calibration::read(b"", "c").unwrap(), Calibration::default());
    }
}
