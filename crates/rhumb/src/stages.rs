//! The stages of a print: families of layers, one on top of the other.
//!
//! A planar print has one. A curved one begins with some planar layers on the bed
//! (`base_layers`), whose upper side is the floor that the curved layers begin on.
//!
//! With `top = planar` the curved layers end below each flat top, and planar ones finish it: the first
//! of them fills the wedges between the curved layers and its own plane, and the last ends on the
//! face. Where the part goes on above, curved layers begin anew on that floor.
//!
//! With `blend = morph` curved layers do not begin as wedges: between base and them lie layers that are
//! each a little steeper than the one below, as many as the limits of a layer's thickness ask for.
//!
//! What lies where may also be said by ranges of heights ([`crate::ranges`]).
//!
//! A stage knows more levels than it prints: what lies beyond is cut all the same, because it
//! decides where the printed ones are bottoms and tops. The base is part of the same solid, so its
//! layers and the curved ones need not know of each other.

use std::ops::Range;

use mesh::flats::Facing;
use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::{Point3, Vector3};
use plan::tilt::{Field, Tilt, TiltParams};
use slicer::blend::{Sheet, Side};
use slicer::clearance::{LayerOrder, Uphill, steepest_slope};
use slicer::level::{Level, Snap};
use slicer::lift::LEAST_WEDGE_SHARE;
use slicer::stacking::Stair;
use slicer::support::MARGIN_MM;
use slicer::surface::{Caps, Cone, Extent, Form, LayerSurface, Plane, Spheres, SurfaceError};

use crate::blend::{self, Curved, Laid, Way};
use crate::failure::Failure;
use crate::flat_tops::{Finish, Slab, Stand, finish};
use crate::levels::{self, Layout, MetFlat};
use crate::ranges;
use crate::settings::Job;

/// The surface that layers follow, as the user names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LayerKind {
    /// Horizontal planes.
    Planar,
    /// Cones about the axis; radians, positive for layers that slope down outwards.
    Conical(f64),
    /// Spheres about a point of the axis at this height, mm.
    Spherical(f64),
    /// Caps of a sphere of this radius (mm), one like the other.
    Caps(f64),
}

impl LayerKind {
    /// Returns the word that users write.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Planar => "planar",
            Self::Conical(_) => "conical",
            Self::Spherical(_) => "spherical",
            Self::Caps(_) => "caps",
        }
    }

    /// Says what it is, for people and for whoever reads the program.
    #[must_use]
    pub fn describe(self) -> String {
        let number = |value: f64| machine::gcode::decimal(value, 3);
        match self {
            Self::Planar => "planar".into(),
            Self::Conical(angle) => format!("conical, angle {}", number(angle.to_degrees())),
            Self::Spherical(centre_z) => format!("spherical, centre {}", number(centre_z)),
            Self::Caps(radius) => format!("caps, radius {}", number(radius)),
        }
    }

    pub(crate) fn surface(self) -> Result<Box<dyn LayerSurface>, SurfaceError> {
        Ok(match self {
            Self::Planar => Box::new(Plane),
            Self::Conical(angle) => Box::new(Cone::new(angle)?),
            Self::Spherical(centre_z) => Box::new(Spheres::new(centre_z)?),
            Self::Caps(radius) => Box::new(Caps::new(radius)?),
        })
    }
}

/// Layers of one family. See the [module](self).
pub struct Stage {
    /// The family.
    pub surface: Box<dyn LayerSurface>,
    /// What it is.
    pub kind: LayerKind,
    /// All levels that are cut.
    pub levels: Vec<Level>,
    /// Which of them are printed.
    pub printed: Range<usize>,
    /// The flat floor that the printed ones begin on, mm; `None` where they begin on the bed and
    /// are flat themselves.
    pub floor: Option<f64>,
    /// The height that the printed ones end at, mm; `None` where the part ends them.
    pub ceiling: Option<f64>,
    /// The sides of all layers, from the lowest up, where each has a surface of its own.
    pub morph: Option<Vec<Side>>,
}

impl Stage {
    /// Returns the unit normal of the upper side of a layer, upwards.
    #[must_use]
    pub fn normal(&self, k: usize, p: &Point3<f64>) -> Vector3<f64> {
        match self.morph.as_ref().and_then(|sides| sides.get(k + 1)) {
            Some(side) => side.sheet.surface().normal(p),
            None => self.surface.normal(p),
        }
    }

    /// What the curved layers of this stage are to a planar layer on top of them; `None` for other
    /// stages.
    pub(crate) fn stair(&self, first: &Level) -> Option<Stair<'_>> {
        let ceiling = self.ceiling?;
        let level = self.levels.get(self.printed.start)?;
        Some(Stair {
            surface: &*self.surface,
            level: level.upper,
            step: level.thickness(),
            floor: self.floor.unwrap_or(f64::NEG_INFINITY),
            top: first.upper,
            least: first.upper - ceiling,
        })
    }

    /// The greatest height that curved layers below these planar ones are laid at, mm: the first layer on
    /// them is nowhere thinner than a wedge may be.
    pub(crate) fn lowest_ground(&self) -> f64 {
        let first = &self.levels[self.printed.start];
        first.upper - LEAST_WEDGE_SHARE * first.thickness()
    }

    /// The highest place of the layers printed, within `radius` of the axis, mm.
    fn height_within(&self, radius: f64) -> f64 {
        let Some(last) = self.printed.end.checked_sub(1).and_then(|last| self.levels.get(last))
        else {
            return 0.0;
        };
        self.surface.height(last.upper, radius).max(last.upper)
    }

    /// The form of layer `k`.
    pub(crate) fn form(&self, k: usize) -> Form {
        match &self.morph {
            Some(sides) => sides[k + 1].sheet.surface().form(),
            None => self.surface.form(),
        }
    }

    /// What layer `k` is called in the program.
    pub(crate) fn describe(&self, k: usize) -> String {
        match &self.morph {
            Some(sides) => match &sides[k + 1].sheet {
                Sheet::Cone(cone) => LayerKind::Conical(cone.angle()).describe(),
                Sheet::Spheres(spheres) => LayerKind::Spherical(spheres.centre_z()).describe(),
            },
            None => self.kind.describe(),
        }
    }
}

/// Lays out the stages of a part that stands on the bed, and says which flat faces they meet.
///
/// # Errors
///
/// `LimitExceeded`, or `OutOfEnvelope` for a surface that does not fit the part.
pub fn stages(solid: &Solid, job: &Job) -> Result<(Vec<Stage>, Layout), Failure> {
    let part = solid.mesh();
    let layout = levels::layout(part, &Plane, job)?;
    if !job.spans.is_empty() {
        return ranges::stages(solid, job, layout);
    }
    if job.layers == LayerKind::Planar {
        return Ok((vec![flat(layout.levels.clone())], layout));
    }
    let kind = within_clearance(solid, job, job.layers)?;
    let surface = kind.surface().map_err(|error| unfit(&error))?;
    surface.fits(&extent(part)).map_err(|error| unfit(&error))?;
    let base = base(job);
    let floor = base.printed.end.checked_sub(1).map_or(0.0, |last| base.levels[last].upper);
    let blended = if job.morph { grown(part, kind, floor, job)? } else { None };
    // Where they begin on the axis, when they do not begin on the floor.
    let start = blended.as_ref().and_then(|stage| stage.levels.get(stage.printed.end - 1));
    let start = start.map(|last| last.upper);
    let stand = blended.as_ref().map_or(floor, |stage| stage.height_within(extent(part).radius));
    let stand = Stand { height: stand, is_blend: blended.is_some() };
    let finish = if job.planar_top {
        finish(&layout, part, &*surface, stand, job)
    } else {
        Finish::default()
    };
    let met = layout.flats.iter().filter(|met| {
        met.flat.facing == Facing::Up
            && finish.slabs.iter().any(|slab| (slab.top - met.flat.z_mm).abs() <= TOP_MM)
    });
    // The other faces are met by no layer on purpose.
    let flats = met.map(|met| MetFlat { miss: 0.0, ..*met }).collect();
    let layout = Layout { flats, stepped: finish.left, ..layout };
    let below: Vec<Stage> = std::iter::once(base).chain(blended).collect();
    Ok((between(part, kind, below, (floor, start), &finish.slabs, job)?, layout))
}

/// Planar layers that are all printed.
pub(crate) fn flat(levels: Vec<Level>) -> Stage {
    Stage {
        surface: Box::new(Plane),
        kind: LayerKind::Planar,
        printed: 0..levels.len(),
        levels,
        floor: None,
        ceiling: None,
        morph: None,
    }
}

/// The fewest layers that lead from the planar ones, which end at `floor` mm, to curved ones; `None` where
/// these are planes.
fn grown(part: &Mesh, kind: LayerKind, floor: f64, job: &Job) -> Result<Option<Stage>, Failure> {
    let curved = Curved { kind, reach: blend_reach(part, None, job) };
    let sides = blend::shortest(&curved, floor, job)?;
    if sides.is_empty() {
        return Ok(None);
    }
    let ground = Side::plane(floor).map_err(|error| unfit(&error))?;
    let laid = Laid { sides: &sides, ground, way: Way::Up, before: job.base_layers };
    blend::stage(&curved, &laid, job).map(Some)
}

/// How far from the axis a blend has layers, mm: as far as there is material, or supports; below `height`
/// mm where that is given.
pub(crate) fn blend_reach(part: &Mesh, height: Option<f64>, job: &Job) -> f64 {
    match height {
        _ if job.paths.support.is_some() => extent(part).radius + MARGIN_MM,
        Some(height) => radius_below(part, height),
        None => extent(part).radius,
    }
}

/// The greatest distance from the axis of a part's outside below a height, mm.
fn radius_below(part: &Mesh, height: f64) -> f64 {
    let mut radius = 0.0_f64;
    for triangle in &part.triangles {
        for k in 0..3 {
            let [a, b] = [k, (k + 1) % 3].map(|k| part.vertices[triangle[k] as usize]);
            if a.z <= height {
                radius = radius.max(a.x.hypot(a.y));
            }
            if (a.z < height) != (b.z < height) {
                let at = a.lerp(&b, (height - a.z) / (b.z - a.z));
                radius = radius.max(at.x.hypot(at.y));
            }
        }
    }
    radius
}

/// How far a flat face may lie from the end of a slab and be met by it, mm: what its own vertices differ
/// by.
const TOP_MM: f64 = 1e-3;

/// Puts curved layers on what is there already, and between slabs of planar ones.
fn between(
    part: &Mesh,
    kind: LayerKind,
    mut all: Vec<Stage>,
    (mut floor, mut start): (f64, Option<f64>),
    slabs: &[Slab],
    job: &Job,
) -> Result<Vec<Stage>, Failure> {
    let count = |all: &[Stage]| all.iter().map(|stage| stage.printed.len()).sum::<usize>();
    for slab in slabs {
        if slab.on_curved {
            let ceiling = slab.bottom + (1.0 - LEAST_WEDGE_SHARE) * slab.step();
            let space =
                Space { floor, start, end: None, ceiling: Some(ceiling), index: count(&all) };
            all.push(curved(part, kind, &space, job)?);
        }
        all.push(planar(slab, count(&all), job));
        (floor, start) = (slab.top, None);
    }
    // Above the highest point there is nothing left to do.
    if part.bounds().max.z > floor + TOP_MM {
        let space = Space { floor, start, end: None, ceiling: None, index: count(&all) };
        all.push(curved(part, kind, &space, job)?);
    }
    Ok(all)
}

/// The layers of a slab; `index` counts those below.
fn planar(slab: &Slab, index: usize, job: &Job) -> Stage {
    let skins = &job.paths.skins;
    let below = skins.bottom_layers.max(1);
    let printed = below..below + slab.count;
    let bound = |k: usize| slab.top - slab.step() * (printed.end as f64 - k as f64);
    let levels = (0..printed.end + skins.top_layers.max(1))
        .map(|k| Level {
            index: (index.max(1) + k).saturating_sub(below),
            lower: bound(k),
            upper: bound(k + 1),
        })
        .collect();
    Stage { printed, ..flat(levels) }
}

/// How deep the nozzle may press into what is laid, mm: a quarter of a usual layer, which a soft
/// bead gives way by.
pub(crate) const GOUGE_MM: f64 = 0.05;

/// Refuses layers too steep for the nozzle, or lowers a cone where the user asked for that.
pub(crate) fn within_clearance(
    solid: &Solid,
    job: &Job,
    kind: LayerKind,
) -> Result<LayerKind, Failure> {
    let uphill = Uphill {
        extent: extent(solid.mesh()).radius,
        thickness: job.schedule.layer_height,
        allowance: GOUGE_MM,
        order: LayerOrder::LowToHigh,
    };
    let most = job.nozzle.steepest(&uphill);
    if let (LayerKind::Conical(angle), true) = (kind, job.lower_cone) {
        let most = most + steepest_lean(solid, angle, job);
        return Ok(LayerKind::Conical(most.min(angle.abs()).copysign(angle)));
    }
    let surface = kind.surface().map_err(|error| unfit(&error))?;
    let slope = match Field::of(&job.printer, job.plan.tilt) {
        // Seen from the nozzle, which leans.
        Some(field) => {
            let form = surface.form();
            let floor =
                base(job).levels.get(job.base_layers.wrapping_sub(1)).map_or(0.0, |l| l.upper);
            let places =
                solid.mesh().vertices.iter().map(|p| Point3::new(p.x, p.y, p.z.max(floor)));
            places.map(|p| field.steepness(&form, &p)).fold(0.0, f64::max)
        }
        None => steepest_slope(solid, &*surface),
    };
    if slope <= most {
        return Ok(kind);
    }
    let degrees = |angle: f64| machine::gcode::decimal(angle.to_degrees(), 1);
    let (slope, most) = (degrees(slope), degrees(most));
    Err(Failure::new(
        "OutOfEnvelope",
        format!(
            "{} layers rise by {slope}° in this part, and the nozzle clears at most {most}°",
            kind.word()
        ),
    )
    .hint(match kind {
        LayerKind::Conical(_) => format!(
            "use --cone-angle max or up to {most}, or describe a slimmer nozzle in the printer \
             profile (nozzle_flat_radius_mm, nozzle_half_angle_deg, nozzle_block_height_mm)"
        ),
        LayerKind::Spherical(_) => "lower the centre with --sphere-centre".into(),
        LayerKind::Caps(_) | LayerKind::Planar => "use a larger --cap-radius".into(),
    }))
}

/// How far the nozzle can lean everywhere in a part in layers that slope as a cone of this angle does,
/// radians.
fn steepest_lean(solid: &Solid, angle: f64, job: &Job) -> f64 {
    let Some(field) = Field::of(&job.printer, TiltParams { tilt: Tilt::Normal, ..job.plan.tilt })
    else {
        return 0.0;
    };
    let Ok(cone) = Cone::new(angle) else { return 0.0 };
    if job.plan.tilt.tilt == Tilt::None {
        return 0.0;
    }
    let form = cone.form();
    let leans = solid.mesh().vertices.iter().map(|p| field.lean(&form, p).abs());
    leans.fold(angle.abs(), f64::min)
}

pub(crate) fn unfit(error: &SurfaceError) -> Failure {
    Failure::new("OutOfEnvelope", error.to_string())
}

/// The greatest distance of a part from the axis, mm.
pub(crate) fn radius(part: &Mesh) -> f64 {
    extent(part).radius
}

pub(crate) fn extent(part: &Mesh) -> Extent {
    let radius = part.vertices.iter().map(|p| p.x.hypot(p.y)).fold(0.0, f64::max);
    Extent { lowest: part.bounds().min.z, radius }
}

/// The planar layers under the curved ones.
pub(crate) fn base(job: &Job) -> Stage {
    let params = &job.schedule;
    let bound = |i: usize| match i.checked_sub(1) {
        None => 0.0,
        Some(above_first) => params.first_layer_height + params.layer_height * above_first as f64,
    };
    let count = job.base_layers + job.paths.skins.top_layers.max(1);
    let levels = (0..count)
        .map(|index| Level { index, lower: bound(index), upper: bound(index + 1) })
        .collect();
    Stage { printed: 0..job.base_layers, ..flat(levels) }
}

/// The least level of a bowl above the floor: the first layer is as thick as the others at the rim
/// that the part has there, and no sliver that no bead fits in.
fn least_of_bowls(part: &Mesh, surface: &dyn LayerSurface, floor: f64) -> f64 {
    // The level of bowls is least at corners of what stands above the floor.
    let mut least = f64::INFINITY;
    for triangle in &part.triangles {
        for k in 0..3 {
            let [a, b] = [k, (k + 1) % 3].map(|k| part.vertices[triangle[k] as usize]);
            if a.z >= floor {
                least = least.min(surface.level(&a));
            }
            if (a.z < floor) != (b.z < floor) {
                let at = a.lerp(&b, (floor - a.z) / (b.z - a.z));
                least = least.min(surface.level(&at));
            }
        }
    }
    if least.is_finite() { least } else { surface.level(&Point3::new(0.0, 0.0, floor)) }
}

/// A last layer thinner than this share of one is rounding.
const WHOLE_LAYER: f64 = 1e-6;

/// How far from a level the corners of a facet may be that lies on it, mm: what files with single
/// precision make of a sphere.
const ON_LEVEL_MM: f64 = 1e-3;

/// Faces smaller than this are no reason to make layers thinner, mm².
const LEAST_FACE_MM2: f64 = 10.0;

/// The area of the facets whose corners all lie on a level of curved layers, mm².
fn area_on_level(part: &Mesh, surface: &dyn LayerSurface, level: f64) -> f64 {
    if surface.form().is_flat() {
        return 0.0;
    }
    let corners = part.triangles.iter().map(|t| t.map(|v| part.vertices[v as usize]));
    corners
        .filter(|corners| corners.iter().all(|p| (surface.level(p) - level).abs() <= ON_LEVEL_MM))
        .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
        .sum()
}

/// Where curved layers go.
pub(crate) struct Space {
    /// Height of the floor below, mm.
    pub(crate) floor: f64,
    /// The level that they begin at, where it is not the floor that they begin on.
    pub(crate) start: Option<f64>,
    /// The level that they end at, under a blend.
    pub(crate) end: Option<f64>,
    /// Height that they end at, mm; `None` where the part ends them.
    pub(crate) ceiling: Option<f64>,
    /// How many layers are below.
    pub(crate) index: usize,
}

pub(crate) fn curved(
    part: &Mesh,
    kind: LayerKind,
    space: &Space,
    job: &Job,
) -> Result<Stage, Failure> {
    let Space { floor, start, end, ceiling, .. } = *space;
    let surface = kind.surface().map_err(|error| unfit(&error))?;
    let Extent { radius, .. } = extent(part);
    let top = part.bounds().max.z;
    let level = |r: f64, z: f64| surface.level(&Point3::new(r, 0.0, z));
    // The level grows or falls outwards all the way, so that its least value on the floor is at
    // one end; its greatest in the part is at a vertex, or, of bowls, at most that of the top on
    // the axis. Layers that turn out empty are left out later.
    let least = if let Some(start) = start {
        start
    } else if surface.form().is_mirrored() && job.paths.support.is_none() {
        least_of_bowls(part, &*surface, floor)
    } else {
        // Supports reach beyond the part.
        let margin = if job.paths.support.is_some() { MARGIN_MM } else { 0.0 };
        level(0.0, floor).min(level(radius + margin, floor))
    };
    let greatest = part.vertices.iter().map(|p| surface.level(p)).fold(level(0.0, top), f64::max);
    let below_ceiling = |z: f64| level(0.0, z).max(level(radius, z));
    let greatest = ceiling.map_or(f64::INFINITY, below_ceiling).min(greatest);
    let greatest = end.unwrap_or(greatest);
    let step = surface.level_step(job.schedule.layer_height);
    let layers = (greatest - least) / step;
    let count = match end {
        // The part may end within the blend below.
        _ if greatest <= least => 0.0,
        Some(_) => layers.round().max(1.0),
        None => (layers - WHOLE_LAYER).ceil().max(1.0),
    };
    levels::check_count(count)?;
    // A face that is a layer itself, such as that of a lens, is met by the last one.
    let ends_on_face = job.schedule.snap != Snap::Off
        && ceiling.is_none()
        && area_on_level(part, &*surface, greatest) >= job.least_flat_mm2.max(LEAST_FACE_MM2);
    let is_fixed = (ends_on_face || end.is_some()) && count > 0.0;
    let step = if is_fixed { (greatest - least) / count } else { step };
    let skins = &job.paths.skins;
    let below = skins.bottom_layers.max(1);
    let printed = below..below + count as usize;
    let bound = |k: usize| least + step * (k as f64 - below as f64);
    let levels = (0..printed.end + skins.top_layers.max(1))
        .map(|k| Level {
            // Only printed layers are counted, after those below.
            index: (space.index + k).saturating_sub(below),
            lower: bound(k),
            upper: bound(k + 1),
        })
        .collect();
    // Cones that go on from a blend have no wedges.
    let floor = if start.is_none() { Some(floor) } else { None };
    Ok(Stage { surface, kind, levels, printed, floor, ceiling, morph: None })
}
