//! At which levels the layers lie: the schedule.
//!
//! A level is what the layer surface calls one: z for planes, the distance along the axis for
//! others; nothing here knows which. The part gives its greatest level, the levels at which it has
//! flat faces, and, for adaptive heights, the thickest layer that each level bears
//! ([`adaptive::caps`]). The bed is level 0. Lengths are mm.
//!
//! Three schedules:
//!
//! * [`Snap::Optimal`]: all heights are whole increments of the machine within its limits, and of
//!   all such schedules it is the one that misses the flat faces by the least
//!   ([`optimal`]). Without a flat face in between, layers have the wanted height; limits are
//!   reached only where faces ask for it. Adaptive schedules want the fewest layers instead.
//! * [`Snap::Greedy`]: the published rule, with its failures ([`greedy`]).
//! * [`Snap::Off`]: layers of the wanted height. They end where the top is met to half a layer.
//!
//! The mesh is cut at the middle of a layer, so a face on an upper level belongs to the layer
//! below it, whatever the rounding.

pub mod adaptive;
mod even;
pub mod greedy;
mod increment;
pub mod optimal;

use adaptive::AdaptiveParams;
pub use increment::Increments;
use optimal::{Aim, Face, Problem};

/// One layer of the schedule; levels in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Counted from 0.
    pub index: usize,
    /// Where the material begins.
    pub lower: f64,
    /// Where it ends and the nozzle runs.
    pub upper: f64,
}

impl Level {
    /// Returns the level at which the mesh is cut.
    #[must_use]
    pub fn middle(&self) -> f64 {
        on_grid(f64::midpoint(self.lower, self.upper))
    }

    /// Returns the difference of the two levels.
    #[must_use]
    pub fn thickness(&self) -> f64 {
        on_grid(self.upper - self.lower)
    }
}

/// How the schedule treats flat faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Snap {
    /// Meets every one that can be met, and misses the others by the least.
    #[default]
    Optimal,
    /// Corrects heights from the bottom up by the published rule.
    Greedy,
    /// Not at all.
    Off,
}

/// What the schedule is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScheduleParams {
    /// Thickness of the first layer, mm. No flat face changes it.
    pub first_layer_height: f64,
    /// Wanted thickness of all others, mm. Adaptive schedules do not use it.
    pub layer_height: f64,
    /// Thinnest layer that flat faces or slopes may ask for, mm.
    pub least_height: f64,
    /// Thickest such layer, mm.
    pub greatest_height: f64,
    /// What the machine moves by between layers, mm. Heights are whole multiples of it, except
    /// with [`Snap::Off`], where they are what the user typed.
    pub increment: f64,
    /// What flat faces do.
    pub snap: Snap,
    /// Heights by the slope of the surface, if wanted.
    pub adaptive: Option<AdaptiveParams>,
}

/// A flat face that a layer should end on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatFace {
    /// Where it lies.
    pub level: f64,
    /// How large it is, mm²: of two that cannot both be met, the larger counts for more.
    pub area: f64,
}

/// What the schedule must know of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent<'a> {
    /// Its greatest level; the least is 0.
    pub top: f64,
    /// Its flat faces, in any order.
    pub flats: &'a [FlatFace],
    /// Thickest layer in increments by cell of one increment, from [`adaptive::caps`]; empty
    /// where slopes do not matter.
    pub caps: &'a [u32],
}

/// Returns the layers of a part, from the bed up. There is at least one unless the part is lower
/// than half the first layer.
///
/// The work and the memory are bounded by [`cost`], which the caller should check first.
#[must_use]
pub fn schedule(part: &Extent<'_>, params: &ScheduleParams) -> Vec<Level> {
    let bounds = match (params.snap, params.adaptive) {
        (Snap::Off, None) => return even::levels(part.top, params),
        (Snap::Off, Some(_)) => planned(&Extent { flats: &[], ..*part }, params),
        (Snap::Optimal, _) => planned(part, params),
        (Snap::Greedy, _) => by_rule(part, params),
    };
    levels(&bounds, part.top)
}

/// The uncorrected bounds that the published rule begins with. It removes material from layers as
/// well as adding it, so there are some more than the part needs.
fn initial(part: &Extent<'_>, params: &ScheduleParams) -> Vec<f64> {
    let mut bounds = if params.adaptive.is_some() {
        planned(&Extent { flats: &[], ..*part }, params)
    } else {
        let levels = even::levels(part.top, params);
        std::iter::once(0.0).chain(levels.iter().map(|level| level.upper)).collect()
    };
    let spare = part.flats.len() + 1;
    for _ in 0..spare {
        let last = bounds.last().copied().unwrap_or(0.0);
        bounds.push(on_grid(last + params.layer_height));
    }
    bounds
}

/// The bounds of the optimal schedule.
fn planned(part: &Extent<'_>, params: &ScheduleParams) -> Vec<f64> {
    let grid = Increments::of(params);
    let faces = faces(part.flats, &grid);
    let problem = Problem {
        top: grid.nearest(part.top).max(1),
        end_slack: grid.greatest / 2,
        first: Some(grid.nearest(params.first_layer_height).max(1)),
        least: grid.least,
        greatest: grid.greatest,
        aim: Aim::Fewest,
        faces: &faces,
        miss_milli: optimal::TIE_BREAK_MILLI,
        caps: part.caps,
    };
    let heights = match params.adaptive {
        Some(_) => optimal::plan(&problem),
        None => nominal(&problem, part, params),
    };
    let mut at = 0;
    let uppers = heights.iter().map(|height| {
        at += u64::from(*height);
        on_grid(at as f64 * grid.size)
    });
    std::iter::once(0.0).chain(uppers).collect()
}

/// Layers as near to the wanted height as can be, but no more of them than the published rule
/// lays: to meet a face that the rule misses may take a layer more, and then a long stretch of
/// even layers can do with one less.
fn nominal(problem: &Problem<'_>, part: &Extent<'_>, params: &ScheduleParams) -> Vec<u32> {
    /// An increment off in one layer, squared.
    const LEAST_COST: u64 = 1_000_000;
    // More than a layer of any height is off: then there are as few as can be.
    let most_cost = (1000 * u64::from(problem.greatest)).pow(2) * 4;
    let height_milli = Increments::of(params).milli(params.layer_height).max(1) as u64;
    let plan = |layer_cost| {
        let aim = Aim::Nominal { height_milli, layer_cost };
        optimal::plan(&Problem { aim, ..*problem })
    };
    let wanted = plan(0);
    if part.flats.is_empty() {
        return wanted;
    }
    let most = levels(&by_rule(part, params), part.top).len();
    let costs = std::iter::successors(Some(LEAST_COST), |cost| Some(2 * cost));
    let mut fewer =
        std::iter::once(wanted.clone()).chain(costs.take_while(|cost| *cost < most_cost).map(plan));
    fewer.find(|heights| heights.len() <= most).unwrap_or(wanted)
}

/// The bounds that the published rule gives.
fn by_rule(part: &Extent<'_>, params: &ScheduleParams) -> Vec<f64> {
    let flats: Vec<f64> = part.flats.iter().map(|flat| flat.level).collect();
    greedy::corrected(&initial(part, params), &flats, &greedy::Rule::published(params))
}

/// Flat faces on the scale of the increments; those that one plane meets are one.
fn faces(flats: &[FlatFace], grid: &Increments) -> Vec<Face> {
    /// The largest face has this weight, the smallest at least 1.
    const MOST_WEIGHT: f64 = 1e6;
    let mut sorted: Vec<FlatFace> = flats.iter().filter(|flat| flat.level > 0.0).copied().collect();
    sorted.sort_by(|a, b| a.level.total_cmp(&b.level).then(a.area.total_cmp(&b.area)));
    let mut merged: Vec<FlatFace> = Vec::new();
    let mut start = f64::NEG_INFINITY;
    for flat in sorted {
        match merged.last_mut() {
            Some(last) if flat.level - start <= grid.size / 2.0 => {
                let area = last.area + flat.area;
                if area > 0.0 {
                    last.level += (flat.level - last.level) * (flat.area / area);
                }
                last.area = area;
            }
            _ => {
                start = flat.level;
                merged.push(flat);
            }
        }
    }
    let largest = merged.iter().map(|flat| flat.area).fold(0.0, f64::max);
    let weight = |area: f64| ((area / largest * MOST_WEIGHT).round() as u64).max(1);
    merged
        .iter()
        .map(|flat| Face { at_milli: grid.milli(flat.level), weight: weight(flat.area) })
        .collect()
}

/// Layers between bounds, without those at the end that the part does not reach.
fn levels(bounds: &[f64], top: f64) -> Vec<Level> {
    let all = bounds.windows(2).enumerate();
    all.map(|(index, pair)| Level { index, lower: pair[0], upper: pair[1] })
        .take_while(|level| level.middle() < top)
        .collect()
}

/// Returns how far every flat face lies from the nearest bound of a layer, mm.
#[must_use]
pub fn misses(levels: &[Level], flats: &[FlatFace]) -> Vec<f64> {
    let distance = |flat: &FlatFace| {
        let above = levels.partition_point(|level| level.upper < flat.level);
        let below = match above.checked_sub(1).map(|k| levels[k].upper) {
            Some(upper) => flat.level - upper,
            None => flat.level.abs(),
        };
        let above = levels.get(above).map_or(f64::INFINITY, |level| level.upper - flat.level);
        on_grid(below.min(above))
    };
    flats.iter().map(distance).collect()
}

/// The level without the noise of its last bits: 17 × 0.2 is 3.4 and not 3.4000000000000004. A flat
/// face of the part that lies exactly on a middle must be told apart from one that lies beside it,
/// by us and by whoever checks the result.
fn on_grid(level: f64) -> f64 {
    const PER_MM: f64 = 1e6;
    (level * PER_MM).round() / PER_MM
}

/// What a schedule would take: a check for users' input that costs nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// The most layers there can be.
    pub layers: f64,
    /// Combinations of a level and a height that are weighed up.
    pub steps: f64,
}

/// Returns what [`schedule`] would take for a part of a height.
#[must_use]
pub fn cost(top: f64, params: &ScheduleParams) -> Cost {
    let above_first = (top - params.first_layer_height).max(0.0);
    let even = 1.0 + above_first / params.layer_height;
    if params.snap == Snap::Off && params.adaptive.is_none() {
        return Cost { layers: even, steps: even };
    }
    let grid = Increments::of(params);
    let layers = match params.adaptive {
        Some(_) => 1.0 + above_first / (f64::from(grid.least) * grid.size),
        None => even,
    };
    let heights = f64::from(grid.greatest - grid.least + 1);
    Cost { layers, steps: (top / grid.size).max(1.0) * heights }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: ScheduleParams = ScheduleParams {
        first_layer_height: 0.2,
        layer_height: 0.2,
        least_height: 0.04,
        greatest_height: 0.32,
        increment: 0.01,
        snap: Snap::Optimal,
        adaptive: None,
    };

    fn uppers(top: f64, flats: &[f64], params: &ScheduleParams) -> Vec<f64> {
        let flats: Vec<FlatFace> =
            flats.iter().map(|&level| FlatFace { level, area: 100.0 }).collect();
        let part = Extent { top, flats: &flats, caps: &[] };
        schedule(&part, params).iter().map(|level| level.upper).collect()
    }

    #[test]
    fn a_prism_has_even_layers_whatever_the_rule() {
        for snap in [Snap::Optimal, Snap::Greedy, Snap::Off] {
            let found = uppers(20.0, &[0.0, 20.0], &ScheduleParams { snap, ..USUAL });
            let wanted: Vec<f64> = (1..=100).map(|i| f64::from(i) / 5.0).collect();
            assert_eq!(found, wanted, "{snap:?}");
        }
    }

    #[test]
    fn without_flats_the_top_is_met_to_half_a_layer() {
        for snap in [Snap::Optimal, Snap::Off] {
            let count = |top: f64| uppers(top, &[], &ScheduleParams { snap, ..USUAL }).len();
            assert_eq!([1.0, 1.05, 1.15, 0.11].map(count), [5, 5, 6, 1], "{snap:?}");
            assert_eq!(count(0.09), 0);
        }
    }

    #[test]
    fn flats_are_met_by_heights_near_the_wanted_one() {
        let flats = [3.07, 7.33, 11.9, 15.0];
        let found = uppers(15.0, &flats, &USUAL);
        assert!(flats.iter().all(|flat| found.contains(flat)), "{found:?}");
        assert_eq!(found.len(), 74);
        for pair in found.windows(2) {
            assert!((pair[1] - pair[0] - 0.2).abs() < 0.011, "{pair:?}");
        }
    }

    #[test]
    fn a_wanted_height_between_increments_becomes_one_beside_it() {
        let found = uppers(10.0, &[], &ScheduleParams { layer_height: 0.125, ..USUAL });
        for pair in found.windows(2) {
            assert!((pair[1] - pair[0] - 0.125).abs() < 0.005 + 1e-9, "{pair:?}");
            assert!((pair[0] * 100.0 - (pair[0] * 100.0).round()).abs() < 1e-9);
        }
    }

    #[test]
    fn the_first_layer_is_its_own() {
        let params = ScheduleParams { first_layer_height: 0.3, ..USUAL };
        let found = uppers(1.0, &[0.25, 1.0], &params);
        assert_eq!(found[0], 0.3);
        assert!(found.contains(&1.0));
    }

    #[test]
    fn misses_are_distances_to_the_nearest_bound() {
        let levels = levels(&[0.0, 0.2, 0.4], 1.0);
        let flats = [0.0, 0.2, 0.25, 0.33, 0.55].map(|level| FlatFace { level, area: 1.0 });
        assert_eq!(misses(&levels, &flats), [0.0, 0.0, 0.05, 0.07, 0.15]);
    }

    #[test]
    fn layers_of_the_off_rule_touch_and_do_not_drift() {
        let params = ScheduleParams { first_layer_height: 0.3, snap: Snap::Off, ..USUAL };
        let levels = schedule(&Extent { top: 200.0, flats: &[], caps: &[] }, &params);
        assert!(levels.windows(2).all(|pair| pair[0].upper == pair[1].lower));
        assert!((levels.last().unwrap().upper - 199.9).abs() < 1e-9);
        assert_eq!(levels[17].thickness(), 0.2);
        assert_eq!(levels[17].middle(), 3.6);
        assert!((cost(200.0, &params).layers - levels.len() as f64).abs() < 1.0);
    }
}
