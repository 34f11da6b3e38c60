//! From planar layers to curved ones, or back: layers that are each a little steeper than the one below,
//! or a little flatter.

use machine::gcode::decimal;
use slicer::blend::{Aim, End, Side, even, fewest};
use slicer::level::Level;
use slicer::lift::LEAST_WEDGE_SHARE;
use slicer::surface::SurfaceError;

use crate::failure::Failure;
use crate::levels;
use crate::settings::Job;
use crate::stages::{LayerKind, Stage, unfit};

/// The curved layers that a blend leads to or from, over a part that reaches so far from the axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curved {
    /// The layers.
    pub(crate) kind: LayerKind,
    /// The greatest distance of the part from the axis, mm.
    pub(crate) reach: f64,
}

impl Curved {
    /// What is aimed at; `None` for planes.
    pub(crate) fn aim(&self) -> Option<Aim> {
        Some(match self.kind {
            LayerKind::Planar => return None,
            LayerKind::Conical(angle) => Aim::Cone { slope: angle.tan() },
            LayerKind::Spherical(centre_z) => Aim::Spheres { centre_z },
            LayerKind::Caps(radius) => Aim::Caps { radius },
        })
    }

    /// The end of a blend on the layer whose highest place is at `height` mm.
    fn end(&self, aim: &Aim, height: f64) -> End {
        let level = aim.level_at(height, self.reach);
        End { level, drop: aim.drop(level, self.reach) }
    }
}

/// How thin and how thick layers of a blend may be, mm: as thin and as thick as beads of a wedge are,
/// within what the printer can lay.
pub(crate) fn limits(job: &Job) -> [f64; 2] {
    let params = &job.schedule;
    let share = |share: f64| share * params.layer_height;
    [
        params.least_height.max(share(LEAST_WEDGE_SHARE)),
        params.greatest_height.min(share(1.0 + LEAST_WEDGE_SHARE)),
    ]
}

/// Returns the upper sides of the fewest layers that lead from the plane at height `floor` to curved
/// layers; none where these are planes.
///
/// # Errors
///
/// `OutOfEnvelope` when layers cannot be of different thickness, or the curved ones do not get as far as
/// the part, `LimitExceeded` when it takes too many.
pub(crate) fn shortest(curved: &Curved, floor: f64, job: &Job) -> Result<Vec<Side>, Failure> {
    let (limits, reach) = (limits(job), curved.reach);
    let Some(aim) = curved.aim().filter(|aim| aim.drop(floor, reach) != 0.0) else {
        return Ok(Vec::new());
    };
    if limits[0] >= limits[1] {
        return Err(Failure::new(
            "OutOfEnvelope",
            format!("layers that are all {} mm thick cannot grow steeper", limits[0]),
        )
        .hint(
            "min_layer_height_mm must be less than max_layer_height_mm, or leave the blend out \
             (blend = none, or no blend in the ranges of layers)",
        ));
    }
    let drop = aim.drop(floor, reach);
    if !drop.is_finite() {
        return Err(out_of_reach(curved));
    }
    levels::check_count(drop.abs() / (limits[1] - limits[0]))?;
    fewest(&aim, floor, reach, limits).map_err(|error| unfit(&error))
}

fn out_of_reach(curved: &Curved) -> Failure {
    let reach = decimal(curved.reach, 2);
    Failure::new(
        "OutOfEnvelope",
        format!(
            "{} layers do not reach the rim of the part, {reach} mm from the axis, where the blend \
             ends",
            curved.kind.word()
        ),
    )
    .hint("lower the centre with --sphere-centre, begin higher, or leave the blend out")
}

/// Which way a blend leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// From planes to curved layers.
    Up,
    /// From curved layers to planes.
    Down,
}

/// Returns the upper sides of layers that lead evenly, between two heights, to curved layers or back. The
/// heights are those of the highest places of the lower and the upper end.
///
/// # Errors
///
/// `OutOfEnvelope` when that takes layers thinner or thicker than may be, with what would do.
pub(crate) fn between(
    curved: &Curved,
    way: Way,
    [from, to]: [f64; 2],
    job: &Job,
) -> Result<Vec<Side>, Failure> {
    let (limits, height, reach) = (limits(job), job.schedule.layer_height, curved.reach);
    let aim = curved.aim().unwrap_or(Aim::Cone { slope: 0.0 });
    let laid = |to: f64| {
        let flat = |level: f64| End { level, drop: 0.0 };
        let ends = match way {
            Way::Up => [flat(from), curved.end(&aim, to)],
            Way::Down => [curved.end(&aim, from), flat(to)],
        };
        levels::check_count((ends[1].level - ends[0].level) / height)?;
        Ok(even(&aim, ends, reach, height).ok())
    };
    let keeps = |[thin, thick]: [f64; 2]| {
        thin >= limits[0] - ROUNDING_MM && thick <= limits[1] + ROUNDING_MM
    };
    let found = laid(to)?;
    if let Some(even) = found.as_ref().filter(|even| keeps(even.thickness)) {
        return Ok(even.sides.clone());
    }
    if !aim.drop(from, reach).is_finite() {
        return Err(out_of_reach(curved));
    }
    let what = match found {
        Some(even) => format!(
            "layers {} to {} mm thick",
            decimal(even.thickness[0], 3),
            decimal(even.thickness[1], 3)
        ),
        None => "layers that cross each other".into(),
    };
    let [least, most] = limits.map(|limit| decimal(limit, 3));
    let failure = Failure::new(
        "OutOfEnvelope",
        format!(
            "a blend from {from} to {to} mm would take {what}; the limits are {least} and {most} mm"
        ),
    );
    let mut wanted = (1..=HIGHER).map(|k| to + (to - from).max(height) * f64::from(k) * HIGHER_BY);
    let fits = |to: &f64| matches!(laid(*to), Ok(Some(even)) if keeps(even.thickness));
    let enough = wanted.find(fits).map(|to| decimal((to * 10.0).ceil() / 10.0, 1));
    Err(failure.hint(match enough {
        Some(to) => format!(
            "let the blend end at {to} mm or higher, choose flatter layers, or raise \
             max_layer_height_mm and lower min_layer_height_mm"
        ),
        None => "choose flatter layers, or raise max_layer_height_mm and lower \
                 min_layer_height_mm"
            .into(),
    }))
}

/// Rounding of a thickness, mm.
const ROUNDING_MM: f64 = 1e-6;

/// How many higher ends of a blend are tried, to say which would do.
const HIGHER: u32 = 200;

/// By how much each is higher than the last, as a share of the height that was asked for.
const HIGHER_BY: f64 = 0.05;

/// Layers with a surface each, as a stage on or under others.
pub(crate) struct Laid<'a> {
    /// The upper sides of the layers, from the lowest up.
    pub(crate) sides: &'a [Side],
    /// The side that they begin on.
    pub(crate) ground: Side,
    /// Which way they lead.
    pub(crate) way: Way,
    /// Layers below them.
    pub(crate) before: usize,
}

/// The stage of a blend, with those layers below and above that decide on its skins.
///
/// # Errors
///
/// `OutOfEnvelope` when a side is no surface.
pub(crate) fn stage(curved: &Curved, laid: &Laid<'_>, job: &Job) -> Result<Stage, Failure> {
    laid_out(curved, laid, job).map_err(|error| unfit(&error))
}

fn laid_out(curved: &Curved, laid: &Laid<'_>, job: &Job) -> Result<Stage, SurfaceError> {
    let (step, skins) = (job.schedule.layer_height, &job.paths.skins);
    let (below, above) = (skins.bottom_layers.max(1), skins.top_layers.max(1));
    let limits = limits(job);
    let mean = f64::midpoint(limits[0], limits[1]);
    let last = laid.sides.last().copied().unwrap_or(laid.ground);
    let aim = curved.aim().unwrap_or(Aim::Cone { slope: 0.0 });
    // One of the curved layers lies so much higher or lower on the axis.
    let rise = curved.kind.surface()?.level_step(step);
    let beside = |from: f64, k: usize, is_flat: bool, way: f64| {
        let by = way * k as f64;
        if is_flat { Side::plane(from + step * by) } else { aim.layer(from + rise * by) }
    };
    let is_up = laid.way == Way::Up;
    let lower = (0..=below).rev().map(|k| match k {
        0 => Ok(laid.ground),
        _ => beside(laid.ground.level, k, is_up, -1.0),
    });
    let beyond = (1..=above).map(|k| beside(last.level, k, !is_up, 1.0));
    let sides = lower.chain(laid.sides.iter().copied().map(Ok)).chain(beyond);
    let sides = sides.collect::<Result<Vec<Side>, _>>()?;
    let levels = sides[1..].iter().enumerate().map(|(k, side)| Level {
        index: (laid.before + k).saturating_sub(below),
        // Beads are laid as far apart as in a layer of the mean thickness.
        lower: side.level - side.sheet.surface().level_step(mean),
        upper: side.level,
    });
    Ok(Stage {
        surface: curved.kind.surface()?,
        kind: curved.kind,
        levels: levels.collect(),
        printed: below..below + laid.sides.len(),
        floor: None,
        ceiling: None,
        morph: Some(sides),
    })
}
