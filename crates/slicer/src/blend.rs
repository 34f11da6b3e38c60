//! Layers that lead from planes to curved layers, or back: each has a surface of its own, a little
//! steeper than that of the layer below.
//!
//! A *side* is a cone or a sphere and where it meets the axis. How steep it is, is told by its *drop*:
//! how much lower it lies at the *reach*, the greatest distance from the axis at which there is material,
//! than on the axis (mm; negative in bowls). The thickness of a layer at distance `r` is that between
//! its two sides along the normal of the upper one, `(rise − drops' difference at r)·cos`: it is
//! greatest on the axis and least at the reach where drops grow, and the other way round in bowls.

use nalgebra::Point3;

use crate::surface::{Cone, LayerSurface, Spheres, SurfaceError};

/// The surface of a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sheet {
    /// A cone; a plane where it has no slope.
    Cone(Cone),
    /// A sphere.
    Spheres(Spheres),
}

impl Sheet {
    /// Returns the family that the sheet is one of.
    #[must_use]
    pub fn surface(&self) -> &dyn LayerSurface {
        match self {
            Self::Cone(cone) => cone,
            Self::Spheres(spheres) => spheres,
        }
    }
}

/// A side of a layer. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// Its surface.
    pub sheet: Sheet,
    /// Its height on the axis, mm.
    pub level: f64,
}

impl Side {
    /// Returns a plane.
    ///
    /// # Errors
    ///
    /// Never: a plane has a slope.
    pub fn plane(level: f64) -> Result<Self, SurfaceError> {
        Ok(Self { sheet: Sheet::Cone(Cone::from_slope(0.0)?), level })
    }

    /// Returns its height at distance `r` from the axis, mm.
    #[must_use]
    pub fn height(&self, r: f64) -> f64 {
        self.sheet.surface().height(self.level, r)
    }

    /// Returns how far this side lies below the point `at` of a layer, along the normal of that, mm.
    #[must_use]
    pub fn depth(&self, surface: &dyn LayerSurface, at: &Point3<f64>) -> f64 {
        (at.z - self.height(at.x.hypot(at.y))) * surface.slope_cos(at)
    }

    /// Returns the side halfway between this one and another.
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when either is no surface.
    pub fn halfway(&self, to: &Self) -> Result<Self, SurfaceError> {
        let level = f64::midpoint(self.level, to.level);
        if let (Sheet::Cone(a), Sheet::Cone(b)) = (&self.sheet, &to.sheet) {
            let cone = Cone::from_slope(f64::midpoint(a.slope(), b.slope()))?;
            return Ok(Self { sheet: Sheet::Cone(cone), level });
        }
        let curvature = f64::midpoint(self.curvature(), to.curvature());
        let sheet = Sheet::Spheres(Spheres::new(level - 1.0 / curvature)?);
        Ok(Self { sheet, level })
    }

    /// One by the radius, 1/mm; zero for planes.
    fn curvature(&self) -> f64 {
        match &self.sheet {
            Sheet::Cone(_) => 0.0,
            Sheet::Spheres(spheres) => 1.0 / spheres.radius(self.level),
        }
    }

    /// Returns the least and the greatest thickness, within `reach` mm of the axis, of the layer between
    /// this side and the one above it, mm.
    #[must_use]
    pub fn thickness_to(&self, above: &Self, reach: f64) -> [f64; 2] {
        let surface = above.sheet.surface();
        let places = (0..=PLACES).map(|k| {
            let r = reach * f64::from(k) / f64::from(PLACES);
            self.depth(surface, &Point3::new(r, 0.0, above.height(r)))
        });
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t| [a.min(t), b.max(t)])
    }
}

/// Places of a meridian at which a layer is measured: it changes evenly, and is least and greatest at its
/// ends or, where sides grow flatter, near their middle.
const PLACES: u32 = 16;

/// The layers that a blend leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// Cones that fall by `slope` mm with every mm outwards.
    Cone {
        /// The slope, negative for bowls.
        slope: f64,
    },
    /// Spheres about a point of the axis.
    Spheres {
        /// Its height, mm.
        centre_z: f64,
    },
    /// Caps of a sphere.
    Caps {
        /// Its radius, mm.
        radius: f64,
    },
}

impl Aim {
    /// Returns how much lower the layer that meets the axis at `level` lies at `reach`, mm; not a number
    /// where it does not get there.
    #[must_use]
    pub fn drop(&self, level: f64, reach: f64) -> f64 {
        let of_sphere = |radius: f64| {
            // Not radius − √(radius² − reach²), in which large radii would cancel.
            reach * reach / (radius + ((radius - reach) * (radius + reach)).sqrt())
        };
        match *self {
            Self::Cone { slope } => slope * reach,
            Self::Spheres { centre_z } => of_sphere(level - centre_z),
            Self::Caps { radius } => of_sphere(radius),
        }
    }

    /// Returns the side of a drop.
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when there is none.
    pub fn side(&self, level: f64, drop: f64, reach: f64) -> Result<Side, SurfaceError> {
        if drop == 0.0 {
            return Side::plane(level);
        }
        let sheet = match self {
            Self::Cone { .. } => Sheet::Cone(Cone::from_slope(drop / reach)?),
            Self::Spheres { .. } | Self::Caps { .. } => {
                Sheet::Spheres(Spheres::new(level - (reach * reach + drop * drop) / (2.0 * drop))?)
            }
        };
        Ok(Side { sheet, level })
    }

    /// Returns the side of the layer aimed at that meets the axis at `level`.
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when it is none.
    pub fn layer(&self, level: f64) -> Result<Side, SurfaceError> {
        let sheet = match *self {
            Self::Cone { slope } => Sheet::Cone(Cone::from_slope(slope)?),
            Self::Spheres { centre_z } => Sheet::Spheres(Spheres::new(centre_z)?),
            Self::Caps { radius } => Sheet::Spheres(Spheres::new(level - radius)?),
        };
        Ok(Side { sheet, level })
    }

    /// Returns the height of the highest place of the layer that meets the axis at `level`, mm.
    #[must_use]
    pub fn highest(&self, level: f64, reach: f64) -> f64 {
        level - self.drop(level, reach).min(0.0)
    }

    /// Returns where the layer meets the axis whose highest place is at `height`, mm.
    #[must_use]
    pub fn level_at(&self, height: f64, reach: f64) -> f64 {
        height + self.drop(height, reach).min(0.0)
    }
}

/// Halvings of the steepest step that keeps the limits: the last is far below a micrometre.
const HALVINGS: usize = 40;

/// Returns the upper sides of the layers that lead from the plane at height `base` to `aim` in the fewest
/// steps, over a part that reaches `reach` mm from the axis, with layers between `thinnest` and
/// `thickest` mm thick everywhere.
///
/// For cones about `reach·asinh(|slope|)/(thickest − thinnest)` layers are needed.
///
/// # Errors
///
/// [`SurfaceError::NotFinite`] unless `0 < thinnest < thickest`, lengths are numbers, and the layers that
/// it leads to get to the reach, less steep than a wall.
pub fn fewest(
    aim: &Aim,
    base: f64,
    reach: f64,
    [thinnest, thickest]: [f64; 2],
) -> Result<Vec<Side>, SurfaceError> {
    let is_sound = 0.0 < thinnest && thinnest < thickest && thickest.is_finite();
    let wanted = aim.drop(base, reach);
    if !(is_sound && wanted.is_finite() && reach.is_finite() && reach > 0.0) {
        return Err(SurfaceError::NotFinite);
    }
    let mut sides = vec![Side::plane(base)?];
    let mut drop = 0.0;
    loop {
        let below = sides[sides.len() - 1];
        // The thickest place of the layer whose upper side has this drop is as thick as may be.
        let above = |next: f64| {
            let cos = |r: f64| -> Result<f64, SurfaceError> {
                let side = aim.side(0.0, next, reach)?;
                let at = Point3::new(r, 0.0, side.height(r));
                Ok(side.sheet.surface().slope_cos(&at))
            };
            let rise = if wanted > 0.0 {
                thickest / cos(0.0)?
            } else {
                thickest / cos(reach)? + (next - drop)
            };
            aim.side(below.level + rise, next, reach)
        };
        let keeps = |side: &Side| below.thickness_to(side, reach)[0] >= thinnest - ROUNDING_MM;
        // Spheres grow flatter with their radius, so the last drop depends on where it is.
        let end = aim.drop(above(drop)?.level, reach);
        let last = above(end)?;
        if end.abs() <= drop.abs() || keeps(&last) {
            sides.push(last);
            sides.remove(0);
            return Ok(sides);
        }
        let (mut held, mut broken) = (drop, end);
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(held, broken);
            if keeps(&above(middle)?) { held = middle } else { broken = middle }
        }
        sides.push(above(held)?);
        drop = held;
    }
}

/// Rounding of a thickness, mm.
const ROUNDING_MM: f64 = 1e-9;

/// An end of a blend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    /// Height on the axis, mm.
    pub level: f64,
    /// How much lower it lies at the reach, mm.
    pub drop: f64,
}

/// What the layers of a blend came to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Even {
    /// Their upper sides.
    pub sides: Vec<Side>,
    /// How thin and how thick they are, mm.
    pub thickness: [f64; 2],
}

/// Returns layers that lead evenly from one end to another, as many as make them nearest to `height` mm
/// thick.
///
/// # Errors
///
/// [`SurfaceError::NotFinite`] when an end is no side of `aim`, or not above the other on the axis.
pub fn even(
    aim: &Aim,
    [from, to]: [End; 2],
    reach: f64,
    height: f64,
) -> Result<Even, SurfaceError> {
    let rise = to.level - from.level;
    if !(rise > 0.0 && rise.is_finite() && to.drop.is_finite() && from.drop.is_finite()) {
        return Err(SurfaceError::NotFinite);
    }
    let laid = |count: usize| -> Result<Even, SurfaceError> {
        let side = |k: usize| {
            let share = k as f64 / count as f64;
            let drop = from.drop + (to.drop - from.drop) * share;
            aim.side(from.level + rise * share, drop, reach)
        };
        let all = (0..=count).map(side).collect::<Result<Vec<_>, _>>()?;
        let pairs = all.windows(2).map(|pair| pair[0].thickness_to(&pair[1], reach));
        let thickness = pairs
            .fold([f64::INFINITY, 0.0_f64], |[a, b], [thin, thick]| [a.min(thin), b.max(thick)]);
        Ok(Even { sides: all[1..].to_vec(), thickness })
    };
    let off = |even: &Even| (even.thickness[1] - height).max(height - even.thickness[0]);
    let at_reach = rise - (to.drop - from.drop);
    let middle = (f64::midpoint(rise, at_reach) / height).max(1.0) as usize;
    let mut best = laid(middle)?;
    for count in (middle.saturating_sub(MORE_OR_LESS).max(1))..=middle + MORE_OR_LESS {
        let other = laid(count)?;
        if off(&other) < off(&best) {
            best = other;
        }
    }
    Ok(best)
}

/// How many layers more or less than the mean height tells are tried.
const MORE_OR_LESS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    const AIMS: [Aim; 6] = [
        Aim::Cone { slope: 0.6 },
        Aim::Cone { slope: -0.4 },
        Aim::Cone { slope: 0.01 },
        Aim::Spheres { centre_z: -30.0 },
        Aim::Spheres { centre_z: -400.0 },
        Aim::Caps { radius: 40.0 },
    ];

    /// The end that leads on to the layers aimed at.
    fn end(aim: &Aim, height: f64, reach: f64) -> End {
        let level = aim.level_at(height, reach);
        End { level, drop: aim.drop(level, reach) }
    }

    #[test]
    fn the_fewest_layers_keep_the_limits_and_end_on_the_layers_aimed_at() {
        for aim in AIMS {
            for (base, reach) in [(0.4, 5.0), (8.0, 15.0), (2.0, 20.0)] {
                let sides = fewest(&aim, base, reach, [0.1, 0.3]).unwrap();
                let mut below = Side::plane(base).unwrap();
                for (k, side) in sides.iter().enumerate() {
                    let [thin, thick] = below.thickness_to(side, reach);
                    assert!(thin > 0.1 - 1e-6 && thick < 0.3 + 1e-6, "{aim:?} {thin} {thick}");
                    // All but the last are as uneven as may be: fewer would not do.
                    let is_last = k + 1 == sides.len();
                    assert!(is_last || thick - thin > 0.19, "{aim:?} {thin} {thick}");
                    below = *side;
                }
                let drop = below.level - below.height(reach);
                assert!((drop - aim.drop(below.level, reach)).abs() < 1e-6, "{aim:?}");
            }
        }
    }

    #[test]
    fn even_layers_begin_and_end_where_they_should_and_none_is_left_out() {
        for aim in AIMS {
            for is_turned in [false, true] {
                let reach = 15.0;
                let flat = End { level: if is_turned { 40.0 } else { 8.0 }, drop: 0.0 };
                let ends = if is_turned {
                    [end(&aim, 24.0, reach), flat]
                } else {
                    [flat, end(&aim, 24.0, reach)]
                };
                let even = even(&aim, ends, reach, 0.2).unwrap();
                let last = even.sides.last().unwrap();
                assert!((last.level - ends[1].level).abs() < 1e-9);
                assert!((last.level - last.height(reach) - ends[1].drop).abs() < 1e-6);
                for r in [0.0, 4.0, reach] {
                    // What lies between the ends is the sum of the layers, straight up.
                    let first = aim.side(ends[0].level, ends[0].drop, reach).unwrap();
                    let heights: Vec<f64> = std::iter::once(&first)
                        .chain(&even.sides)
                        .map(|side| side.height(r))
                        .collect();
                    assert!(heights.is_sorted(), "{aim:?} {r}");
                }
                let [thin, thick] = even.thickness;
                assert!(thin > 0.0 && thin <= 0.21 && thick >= 0.18, "{aim:?} {thin} {thick}");
            }
        }
    }

    #[test]
    fn halfway_is_between_both() {
        for aim in AIMS {
            let sides = fewest(&aim, 3.0, 12.0, [0.1, 0.3]).unwrap();
            for pair in sides.windows(2) {
                let half = pair[0].halfway(&pair[1]).unwrap();
                for r in [0.0, 5.0, 12.0] {
                    let wanted = f64::midpoint(pair[0].height(r), pair[1].height(r));
                    // Half the square of a step of curvature: far less than a layer is known to.
                    assert!((half.height(r) - wanted).abs() < 2e-3, "{aim:?} {r}");
                }
            }
        }
    }

    #[test]
    fn what_leads_nowhere_is_refused() {
        let cone = Aim::Cone { slope: 0.5 };
        assert!(fewest(&cone, 1.0, 10.0, [0.3, 0.1]).is_err());
        assert!(fewest(&Aim::Cone { slope: f64::NAN }, 1.0, 10.0, [0.1, 0.3]).is_err());
        // A sphere of 6 mm does not get to 10 mm from the axis.
        assert!(fewest(&Aim::Spheres { centre_z: -5.0 }, 1.0, 10.0, [0.1, 0.3]).is_err());
        let [low, high] = [8.0, 9.0].map(|level| End { level, drop: 0.0 });
        assert!(even(&cone, [high, low], 10.0, 0.2).is_err());
    }
}
