//! `rhumb orient`: the ways to lay a model down.

use std::fmt::Write as _;

use machine::gcode::decimal;
use mesh::mesh::Mesh;
use mesh::orient::{Candidate, Rating, Rest, candidates, rate, rest};
use mesh::{measure, stl};

use super::{DONE, display_name, say, say_json, settings, wish, write_file};
use crate::args::{Manner, Orient};
use crate::estimate::{Estimate, estimate};
use crate::failure::Failure;
use crate::input;
use crate::place::place;
use crate::program_text::duration;
use crate::settings::Job;

/// A way to lie, and what is known of it.
struct Choice {
    candidate: Candidate,
    rating: Rating,
    estimate: Estimate,
    /// Whether `--orient flat` takes it.
    is_default: bool,
}

pub(super) fn run(arguments: &Orient, manner: &Manner) -> Result<u8, Failure> {
    let (_, job) = settings(&arguments.settings)?;
    let wish = wish(&arguments.place)?;
    let bytes = input::read(&arguments.model)?;
    let (solid, _) = super::solid(&arguments.model, &bytes, &wish)?;
    if let Some(target) = &arguments.output {
        let placed = place(solid.clone(), &wish, &job.orient)?;
        write_file(target, &[&arguments.model], &stl::write(placed.solid.mesh()))?;
    }
    let choices = choices(solid.mesh(), &job);
    if manner.json {
        let list: Vec<_> = choices.iter().map(as_json).collect();
        let name = display_name(&arguments.model);
        say_json(&serde_json::json!({"file": name, "candidates": list}))?;
    } else {
        say(&as_text(&choices))?;
    }
    Ok(DONE)
}

fn choices(mesh: &Mesh, job: &Job) -> Vec<Choice> {
    let volume = measure::volume_mm3(mesh);
    let default = match rest(mesh, &job.orient).1 {
        Rest::Flat(candidate) => Some(candidate.down),
        Rest::Kept { .. } => None,
    };
    candidates(mesh, &job.orient)
        .into_iter()
        .map(|candidate| {
            let rating = rate(mesh, &candidate, &job.orient);
            Choice {
                candidate,
                rating,
                estimate: estimate(&rating, candidate.height_mm, volume, job),
                is_default: default == Some(candidate.down),
            }
        })
        .collect()
}

fn as_json(choice: &Choice) -> serde_json::Value {
    let Choice { candidate: c, rating, estimate, is_default } = choice;
    serde_json::json!({
        "normal_model": [c.down.x, c.down.y, c.down.z],
        "default": is_default,
        "area_mm2": c.class_area_mm2,
        "bed_area_mm2": c.bed_area_mm2,
        "height_mm": c.height_mm,
        "overhang_mm2": rating.planar_mm2,
        "cone": {"overhang_mm2": rating.cone_mm2, "angle_deg": rating.cone_rad.to_degrees()},
        "sphere": {"overhang_mm2": rating.sphere_mm2, "centre_z_mm": rating.sphere_centre_mm},
        "layers": estimate.layers,
        "stair_mm": estimate.stair,
        "time_s": estimate.time,
    })
}

fn as_text(choices: &[Choice]) -> String {
    let mut out = String::from(
        "                                                           overhang mm² of layers that are\n\
         rank  downwards in the model     flat mm²    bed mm²  height     flat  conical     \
         spherical            layers  stair mm  time\n",
    );
    for (rank, choice) in choices.iter().enumerate() {
        let Choice { candidate: c, rating, estimate, is_default } = choice;
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{:>3}{}  ({:>6}, {:>6}, {:>6})  {:>9}  {:>9}  {:>6}  {:>7}  {:>7} {:<6}  {:>7} {:<10}  \
             {:>6}  {:>8}  {}",
            rank + 1,
            if *is_default { '*' } else { ' ' },
            decimal(c.down.x, 3),
            decimal(c.down.y, 3),
            decimal(c.down.z, 3),
            decimal(c.class_area_mm2, 1),
            decimal(c.bed_area_mm2, 1),
            decimal(c.height_mm, 2),
            decimal(rating.planar_mm2, 1),
            decimal(rating.cone_mm2, 1),
            format!("({}°)", decimal(rating.cone_rad.to_degrees(), 0)),
            decimal(rating.sphere_mm2, 1),
            format!("({} mm)", decimal(rating.sphere_centre_mm, 0)),
            decimal(estimate.layers, 0),
            decimal(estimate.stair, 3),
            duration(estimate.time)
        );
    }
    out.push_str(
        "* is what --orient flat takes; --orient RANK takes another. In brackets: the angle of the \
         best cones (above 0 they slope down outwards) and the height of the best spheres' \
         centre.\nTimes are estimates, for comparison.\n",
    );
    out
}
