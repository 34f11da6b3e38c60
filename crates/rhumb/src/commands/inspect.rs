//! `rhumb inspect`: what is in a mesh.

use std::fmt::Write as _;

use machine::gcode::decimal;
use mesh::health::Health;
use mesh::overlap::self_intersections;
use mesh::topology::Solid;

use super::{DONE, LOOK, display_name, say, say_json};
use crate::args::{Inspect, Manner};
use crate::failure::Failure;
use crate::input;
use crate::place::Wish;

/// Crossings that are listed; a mesh with more is not mended by knowing all.
const MOST_CROSSINGS: usize = 1000;

pub(super) fn run(arguments: &Inspect, manner: &Manner) -> Result<u8, Failure> {
    let bytes = input::read(&arguments.model)?;
    let (solid, health) = super::solid(&arguments.model, &bytes, &Wish::default())?;
    let crossings = self_intersections(&solid, MOST_CROSSINGS).len();
    if manner.json {
        say_json(&as_json(&display_name(&arguments.model), &solid, &health, crossings))?;
    } else {
        say(&as_text(&solid, &health, crossings))?;
    }
    Ok(if health.guessed { LOOK } else { DONE })
}

fn as_json(name: &str, solid: &Solid, health: &Health, crossings: usize) -> serde_json::Value {
    let bounds = solid.mesh().bounds();
    serde_json::json!({
        "file": name,
        "facets": health.facets,
        "triangles": health.triangles,
        "shells": health.shells,
        "volume_mm3": solid.volume_mm3(),
        "area_mm2": health.area_mm2,
        "bounds_mm": [
            [bounds.min.x, bounds.min.y, bounds.min.z],
            [bounds.max.x, bounds.max.y, bounds.max.z],
        ],
        "open_edges": health.open_edges,
        "open_edges_left": health.open_edges_left,
        "nonmanifold_edges": health.nonmanifold_edges,
        "flipped": health.flipped,
        "degenerate": health.degenerate,
        "duplicate": health.duplicate,
        "self_intersections": crossings,
        "guessed": health.guessed,
        "notes": health.notes.iter().map(|note| serde_json::json!({
            "code": note.code,
            "message": note.message,
        })).collect::<Vec<_>>(),
    })
}

fn as_text(solid: &Solid, health: &Health, crossings: usize) -> String {
    let bounds = solid.mesh().bounds();
    let size = bounds.size();
    let mut out = String::new();
    let mut row = |label: &str, text: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{label:>12}  {text}");
    };
    row(
        "size",
        format!("{} x {} x {} mm", decimal(size.x, 3), decimal(size.y, 3), decimal(size.z, 3)),
    );
    row(
        "from",
        format!(
            "({}, {}, {}) mm",
            decimal(bounds.min.x, 3),
            decimal(bounds.min.y, 3),
            decimal(bounds.min.z, 3)
        ),
    );
    row("volume", format!("{} mm³", decimal(solid.volume_mm3(), 2)));
    row("surface", format!("{} mm²", decimal(health.area_mm2, 2)));
    row("facets", format!("{} in the file, {} after repair", health.facets, health.triangles));
    row("shells", health.shells.to_string());
    row(
        "edges",
        format!(
            "{} open, {} with more than two facets; {} open after repair",
            health.open_edges, health.nonmanifold_edges, health.open_edges_left
        ),
    );
    row(
        "facets",
        format!(
            "{} turned over, {} without area, {} twice",
            health.flipped, health.degenerate, health.duplicate
        ),
    );
    row(
        "crossings",
        match crossings {
            0 => "none".into(),
            MOST_CROSSINGS => format!("{MOST_CROSSINGS} or more pairs of facets cross"),
            count => format!("{count} pairs of facets cross"),
        },
    );
    if health.notes.is_empty() {
        row("repair", "nothing to mend".into());
    }
    for note in &health.notes {
        row("note", format!("{} [{}]", note.message, note.code));
    }
    out
}
