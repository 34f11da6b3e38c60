//! Pulses as words of a parallel port.
//!
//! The port has eight data lines. The first four drive the phases of the motor that is addressed, the
//! next three address the motors of the first three axes, one each; a latch for every motor holds its
//! phases until it is addressed again, and amplifiers stand behind the latches. The source's port ends
//! there; the eighth line, which it leaves free, addresses the fourth motor.
//!
//! ```text
//! # rhumb port words 1, half steps
//! # bits 0-3: phases A B C D; bit 4: R, bit 5: theta, bit 6: Z, bit 7: E
//! time_us,word
//! 0,0x11
//! 1250,0x13
//! ```
//!
//! A row is a word and the time at which it is put out, whole µs from the begin of the program. The
//! first rows, at 0, give every motor its phases where it stands. A word is put out when the axis
//! passes the middle between two steps, so that the motor is never more than half a step behind or ahead.
//! Words of one time are put out one after the other, in the order of the axes.
//!
//! Phases of a four-phase motor, `DCBA`, for counts 0, 1, 2 …:
//!
//! * half steps: one phase and two by turns, 0001 0011 0010 0110 0100 1100 1000 1001;
//! * full steps: two phases at a time, 0011 0110 1100 1001.
//!
//! Backwards the sequence runs the other way. Source: synthesis of the control of step drives for
//! prescribed movements (Kyrgyz State Technical University).

use std::io::{self, Write};

use super::{Axes, Interval, MOST_AXES};

/// How the phases follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sequence {
    /// Two phases at a time; a count is a full step.
    Full,
    /// One and two by turns; a count is half a step.
    Half,
}

impl Sequence {
    /// Counts in a full step.
    #[must_use]
    pub fn microsteps(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
        }
    }

    /// Returns the phases at a count, D to A in bits 3 to 0.
    #[must_use]
    pub fn phases(self, count: i64) -> u8 {
        let sequence: &[u8] = match self {
            Self::Full => &[0b0011, 0b0110, 0b1100, 0b1001],
            Self::Half => &[0b0001, 0b0011, 0b0010, 0b0110, 0b0100, 0b1100, 0b1000, 0b1001],
        };
        sequence[count.rem_euclid(sequence.len() as i64) as usize]
    }

    /// Returns the word that brings the motor of an axis to a count.
    #[must_use]
    pub fn word(self, axis: usize, count: i64) -> u8 {
        self.phases(count) | 0b1_0000 << axis
    }

    fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Half => "half",
        }
    }
}

/// Microseconds in a second.
const US: f64 = 1e6;

/// Writes words, interval by interval.
#[derive(Debug)]
pub struct Port<W> {
    out: W,
    axes: Axes,
    sequence: Sequence,
    /// The words of the present interval: when, axis and count.
    words: Vec<(f64, usize, i64)>,
}

impl<W: Write> Port<W> {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn new(
        mut out: W,
        axes: &Axes,
        sequence: Sequence,
        start: [i64; MOST_AXES],
    ) -> io::Result<Self> {
        writeln!(out, "# rhumb port words 1, {} steps", sequence.name())?;
        write!(out, "# bits 0-3: phases A B C D")?;
        for (k, name) in axes.names.iter().enumerate() {
            write!(out, "{} bit {}: {name}", if k == 0 { ';' } else { ',' }, k + 4)?;
        }
        writeln!(out, "\ntime_us,word")?;
        let mut port = Self { out, axes: *axes, sequence, words: Vec::new() };
        for (axis, &count) in start[..axes.names.len()].iter().enumerate() {
            port.word(0.0, axis, count)?;
        }
        Ok(port)
    }

    /// Writes the words of an interval.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn interval(&mut self, interval: &Interval) -> io::Result<()> {
        self.words.clear();
        for axis in 0..self.axes.names.len() {
            let pulses = interval.pulses[axis];
            let way = pulses.signum();
            let step = self.axes.steps[axis];
            let [from, to] = [interval.from[axis], interval.to[axis]].map(|at| at / step);
            for k in 0..pulses.abs() {
                let count = interval.count[axis] + way * k;
                // Rounding puts the middle a hair outside of the interval at most.
                let middle = count as f64 + 0.5 * way as f64;
                let share = ((middle - from) / (to - from)).clamp(0.0, 1.0);
                let time = interval.start + share * interval.duration;
                self.words.push((time, axis, count + way));
            }
        }
        // Stable: the words of one time stay in the order of the axes.
        self.words.sort_by(|a, b| a.0.total_cmp(&b.0));
        for k in 0..self.words.len() {
            let (time, axis, count) = self.words[k];
            self.word(time, axis, count)?;
        }
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn word(&mut self, time: f64, axis: usize, count: i64) -> io::Result<()> {
        writeln!(self.out, "{:.0},0x{:02x}", time * US, self.sequence.word(axis, count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::count::Counts;
    use crate::steps::table;

    fn axes(step: f64) -> Axes {
        Axes { names: &["X", "Y", "Z"], steps: [step, step, step, 1.0], turns: [false; MOST_AXES] }
    }

    #[test]
    fn words_as_they_are_documented() {
        let axes = axes(0.8);
        let mut counts = Counts::new(axes, [0.0; 4]);
        let mut out = Vec::new();
        let mut port = Port::new(&mut out, &axes, Sequence::Half, counts.count()).unwrap();
        port.interval(&counts.go(1, [1.6, -0.8, 0.0, 0.0], 0.004)).unwrap();
        let expected = "# rhumb port words 1, half steps\n\
                        # bits 0-3: phases A B C D; bit 4: X, bit 5: Y, bit 6: Z\n\
                        time_us,word\n\
                        0,0x11\n0,0x21\n0,0x41\n1000,0x13\n2000,0x29\n3000,0x12\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn neighbours_in_a_sequence_differ_by_one_switch_or_two() {
        for (sequence, most) in [(Sequence::Half, 1), (Sequence::Full, 2)] {
            for count in -9..9 {
                let change = sequence.phases(count) ^ sequence.phases(count + 1);
                assert_eq!(change.count_ones(), most);
            }
        }
        // Full steps are every second of the half steps.
        for count in -9..9 {
            assert_eq!(Sequence::Full.phases(count), Sequence::Half.phases(2 * count + 1));
        }
    }

    #[test]
    fn the_phases_of_the_example_lead_each_motor_to_its_place() {
        let axes = axes(0.8);
        let points = table::read(table::EXAMPLE).unwrap();
        let (start, intervals) = table::intervals(&points, &axes);
        let mut out = Vec::new();
        let mut port = Port::new(&mut out, &axes, Sequence::Half, start).unwrap();
        intervals.iter().for_each(|interval| port.interval(interval).unwrap());
        let text = String::from_utf8(out).unwrap();
        // A motor turns by the difference of the phases, half a turn of the sequence at most.
        let (mut at, mut last) = ([0_i64; 3], 0_u64);
        for row in text.lines().skip(6) {
            let (time, word) = row.split_once(',').unwrap();
            let (time, word): (u64, u8) =
                (time.parse().unwrap(), u8::from_str_radix(&word[2..], 16).unwrap());
            assert!(time >= last, "{row}");
            last = time;
            let axis = (0..3).find(|axis| word >> 4 == 1 << axis).unwrap();
            let way =
                [1, -1].into_iter().find(|way| Sequence::Half.phases(at[axis] + way) == word & 0xf);
            at[axis] += way.unwrap();
        }
        assert_eq!((at, last), ([0, 0, 8], 12_976_000));
    }
}
