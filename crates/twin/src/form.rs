//! How far a part is off when its program runs on a machine that is not the one it was made for.
//!
//! The program is replayed twice, on the machine that it was made for and on the one that misses
//! it. Where material is laid, places of the one are compared with places of the other. A part that
//! lies elsewhere on the bed, or is turned, is no worse for it: the best rigid motion is taken off,
//! by the method of W. Kabsch ("A solution for the best rotation to relate two sets of vectors",
//! Acta Crystallographica A32, 1976), with the determinant kept positive. mm.

use machine::gcode::dialect::Dialect;
use machine::profile::Printer;
use machine::program::Role;
use nalgebra::{Matrix3, Point3, Vector3};

use crate::replay::{Event, Replay};

/// The error of a form, before and after the best rigid motion. mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FormError {
    /// Greatest distance of a place from where it is meant to be.
    pub greatest: f64,
    /// Root of the mean square of those distances.
    pub rms: f64,
    /// The greatest when the part is laid over the wanted one as well as it can be.
    pub greatest_fitted: f64,
    /// The root of the mean square then.
    pub rms_fitted: f64,
    /// Places compared.
    pub places: usize,
}

/// Replays a program on the printer that it was made for and on the one that it runs on. Lines that
/// cannot be read are left out. Returns `None` when nothing is laid.
///
/// A dialect in part coordinates says nothing of the joints: there the two agree, and what the
/// firmware makes of a misalignment is not known.
#[must_use]
pub fn compare<'a>(
    lines: impl Iterator<Item = &'a str>,
    made_for: &Printer,
    runs_on: &Printer,
    dialect: Dialect,
) -> Option<FormError> {
    let mut replays = [made_for, runs_on].map(|printer| Replay::new(printer, dialect));
    let mut places = Places::default();
    for line in lines {
        let [wanted, is] = [0, 1].map(|k| replays[k].line(line));
        if let (Ok(Event::Segment(wanted)), Ok(Event::Segment(is))) = (wanted, is)
            && wanted.extrudes()
            && wanted.role != Role::Custom
        {
            places.add(wanted.part[1], is.part[1]);
        }
    }
    places.error()
}

/// Places in pairs: where they are wanted, and where they are.
#[derive(Debug, Clone, Default)]
pub struct Places {
    pairs: Vec<[Point3<f64>; 2]>,
    /// One of so many is kept; a power of two.
    every: usize,
    seen: usize,
}

/// Places that are kept, evenly over the program. More say no more of a form that some ten numbers
/// describe, and are 48 bytes each.
const MOST: usize = 1 << 20;

impl Places {
    /// Adds a pair.
    pub fn add(&mut self, wanted: Point3<f64>, is: Point3<f64>) {
        self.every = self.every.max(1);
        if self.seen.is_multiple_of(self.every) {
            if self.pairs.len() == MOST {
                let mut index = 0;
                self.pairs.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.every *= 2;
            }
            self.pairs.push([wanted, is]);
        }
        self.seen += 1;
    }

    /// Returns the error of the form; `None` without places.
    #[must_use]
    pub fn error(&self) -> Option<FormError> {
        if self.pairs.is_empty() {
            return None;
        }
        let (greatest, rms) = self.distances(|p| *p);
        let [wanted, is] = [0, 1].map(|k| self.centre(k));
        let turn = self.best_turn(&wanted, &is);
        let (greatest_fitted, rms_fitted) = self.distances(|p| wanted + turn * (p - is));
        Some(FormError { greatest, rms, greatest_fitted, rms_fitted, places: self.pairs.len() })
    }

    /// Greatest distance and root mean square, after a motion of what is.
    fn distances(&self, moved: impl Fn(&Point3<f64>) -> Point3<f64>) -> (f64, f64) {
        let squares = self.pairs.iter().map(|[wanted, is]| (moved(is) - wanted).norm_squared());
        let (greatest, sum) =
            squares.fold((0.0_f64, 0.0), |(most, sum), square| (most.max(square), sum + square));
        (greatest.sqrt(), (sum / self.pairs.len() as f64).sqrt())
    }

    fn centre(&self, which: usize) -> Point3<f64> {
        let sum: Vector3<f64> = self.pairs.iter().map(|pair| pair[which].coords).sum();
        Point3::from(sum / self.pairs.len() as f64)
    }

    /// The rotation that lays what is over what is wanted.
    fn best_turn(&self, wanted: &Point3<f64>, is: &Point3<f64>) -> Matrix3<f64> {
        let products: Matrix3<f64> =
            self.pairs.iter().map(|[w, i]| (w - wanted) * (i - is).transpose()).sum();
        let svd = products.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
        let mirror = Vector3::new(1.0, 1.0, (u * v_t).determinant().signum());
        u * Matrix3::from_diagonal(&mirror) * v_t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::printer;
    use machine::gcode::dialect::POLAR;
    use nalgebra::Rotation3;

    fn some_places() -> impl Iterator<Item = Point3<f64>> {
        let share = |i: u32, step: f64| (f64::from(i) * step).fract() * 40.0 - 20.0;
        (0..500).map(move |i| Point3::new(share(i, 0.618), share(i, 0.414), share(i, 0.732)))
    }

    #[test]
    fn a_part_that_lies_elsewhere_has_no_error_of_form() {
        let turn = Rotation3::from_euler_angles(0.02, -0.01, 1.3);
        let mut places = Places::default();
        for p in some_places() {
            places.add(p, turn * p + Vector3::new(3.0, -2.0, 0.1));
        }
        let error = places.error().unwrap();
        assert!(error.greatest > 3.0 && error.rms > 3.0);
        assert!(error.greatest_fitted < 1e-12 && error.rms_fitted < 1e-12, "{error:?}");
        assert_eq!(error.places, 500);
    }

    #[test]
    fn what_no_motion_mends_stays() {
        // 1 % larger along x: the fit leaves it, to second order.
        let mut places = Places::default();
        for p in some_places() {
            places.add(p, Point3::new(p.x * 1.01, p.y, p.z));
        }
        let error = places.error().unwrap();
        assert!((error.greatest_fitted - 0.2).abs() < 0.01, "{error:?}");
        assert!((error.rms_fitted - 0.01 * 20.0 / 3.0_f64.sqrt()).abs() < 0.005, "{error:?}");
        assert!(error.rms_fitted <= error.rms);
        assert_eq!(Places::default().error(), None);
    }

    #[test]
    fn a_mirrored_part_does_not_fit() {
        let mut places = Places::default();
        for p in some_places() {
            places.add(p, Point3::new(-p.x, p.y, p.z));
        }
        assert!(places.error().unwrap().rms_fitted > 5.0);
    }

    #[test]
    fn a_rail_that_misses_the_axis_opens_every_circle() {
        // A circle of 10 mm on a rail that passes the axis 0.5 mm aside: 0.5 mm off everywhere,
        // along the circle and so mended by a turn, but for the radius √(10² + 0.5²).
        let made_for = printer();
        let mut runs_on = printer();
        runs_on.alignment.b = 0.5;
        let mut text = String::from("G28\n;LAYER:0\n;TYPE:Perimeter\nG1 R10 T0 Z0.2 F600\n");
        for k in 1..=90 {
            text += &format!("G1 R10 T{} E0.1\n", 4 * k);
        }
        let error = compare(text.lines(), &made_for, &runs_on, POLAR).unwrap();
        assert!((error.rms - 0.5).abs() < 1e-3, "{error:?}");
        assert!((error.rms_fitted - (10.0_f64.hypot(0.5) - 10.0)).abs() < 1e-4, "{error:?}");
        let none = compare(text.lines(), &runs_on, &runs_on, POLAR).unwrap();
        assert_eq!((none.greatest, none.places), (0.0, 90));
    }
}
