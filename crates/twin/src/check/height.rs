//! Does the print go up to the top of the part?
//!
//! A program that was cut off, or that belongs to another model, ends below it. Layers above the last are
//! nobody's to be judged by themselves, and a print that is not solid may hold little; so here is what the mesh
//! holds above the last layer. Not counted are
//!
//! * one layer, the thickest: where a print ends within it is a matter of rounding;
//! * sections in which no two beads have room beside each other (area over outline below a nozzle):
//!   tips and thin walls may be left out, which the slicer tells.
//!
//! More than [`PRINT_SHARE`] of the mesh is a warning. Only layers that are planes are looked at.
//!
//! mm, mm², mm³. Part frame.

use mesh::mesh::Mesh;

use super::volume::{LayerVolume, PRINT_SHARE};
use crate::finding::{Findings, Place};
use crate::section::{self, Section, Sweep};

/// The name of this check.
pub const NAME: &str = "height";

/// How often what lies above is cut.
const CUTS: usize = 64;

/// Compares the height of the last layer with that of the mesh; `has_laid` tells whether anything was laid.
pub(crate) fn check(
    mesh: &Mesh,
    (layers, has_laid): (&[LayerVolume], bool),
    nozzle: f64,
    place: Place,
    findings: &mut Findings,
) {
    let Some(reached) = reached(layers, has_laid) else { return };
    let missing = above(mesh, reached, nozzle);
    let limit = PRINT_SHARE * section::volume(mesh);
    // What is inside out as a whole encloses nothing that could be missing.
    if limit > 0.0 && missing > limit {
        let top = mesh.bounds().max.z;
        findings.warning(NAME, place, (missing, limit), || {
            format!(
                "layers reach to {reached:.2} mm and the mesh to {top:.2} mm: {missing:.1} mm³ of it are \
                 not printed"
            )
        });
    }
}

/// How high layers reach and another would; `None` where they do not tell.
fn reached(layers: &[LayerVolume], has_laid: bool) -> Option<f64> {
    if layers.is_empty() && has_laid {
        return None;
    }
    let (mut top, mut thickest) = (0.0_f64, 0.0_f64);
    for layer in layers {
        top = top.max(layer.top.filter(|_| layer.is_plane)?);
        thickest = thickest.max(layer.height?);
    }
    Some(top + thickest)
}

/// What the mesh holds above a height where two beads have room, mm³.
fn above(mesh: &Mesh, z: f64, nozzle: f64) -> f64 {
    let bounds = mesh.bounds();
    let bottom = z.max(bounds.min.z);
    let step = (bounds.max.z - bottom) / CUTS as f64;
    if !(step > 0.0 && step.is_finite()) {
        return 0.0;
    }
    let (mut sweep, mut section) = (Sweep::new(mesh), Section::default());
    let areas = (0..CUTS).map(|k| {
        sweep.cut(bottom + (k as f64 + 0.5) * step, &mut section);
        let area = section.area();
        if area > section.perimeter() * nozzle { area } else { 0.0 }
    });
    areas.sum::<f64>() * step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::tests::block;

    fn layers(count: usize) -> Vec<LayerVolume> {
        let layer = |index| LayerVolume {
            index,
            line: index + 1,
            top: Some(0.2 * (index + 1) as f64),
            height: Some(0.2),
            part: 1.0,
            other: 0.0,
            area: None,
            outline: 0.0,
            corners: 0.0,
            is_plane: true,
        };
        (0..count).map(layer).collect()
    }

    /// Whether something is found for a mesh of 4 mm under so many layers of 0.2 mm.
    fn is_found(mesh: &Mesh, layers: &[LayerVolume], has_laid: bool) -> bool {
        let mut findings = Findings::default();
        check(mesh, (layers, has_laid), 0.4, Place::line(1, None), &mut findings);
        !findings.is_empty()
    }

    #[test]
    fn a_print_that_ends_below_the_top_is_found() {
        let part = block(10.0, 0.0, 4.0, 0.0);
        assert!(!is_found(&part, &layers(20), true));
        // Rounding may cost a layer.
        assert!(!is_found(&part, &layers(19), true));
        assert!(is_found(&part, &layers(17), true));
        assert!(is_found(&part, &[], false));
        // Nobody knows how high a program goes that does not tell.
        assert!(!is_found(&part, &[], true));
    }

    #[test]
    fn what_no_bead_fits_in_may_be_left_out() {
        let fin = block(0.3, 0.0, 4.0, 0.0);
        assert!(!is_found(&fin, &layers(5), true));
        assert!(is_found(&block(2.0, 0.0, 4.0, 0.0), &layers(5), true));
    }
}
