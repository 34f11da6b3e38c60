//! Where planar layers finish flat tops (`top = planar`): above curved layers and between them.
//!
//! The planar layers below a flat top reach over the whole part, not only over the face: beside a
//! higher piece of the part no nozzle could finish the face once that piece stands, nor the piece
//! once the face does. Curved layers go on above, on the flat floor that is left.
//!
//! A slab is as many layers as the skin of a top has. Where faces lie so near each other that hardly
//! a curved layer would fit between them, all between them is planar.

use mesh::flats::Facing;
use mesh::mesh::Mesh;
use slicer::surface::{LayerSurface, Plane};

use crate::levels::{Layout, MetFlat, SteppedFlat, Why};
use crate::overhang::overhangs_between;
use crate::settings::Job;

/// Planar layers that end on a flat top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slab {
    /// Where the lowest begins, mm.
    pub(crate) bottom: f64,
    /// The face, mm.
    pub(crate) top: f64,
    /// How many layers.
    pub(crate) count: usize,
    /// Whether curved layers lie under it.
    pub(crate) on_curved: bool,
}

impl Slab {
    /// The thickness of a layer, mm.
    pub(crate) fn step(&self) -> f64 {
        (self.top - self.bottom) / self.count as f64
    }
}

/// What is below the first curved layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stand {
    /// Its greatest height, mm.
    pub(crate) height: f64,
    /// Whether cones grow out of planes there, which only cones can go on from.
    pub(crate) is_blend: bool,
}

/// The slabs of a print from the lowest up, and the flat tops that are left to curved layers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Finish {
    pub(crate) slabs: Vec<Slab>,
    pub(crate) left: Vec<SteppedFlat>,
}

/// Fewer curved layers than this below planar ones are not worth it.
const LEAST_CURVED: usize = 2;

/// How far a flat face may lie from the highest point of the part and be its top, mm: what its own
/// vertices differ by.
const TOP_MM: f64 = 1e-3;

/// More than this that looks down is not hung into the air for the sake of a flat top, mm²: a bridge
/// of a few beads.
const LEAST_HANGING_MM2: f64 = 2.0;

/// Chooses the slabs of a part: the highest face first, then the next one that leaves room.
pub(crate) fn finish(
    layout: &Layout,
    part: &Mesh,
    surface: &dyn LayerSurface,
    stand: Stand,
    job: &Job,
) -> Finish {
    let faces_up = |met: &&MetFlat| met.wanted && met.flat.facing == Facing::Up;
    let mut tops: Vec<&MetFlat> = layout.flats.iter().filter(faces_up).collect();
    tops.sort_by(|a, b| b.flat.z_mm.total_cmp(&a.flat.z_mm));
    let top = part.bounds().max.z;
    let mut finish = Finish::default();
    let mut kept: Vec<f64> = Vec::new();
    for met in tops {
        let z = met.flat.z_mm;
        let is_top = (top - z).abs() <= TOP_MM;
        match reason(z, is_top, &kept, (part, surface), stand, job) {
            Some(why) => finish.left.push(SteppedFlat { flat: met.flat, why }),
            None => kept.push(z),
        }
    }
    kept.reverse();
    finish.left.reverse();
    finish.slabs = slabs(&kept, stand, job);
    if finish.slabs.iter().all(|slab| !slab.on_curved)
        && kept.last().is_some_and(|z| *z >= top - TOP_MM)
    {
        // There would be no curved layer at all.
        let met = layout.flats.iter().filter(|met| faces_up(met) && kept.contains(&met.flat.z_mm));
        finish.left.extend(met.map(|met| SteppedFlat { flat: met.flat, why: Why::NoRoom }));
        finish.left.sort_by(|a, b| a.flat.z_mm.total_cmp(&b.flat.z_mm));
        finish.slabs.clear();
    }
    finish
}

/// Why a flat top is left to the curved layers, if it is; `above` are those that are not.
fn reason(
    z: f64,
    is_top: bool,
    above: &[f64],
    (part, surface): (&Mesh, &dyn LayerSurface),
    stand: Stand,
    job: &Job,
) -> Option<Why> {
    if let Some(next) = above.last().filter(|next| even(*next - z, job).is_none()) {
        return Some(Why::Near(*next));
    }
    if stand.is_blend && !leaves_curved(z - stand.height, job) {
        return Some(if is_top { Why::NoRoom } else { Why::InBlend });
    }
    if even(z - stand.height, job).is_none() {
        return Some(if is_top { Why::NoRoom } else { Why::InBase });
    }
    if is_top {
        return None;
    }
    let limit = job.orient.overhang_rad;
    let bottom = z - thickness(job);
    let hangs = overhangs_between(part, &Plane, limit, [bottom, z])
        - overhangs_between(part, surface, limit, [bottom, z]);
    (hangs > LEAST_HANGING_MM2).then_some(Why::Hangs(hangs))
}

/// How thick a slab is on curved layers, mm.
fn thickness(job: &Job) -> f64 {
    job.schedule.layer_height * job.paths.skins.top_layers.max(1) as f64
}

/// Whether curved layers fit under a slab that ends `gap` mm above what is below.
fn leaves_curved(gap: f64, job: &Job) -> bool {
    gap > thickness(job) + job.schedule.layer_height * LEAST_CURVED as f64
}

/// How many layers of one thickness fill a gap, mm; `None` where none that the printer can lay do.
fn even(gap: f64, job: &Job) -> Option<usize> {
    let params = &job.schedule;
    if gap <= 0.0 {
        return None;
    }
    let usual = (gap / params.layer_height).round().max(1.0);
    let least = (gap / params.greatest_height).ceil().max(1.0);
    let count = usual.max(least);
    (gap / count >= params.least_height).then_some(count as usize)
}

fn slabs(tops: &[f64], stand: Stand, job: &Job) -> Vec<Slab> {
    let mut floor = stand.height;
    let mut slabs = Vec::with_capacity(tops.len());
    for &top in tops {
        let on_curved = leaves_curved(top - floor, job);
        let (bottom, count) = if on_curved {
            (top - thickness(job), job.paths.skins.top_layers.max(1))
        } else {
            (floor, even(top - floor, job).unwrap_or(1))
        };
        slabs.push(Slab { bottom, top, count, on_curved });
        floor = top;
    }
    slabs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::layout;
    use crate::settings::Settings;
    use mesh::shapes;
    use nalgebra::Point3;
    use slicer::surface::Cone;

    fn finished(part: &Mesh) -> Finish {
        let mut settings = Settings::defaults();
        settings.set("top=planar").unwrap();
        let job = Job::resolve(&settings).unwrap();
        let layout = layout(part, &Plane, &job).unwrap();
        let cone = Cone::new(0.8).unwrap();
        finish(&layout, part, &cone, Stand { height: 0.4, is_blend: false }, &job)
    }

    /// A block of 20 mm with a step at `z`, turned so that the step is a flat top.
    fn stepped(z: f64) -> Mesh {
        let outline = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [10.0, 20.0], [10.0, z], [0.0, z]];
        let mut mesh = shapes::extruded(&outline, &[], 10.0);
        for p in &mut mesh.vertices {
            *p = Point3::new(p.x, -p.z, p.y);
        }
        mesh
    }

    #[test]
    fn every_flat_top_that_leaves_room_is_finished() {
        let found = finished(&shapes::steps());
        assert!(found.left.is_empty(), "{found:?}");
        let tops: Vec<f64> = found.slabs.iter().map(|slab| slab.top).collect();
        let wanted = [3.07, 7.33, 11.9, 15.0];
        assert!(tops.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{tops:?}");
        assert!(found.slabs.iter().all(|slab| slab.on_curved && slab.count == 4), "{found:?}");
    }

    #[test]
    fn what_lies_near_the_next_is_planar_between_and_what_lies_too_near_is_named() {
        let near = finished(&stepped(19.25));
        let [low, high] = near.slabs[..] else { panic!("{near:?}") };
        assert!(low.on_curved && !high.on_curved);
        assert_eq!((high.bottom, high.count), (low.top, 4));
        assert!((high.step() - 0.1875).abs() < 1e-6);
        let too_near = finished(&stepped(19.98));
        assert_eq!(too_near.slabs.len(), 1);
        assert!(matches!(too_near.left[..], [SteppedFlat { why: Why::Near(_), .. }]));
        let in_base = finished(&stepped(0.3));
        assert_eq!(in_base.left[0].why, Why::InBase);
    }

    #[test]
    fn nothing_is_hung_into_the_air_for_a_flat_top() {
        // A step as high as the underside of an arm on the other side.
        let outline = [
            [0.0, 0.0],
            [20.0, 0.0],
            [20.0, 9.8],
            [30.0, 9.8],
            [30.0, 20.0],
            [10.0, 20.0],
            [10.0, 10.0],
            [0.0, 10.0],
        ];
        let mut mesh = shapes::extruded(&outline, &[], 10.0);
        for p in &mut mesh.vertices {
            *p = Point3::new(p.x - 15.0, -p.z, p.y);
        }
        let found = finished(&mesh);
        assert_eq!(found.slabs.len(), 1, "{found:?}");
        let Why::Hangs(area) = found.left[0].why else { panic!("{found:?}") };
        assert!((area - 100.0).abs() < 1e-6, "{area}");
    }
}
