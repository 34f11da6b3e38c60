//! What kind of order a command is that says nothing of where the nozzle goes.

use machine::gcode::{Code, parse_line};

/// What is to become of a command that is no motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Slicers write it, and it means the same on every machine.
    Usual,
    /// Nobody here knows what it does.
    Unknown,
    /// It changes the machine for good, takes a guard away, or deletes files.
    Dangerous,
    /// From here on lines are written to the printer's card and not run.
    ToCard,
    /// The end of that.
    ToCardEnds,
}

/// `G` commands of slicers that pass on: dwell, retraction by the firmware, wiping, parking, levelling.
const USUAL_G: [u32; 12] = [4, 10, 11, 12, 26, 27, 29, 30, 32, 34, 80, 81];

/// `M` commands of slicers.
const USUAL_M: [u32; 82] = [
    0, 1, 2, 3, 4, 5, 17, 18, 24, 25, 42, 48, 73, 74, 75, 76, 77, 80, 81, 82, 83, 84, 85, 104, 105,
    106, 107, 108, 109, 110, 111, 113, 115, 116, 117, 118, 119, 132, 140, 141, 145, 150, 155, 190,
    191, 201, 202, 203, 204, 205, 207, 208, 209, 211, 217, 218, 220, 221, 226, 240, 280, 300, 400,
    401, 402, 404, 412, 413, 420, 425, 486, 555, 569, 572, 593, 600, 601, 602, 701, 702, 862, 900,
];

/// Commands that outlive the print or take a guard away: cold extrusion, PID, steps per millimetre, home
/// and probe offsets, current and saved settings, firmware updates, files on the card.
const DANGEROUS_M: [u32; 21] = [
    29, 30, 32, 92, 206, 301, 302, 303, 304, 305, 306, 428, 500, 501, 502, 504, 665, 666, 851, 997,
    906,
];

/// Tells what kind of order a command is, which is given without line number and comment.
pub(super) fn order(command: &str) -> Order {
    let Ok(line) = parse_line(&command[..code_end(command)]) else { return Order::Unknown };
    match line.command.map(|command| command.code) {
        Some(Code::Numbered(b'M', 28 | 928, _)) => Order::ToCard,
        Some(Code::Numbered(b'M', 29, _)) => Order::ToCardEnds,
        Some(Code::Numbered(b'M', number, _)) if DANGEROUS_M.contains(&number) => Order::Dangerous,
        Some(Code::Numbered(b'M', number, _)) if USUAL_M.contains(&number) => Order::Usual,
        Some(Code::Numbered(b'G', number, 0)) if USUAL_G.contains(&number) => Order::Usual,
        Some(Code::Numbered(b'T', ..)) => Order::Usual,
        _ => Order::Unknown,
    }
}

/// Where the letter and number of a command end; names end with the first blank.
fn code_end(command: &str) -> usize {
    let is_name = command.as_bytes().get(1).is_some_and(|byte| !byte.is_ascii_digit());
    let number = |c: char| c.is_ascii_digit() || c == '.';
    let rest = command.char_indices().skip(1);
    rest.filter(|(_, c)| if is_name { c.is_whitespace() } else { !number(*c) })
        .map(|(at, _)| at)
        .next()
        .unwrap_or(command.len())
}

/// The temperature that a command sets, °C, and whether it is that of the bed; `None` for others.
pub(super) fn heat(command: &str) -> Option<(f64, bool)> {
    let starts = command.as_bytes().first().is_some_and(|c| c.eq_ignore_ascii_case(&b'M'));
    let line = starts.then(|| parse_line(command).ok()).flatten()?;
    let command = line.command?;
    let Code::Numbered(b'M', number @ (104 | 109 | 140 | 190), 0) = command.code else {
        return None;
    };
    let told = command.word(b'S').or_else(|| command.word(b'R'))?;
    Some((told, matches!(number, 140 | 190)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_told_apart() {
        for usual in ["M104 S200", "m106 s255", "G4 P10", "T0", "M862.3 P \"MK3S\"", "M117 G1 X5"] {
            assert_eq!(order(usual), Order::Usual, "{usual}");
        }
        for unknown in
            ["M999 P1", "G777", "G53", "SET_FAN SPEED=1", "EXCLUDE_OBJECT_DEFINE NAME=ä", "ä"]
        {
            assert_eq!(order(unknown), Order::Unknown, "{unknown}");
        }
        for dangerous in ["M302 P1", "M500", "M92 E1000", "M30 keep.gco", "M851 Z-5", "m997"] {
            assert_eq!(order(dangerous), Order::Dangerous, "{dangerous}");
        }
        assert_eq!(order("M28 evil.g"), Order::ToCard);
        assert_eq!(order("M29"), Order::ToCardEnds);
    }

    #[test]
    fn heat_is_read() {
        assert_eq!(heat("M109 R215"), Some((215.0, false)));
        assert_eq!(heat("m140 s60"), Some((60.0, true)));
        assert_eq!(heat("M106 S255"), None);
        assert_eq!(heat("M117 S255"), None);
    }
}
