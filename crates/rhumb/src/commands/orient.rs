//! `rhumb orient`: the ways to lay a model down.

use std::fmt::Write as _;

use machine::gcode::decimal;
use mesh::health::solid_from_soup;
use mesh::orient::candidates;
use mesh::stl;

use super::{DONE, display_name, say, say_json, settings, wish, write_file};
use crate::args::{Manner, Orient};
use crate::failure::Failure;
use crate::input;
use crate::place::place;

pub(super) fn run(arguments: &Orient, manner: &Manner) -> Result<u8, Failure> {
    let (_, job) = settings(&arguments.settings)?;
    let wish = wish(&arguments.place)?;
    let bytes = input::read(&arguments.model)?;
    let failed = |class: &'static str, message: String| Failure::new(class, message);
    let (soup, _) = stl::read(&bytes).map_err(|e| failed(e.class(), e.to_string()))?;
    let (solid, _) =
        solid_from_soup(&soup.scaled(wish.scale)).map_err(|e| failed(e.class(), e.to_string()))?;
    let ranked = candidates(solid.mesh(), &job.orient);
    if let Some(target) = &arguments.output {
        let placed = place(&solid, &wish, &job.orient);
        write_file(target, &[&arguments.model], &stl::write(placed.solid.mesh()))?;
    }
    if manner.json {
        let list: Vec<_> = ranked
            .iter()
            .map(|c| {
                serde_json::json!({
                    "normal_model": [c.down.x, c.down.y, c.down.z],
                    "area_mm2": c.class_area_mm2,
                    "bed_area_mm2": c.bed_area_mm2,
                    "height_mm": c.height_mm,
                    "overhang_mm2": c.overhang_area_mm2,
                })
            })
            .collect();
        let name = display_name(&arguments.model);
        say_json(&serde_json::json!({"file": name, "candidates": list}))?;
        return Ok(DONE);
    }
    let mut out = String::from(
        "rank  downwards in the model      flat mm²    on bed mm²  height mm  overhang mm²\n",
    );
    for (rank, c) in ranked.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{:>4}  ({:>6}, {:>6}, {:>6})  {:>12}  {:>12}  {:>9}  {:>12}",
            rank + 1,
            decimal(c.down.x, 3),
            decimal(c.down.y, 3),
            decimal(c.down.z, 3),
            decimal(c.class_area_mm2, 1),
            decimal(c.bed_area_mm2, 1),
            decimal(c.height_mm, 2),
            decimal(c.overhang_area_mm2, 1)
        );
    }
    say(&out)?;
    Ok(DONE)
}
