//! Layers of one height on a first layer of its own.

use super::{Level, ScheduleParams, on_grid};

/// Returns layers up to where the part reaches their middle: its top is met to half a layer.
pub(super) fn levels(top: f64, params: &ScheduleParams) -> Vec<Level> {
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
