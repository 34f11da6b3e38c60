//! Puts what was found and done into sentences.

use super::Findings;
use crate::note::{self, Note, Tally, count, number, place};
use crate::overlap::{MeetingKind, ShellMeeting};
use crate::repair::RepairReport;
use crate::topology::Solid;
use crate::weld::WeldReport;

/// Returns the notes on a model, in the order of the work.
pub(super) fn notes(
    welded: &WeldReport,
    repaired: &RepairReport,
    solid: &Solid,
    findings: &Findings,
) -> Vec<Note> {
    let mut notes = Vec::new();
    let mut say = |code, message: Option<String>| {
        notes.extend(message.map(|message| Note::new(code, message)));
    };
    say(note::PRECISION_LOST, precision(welded));
    say(note::VERTICES_WELDED, seams(welded));
    say(note::DEGENERATE_REMOVED, degenerate(&repaired.degenerate));
    say(note::DUPLICATES_REMOVED, duplicate(&repaired.duplicate));
    say(note::T_JUNCTION, t_junctions(&repaired.t_junctions));
    say(note::FACETS_REORIENTED, turned(&repaired.flipped));
    say(note::HOLES_CLOSED, holes(repaired));
    say(note::SHAPE_GUESSED, guesses(&repaired.guessed));
    say(note::HOLES_LEFT, holes_left(&repaired.left_open));
    say(note::OPEN_SHELL_DROPPED, dropped(&repaired.dropped));
    say(note::NON_MANIFOLD, shared(repaired, solid, findings));
    say(note::SELF_INTERSECTION, overlaps(findings));
    notes
}

/// Returns the message when the tally counts anything.
fn when(tally: &Tally, message: impl FnOnce() -> String) -> Option<String> {
    (tally.count > 0).then(message)
}

fn was(n: usize) -> &'static str {
    if n == 1 { "was" } else { "were" }
}

fn precision(welded: &WeldReport) -> Option<String> {
    welded.precision_lost.map(|lost| {
        format!(
            "the model lies so far from the origin that the file's numbers step by {} mm, at a \
             size of {} mm; its shape is damaged: move it to the origin before exporting",
            number(lost.step),
            number(lost.size)
        )
    })
}

fn seams(welded: &WeldReport) -> Option<String> {
    let joined = &welded.joined;
    when(joined, || {
        format!(
            "{} on open seams {} joined with a neighbour, over {} mm at most, at {}",
            count(joined.count, "vertex"),
            was(joined.count),
            number(joined.worst),
            joined.place()
        )
    })
}

fn degenerate(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} with two equal corners {} removed, the longest ({} mm) at {}",
            count(tally.count, "facet"),
            was(tally.count),
            number(tally.worst),
            tally.place()
        )
    })
}

fn duplicate(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} ({} mm²) that the file holds more than once {} removed, the largest at {}",
            count(tally.count, "facet"),
            number(tally.total),
            was(tally.count),
            tally.place()
        )
    })
}

fn t_junctions(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "at {} facets were split because a vertex lies on a neighbour's side, within {} mm, \
             at {}",
            count(tally.count, "place"),
            number(tally.worst),
            tally.place()
        )
    })
}

fn turned(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} ({} mm²) {} turned over to face outwards, the largest at {}",
            count(tally.count, "facet"),
            number(tally.total),
            was(tally.count),
            tally.place()
        )
    })
}

fn holes(repaired: &RepairReport) -> Option<String> {
    let mut all = repaired.closed;
    all.merge(&repaired.guessed);
    when(&all, || {
        format!(
            "{} ({} mm²) {} closed, the largest ({} mm²) at {}",
            count(all.count, "hole"),
            number(all.total),
            was(all.count),
            number(all.worst),
            all.place()
        )
    })
}

fn guesses(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} of the holes {} not flat: the surface of least area ({} mm²) is a guess, the \
             largest at {}; look at the result",
            tally.count,
            was(tally.count),
            number(tally.total),
            tally.place()
        )
    })
}

fn holes_left(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} {} left open: rims of {} mm in all, the longest ({} mm) at {}",
            count(tally.count, "hole"),
            was(tally.count),
            number(tally.total),
            number(tally.worst),
            tally.place()
        )
    })
}

fn dropped(tally: &Tally) -> Option<String> {
    when(tally, || {
        format!(
            "{} ({} mm²) that enclosed nothing {} removed, the largest at {}",
            count(tally.count, "surface"),
            number(tally.total),
            was(tally.count),
            tally.place()
        )
    })
}

fn shared(repaired: &RepairReport, solid: &Solid, findings: &Findings) -> Option<String> {
    let edges = &repaired.nonmanifold_edges;
    let mut parts = Vec::new();
    if edges.count > 0 {
        parts.push(format!(
            "more than two facets share {} ({} mm), the longest at {}",
            count(edges.count, "edge"),
            number(edges.total),
            edges.place()
        ));
    }
    if let Some(first) = findings.pinched.first() {
        parts.push(format!(
            "surfaces meet only in {}, the first at {}",
            count(findings.pinched.len(), "vertex"),
            place(&solid.mesh().vertices[*first as usize])
        ));
    }
    parts.extend(meetings(findings, MeetingKind::Touching, "have a piece of wall in common"));
    (!parts.is_empty()).then(|| format!("{}; nothing was changed", parts.join("; ")))
}

fn overlaps(findings: &Findings) -> Option<String> {
    let mut parts = Vec::new();
    if let Some(first) = findings.crossings.first() {
        let n = findings.crossings.len();
        let more = if n == super::MOST_CROSSINGS { "or more " } else { "" };
        parts.push(format!(
            "facets pass through each other in {} {more}(first at {})",
            count(n, "place"),
            place(&first.at)
        ));
    }
    parts.extend(meetings(findings, MeetingKind::Crossing, "pass through each other"));
    parts.extend(meetings(
        findings,
        MeetingKind::Inside,
        "overlap, one in the material of the other",
    ));
    let rest = "overlapping material is printed once";
    (!parts.is_empty()).then(|| format!("{}; {rest}", parts.join("; ")))
}

/// What is to be said about the shells that meet in one way.
fn meetings(findings: &Findings, kind: MeetingKind, verb: &str) -> Option<String> {
    let of_kind: Vec<&ShellMeeting> = findings.meetings.iter().filter(|m| m.kind == kind).collect();
    let first = of_kind.first()?;
    let [a, b] = first.shells.map(|shell| shell + 1);
    let at = place(&first.at);
    Some(match of_kind.len() {
        1 => format!("shells {a} and {b} {verb}, at {at}"),
        n => format!("{} of shells {verb}, the first ({a} and {b}) at {at}", count(n, "pair")),
    })
}
