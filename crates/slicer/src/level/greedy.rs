//! The published correction of layer heights, to the letter.
//!
//! Source: the utility model "layered building with variable layer thickness" (Ukraine), source C.
//! Layers begin with heights of any kind; `Z_i` is their running sum. For the flat faces from the
//! bottom up, unless `Z_plane(p) − Z_plane(p−1) < h_min`: with `Z_i ≤ Z_plane < Z_(i+1)` and
//! `δ = Z_plane − Z_i`,
//!
//! * `|δ| ≤ Δz` leaves the heights as they are;
//! * `δ ≥ h_min` makes the next layer `δ` thick;
//! * otherwise the previous layer becomes `h_(i−1) + δ` thick where that is `≤ h_max`, and `h_min`
//!   where it is not;
//!
//! and the planes above are recomputed. A correction is made with discreteness Δz: δ is rounded to
//! it. The first layer, which has a height of its own here, is not corrected.
//!
//! The failures of the rule are kept, so that it can be compared:
//!
//! * a face closer than `h_min` to the one below is not looked at;
//! * thinning the previous layer to `h_min` meets nothing, it only moves all planes above;
//! * stretching the previous layer moves its lower neighbour off nothing, but its own upper plane
//!   may have been on a face ([`CloseFaces::Chased`]: the face at 1.00 is lost to the one at 1.07);
//! * what is inserted is never balanced: a layer of 0.134 lies between layers of 0.200;
//! * limits are looked at only where the rule says so.

use super::{ScheduleParams, on_grid};

/// What the rule does with a face that is closer than `h_min` to the face below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloseFaces {
    /// Nothing, as the rule says.
    Skipped,
    /// The same as with any other.
    Chased,
}

/// The constants of the rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// Thinnest layer, mm.
    pub least: f64,
    /// Thickest layer, mm.
    pub greatest: f64,
    /// Discreteness Δz, mm; 0 for a machine without.
    pub increment: f64,
    /// What is done with close faces.
    pub close: CloseFaces,
}

impl Rule {
    /// Returns the rule as published, with the limits of a schedule.
    #[must_use]
    pub fn published(params: &ScheduleParams) -> Self {
        Self {
            least: params.least_height,
            greatest: params.greatest_height,
            increment: params.increment,
            close: CloseFaces::Skipped,
        }
    }
}

/// Returns corrected bounds of layers. `bounds` ascend from 0 and reach above all faces by a layer
/// for each face; the faces may have any order.
#[must_use]
pub fn corrected(bounds: &[f64], faces: &[f64], rule: &Rule) -> Vec<f64> {
    let mut planes = bounds.to_vec();
    let mut faces: Vec<f64> = faces.iter().filter(|face| **face > 0.0).copied().collect();
    faces.sort_by(f64::total_cmp);
    faces.dedup();
    let mut before = 0.0;
    for face in faces {
        // A difference such as 1.1 − 1.0 is no less than 0.1.
        if rule.close == CloseFaces::Chased || on_grid(face - before) >= rule.least {
            correct(&mut planes, face, rule);
        }
        before = face;
    }
    planes
}

fn correct(planes: &mut [f64], face: f64, rule: &Rule) {
    let above = planes.partition_point(|plane| *plane <= face);
    let Some(i) = above.checked_sub(1).filter(|_| above < planes.len()) else { return };
    let off = on_grid(face - planes[i]);
    if off <= rule.increment {
        return;
    }
    let steps = |length: f64| {
        if rule.increment > 0.0 {
            (length / rule.increment).round() * rule.increment
        } else {
            length
        }
    };
    let delta = steps(off);
    if off >= rule.least && i > 0 {
        let to = planes[i] + delta;
        shift(&mut planes[above..], to);
    } else if off < rule.least && i > 1 {
        let height = on_grid(planes[i] - planes[i - 1] + delta);
        let to = planes[i - 1] + if height <= rule.greatest { height } else { rule.least };
        shift(&mut planes[i..], to);
    }
}

/// Moves planes so that the first lies at `to`.
fn shift(planes: &mut [f64], to: f64) {
    let by = to - planes[0];
    for plane in planes {
        *plane = on_grid(*plane + by);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: Rule =
        Rule { least: 0.1, greatest: 0.3, increment: 0.01, close: CloseFaces::Skipped };

    fn even() -> Vec<f64> {
        (0..40).map(|i| on_grid(0.2 * f64::from(i))).collect()
    }

    fn has(planes: &[f64], plane: f64) -> bool {
        planes.iter().any(|p| (p - plane).abs() < 1e-9)
    }

    #[test]
    fn the_three_cases_of_the_rule() {
        assert_eq!(corrected(&even(), &[1.005, 2.0], &RULE), even());
        let inserted = corrected(&even(), &[1.13], &RULE);
        assert!(has(&inserted, 1.0) && has(&inserted, 1.13) && has(&inserted, 1.33));
        let stretched = corrected(&even(), &[1.07], &RULE);
        assert!(has(&stretched, 0.8) && has(&stretched, 1.07) && has(&stretched, 1.27));
        let thinned = corrected(&even(), &[1.07], &Rule { greatest: 0.25, ..RULE });
        assert!(has(&thinned, 0.9) && !has(&thinned, 1.07), "the face is missed: {thinned:?}");
    }

    #[test]
    fn close_faces_are_skipped_or_spoil_the_one_below() {
        let skipped = corrected(&even(), &[1.0, 1.07], &RULE);
        assert!(has(&skipped, 1.0) && !has(&skipped, 1.07));
        let chased = corrected(&even(), &[1.0, 1.07], &Rule { close: CloseFaces::Chased, ..RULE });
        assert!(!has(&chased, 1.0) && has(&chased, 1.07));
    }

    #[test]
    fn the_first_layer_stays() {
        let planes = corrected(&even(), &[0.15, 0.25], &RULE);
        assert_eq!(planes[1], 0.2);
    }
}
