//! The finished program, read again and proved on a model of the machine.

use std::io::{BufRead, ErrorKind};

use mesh::mesh::Mesh;
use plan::tilt::CHORD_SHARE;
use twin::finding::{Finding, Severity};
use twin::segment::Segment;
use twin::verify::{Setup, Verdict, Verifier};

use crate::failure::Failure;
use crate::report;
use crate::settings::Job;

/// Chord tolerance and simplification that every proof allows, mm: those of the default settings.
const USUAL_TOLERANCE: f64 = 0.005 + 0.002;

/// Reads a program line by line and judges it, `thorough`ly or as fast as it can; `each` sees every
/// motion.
///
/// # Errors
///
/// `Unreadable`, when the program cannot be read to its end.
pub fn check(
    program: impl BufRead,
    job: &Job,
    part: Option<&Mesh>,
    thorough: bool,
    mut each: impl FnMut(&Segment),
) -> Result<Verdict, Failure> {
    let chord = job.plan.resample.chord;
    // A head that turns the nozzle leaves the way by another half of it.
    let chord = if job.printer.head.is_some() { chord * (1.0 + CHORD_SHARE) } else { chord };
    let mut verifier = Verifier::new(Setup {
        printer: &job.printer,
        dialect: job.dialect,
        filament_area: job.plan.filament.area,
        multiplier: job.plan.filament.multiplier,
        restart_extra: job.plan.filament.restart_extra,
        coarse: (chord + job.paths.tolerance - USUAL_TOLERANCE).max(0.0),
        volume_per_second: job.plan.filament.volume_per_second,
        mesh: part,
        moved: job.paths.compensation.greatest(),
        solid: job.paths.skins.all_solid,
        thorough,
    });
    each_line(program, |text| {
        verifier.each_of_line(text, &mut each);
    })?;
    Ok(verifier.finish())
}

/// Reads a program line by line, without their ends.
///
/// # Errors
///
/// `Unreadable`, when the program cannot be read to its end.
pub fn each_line(mut program: impl BufRead, mut each: impl FnMut(&[u8])) -> Result<(), Failure> {
    // What was read of a line that goes on beyond the buffer.
    let mut begun = Vec::new();
    loop {
        let buffer = match program.fill_buf() {
            Ok(buffer) => buffer,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(Failure::new("Unreadable", format!("program: {error}"))),
        };
        let count = buffer.len();
        if count == 0 {
            break;
        }
        let mut lines = buffer.split(|&byte| byte == b'\n');
        let last = lines.next_back().unwrap_or_default();
        for text in lines {
            if begun.is_empty() {
                each(text);
            } else {
                begun.extend_from_slice(text);
                each(&begun);
                begun.clear();
            }
        }
        begun.extend_from_slice(last);
        if begun.len() >= LONGEST_LINE {
            each(&begun);
            begun.clear();
        }
        program.consume(count);
    }
    if !begun.is_empty() {
        each(&begun);
    }
    Ok(())
}

/// A line without end is a line all the same; more than this of it, in bytes, is no program.
const LONGEST_LINE: usize = 1 << 20;

/// Returns the failure that refuses a program with errors; `None` for one that may be printed.
#[must_use]
pub fn refusal(verdict: &Verdict) -> Option<Failure> {
    refusal_for(verdict, |_| true)
}

/// What a converted program owes to us, and not to the one that it was made of.
const OURS: [&str; 5] = ["text", "reach", "axis", "speed", "acceleration"];

/// Returns the failure that refuses a converted program; `None` for one that may be printed as far as
/// it is our work. That a source does not home, or lays with the filament drawn back, is found and
/// said, and no reason to refuse.
#[must_use]
pub fn refusal_of_converted(verdict: &Verdict) -> Option<Failure> {
    refusal_for(verdict, |check| OURS.contains(&check))
}

fn refusal_for(verdict: &Verdict, counts: impl Fn(&str) -> bool) -> Option<Failure> {
    let is_fault = |severity: Severity, check: &str| severity == Severity::Error && counts(check);
    let errors: Vec<&Finding> =
        verdict.findings.iter().filter(|f| is_fault(f.severity, f.check)).collect();
    let first = errors.first()?;
    let omitted: usize = verdict
        .omitted
        .iter()
        .filter(|omitted| is_fault(omitted.severity, omitted.check))
        .map(|omitted| omitted.count)
        .sum();
    let count = errors.len() + omitted;
    Some(
        Failure::new(
            "SelfCheckFailed",
            format!("the finished program fails {count} checks; the first: {first}"),
        )
        .hint(
            "nothing was written; if neither settings nor start and end programs explain it, \
             please report this as a bug. --no-verify writes the program all the same",
        ),
    )
}

/// Returns a verdict as data.
#[must_use]
pub fn findings(verdict: &Verdict) -> Vec<report::Finding> {
    verdict
        .findings
        .iter()
        .map(|finding| report::Finding {
            check: finding.check,
            severity: match finding.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            line: finding.line,
            measured: finding.measured,
            limit: finding.limit,
            message: finding.message.clone(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_same_for_any_buffer() {
        for text in ["", "\n", "a", "a\nbc\n\ndef", "a\nbc\n\ndef\n"] {
            for size in 1..8 {
                let mut lines = Vec::new();
                let reader = std::io::BufReader::with_capacity(size, text.as_bytes());
                each_line(reader, |line| lines.push(String::from_utf8_lossy(line).into_owned()))
                    .unwrap();
                assert_eq!(lines, text.lines().collect::<Vec<_>>(), "{text:?} {size}");
            }
        }
    }
}
