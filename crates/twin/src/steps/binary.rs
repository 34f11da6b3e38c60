//! Pulses by interval in few bytes.
//!
//! All numbers are little-endian.
//!
//! | bytes | what |
//! | --- | --- |
//! | 8 | the letters `RHUMBSTP` |
//! | 1 | version: 1 |
//! | 1 | number of axes |
//! | 24 for each axis | name (8, ASCII, zeros at the end), what a pulse moves (`f64`, mm or degrees), where its motor stands before the first interval (`i64`, pulses from zero) |
//! | 2 and more for each interval, to the end of the file | time, then the pulses of each axis |
//!
//! Time is the µs by which the interval ends after the one before, ends rounded to whole ones, so that it
//! does not drift: a number of 7 bits to the byte, least first, the top bit set on all bytes but the last
//! (LEB128). Pulses are the same after folding negative ones in: `2n` for `n ≥ 0`, `−2n − 1` below.

use std::io::{self, Write};

use super::{Axes, Interval, MOST_AXES};

/// The first bytes.
pub const MAGIC: &[u8; 8] = b"RHUMBSTP";

const VERSION: u8 = 1;

/// Ticks in a second.
const TICKS: f64 = 1e6;

/// Writes intervals, one after the other.
#[derive(Debug)]
pub struct Binary<W> {
    out: W,
    axes: usize,
    ticks: u64,
}

impl<W: Write> Binary<W> {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn new(mut out: W, axes: &Axes, start: [i64; MOST_AXES]) -> io::Result<Self> {
        out.write_all(MAGIC)?;
        out.write_all(&[VERSION, axes.names.len() as u8])?;
        for (k, name) in axes.names.iter().enumerate() {
            let mut letters = [0; 8];
            for (to, from) in letters.iter_mut().zip(name.bytes()) {
                *to = from;
            }
            out.write_all(&letters)?;
            out.write_all(&axes.step_in_unit(k).to_le_bytes())?;
            out.write_all(&start[k].to_le_bytes())?;
        }
        Ok(Self { out, axes: axes.names.len(), ticks: 0 })
    }

    /// Writes an interval.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn interval(&mut self, interval: &Interval) -> io::Result<()> {
        let end = ((interval.start + interval.duration) * TICKS).round() as u64;
        self.number(end.saturating_sub(self.ticks))?;
        self.ticks = self.ticks.max(end);
        for &pulses in &interval.pulses[..self.axes] {
            self.number(folded(pulses))?;
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

    fn number(&mut self, mut number: u64) -> io::Result<()> {
        let mut bytes = [0; 10];
        let mut count = 0;
        loop {
            let low = (number & 0x7f) as u8;
            number >>= 7;
            bytes[count] = if number == 0 { low } else { low | 0x80 };
            count += 1;
            if number == 0 {
                return self.out.write_all(&bytes[..count]);
            }
        }
    }
}

fn folded(pulses: i64) -> u64 {
    ((pulses << 1) ^ (pulses >> 63)) as u64
}

/// What a file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// Of each axis its name, what a pulse moves, and where its motor stands at first.
    pub axes: Vec<(String, f64, i64)>,
    /// Of each interval how long it takes, s, and the pulses of each axis.
    pub intervals: Vec<(f64, Vec<i64>)>,
}

/// Reads a file; `None` when it is none, or ends within an interval.
#[must_use]
pub fn decode(bytes: &[u8]) -> Option<Decoded> {
    let mut rest = bytes.strip_prefix(MAGIC)?;
    let [version, count] = take(&mut rest)?;
    if version != VERSION {
        return None;
    }
    let mut axes = Vec::new();
    for _ in 0..count {
        let name: [u8; 8] = take(&mut rest)?;
        let end = name.iter().position(|&byte| byte == 0).unwrap_or(name.len());
        let name = std::str::from_utf8(&name[..end]).ok()?.to_owned();
        let step = f64::from_le_bytes(take(&mut rest)?);
        axes.push((name, step, i64::from_le_bytes(take(&mut rest)?)));
    }
    let mut intervals = Vec::new();
    while !rest.is_empty() {
        let ticks = number(&mut rest)?;
        let pulses = axes.iter().map(|_| number(&mut rest).map(unfolded)).collect::<Option<_>>()?;
        intervals.push((ticks as f64 / TICKS, pulses));
    }
    Some(Decoded { axes, intervals })
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (first, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(*first)
}

fn number(rest: &mut &[u8]) -> Option<u64> {
    let mut number = 0_u64;
    for shift in (0..64).step_by(7) {
        let [byte] = take(rest)?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

fn unfolded(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::count::Counts;

    #[test]
    fn what_was_written_is_read_again() {
        let axes = Axes { names: &["R", "theta"], steps: [0.5; 4], turns: [false; 4] };
        let mut counts = Counts::new(axes, [-3.0, 0.0, 0.0, 0.0]);
        let mut bytes = Vec::new();
        let mut file = Binary::new(&mut bytes, &axes, counts.count()).unwrap();
        let ways = [[0.0, 0.5], [-40.0, 1e6], [1e9, 1e6], [1e9, 1e6]];
        for to in ways {
            file.interval(&counts.go(1, [to[0], to[1], 0.0, 0.0], 1.0 / 3.0)).unwrap();
        }
        let decoded = decode(&bytes).unwrap();
        assert_eq!(decoded.axes, [("R".to_owned(), 0.5, -6), ("theta".to_owned(), 0.5, 0)]);
        let pulses: Vec<&[i64]> = decoded.intervals.iter().map(|(_, n)| n.as_slice()).collect();
        let expected = [[6, 1], [-80, 1_999_999], [2_000_000_080, 0], [0, 0]];
        assert_eq!(pulses, expected);
        let time: f64 = decoded.intervals.iter().map(|(time, _)| time).sum();
        assert!((time - 4.0 / 3.0).abs() < 1e-6);
        assert_eq!(decoded.intervals[3].1.len(), 2);
        for end in 0..bytes.len() {
            if let Some(part) = decode(&bytes[..end]) {
                assert!(part.intervals.len() < 4);
            }
        }
    }

    #[test]
    fn extremes_fold_and_unfold() {
        for pulses in [0, 1, -1, 63, -64, i64::MAX, i64::MIN] {
            assert_eq!(unfolded(folded(pulses)), pulses);
        }
        assert_eq!((folded(0), folded(-1), folded(1)), (0, 1, 2));
    }
}
