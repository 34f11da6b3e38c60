//! Models with settings of their own among others on one bed.
//!
//! All models share the layers. Those with the same settings are cut and filled together, and the lines of
//! all are put into one layer; skirt and brim go round everything.

use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::Rotation3;
use slicer::layer::{Filled, PathParams};

use crate::place::Placed;
use crate::settings::Job;
use crate::stack::Stack;
use crate::stages::Stage;

/// How one model is filled other than the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Own {
    /// Which model of the command line, counted from 0.
    pub model: usize,
    /// How it is filled.
    pub paths: PathParams,
    /// The same, for people.
    pub said: Vec<String>,
}

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
        let (object, first) = (object.mesh(all), mesh.vertices.len() as u32);
        mesh.vertices.extend(object.vertices.iter().map(|p| upright * p));
        mesh.triangles.extend(object.triangles.iter().map(|corners| corners.map(|v| v + first)));
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
