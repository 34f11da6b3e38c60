//! Watches what another program asks of the machine: what is beyond its limits is refused, what
//! would change it for good is left out, and what a user should know is gathered.

use machine::profile::Printer;
use nalgebra::Point3;
use plan::route::Stroke;

use super::concern::{Concern, Concerns};
use super::order::{Order, heat, order};
use super::reader::ReadError;

/// Watches a program; see the [module](self).
#[derive(Debug)]
pub(super) struct Watch {
    /// Hottest nozzle and bed, °C.
    hottest: [f64; 2],
    /// Coldest nozzle that extrudes, °C.
    coldest: f64,
    /// The fastest that a nozzle can move over the bed, mm/s.
    fastest: f64,
    /// Filament per path from which a line is too thick, and the least length of filament that counts,
    /// mm.
    thickest: f64,
    least_spike: f64,
    keeps_dangerous: bool,
    concerns: Concerns,
    /// Whether the program has homed the machine, or called a macro that may have.
    knows_place: bool,
    has_moved: bool,
    /// The temperature told last, °C; `None` where a macro may have told another.
    nozzle: Option<f64>,
    is_on_card: bool,
}

/// Thickest line, as a multiple of the square of the nozzle's bore: Klipper refuses more.
const THICKEST: f64 = 4.0;

impl Watch {
    /// Returns a watch for a machine that prints filament of this cross-section, mm².
    pub(super) fn new(printer: &Printer, filament_area: f64, keeps_dangerous: bool) -> Self {
        let farthest = printer.rail.min.abs().max(printer.rail.max.abs());
        let thickest = THICKEST * printer.nozzle_diameter.powi(2) / filament_area;
        Self {
            hottest: [printer.nozzle_temperature_max, printer.bed_temperature_max],
            coldest: printer.nozzle_temperature_min_extrude,
            fastest: printer.rail.speed.hypot(printer.bed.speed * farthest),
            thickest,
            least_spike: thickest * printer.nozzle_diameter,
            keeps_dangerous,
            concerns: Concerns::default(),
            knows_place: false,
            has_moved: false,
            nozzle: None,
            is_on_card: false,
        }
    }

    /// Whether lines go to the printer's card now, and are not run.
    pub(super) fn is_on_card(&self) -> bool {
        self.is_on_card
    }

    /// Looks at a command that is no motion; returns whether it goes over.
    pub(super) fn other(&mut self, command: &str, line: usize) -> Result<bool, ReadError> {
        if self.is_on_card {
            self.is_on_card = order(command) != Order::ToCardEnds;
            return Ok(false);
        }
        if let Some((told, is_bed)) = heat(command) {
            let most = self.hottest[usize::from(is_bed)];
            if told > most {
                let of = if is_bed { "bed" } else { "nozzle" };
                return Err(ReadError::TooHot { of, told, most });
            }
            if !is_bed {
                self.nozzle = Some(told);
            }
        }
        if command.contains("//action") || command.contains("$(") || command.starts_with('@') {
            self.concerns.note("HostAction", line, command);
        }
        let order = order(command);
        self.is_on_card = order == Order::ToCard;
        match order {
            Order::Usual => Ok(true),
            Order::Unknown => {
                // It may be a macro that homes and heats.
                (self.knows_place, self.nozzle) = (true, None);
                self.concerns.note("UnknownCommand", line, command);
                Ok(true)
            }
            Order::Dangerous if self.keeps_dangerous => Ok(true),
            Order::Dangerous | Order::ToCard | Order::ToCardEnds => {
                self.concerns.note("DangerousCommand", line, command);
                Ok(false)
            }
        }
    }

    /// Looks at a command that homes.
    pub(super) fn home(&mut self, command: &str, line: usize) {
        self.knows_place = true;
        let named = |axis: char| command.chars().skip(1).any(|c| c.eq_ignore_ascii_case(&axis));
        if named('X') != named('Y') {
            self.concerns.note("HomeXY", line, command);
        }
    }

    /// Looks at a line of which a bracket stays open.
    pub(super) fn open_bracket(&mut self, text: &str, line: usize) {
        self.concerns.note("UnclosedComment", line, text);
    }

    /// Looks at a comment.
    pub(super) fn comment(&mut self, comment: &str, line: usize) {
        if comment.trim_start().starts_with('@') || comment.contains("//action") {
            self.concerns.note("HostAction", line, comment);
        }
    }

    /// Looks at the strokes of a command, which begin at `from`.
    pub(super) fn moved(
        &mut self,
        from: Point3<f64>,
        strokes: &[Stroke],
        has_speed: bool,
        (command, line): (&str, usize),
    ) {
        let mut at = from;
        for stroke in strokes {
            let path = (stroke.to - std::mem::replace(&mut at, stroke.to)).norm();
            for (is, code) in [
                (
                    !std::mem::replace(&mut self.has_moved, true) && !self.knows_place,
                    "StartUnknown",
                ),
                (!has_speed, "NoFeedrate"),
                (stroke.speed > self.fastest, "FeedClamped"),
                (stroke.filament > 0.0 && self.is_cold(), "ColdExtrusion"),
                (path > 0.0 && self.is_spike(stroke.filament, path), "ExtrusionSpike"),
            ] {
                if is {
                    self.concerns.note(code, line, command);
                }
            }
        }
    }

    fn is_cold(&self) -> bool {
        self.nozzle.is_some_and(|told| told < self.coldest)
    }

    fn is_spike(&self, filament: f64, path: f64) -> bool {
        filament > self.least_spike && filament > self.thickest * path
    }

    /// Returns what a user should know, at the end of the program.
    pub(super) fn concerns(&mut self) -> Vec<Concern> {
        if !self.has_moved {
            self.concerns.note("NoMoves", 0, "");
        }
        self.concerns.all()
    }
}
