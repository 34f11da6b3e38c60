//! Tests of the resampler as a whole.

use super::*;
use crate::testing::printer;
use machine::gcode::dialect::{CARTESIAN, POLAR};
use std::f64::consts::PI;

pub(super) const PARAMS: ResampleParams =
    ResampleParams { chord: 0.005, travel_chord: 0.1, dialect: POLAR, azimuth: 0.0 };

pub(super) fn print(x: f64, y: f64) -> Stroke {
    Stroke {
        kind: Kind::Print,
        to: Point3::new(x, y, 0.2),
        filament: 0.1,
        speed: 50.0,
        continues: false,
    }
}

pub(super) fn travel(x: f64, y: f64) -> Stroke {
    Stroke { kind: Kind::Travel, filament: 0.0, ..print(x, y) }
}

fn legs(resampler: &mut Resampler, strokes: &[Stroke]) -> Vec<Leg> {
    resampler.legs(strokes).unwrap().into_iter().flatten().collect()
}

/// Greatest distance of joint-linear legs from the line through `a` and `b`.
fn deviation(start: Joints, legs: &[Leg], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (a, b) = (Point2::from(a), Point2::from(b));
    let mut from = start;
    let mut worst: f64 = 0.0;
    for leg in legs {
        for k in 0..=50 {
            let p = Alignment::default().part_from_joints(&POLAR.between(
                &from,
                &leg.to,
                f64::from(k) / 50.0,
            ));
            worst = worst.max(geom::polyline::distance_to_segment(&a, &b, &p.xy()));
        }
        from = leg.to;
    }
    worst
}

#[test]
fn moves_stay_within_the_chord_tolerance() {
    for offset in [0.5, 1.0, 3.0, 10.0, 30.0] {
        let mut resampler = Resampler::new(&printer(), PARAMS);
        legs(&mut resampler, &[travel(-40.0, offset)]);
        let start = resampler.joints();
        let line = legs(&mut resampler, &[print(40.0, offset)]);
        let worst = deviation(start, &line, [-40.0, offset], [40.0, offset]);
        assert!(worst <= 0.005 * 1.05, "{worst} at {offset}");
        assert!(line.len() < 130, "{} moves at {offset}", line.len());
        let fed: f64 = line.iter().map(|leg| leg.filament).sum();
        assert!((fed - 0.1).abs() < 1e-12);
        assert!(line.iter().all(|leg| leg.at.z == 0.2));
    }
}

#[test]
fn a_line_that_grazes_the_axis_goes_round_it() {
    let mut near_only = printer();
    near_only.rail.min = 0.0;
    near_only.axis_clearance = 0.1;
    for offset in [0.0, 0.03, -0.07] {
        let mut resampler = Resampler::new(&near_only, PARAMS);
        legs(&mut resampler, &[travel(-10.0, offset)]);
        let line = legs(&mut resampler, &[print(10.0, offset)]);
        let nearest = line.iter().map(|leg| leg.to.s).fold(f64::INFINITY, f64::min);
        assert!(nearest >= 0.1 - 1e-9, "{nearest}");
        assert!(line.iter().all(|leg| leg.to.s >= 0.0));
    }
}

#[test]
fn lines_over_the_tip_of_a_cone_stay_on_it_round_the_axis() {
    let mut near_only = printer();
    near_only.rail.min = 0.0;
    near_only.axis_clearance = 0.1;
    let on_cone = |stroke: Stroke| {
        let z = 5.0 - 0.8 * stroke.to.xy().coords.norm();
        Stroke { to: Point3::new(stroke.to.x, stroke.to.y, z), ..stroke }
    };
    // Past the axis, over it with a corner on it, from it, to it, and with two corners beside it.
    let ways: [&[[f64; 2]]; 5] = [
        &[[-1.0, 0.0], [0.0, 0.0], [0.2, 0.9]],
        &[[-0.3, 0.05], [-0.2, 0.05], [-0.13, 0.05], [-0.05, 0.05], [0.0, 0.02], [0.04, 0.3]],
        &[[0.0, 0.0], [0.0, -2.0]],
        &[[0.7, 0.7], [0.0, 0.01]],
        &[[0.02, -0.01], [0.0, 0.04], [0.0, 0.3]],
    ];
    for way in ways {
        let mut resampler = Resampler::new(&near_only, PARAMS);
        let begin = on_cone(travel(way[0][0], way[0][1]));
        let mut strokes = vec![begin];
        strokes.push(Stroke { kind: Kind::Filament, filament: 0.8, ..begin });
        strokes.extend(way[1..].iter().map(|&[x, y]| on_cone(print(x, y))));
        let legs = legs(&mut resampler, &strokes);
        let first = legs.iter().rposition(|leg| leg.kind == Kind::Travel).unwrap();
        for leg in &legs[first..] {
            let off = leg.at.z - (5.0 - 0.8 * leg.at.xy().coords.norm());
            // Lines that are straight in space and pass the axis aside lie in the cone.
            assert!(off.abs() < 0.003, "{way:?}: {off} at {}", leg.at);
        }
    }
}

#[test]
fn a_line_through_the_axis_turns_nothing_where_the_carriage_can_pass() {
    let mut resampler = Resampler::new(&printer(), PARAMS);
    legs(&mut resampler, &[travel(0.0, 15.0), travel(-10.0, 0.0)]);
    let line = legs(&mut resampler, &[print(10.0, 0.0), print(10.0, 4.0)]);
    assert_eq!(line[0].to.s, -10.0);
    assert!((line[0].to.turn.radians().abs() - PI).abs() < 1e-9);
    assert!(line.iter().all(|leg| leg.to.s < 0.0));
    // Too long for the far side: round the axis on the near one.
    let mut resampler = Resampler::new(&printer(), PARAMS);
    legs(&mut resampler, &[travel(0.0, 15.0), travel(-40.0, 0.0)]);
    let line = legs(&mut resampler, &[print(40.0, 0.0)]);
    assert!(line.iter().all(|leg| leg.to.s > 0.0));
}

#[test]
fn a_line_that_ends_just_past_the_axis_stays_straight() {
    for beyond in [0.011, 0.05, 0.3, 5.0] {
        for miss in [-0.004, 0.0, 0.003] {
            let mut resampler = Resampler::new(&printer(), PARAMS);
            legs(&mut resampler, &[travel(0.0, 15.0), travel(-20.0, miss)]);
            let start = resampler.joints();
            let line = legs(&mut resampler, &[print(beyond, miss)]);
            let worst = deviation(start, &line, [-20.0, miss], [beyond, miss]);
            // The detour round the axis, where there is one, is as wide as the clearance.
            assert!(worst <= 0.005 * 1.05 + printer().axis_clearance, "{worst} {beyond} {miss}");
        }
    }
}

#[test]
fn the_far_side_is_left_when_the_next_run_is_out_of_its_reach() {
    let mut resampler = Resampler::new(&printer(), PARAMS);
    legs(&mut resampler, &[travel(0.0, 15.0)]);
    let prime = Stroke { kind: Kind::Filament, ..travel(12.0, 1.0) };
    let strokes =
        [travel(-10.0, 0.0), print(10.0, 0.0), travel(12.0, 1.0), prime, print(60.0, 1.0)];
    let all = resampler.legs(&strokes).unwrap();
    assert!(all[1].iter().all(|leg| leg.to.s < 0.0));
    assert!(all[4].iter().all(|leg| leg.to.s > 0.0));
    for leg in all.iter().flatten() {
        assert!(leg.to.s >= -25.0);
    }
}

#[test]
fn a_travel_from_the_far_side_to_the_axis_ends_clear_of_it() {
    let mut resampler = Resampler::new(&printer(), PARAMS);
    legs(&mut resampler, &[travel(10.0, 0.0), travel(-20.0, 0.0)]);
    assert!(resampler.joints().s < 0.0, "it stands behind the axis");
    // The far side does not reach what follows.
    let path = [travel(0.0, 0.0), print(-30.0, 30.0)];
    let all = legs(&mut resampler, &path);
    assert!(all.iter().all(|leg| leg.to.s.abs() >= printer().axis_clearance - 1e-9));
    assert!(deviation(all[0].to, &all[1..], [0.0, 0.0], [-30.0, 30.0]) <= 0.03);
}

#[test]
fn ends_on_the_axis_are_kept_clear_of_it() {
    let mut resampler = Resampler::new(&printer(), PARAMS);
    let path = [travel(5.0, 5.0), print(0.0, 0.0), print(-4.0, 3.0)];
    for leg in legs(&mut resampler, &path) {
        assert!(leg.to.s.abs() >= printer().axis_clearance - 1e-9);
    }
}

#[test]
fn the_azimuth_turns_the_bed_and_nothing_else() {
    let strokes = [travel(12.0, 3.0), print(-9.0, 7.0), print(-9.0, -20.0)];
    let mut plain = Resampler::new(&printer(), PARAMS);
    // A whole number of the last place of an angle, so that rounding turns along.
    let azimuth = 45.8366_f64.to_radians();
    let mut turned = Resampler::new(&printer(), ResampleParams { azimuth, ..PARAMS });
    let (plain, turned) = (legs(&mut plain, &strokes), legs(&mut turned, &strokes));
    // The first stroke comes from home, which does not turn with the part.
    let first = plain.iter().position(|leg| leg.kind == Kind::Print).unwrap();
    let offset = turned.len() - plain.len();
    for (a, b) in plain[first..].iter().zip(&turned[first + offset..]) {
        assert!((a.to.s - b.to.s).abs() < 1e-9);
        let turn = b.to.turn.radians() - a.to.turn.radians() - azimuth;
        assert!(turn.abs() < 1e-9, "{turn}");
    }
}

#[test]
fn straight_dialects_get_one_leg_a_stroke() {
    let params = ResampleParams { dialect: CARTESIAN, ..PARAMS };
    let mut resampler = Resampler::new(&printer(), params);
    let all = resampler.legs(&[travel(-40.0, 1.0), print(40.0, 1.0)]).unwrap();
    assert_eq!((all[0].len(), all[1].len()), (1, 1));
    assert!((all[1][0].path - 80.0).abs() < 1e-9);
}

#[test]
fn nothing_is_sent_beyond_the_rail_by_rounding() {
    let mut marlin = printer();
    marlin.rail.min = 0.0;
    let params = ResampleParams { dialect: machine::gcode::dialect::KLIPPER_POLAR, ..PARAMS };
    let mut resampler = Resampler::new(&marlin, params);
    for k in 0..500 {
        let angle = f64::from(k) * 0.0123;
        let (x, y) = (120.0 * angle.cos(), 120.0 * angle.sin());
        for leg in legs(&mut resampler, &[travel(0.5 * x, 0.5 * y), print(x, y)]) {
            assert!(leg.to.s <= 120.0, "{k}: {}", leg.to.s);
        }
    }
}

#[test]
fn filament_drawn_back_on_a_way_too_short_is_drawn_back_after_it() {
    let mut resampler = Resampler::new(&printer(), PARAMS);
    let wipe = |x: f64| Stroke { filament: -0.5, ..travel(x, 5.0) };
    let rest = Stroke { kind: Kind::Filament, filament: -0.2, ..travel(0.0, 5.0) };
    let strokes = [travel(30.0, 5.0), print(40.0, 5.0), wipe(40.000_000_1), rest, print(50.0, 5.0)];
    let all = resampler.legs(&strokes).unwrap();
    assert!(all[2].is_empty());
    assert!((all[3][0].filament + 0.7).abs() < 1e-12);
    let fed: f64 = all[4].iter().map(|leg| leg.filament).sum();
    assert!((fed - strokes[4].filament).abs() < 1e-12);
}

#[test]
fn lines_have_hardly_more_moves_than_the_least_in_every_dialect_and_alignment() {
    use machine::gcode::dialect::{GRBLHAL_POLAR, RRF_DIRECT};
    let missed = Alignment { a: 0.2, b: 0.35, ..Alignment::IDEAL };
    for dialect in [POLAR, RRF_DIRECT] {
        for alignment in [Alignment::IDEAL, missed] {
            for offset in [0.6, 1.0, 3.0, 10.0, 30.0] {
                let real = Printer { alignment, ..printer() };
                let params = ResampleParams { dialect, ..PARAMS };
                let mut resampler = Resampler::new(&real, params);
                legs(&mut resampler, &[travel(-40.0, offset)]);
                let least = least_moves(&resampler, [-40.0, offset], [40.0, offset]);
                let count = legs(&mut resampler, &[print(40.0, offset)]).len();
                assert!(
                    count >= least && count <= 1 + least * 11 / 10,
                    "{offset}: {count} {least}"
                );
            }
        }
    }
    // Where the firmware runs straight itself the bed's even turn counts as well.
    let params = ResampleParams { dialect: GRBLHAL_POLAR, ..PARAMS };
    let mut resampler = Resampler::new(&printer(), params);
    legs(&mut resampler, &[travel(-40.0, 3.0)]);
    assert!(legs(&mut resampler, &[print(40.0, 3.0)]).len() < 90);
}

/// The number of moves when each is as long as the tolerance lets it be, searched by forward
/// kinematics alone.
fn least_moves(resampler: &Resampler, a: [f64; 2], b: [f64; 2]) -> usize {
    let alignment = resampler.alignment;
    let (a, b) = (Point2::from(a), Point2::from(b));
    let joints = |share: f64| {
        let p = a + (b - a) * share;
        let part = Point3::new(p.x, p.y, 0.2);
        alignment.joints_from_part(&part, Branch::Near, resampler.joints().turn).unwrap()
    };
    let is_near = |from: f64, to: f64| {
        let ends = [joints(from), joints(to)];
        (1..20).all(|k| {
            let between = POLAR.between(&ends[0], &ends[1], f64::from(k) / 20.0);
            let at = alignment.part_from_joints(&between).xy();
            geom::polyline::distance_to_segment(&a, &b, &at) <= 0.005
        })
    };
    let (mut done, mut count) = (0.0, 0);
    while done < 1.0 {
        let (mut good, mut bad) = (done, 1.0);
        if !is_near(done, 1.0) {
            for _ in 0..40 {
                let middle = f64::midpoint(good, bad);
                if is_near(done, middle) { good = middle } else { bad = middle }
            }
        } else {
            good = 1.0;
        }
        done = good;
        count += 1;
    }
    count
}
