//! The closing words of a slice, as data and for people.

use std::fmt::Write as _;

use mesh::orient::{Rest, candidates};
use nalgebra::{Point3, Rotation3, Vector3};
use twin::verify::Verdict;

use crate::check::findings;
use crate::choice::Choice;
use crate::pipeline::{Outcome, part};
use crate::program_text::duration;
use crate::ranges::LaidSpan;
use crate::report::{
    FloatingIsland, LayerRange, Layers, MeshHealth, Model, Orientation, OrientationCandidate,
    Print, Report, SlowFlow, Verify, Weighed, WeighedSurface, tidy,
};
use crate::settings::Job;
use machine::gcode::decimal;

/// Returns the report of a slice. The other ways to lie are rated for a report that is written out
/// (`ranks`); the summary does not tell them.
#[must_use]
pub fn report(
    name: &str,
    outcome: &Outcome,
    verdict: Option<&Verdict>,
    job: &Job,
    ranks: bool,
) -> Report {
    let (health, totals, part) = (&outcome.health, &outcome.totals, part(outcome));
    let volume = outcome.placed.solid.volume_mm3();
    let bounds = part.bounds();
    let corner = |p: Point3<f64>| [p.x, p.y, p.z];
    let spans = &outcome.layout.spans;
    let supports = Some(totals.supports()).filter(|volume| *volume > 0.0);
    Report {
        rhumb: env!("CARGO_PKG_VERSION"),
        model: Model {
            file: name.to_owned(),
            triangles: health.facets,
            volume_mm3: volume,
            bounds_mm: [corner(bounds.min), corner(bounds.max)],
        },
        mesh: MeshHealth {
            shells: health.shells,
            open_edges: health.open_edges_left,
            nonmanifold_edges: health.nonmanifold_edges,
            flipped: health.flipped,
            degenerate: health.degenerate,
            duplicate: health.duplicate,
            repairs: health.repairs().map(|note| note.code.to_owned()).collect(),
        },
        orientation: orientation(outcome, job, ranks),
        layers: Layers {
            kind: if spans.is_empty() { outcome.layers.word() } else { "ranges" },
            ranges: spans.iter().map(layer_range).collect(),
            count: outcome.layout.levels.len(),
            levels_mm: outcome.layout.levels.iter().map(|level| tidy(level.upper)).collect(),
            heights_mm: outcome.heights.iter().map(|&height| tidy(height)).collect(),
            flats: outcome.layout.report(),
            flats_stepped: outcome.layout.report_stepped(),
            lost_mm2: outcome.lost.area,
            covered_share: 1.0 - outcome.lost_volume / volume,
            weighed: outcome.choice.as_ref().map(weighed),
            overhang_planar_mm2: outcome.overhang.map(|overhang| tidy(overhang.planar)),
            overhang_mm2: outcome.overhang.map(|overhang| tidy(overhang.chosen)),
            floating: floating(outcome),
        },
        print: Print {
            time_s: totals.time,
            filament_mm: totals.filament,
            filament_g: totals.filament * job.plan.filament.area * job.density_g_per_mm3,
            extruded_mm3: totals.extruded(),
            part_mm3: totals.part(),
            support_filament_mm: supports.map(|volume| volume / job.plan.filament.area),
            support_filament_g: supports.map(|volume| volume * job.density_g_per_mm3),
            travel_mm: totals.travel,
            moves: totals.moves,
            retractions: totals.retractions,
            bed_turns: totals.bed_turns,
            slow_flow: SlowFlow::of(&totals.slow_flow, job.plan.filament.least_flow),
        },
        verify: Verify { findings: verdict.map(findings).unwrap_or_default() },
        timings_ms: outcome.timings.clone(),
        warnings: outcome.warnings.clone(),
    }
}

/// What was weighed, and why which was taken.
fn weighed_rows(choice: &Choice) -> Vec<(&'static str, String)> {
    let candidates = choice.candidates.iter().map(|candidate| {
        let text = format!(
            "{}: {} mm² unsupported, steps {} of a layer, {} min",
            candidate.describe(),
            decimal(candidate.unsupported, 0),
            decimal(candidate.steps, 2),
            decimal(candidate.time / 60.0, 1)
        );
        ("weighed", text)
    });
    let steepest = decimal(choice.steepest.to_degrees(), 0);
    let why = format!("{}; the nozzle clears {steepest}°", choice.why());
    candidates.chain([("chosen", why)]).collect()
}

fn weighed(choice: &Choice) -> Weighed {
    let candidates = choice.candidates.iter().map(|candidate| WeighedSurface {
        surface: candidate.describe(),
        unsupported_mm2: tidy(candidate.unsupported),
        steps: tidy(candidate.steps),
        time_s: candidate.time,
        cost: tidy(candidate.cost),
    });
    Weighed {
        candidates: candidates.collect(),
        chosen: choice.best().describe(),
        steepest_deg: tidy(choice.steepest.to_degrees()),
        why: choice.why(),
    }
}

fn floating(outcome: &Outcome) -> Vec<FloatingIsland> {
    let islands = outcome.floating.iter().map(|(layer, island)| FloatingIsland {
        layer: *layer,
        at_mm: [tidy(island.at.x), tidy(island.at.y), tidy(island.at.z)],
        area_mm2: tidy(island.area),
    });
    islands.collect()
}

fn orientation(outcome: &Outcome, job: &Job, ranks: bool) -> Orientation {
    let rotation: &Rotation3<f64> = &outcome.placed.placement.rotation;
    let row = |i: usize| [rotation[(i, 0)], rotation[(i, 1)], rotation[(i, 2)]];
    let direction = |v: Vector3<f64>| [v.x, v.y, v.z];
    // Directions of the part, turned back to those of the model.
    let ranked = if ranks { candidates(part(outcome), &job.orient) } else { Vec::new() };
    Orientation {
        part_from_model: [row(0), row(1), row(2)],
        normal_model: direction(rotation.inverse() * -Vector3::z()),
        area_mm2: match outcome.placed.rest {
            Some(Rest::Flat(best)) => best.class_area_mm2,
            _ => 0.0,
        },
        candidates: ranked
            .iter()
            .map(|candidate| OrientationCandidate {
                normal_model: direction(rotation.inverse() * candidate.down),
                area_mm2: candidate.class_area_mm2,
                bed_area_mm2: candidate.bed_area_mm2,
                height_mm: candidate.height_mm,
            })
            .collect(),
    }
}

/// Returns the closing summary.
#[must_use]
pub fn text(
    report: &Report,
    outcome: &Outcome,
    verdict: Option<&Verdict>,
    job: &Job,
    target: &str,
    verbose: bool,
) -> String {
    let mut out = String::new();
    let size = part(outcome).bounds().size();
    let mut row = |label: &str, text: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{label:>10}  {text}");
    };
    row(
        "part",
        format!(
            "{} x {} x {} mm, {} mm³, {}",
            decimal(size.x, 2),
            decimal(size.y, 2),
            decimal(size.z, 2),
            decimal(report.model.volume_mm3, 1),
            resting(outcome)
        ),
    );
    row("layers", format!("{} of {} mm", report.layers.count, heights(report, job)));
    outcome.choice.iter().flat_map(weighed_rows).for_each(|(label, text)| row(label, text));
    for range in &report.layers.ranges {
        row("range", range_words(range));
    }
    if let Some(overhang) = outcome.overhang {
        if report.layers.ranges.is_empty() {
            row("surface", outcome.layers.describe());
        }
        row(
            "overhang",
            format!(
                "{} mm², with planar layers {} mm²",
                decimal(overhang.chosen, 0),
                decimal(overhang.planar, 0)
            ),
        );
    }
    if let Some(flats) = outcome.layout.summary() {
        row("flat faces", flats);
    }
    row("time", duration(report.print.time_s));
    row(
        "filament",
        format!(
            "{} m, {} g",
            decimal(report.print.filament_mm / 1000.0, 2),
            decimal(report.print.filament_g, 1)
        ),
    );
    if let (Some(length), Some(weight)) =
        (report.print.support_filament_mm, report.print.support_filament_g)
    {
        let (length, weight) = (decimal(length / 1000.0, 2), decimal(weight, 1));
        row("supports", format!("{length} m, {weight} g of that"));
    }
    row("bed", format!("{} turns", decimal(report.print.bed_turns, 0)));
    if let Some(slow) = &report.print.slow_flow {
        row("slow flow", slow.to_string());
    }
    for warning in &report.warnings {
        row("note", format!("{} [{}]", warning.message, warning.code));
    }
    judged(verdict).into_iter().for_each(|text| row("check", text));
    if verbose {
        let t = &report.timings_ms;
        row(
            "ms",
            format!(
                "read {:.0}, repair {:.0}, orient {:.0}, schedule {:.0}, slice {:.0}, verify {:.0}, \
                 total {:.0}",
                t.read, t.repair, t.orient, t.schedule, t.slice, t.verify, t.total
            ),
        );
    }
    row("written", target.to_owned());
    out
}

/// What the self-check says.
fn judged(verdict: Option<&Verdict>) -> Vec<String> {
    let Some(verdict) = verdict else { return vec!["left out on request".into()] };
    if verdict.findings.is_empty() {
        let moves = verdict.totals.moves;
        return vec![format!("{moves} moves read back and replayed: nothing to complain of")];
    }
    let findings = verdict.findings.iter().map(ToString::to_string);
    findings.chain(verdict.omitted.iter().map(ToString::to_string)).collect()
}

fn layer_range(span: &LaidSpan) -> LayerRange {
    let ([from, to], [thin, thick]) = (span.heights, span.thickness);
    LayerRange {
        kind: span.word,
        surface: span.follows.clone(),
        from_mm: tidy(from),
        to_mm: tidy(to),
        thinnest_mm: tidy(thin),
        thickest_mm: tidy(thick),
    }
}

fn range_words(range: &LayerRange) -> String {
    let mm = |value: f64| decimal(value, 2);
    let thickness = if range.thickest_mm - range.thinnest_mm < 0.005 {
        mm(range.thinnest_mm)
    } else {
        format!("{} to {}", mm(range.thinnest_mm), mm(range.thickest_mm))
    };
    let (from, to) = (mm(range.from_mm), mm(range.to_mm));
    let name = if range.kind == "blend" {
        format!("blend {}", range.surface)
    } else {
        range.surface.clone()
    };
    format!("{from} to {to} mm: {name}, {thickness} mm thick")
}

/// The heights of the layers above the first, and the first where it is another.
fn heights(report: &Report, job: &Job) -> String {
    let heights = &report.layers.heights_mm;
    let above = heights.get(1..).filter(|above| !above.is_empty()).unwrap_or(heights);
    let least = above.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = above.iter().copied().fold(0.0, f64::max);
    let range = if least == greatest {
        decimal(greatest, 3)
    } else {
        format!("{} to {}", decimal(least, 3), decimal(greatest, 3))
    };
    match heights.first() {
        Some(first) if job.schedule.first_layer_height != job.schedule.layer_height => {
            format!("{range} (the first {})", decimal(*first, 3))
        }
        _ => range,
    }
}

fn resting(outcome: &Outcome) -> String {
    let rests = &outcome.placed.rests;
    if !rests.is_empty() {
        return resting_together(rests);
    }
    match outcome.placed.rest {
        None => "in the pose that was asked for".into(),
        Some(Rest::Flat(best)) => {
            format!("resting on {} mm²", decimal(best.bed_area_mm2, 1))
        }
        Some(Rest::Kept { largest_share }) => format!(
            "as in the file: the largest flat face has only {} % of its surface",
            decimal(largest_share * 100.0, 1)
        ),
    }
}

/// How several models lie.
fn resting_together(rests: &[Option<Rest>]) -> String {
    let n_flat = rests.iter().filter(|rest| matches!(rest, Some(Rest::Flat(_)))).count();
    let n_asked = rests.iter().filter(|rest| rest.is_none()).count();
    let all = rests.len();
    if n_flat == all {
        format!("{all} models, each resting on its largest flat face")
    } else if n_asked == all {
        format!("{all} models, in the pose that was asked for")
    } else if n_flat == 0 && n_asked == 0 {
        format!("{all} models, as in their files: none has a large flat face")
    } else {
        format!("{all} models, {n_flat} of them resting on their largest flat faces")
    }
}
