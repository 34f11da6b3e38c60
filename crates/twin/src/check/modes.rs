//! Is the machine in the state in which the program's words mean what they say?
//!
//! Before the first motion it must know where it is (`G28`), take positions as absolute (`G90`)
//! and filament as relative (`M83`), and a speed must have been given with the motion at the
//! latest. What a firmware assumes otherwise differs, and is kept from the print before.

use machine::gcode::{Code, Command};

use crate::finding::{Findings, Place};

/// The name of this check.
pub const NAME: &str = "modes";

/// Remembers what was commanded; each lack is reported once.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Modes {
    homed: bool,
    absolute: bool,
    relative_filament: bool,
    has_speed: bool,
}

impl Modes {
    /// Something was commanded of which nobody knows whether it homes.
    pub(crate) fn unknown(&mut self) {
        self.homed = true;
    }

    /// Takes note of a command.
    pub(crate) fn command(&mut self, command: &Command<'_>, place: Place, findings: &mut Findings) {
        match command.code {
            Code::Numbered(b'G', 28, 0) => self.homed = true,
            Code::Numbered(b'G', 90, 0) => self.absolute = true,
            Code::Numbered(b'G', 91, 0) => self.absolute = false,
            Code::Numbered(b'M', 83, 0) => self.relative_filament = true,
            Code::Numbered(b'M', 82, 0) => self.relative_filament = false,
            Code::Numbered(b'G', 0..=3, 0) => {
                self.has_speed |= command.word(b'F').is_some();
                let moves = b"RTXYCZE".iter().any(|letter| command.word(*letter).is_some());
                if moves {
                    self.motion(place, findings);
                }
            }
            _ => {}
        }
    }

    fn motion(&mut self, place: Place, findings: &mut Findings) {
        for (known, what) in [
            (&mut self.homed, "motion before G28: the machine does not know where it is"),
            (&mut self.absolute, "motion without G90: positions may be taken as relative"),
            (&mut self.relative_filament, "motion without M83: E may be taken as absolute"),
            (&mut self.has_speed, "motion before any F: the speed is that of the print before"),
        ] {
            if !*known {
                findings.error(NAME, place, (0.0, 1.0), || what.into());
                *known = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::gcode::parse_line;

    fn found(program: &str) -> Vec<String> {
        let (mut check, mut findings) = (Modes::default(), Findings::default());
        for (line, text) in (1..).zip(program.split('|')) {
            let command = parse_line(text).unwrap().command.unwrap();
            check.command(&command, Place::line(line, None), &mut findings);
        }
        findings.kept().iter().map(|finding| finding.message[..18].to_string()).collect()
    }

    #[test]
    fn each_lack_is_said_once() {
        assert!(found("G28|G90|M83|G1 F600|G1 R5 T0").is_empty());
        assert_eq!(found("G90|M83|G1 R5 T0 F60|G1 R6 T0"), ["motion before G28:"]);
        assert_eq!(found("G28|M83|G1 R5 T0 F60"), ["motion without G90"]);
        assert_eq!(found("G28|G90|G1 R5 T0 F60"), ["motion without M83"]);
        assert_eq!(found("G28|G90|M83|M82|G1 R5 T0 F60"), ["motion without M83"]);
        assert_eq!(found("G28|G90|M83|G1 R5 T0"), ["motion before any "]);
        assert_eq!(found("G1 E1").len(), 4);
    }
}
