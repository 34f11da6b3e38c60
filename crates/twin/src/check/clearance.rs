//! Do nozzle and hot end stay clear of everything that was printed before?
//!
//! Nozzle, heater block and carriage from the printer's profile stand over the tip every
//! [`crate::check::support::PIECE`] of the way, travels included. Where the heights of what was laid
//! (see `pile`) rise above them, the bodies themselves are compared: how far each would have to be
//! raised to clear the true beads there (see [`geom::lift`]).
//!
//! * The flat face may press [`PRESSED`] layers deep into earlier layers: it irons what is uphill of
//!   it. What the present layer laid is soft, and the face drags through it wherever a
//!   layer slopes; that is not judged.
//! * Cone, block and carriage may touch what was laid to [`TOUCHED`]; the cone counts from a layer above
//!   the face, and for what the present layer laid from [`SOFT`] faces off.
//! * A nozzle that leans is compared upright with beads that are turned about its tip the other way; the
//!   carriage above it does not lean.
//! * The carriage is a beam over the whole bed, along the rail as it lies over the part there.
//!
//! mm, part frame.

use geom::lift::{Tool, lift};
use machine::head::{Head, shortest_turn};
use machine::profile::{NozzleShape, Printer};
use nalgebra::{Point2, Point3, UnitVector3, Vector2, Vector3};

use crate::finding::{Findings, Place};
use crate::pile::{CELL, Pile, Rise, Underside};

/// The name of this check.
pub const NAME: &str = "clearance";

/// How deep the rim of the face may press into earlier layers, in layers: it then still runs on
/// the layer below.
pub const PRESSED: f64 = 1.0;

/// How deep cone, block and carriage may reach into what was laid, mm: half a layer.
pub const TOUCHED: f64 = 0.1;

/// How far around the nozzle what the present layer laid is soft, in radii of the face.
pub const SOFT: f64 = 2.0;

/// After so many findings no more are looked for: the program is unprintable, and each costs time.
pub const ENOUGH: usize = 1000;

/// How tall the face's own body and the carriage are, mm: taller than any bead is thick. They come from
/// above, so more would say nothing.
const BODY: f64 = 10.0;

/// Judges places of the nozzle.
#[derive(Debug)]
pub(crate) struct Clear {
    nozzle: NozzleShape,
    /// Half the length of the carriage's beam: over all of the bed from anywhere.
    half_beam: f64,
    /// From the tip to what a head turns the nozzle about, mm.
    pivot_length: f64,
    deepest: f64,
    found: usize,
}

/// One body that may run into what was laid.
#[derive(Debug, Clone, Copy)]
struct Part {
    what: &'static str,
    tool: Tool,
    /// How deep it may reach.
    limit: f64,
    /// The layer whose lines it does not mind.
    ignored: Option<u32>,
}

impl Clear {
    /// Returns the check for this printer.
    pub(crate) fn new(printer: &Printer) -> Self {
        let reach = printer.rail.max.max(-printer.rail.min);
        Self {
            nozzle: printer.nozzle,
            half_beam: 2.0 * reach,
            pivot_length: printer.head.as_ref().map_or(0.0, Head::pivot_length),
            deepest: 0.0,
            found: 0,
        }
    }

    /// The tip stands at `tip`, the nozzle along `axis`, while a layer `thickness` thick is printed; `rail` says where the rail
    /// lies over the part.
    pub(crate) fn tip(
        &mut self,
        (tip, axis): (&Point3<f64>, &UnitVector3<f64>),
        (layer, thickness): (u32, f64),
        place: Place,
        (pile, rail): (&Pile, impl Fn() -> Vector2<f64>),
        findings: &mut Findings,
    ) {
        // How far anything rises above the tip.
        let rises = pile.greatest() - tip.z;
        let sine = axis.xy().norm();
        let NozzleShape { flat_radius, block_height, block_radius, .. } = self.nozzle;
        let rim = block_height * axis.z - block_radius * sine;
        if rises <= rim.min(-flat_radius * sine) || self.found >= ENOUGH {
            return;
        }
        let stand = &Stand { tip, axis };
        let limit = PRESSED * thickness;
        let face =
            Part { what: "the face of the nozzle", tool: self.face(), limit, ignored: Some(layer) };
        self.judge(&face, stand, place, pile, findings);
        let what = "the cone of the nozzle";
        let soft = self.nozzle.height(SOFT * self.nozzle.flat_radius);
        for (from, ignored) in [(thickness, Some(layer)), (soft.max(thickness), None)] {
            if let Some(tool) = self.cone(from) {
                let cone = Part { what, tool, limit: TOUCHED, ignored };
                if self.judge(&cone, stand, place, pile, findings) {
                    break;
                }
            }
        }
        if rises > rim {
            let part = Part {
                what: "the heater block",
                tool: self.block(),
                limit: TOUCHED,
                ignored: None,
            };
            self.judge(&part, stand, place, pile, findings);
        }
        // It does not lean; the pivot below it stands where the nozzle leads.
        let swung = tip + (axis.into_inner() - Vector3::z()) * self.pivot_length;
        if rises > self.nozzle.carriage_height + swung.z - tip.z {
            let tool = self.carriage(rail());
            let part = Part { what: "the carriage", tool, limit: TOUCHED, ignored: None };
            let upright = Stand { tip: &swung, axis: &Vector3::z_axis() };
            self.judge(&part, &upright, place, pile, findings);
        }
    }

    fn face(&self) -> Tool {
        Tool::Frustum { radii: [self.nozzle.flat_radius; 2], heights: [0.0, BODY] }
    }

    /// The cone from a height above the face upwards; `None` when it ends below.
    fn cone(&self, from: f64) -> Option<Tool> {
        let NozzleShape { flat_radius, half_angle, block_height, block_radius, .. } = self.nozzle;
        let top = block_height.min((block_radius - flat_radius) / half_angle.tan());
        let radius = |height: f64| flat_radius + height * half_angle.tan();
        let is_left = from < top;
        is_left.then(|| Tool::Frustum { radii: [radius(from), radius(top)], heights: [from, top] })
    }

    fn block(&self) -> Tool {
        let low = self.nozzle.block_height;
        let heights = [low, self.nozzle.carriage_height.max(low + BODY)];
        Tool::Frustum { radii: [self.nozzle.block_radius; 2], heights }
    }

    fn carriage(&self, along: Vector2<f64>) -> Tool {
        let NozzleShape { carriage_height: low, carriage_width: width, .. } = self.nozzle;
        Tool::Beam { along, half: [self.half_beam, width / 2.0], heights: [low, low + BODY] }
    }

    /// Returns whether the part reaches deeper than it may.
    fn judge(
        &mut self,
        part: &Part,
        stand: &Stand<'_>,
        place: Place,
        pile: &Pile,
        findings: &mut Findings,
    ) -> bool {
        // What is neither forbidden nor deeper than anything before need not be known.
        let least = part.limit.min(self.deepest);
        let Stand { tip, axis } = *stand;
        let standing = Standing { tool: &part.tool, tip, axis, raised: least };
        let upright = leans(axis).then(|| shortest_turn(axis).inverse());
        let mut worst: Option<(f64, Rise)> = None;
        for rise in pile.rising(&standing, part.ignored) {
            let so_far = worst.map_or(least, |(depth, _)| depth);
            if least + rise.above <= so_far {
                break;
            }
            let bead = pile.bead(rise.piece);
            let bead = upright.map_or(bead, |turn| bead.turned_about(tip, &turn));
            if let Some(depth) = lift(&part.tool, tip, &bead, so_far) {
                worst = Some((depth, rise));
            }
        }
        let Some((depth, Rise { at, .. })) = worst else { return false };
        self.deepest = self.deepest.max(depth);
        if depth <= part.limit {
            return false;
        }
        self.found += 1;
        let Part { what, limit, .. } = part;
        findings.warning(NAME, place, (depth, *limit), || {
            format!(
                "{what} reaches {depth:.2} mm into what is printed at x {:.1} y {:.1} z {:.2}, at \
                 most {limit:.2} mm",
                at.x, at.y, at.z
            )
        });
        true
    }

    /// Returns how deep the nozzle reached into what was printed, mm.
    pub(crate) fn deepest(&self) -> f64 {
        self.deepest
    }
}

/// How much wider a body is taken on the cells of the pile: what a bead covers of a cell that is not
/// its own, and what it rises within one.
const PAD: f64 = CELL;

/// Where the tip is, and where the nozzle points up to.
struct Stand<'a> {
    tip: &'a Point3<f64>,
    axis: &'a UnitVector3<f64>,
}

/// Less than this is upright, radians: a micrometre is a thousand times as much as it moves any body.
const UPRIGHT: f64 = 1e-9;

fn leans(axis: &UnitVector3<f64>) -> bool {
    axis.xy().norm() > UPRIGHT
}

/// A body over its place, and raised.
struct Standing<'a> {
    tool: &'a Tool,
    tip: &'a Point3<f64>,
    axis: &'a UnitVector3<f64>,
    raised: f64,
}

impl Underside for Standing<'_> {
    fn lowest(&self, about: &Point2<f64>, radius: f64) -> f64 {
        let from_axis = about - self.tip.xy();
        if leans(self.axis) {
            return self.tip.z + self.lowest_leaning(&from_axis, radius + PAD);
        }
        let height = match self.tool {
            Tool::Frustum { radii: [low, high], heights } => {
                let distance = from_axis.norm() - radius - PAD;
                if distance <= *low {
                    heights[0]
                } else if distance <= *high {
                    heights[0] + (heights[1] - heights[0]) * (distance - low) / (high - low)
                } else {
                    f64::INFINITY
                }
            }
            Tool::Beam { along, half, heights } => {
                let sides = [from_axis.dot(along), along.perp(&from_axis)];
                let beyond = |k: usize| (sides[k].abs() - half[k]).max(0.0);
                let is_under = beyond(0).hypot(beyond(1)) <= radius + PAD;
                if is_under { heights[0] } else { f64::INFINITY }
            }
        };
        self.tip.z + self.raised + height
    }

    fn square(&self) -> (Point2<f64>, f64) {
        if leans(self.axis) {
            return (self.tip.xy(), self.reach() + PAD);
        }
        let half = match self.tool {
            Tool::Frustum { radii, .. } => radii[0].max(radii[1]),
            Tool::Beam { half, .. } => half[0] + half[1],
        };
        (self.tip.xy(), half + PAD)
    }
}

impl Standing<'_> {
    /// How far a leaning body reaches sideways.
    fn reach(&self) -> f64 {
        let (Tool::Frustum { heights, .. } | Tool::Beam { heights, .. }) = self.tool;
        let wide = match self.tool {
            Tool::Frustum { radii, .. } => radii[0].max(radii[1]),
            Tool::Beam { half, .. } => half[0] + half[1],
        };
        wide + heights[1] * self.axis.xy().norm()
    }

    /// How high above the tip a leaning body is at least over a place and what is within `radius` of it.
    ///
    /// With `x` the way the nozzle leans and `y` across, a point of it is `t = x·sin + z·cos` up the nozzle
    /// and `q = x·cos − z·sin` beside it; a cone has `t ≥ h + (|q| − r)/tan` and the same of `|y|`, a
    /// cylinder `|q|, |y| ≤ r`. Each is a plane, and the body lies above all of them.
    fn lowest_leaning(&self, from_tip: &Vector2<f64>, radius: f64) -> f64 {
        let lean = self.axis.xy();
        let (sin, cos) = (lean.norm(), self.axis.z);
        let Tool::Frustum { radii: [low, high], heights: [base, top] } = *self.tool else {
            return f64::NEG_INFINITY;
        };
        if from_tip.norm() > self.reach() + radius {
            return f64::INFINITY;
        }
        let (x, y) = (from_tip.dot(&lean) / sin, lean.perp(from_tip) / sin);
        // The height of a plane over x, less what it falls within the radius.
        let plane = |at_zero: f64, slope: f64| at_zero + slope * x - slope.abs() * radius;
        let aside = (y.abs() - radius).max(0.0);
        let slope = (high - low) / (top - base);
        let mut height = plane(base / cos, -sin / cos);
        if slope > 0.0 {
            let foot = base - low / slope;
            height = height.max(plane((foot + aside / slope) / cos, -sin / cos));
            let across = [cos + sin / slope, cos - sin / slope];
            height = height.max(plane(foot / across[0], (cos / slope - sin) / across[0]));
            if across[1] > 0.0 {
                height = height.max(plane(foot / across[1], -(cos / slope + sin) / across[1]));
            }
        } else if aside > high {
            return f64::INFINITY;
        } else {
            height = height.max(plane(-high / sin, cos / sin));
            // Behind the axis it ends above, too.
            let ceiling = (x * cos + high + radius * cos) / sin;
            if height > ceiling {
                return f64::INFINITY;
            }
        }
        height + self.raised * cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;
    use crate::pile::Piece;
    use crate::sample::printer;

    /// A bead of 0.45 mm from one place to another.
    fn bead(ends: [[f64; 3]; 2], family: Family) -> Piece {
        let ends = ends.map(Point3::from);
        Piece {
            ends,
            half_width: 0.225,
            thickness: 0.2,
            family,
            layer: 3,
            stroke: 0,
            supports: false,
        }
    }

    /// What is found with the tip at `tip`, the rail along `rail`, after `piece` was laid; and the depth.
    fn found_beside(piece: &Piece, tip: [f64; 3], rail: [f64; 2]) -> (Vec<String>, f64) {
        let mut pile = Pile::new(60.0);
        pile.lay(piece);
        let (mut check, mut findings) = (Clear::new(&printer()), Findings::default());
        let (place, rail) = (Place::line(1, None), Vector2::from(rail));
        let stand = (&Point3::from(tip), &Vector3::z_axis());
        check.tip(stand, (4, 0.2), place, (&pile, || rail), &mut findings);
        let messages = findings.kept().iter().map(|finding| finding.message.clone()).collect();
        (messages, check.deepest())
    }

    /// The same beside a wall 10 mm long along x at y = 0 up to `top`.
    fn found(top: f64, tip: [f64; 3]) -> Vec<String> {
        let wall = bead([[-5.0, 0.0, top], [5.0, 0.0, top]], Family::Planar);
        found_beside(&wall, tip, [1.0, 0.0]).0
    }

    #[test]
    fn each_part_of_the_hot_end_is_clear_or_not() {
        assert!(found(5.0, [0.0, 0.0, 5.0]).is_empty());
        assert!(found(5.0, [0.0, 0.3, 4.81]).is_empty());
        assert!(found(5.0, [0.0, 0.3, 4.7])[0].starts_with("the face of the nozzle reaches 0.30"));
        // The round side of the wall is 1.875 - 0.5 off the rim, where the cone is 1.375 / tan 30° less
        // 0.1 / sin 30° above the tip.
        assert!(found(5.0, [0.0, 2.0, 2.8]).is_empty());
        let hit = found(5.0, [0.0, 2.0, 2.0]);
        let depth = 4.9 - 2.0 - 1.375 * 3.0_f64.sqrt() + 0.2;
        assert!(
            hit[0].starts_with(&format!("the cone of the nozzle reaches {depth:.2}")),
            "{hit:?}"
        );
        // The block, 12 mm up, reaches 20 mm out.
        assert!(found(15.0, [0.0, 15.0, 3.0]).is_empty());
        let hit = found(15.0, [0.0, 15.0, 2.5]);
        assert!(hit.len() == 1 && hit[0].starts_with("the heater block reaches 0.50"), "{hit:?}");
        assert!(found(15.0, [0.0, 20.4, 2.5]).is_empty());
    }

    #[test]
    fn a_nozzle_that_leans_away_clears_what_an_upright_one_hits_and_hits_the_other_side() {
        let wall = |y: f64, top: f64| bead([[-5.0, y, top], [5.0, y, top]], Family::Planar);
        let found = |piece: &Piece, lean: f64| {
            let mut pile = Pile::new(60.0);
            pile.lay(piece);
            let (mut check, mut findings) = (Clear::new(&printer()), Findings::default());
            let axis = UnitVector3::new_normalize(Vector3::new(0.0, lean.sin(), lean.cos()));
            let rail = || Vector2::x();
            let place = Place::line(1, None);
            let tip = Point3::new(0.0, 0.0, 5.0);
            check.tip((&tip, &axis), (4, 0.2), place, (&pile, rail), &mut findings);
            let told: Vec<String> = findings.kept().iter().map(|f| f.message.clone()).collect();
            told
        };
        // A wall 3 mm higher than the tip, 2 mm beside it.
        let near = wall(-2.0, 8.0);
        assert!(found(&near, 0.0)[0].starts_with("the cone of the nozzle"));
        assert!(found(&near, 0.6).is_empty(), "{:?}", found(&near, 0.6));
        assert!(!found(&near, -0.3).is_empty());
        // Leaning by 30°, the far rim of the block is 12·cos 30° − 20·sin 30° = 0.39 mm above the tip, and
        // 23.3 mm from it.
        let far = wall(22.0, 6.5);
        assert!(found(&far, 0.0).is_empty());
        let hit = found(&far, std::f64::consts::FRAC_PI_6);
        assert!(hit.iter().any(|told| told.starts_with("the heater block")), "{hit:?}");
    }

    #[test]
    fn leaning_bodies_lie_above_what_is_said_of_them() {
        let clear = Clear::new(&printer());
        let mut closest = f64::INFINITY;
        for tool in [clear.face(), clear.cone(0.2).unwrap(), clear.block()] {
            let Tool::Frustum { radii, heights } = tool else { panic!() };
            for k in 0..4000_u32 {
                let t = f64::from(k);
                let part = |share: f64| (t * share).fract();
                let (lean, way) = (0.02 + part(0.618), 6.3 * part(0.31));
                let axis = Vector3::new(lean.sin() * way.cos(), lean.sin() * way.sin(), lean.cos());
                let axis = UnitVector3::new_normalize(axis);
                let share = if k.is_multiple_of(2) { 0.0 } else { part(0.37) };
                let height = heights[0] + (heights[1] - heights[0]) * share;
                let radius = radii[0] + (radii[1] - radii[0]) * share;
                let angle = 6.3 * part(0.77);
                let upright = Vector3::new(radius * angle.cos(), radius * angle.sin(), height);
                let inside = shortest_turn(&axis) * upright;
                let tip = Point3::new(3.0, -4.0, 7.0);
                let standing = Standing { tool: &tool, tip: &tip, axis: &axis, raised: 0.0 };
                let place = tip.xy() + inside.xy();
                let lowest = standing.lowest(&place, 0.1);
                assert!(lowest <= tip.z + inside.z, "{tool:?} {lean}: {lowest} {inside}");
                closest = closest.min(tip.z + inside.z - lowest);
            }
        }
        assert!(closest < 0.3, "{closest}");
    }

    #[test]
    fn only_the_carriage_lies_over_what_is_far_along_the_rail() {
        let tower = bead([[0.0, 50.0, 62.0], [0.5, 50.0, 62.0]], Family::Planar);
        let (hit, depth) = found_beside(&tower, [0.0, 0.0, 1.0], [0.0, 1.0]);
        assert!(hit.len() == 1 && hit[0].starts_with("the carriage reaches 1.00"), "{hit:?}");
        assert!((depth - 1.0).abs() < 1e-4, "{depth}");
        // The beam lies elsewhere, or is higher up.
        assert!(found_beside(&tower, [0.0, 0.0, 1.0], [0.8, 0.6]).0.is_empty());
        assert!(found_beside(&tower, [0.0, 0.0, 2.0], [0.0, 1.0]).0.is_empty());
    }

    #[test]
    fn a_sloped_bead_beside_the_cone_is_clear_that_cells_would_hit() {
        // A line down the side of a cone, and the nozzle beside it. Cells know its flat upper side
        // only, which ends where its round side does.
        let (slope, level) = (1.5_f64, 20.0);
        let family = Family::Conical { slope };
        let at = |x: f64| [x, 0.0, level - slope * x];
        let line = bead([at(6.0), at(8.0)], family);
        let mut pile = Pile::new(60.0);
        pile.lay(&line);
        let clear = Clear::new(&printer());
        let tool = clear.cone(0.2).unwrap();
        let mut told_apart = 0;
        for step in 0..40 {
            let tip = Point3::new(7.0, 0.9, at(7.0)[2] + 1.0 - 0.03 * f64::from(step));
            let axis = &Vector3::z_axis();
            let standing = Standing { tool: &tool, tip: &tip, axis, raised: TOUCHED };
            let cells = !pile.rising(&standing, None).is_empty();
            let depth = lift(&tool, &tip, &pile.bead(0), TOUCHED);
            assert!(cells || depth.is_none(), "{step}: cells do not see {depth:?}");
            told_apart += u32::from(cells && depth.is_none());
            let cone = |message: &String| message.starts_with("the cone");
            let (hit, _) = found_beside(&line, tip.into(), [1.0, 0.0]);
            assert_eq!(hit.iter().any(cone), depth.is_some(), "{step}: {hit:?}");
        }
        assert!((3..30).contains(&told_apart), "{told_apart}");
    }
}
