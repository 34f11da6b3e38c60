//! Models with settings of their own among others on one bed.
//!
//! All models share the layers. Those with the same settings are cut and filled together, and the lines of
//! all are put into one layer; skirt and brim go round everything.

use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::{Rotation3, Vector3};
use slicer::layer::{Filled, PathParams};

use crate::objects::Extent;
use crate::own::Own;
use crate::place::Placed;
use crate::settings::Job;
use crate::stack::Stack;
use crate::stages::Stage;

/// Models that are filled alike.
pub(crate) struct Group {
    solid: Solid,
    job: Job,
}

/// Returns the groups of models in the frame that is turned by `upright`; none where all are filled
/// alike.
pub(crate) fn groups(
    placed: &Placed,
    upright: &Rotation3<f64>,
    own: &[Own],
    job: &Job,
) -> Vec<Group> {
    if own.is_empty() {
        return Vec::new();
    }
    let mut each: Vec<(PathParams, Mesh)> = Vec::new();
    let all = placed.solid.mesh();
    for object in &placed.objects {
        let paths = own.iter().find(|own| own.model == object.model).map(|own| &own.paths);
        let paths = paths.unwrap_or(&job.paths);
        let k = each.iter().position(|(other, _)| other == paths).unwrap_or_else(|| {
            each.push((*paths, Mesh::default()));
            each.len() - 1
        });
        let mesh = &mut each[k].1;
        let mut object = object.extent.mesh(all);
        object.vertices.iter_mut().for_each(|p| *p = upright * *p);
        Extent::added(mesh, &object, &Vector3::zeros());
    }
    let group = |(paths, mesh): (PathParams, Mesh)| {
        let mut job = job.clone();
        job.paths = paths;
        Group { solid: Solid::new(mesh), job }
    };
    each.into_iter().map(group).collect()
}

/// Returns the stacks of a stage: one for each group, or one for all.
pub(crate) fn stacks<'a>(
    groups: &'a [Group],
    solid: &'a Solid,
    stage: &'a Stage,
    below: Option<&'a Stage>,
    job: &'a Job,
) -> Vec<Stack<'a>> {
    if groups.is_empty() {
        return vec![Stack::new(solid, stage, below, job)];
    }
    groups.iter().map(|group| Stack::new(&group.solid, stage, below, &group.job)).collect()
}

/// Puts the same layers of several groups together.
pub(crate) fn together(each: Vec<Vec<Filled>>) -> Vec<Filled> {
    let mut each = each.into_iter();
    let mut all = each.next().unwrap_or_default();
    for group in each {
        for (layer, other) in all.iter_mut().zip(group) {
            add(layer, other);
        }
    }
    all
}

fn add(layer: &mut Filled, other: Filled) {
    if layer.paths.is_empty() {
        // What passes beside a group has no height of its own.
        let lost = layer.paths.lost;
        layer.paths = other.paths;
        layer.paths.lost.merge(&lost);
    } else {
        layer.paths.islands.extend(other.paths.islands);
        layer.paths.lost.merge(&other.paths.lost);
    }
    layer.floating.extend(other.floating);
}

/// Takes skirt and brim from the layer of all models together.
pub(crate) fn surround(layer: &mut Filled, all: Filled) {
    layer.paths.adhesion = all.paths.adhesion;
    layer.adhesion_out_of_reach = all.adhesion_out_of_reach;
}
