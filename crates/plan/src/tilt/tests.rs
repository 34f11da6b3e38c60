use super::*;
use crate::resample::{ResampleParams, Resampler};
use crate::route::Stroke;
use crate::speed::{Limits, Pace, posed_durations};
use crate::testing::printer;
use machine::gcode::dialect::{CARTESIAN, Space};
use machine::head::hexapod::{Hexapod, JointLimits, Layout};
use machine::head::tilting::Tilting;
use slicer::surface::{Cone, LayerSurface, Plane, Spheres};

const TILT: Axis = Axis { min: -0.8, max: 0.8, speed: 2.0, acceleration: 30.0 };

const NORMAL: TiltParams = TiltParams { tilt: Tilt::Normal, clears: 0.4 };

const CHORDS: [f64; 2] = [0.005, 0.1];

fn with(head: Head) -> Printer {
    let lift = Axis { min: -20.0, ..printer().lift };
    Printer { head: Some(head), lift, ..printer() }
}

fn hexapod(turns_bed: bool) -> Head {
    let layout = Layout {
        base_radius: 200.0,
        platform_radius: 50.0,
        base_half_angle: 0.2,
        platform_half_angle: 0.0,
    };
    let home = Vector3::new(0.0, 0.0, -layout.height_at_45());
    let joints = JointLimits { cone: 1.2, home, apart: 5.0, condition: 20.0, tilt: 0.7 };
    let leg = Axis { min: 100.0, max: 450.0, speed: 150.0, acceleration: 2000.0 };
    let hexapod = Hexapod::new(layout.joints(), 50.0, leg, joints);
    let place = Vector3::new(if turns_bed { 40.0 } else { 0.0 }, 0.0, 270.0);
    Head::Hexapod(Box::new(Hexapod { turns_bed, place, ..hexapod }))
}

fn heads() -> [Printer; 4] {
    let two = Tilting::two_axes(45.0, TILT, TILT);
    let home = Joints { s: 60.0, z: 30.0, ..printer().home };
    [
        Head::Tilting(Tilting::one_axis(43.0, TILT)),
        Head::Tilting(two),
        hexapod(true),
        hexapod(false),
    ]
    .map(|head| Printer { home, ..with(head) })
}

/// A loop and a line on a sphere about a place below the bed, laid on one of the machines.
fn laid(printer: &Printer, form: Form) -> (Vec<Leg>, PosedLegs, Stance) {
    let stands = printer.head.as_ref().is_some_and(|head| !head.turns_bed());
    let dialect = if stands { CARTESIAN } else { POLAR };
    let [chord, travel_chord] = CHORDS;
    let params = ResampleParams { chord, travel_chord, dialect, azimuth: 0.0 };
    let mut resampler = Resampler::new(printer, params).on_near_side();
    let on_sphere =
        |x: f64, y: f64| Point3::new(x, y, (80.0_f64.powi(2) - x * x - y * y).sqrt() - 60.0);
    let stroke = |k: u32| {
        let angle = f64::from(k) * 0.05;
        let radius = 8.0 + f64::from(k) * 0.06;
        let to = on_sphere(radius * angle.cos(), radius * angle.sin());
        let kind = if k == 0 { Kind::Travel } else { Kind::Print };
        let filament = if k == 0 { 0.0 } else { 0.05 };
        Stroke { kind, to, filament, speed: 40.0, continues: false }
    };
    let strokes: Vec<Stroke> = (0..300).map(stroke).collect();
    let groups = resampler.legs(&strokes).unwrap();
    let legs = groups.iter().flatten().copied().collect();
    let mut tilter = Tilter::new(printer, NORMAL, POLAR, CHORDS).unwrap();
    let start = tilter.stance();
    tilter.follow(form);
    (legs, tilter.legs(groups).unwrap(), start)
}

fn spheres() -> Form {
    Spheres::new(-60.0).unwrap().form()
}

#[test]
fn tip_and_direction_keep_to_their_ways_on_every_machine() {
    for printer in heads() {
        let head = printer.head.as_ref().unwrap();
        let (plain, posed, start) = laid(&printer, spheres());
        let ends = |group: &[Leg]| group.last().map(|leg| leg.at);
        let last = posed.groups.iter().rev().find_map(|group| ends(group)).unwrap();
        assert!((last - plain.last().unwrap().at).norm() < 0.004);
        let legs: Vec<&Leg> = posed.groups.iter().flatten().collect();
        let fed = |legs: &mut dyn Iterator<Item = f64>| legs.sum::<f64>();
        let (before, after) = (
            fed(&mut plain.iter().map(|leg| leg.filament)),
            fed(&mut legs.iter().map(|leg| leg.filament)),
        );
        assert!((before - after).abs() < 1e-9);
        let (mut from, mut at) = (start, Point3::origin());
        let mut farthest: f64 = 0.0;
        for (leg, to) in legs.iter().zip(&posed.stances) {
            for share in [0.2, 0.5, 0.9] {
                let stance = Head::between(&from, to, share);
                let near = Pose::upright(leg.at);
                let pose = head.pose(&stance, &near, &printer.alignment).unwrap();
                if leg.kind == Kind::Print && share > 0.0 {
                    // On the sphere, and along its normal.
                    let out = pose.at - Point3::new(0.0, 0.0, -60.0);
                    farthest = farthest.max((out.norm() - 80.0).abs());
                    let angle = out.angle(&pose.axis);
                    assert!(angle < 0.02, "{}: {angle}", printer.name);
                }
            }
            (from, at) = (*to, leg.at);
        }
        assert!(at != Point3::origin() && farthest < 0.012, "{farthest}");
    }
}

#[test]
fn every_drive_keeps_its_speed_and_acceleration() {
    for printer in heads() {
        let (_, posed, start) = laid(&printer, spheres());
        let legs: Vec<Leg> = posed.groups.iter().flatten().copied().collect();
        let limits = Limits::of(&printer, Space::Joints);
        let (times, _) = posed_durations(&legs, (&start, &posed.stances), Pace::REST, &limits, &[]);
        let mut from = start;
        let mut before: Option<([f64; 6], f64)> = None;
        let mut fastest: f64 = 0.0;
        for (to, &time) in posed.stances.iter().zip(&times) {
            let speeds: [f64; 6] = std::array::from_fn(|k| (to.head[k] - from.head[k]) / time);
            for (k, own) in printer.head.as_ref().unwrap().axes().iter().enumerate() {
                assert!(speeds[k].abs() <= own.axis.speed);
                fastest = fastest.max(speeds[k].abs() / own.axis.speed);
                if let Some((last, last_time)) = before {
                    let most = own.axis.acceleration * f64::midpoint(last_time, time);
                    assert!((speeds[k] - last[k]).abs() <= most * 1.001, "{}", own.name);
                }
            }
            (from, before) = (*to, Some((speeds, time)));
        }
        assert!(fastest > 0.01);
    }
}

#[test]
fn as_little_as_needed_is_nothing_on_shallow_layers_and_the_rest_on_steep_ones() {
    let printer = with(Head::Tilting(Tilting::one_axis(43.0, TILT)));
    let field = |tilt| Field::of(&printer, TiltParams { tilt, clears: 0.4 }).unwrap();
    let p = Point3::new(12.0, 9.0, 30.0);
    for slope in [-0.9, -0.5, -0.3, 0.3, 0.5, 0.7] {
        let form = Cone::new(slope).unwrap().form();
        let lean = |tilt| field(tilt).lean(&form, &p);
        assert_eq!(lean(Tilt::None), 0.0);
        let needed = lean(Tilt::Needed);
        assert!((needed.abs() - (slope.abs() - 0.38).max(0.0)).abs() < 1e-12, "{slope}: {needed}");
        assert!(needed * slope >= 0.0);
        let normal = lean(Tilt::Normal);
        assert!((normal - slope.clamp(-0.8, 0.8)).abs() < 1e-12, "{slope}: {normal}");
    }
    assert_eq!(field(Tilt::Normal).lean(&Plane.form(), &p), 0.0);
    assert_eq!(Field::of(&crate::testing::printer(), NORMAL), None);
}

#[test]
fn the_block_stays_over_the_bed_and_the_carriage_on_its_rail() {
    let printer = with(Head::Tilting(Tilting::one_axis(43.0, TILT)));
    let field = Field::of(&printer, NORMAL).unwrap();
    let steep = Cone::new(0.79).unwrap().form();
    let NozzleShape { block_height, block_radius, .. } = printer.nozzle;
    for z in [0.0, 0.5, 2.0, 4.0, 9.0] {
        let lean = field.lean(&steep, &Point3::new(30.0, 0.0, z));
        let rim = z + block_height * lean.cos() - block_radius * lean.sin();
        assert!(rim > -1e-9 && (lean == 0.79 || rim < 1e-9), "{z}: {lean} {rim}");
    }
    // Near the end of the rail there is no room for the pivot.
    let at_end = field.lean(&steep, &Point3::new(110.0, 0.0, 40.0));
    assert!((110.0 + 43.0 * at_end.sin() - printer.rail.max).abs() < 1e-9);
    // A bowl so narrow that the block would meet its other side.
    let bowl = Cone::new(-0.6).unwrap().form();
    let lean = |r: f64| field.lean(&bowl, &Point3::new(r, 0.0, 60.0));
    assert!(lean(1.0) > lean(10.0) && lean(1.0) <= 0.0 && lean(14.0) == -0.6);
}

#[test]
fn a_new_direction_comes_before_the_bead_and_not_with_it() {
    let printer = with(Head::Tilting(Tilting::one_axis(43.0, TILT)));
    let mut tilter = Tilter::new(&printer, NORMAL, POLAR, CHORDS).unwrap();
    let params = ResampleParams { chord: 0.005, travel_chord: 0.1, dialect: POLAR, azimuth: 0.0 };
    let mut resampler = Resampler::new(&printer, params);
    let stroke = |kind, x: f64, z: f64| Stroke {
        kind,
        to: Point3::new(x, 0.0, z),
        filament: if kind == Kind::Print { 0.1 } else { 0.0 },
        speed: 30.0,
        continues: false,
    };
    let there = resampler.legs(&[stroke(Kind::Travel, 30.0, 40.0)]).unwrap();
    tilter.legs(there).unwrap();
    tilter.follow(Cone::new(0.6).unwrap().form());
    let bead = resampler.legs(&[stroke(Kind::Print, 31.0, 39.3)]).unwrap();
    let posed = tilter.legs(bead).unwrap();
    let [legs] = posed.groups.as_slice() else { panic!() };
    let first = legs.iter().position(|leg| leg.kind == Kind::Print).unwrap();
    assert!(first >= 10, "turned in steps before the bead");
    assert!((posed.stances[first - 1].head[0] - 0.6).abs() < 1e-5);
    for (k, leg) in legs[..first].iter().enumerate() {
        assert!((leg.at - Point3::new(30.0, 0.0, 40.0)).norm() < 0.002, "{k}");
        assert!(posed.swings[k] > 0.5 && leg.filament == 0.0);
    }
}
