//! Short layers are stretched, so that one is solid before the next comes.

use crate::resample::Leg;
use crate::route::Kind;

/// How long a layer takes at least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoolingParams {
    /// A layer that takes less is slowed down, s.
    pub least_layer_time: f64,
    /// But never below this speed, mm/s.
    pub least_speed: f64,
}

/// Lowers the wanted speed of a layer's extruding legs so that it takes the least layer time, but none
/// so far that it feeds less filament than `least_feed`, mm/s; returns whether anything changed.
pub fn slow_down(
    legs: &mut [Leg],
    durations: &[f64],
    params: &CoolingParams,
    least_feed: f64,
) -> bool {
    let of_kind = |print: bool| -> f64 {
        legs.iter()
            .zip(durations)
            .filter(|(leg, _)| (leg.kind == Kind::Print) == print)
            .map(|(_, duration)| duration)
            .sum()
    };
    let (printing, other) = (of_kind(true), of_kind(false));
    if printing == 0.0 || printing + other >= params.least_layer_time {
        return false;
    }
    let stretch = (params.least_layer_time - other) / printing;
    for (leg, duration) in legs.iter_mut().zip(durations) {
        if leg.kind == Kind::Print {
            let speed = leg.path / duration;
            let flows = if leg.filament > 0.0 { least_feed * leg.path / leg.filament } else { 0.0 };
            leg.speed = (speed / stretch).max(params.least_speed.max(flows).min(speed));
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::program::{BedTurn, Joints};
    use nalgebra::Point3;

    fn legs() -> Vec<Leg> {
        let leg = |kind, path| Leg {
            kind,
            to: Joints { s: 10.0, turn: BedTurn::default(), z: 1.0 },
            at: Point3::new(10.0, 0.0, 1.0),
            filament: 0.0,
            path,
            speed: 50.0,
        };
        vec![leg(Kind::Travel, 50.0), leg(Kind::Print, 100.0)]
    }

    #[test]
    fn short_layers_last_longer_and_long_ones_do_not() {
        let mut stretched = legs();
        let params = CoolingParams { least_layer_time: 6.0, least_speed: 10.0 };
        assert!(slow_down(&mut stretched, &[1.0, 2.0], &params, 0.0));
        assert!((stretched[1].speed - 20.0).abs() < 1e-12, "5 s are left for 100 mm");
        assert_eq!(stretched[0].speed, 50.0, "travel stays fast");
        let enough = CoolingParams { least_layer_time: 3.0, ..params };
        assert!(!slow_down(&mut legs(), &[1.0, 2.0], &enough, 0.0));
        let forever = CoolingParams { least_layer_time: 60.0, ..params };
        let mut slowest = legs();
        slow_down(&mut slowest, &[1.0, 2.0], &forever, 0.0);
        assert_eq!(slowest[1].speed, 10.0);
        // 4 mm of filament on 100 mm: at 25 mm/s that is a millimetre a second.
        let mut flowing = legs();
        flowing[1].filament = 4.0;
        slow_down(&mut flowing, &[1.0, 2.0], &forever, 1.0);
        assert_eq!(flowing[1].speed, 25.0);
    }
}
