//! At which levels the layers lie: the schedule.
//!
//! Layers of one height on a first layer of its own. A layer is laid when the part reaches its
//! middle, so the top of the part is met to within half a layer.

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

/// What the schedule is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScheduleParams {
    /// Thickness of the first layer, mm.
    pub first_layer_height: f64,
    /// Thickness of all others, mm.
    pub layer_height: f64,
}

/// Returns the layers of a part whose levels reach from 0 to `top`.
#[must_use]
pub fn schedule(top: f64, params: &ScheduleParams) -> Vec<Level> {
    let bound = |i: usize| {
        // Multiplied and not added up: the hundredth layer is as exact as the first.
        let above_first = params.layer_height * i.saturating_sub(1) as f64;
        if i == 0 { 0.0 } else { on_grid(params.first_layer_height + above_first) }
    };
    (0..)
        .map(|index| Level { index, lower: bound(index), upper: bound(index + 1) })
        .take_while(|level| level.middle() < top)
        .collect()
}

/// The level without the noise of its last bits: 17 × 0.2 is 3.4 and not 3.4000000000000004. A flat
/// face of the part that lies exactly on a middle must be told apart from one that lies beside it,
/// by us and by whoever checks the result.
fn on_grid(level: f64) -> f64 {
    const PER_MM: f64 = 1e6;
    (level * PER_MM).round() / PER_MM
}

/// Returns how many layers [`schedule`] would return, as a real number: a check for users' input
/// that costs nothing.
#[must_use]
pub fn expected_count(top: f64, params: &ScheduleParams) -> f64 {
    1.0 + ((top - params.first_layer_height) / params.layer_height).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uppers(top: f64, first: f64, height: f64) -> Vec<f64> {
        schedule(top, &ScheduleParams { first_layer_height: first, layer_height: height })
            .iter()
            .map(|level| level.upper)
            .collect()
    }

    #[test]
    fn the_top_is_met_to_half_a_layer() {
        assert_eq!(uppers(1.0, 0.2, 0.2).len(), 5);
        assert_eq!(uppers(1.05, 0.2, 0.2).len(), 5);
        assert_eq!(uppers(1.15, 0.2, 0.2).len(), 6);
        assert_eq!(uppers(0.09, 0.2, 0.2).len(), 0);
    }

    #[test]
    fn layers_touch_and_do_not_drift() {
        let levels =
            schedule(200.0, &ScheduleParams { first_layer_height: 0.3, layer_height: 0.2 });
        assert!(levels.windows(2).all(|pair| pair[0].upper == pair[1].lower));
        assert!((levels.last().unwrap().upper - 199.9).abs() < 1e-9);
        assert_eq!(levels[17].thickness(), 0.2);
        assert_eq!(levels[17].middle(), 3.6);
        let params = ScheduleParams { first_layer_height: 0.3, layer_height: 0.2 };
        assert!((expected_count(200.0, &params) - levels.len() as f64).abs() < 1.0);
    }
}
