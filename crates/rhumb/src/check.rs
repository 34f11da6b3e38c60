//! The finished program, read again and proved on a model of the machine.

use std::io::BufRead;

use mesh::mesh::Mesh;
use twin::finding::{Finding, Severity};
use twin::segment::Segment;
use twin::verify::{Setup, Verdict, Verifier};

use crate::failure::Failure;
use crate::report;
use crate::settings::Job;

/// Reads a program line by line and judges it, `thorough`ly or as fast as it can; `each` sees every
/// motion.
///
/// # Errors
///
/// `Unreadable`, when the program cannot be read to its end.
pub fn check(
    mut program: impl BufRead,
    job: &Job,
    part: Option<&Mesh>,
    thorough: bool,
    mut each: impl FnMut(&Segment),
) -> Result<Verdict, Failure> {
    let mut verifier = Verifier::new(Setup {
        printer: &job.printer,
        dialect: job.dialect,
        filament_area: job.plan.filament.area,
        mesh: part,
        solid: job.paths.skins.all_solid,
        thorough,
    });
    let mut line = Vec::new();
    loop {
        line.clear();
        // A line without end is a line all the same; more than a megabyte of it is no program.
        let count = std::io::Read::take(&mut program, LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(|error| Failure::new("Unreadable", format!("program: {error}")))?;
        if count == 0 {
            return Ok(verifier.finish());
        }
        let text = line.strip_suffix(b"\n").unwrap_or(&line);
        if let Some(segment) = verifier.line_bytes(text) {
            each(&segment);
        }
    }
}

const LONGEST_LINE: u64 = 1 << 20;

/// Returns the failure that refuses a program with errors; `None` for one that may be printed.
#[must_use]
pub fn refusal(verdict: &Verdict) -> Option<Failure> {
    let errors: Vec<&Finding> =
        verdict.findings.iter().filter(|f| f.severity == Severity::Error).collect();
    let first = errors.first()?;
    let omitted: usize = verdict
        .omitted
        .iter()
        .filter(|omitted| omitted.severity == Severity::Error)
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
