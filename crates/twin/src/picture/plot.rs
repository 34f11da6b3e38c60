//! Plots of a program: what the machine does over time, and layers against flat faces.

use machine::gcode::decimal;
use machine::profile::Printer;

use super::palette::{AXIS, Colour, INK, of_height};
use super::svg::{Canvas, PathData, Pen};
use crate::check::volume::LayerVolume;
use crate::segment::Segment;

/// Width of a plot's area and room to the left of it, to the right and between plots, pixels.
const WIDTH: f64 = 1000.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 24.0;
const GAP: f64 = 54.0;

/// Height of one plot, pixels.
const HEIGHT: f64 = 190.0;

/// Columns over which a program is gathered.
const COLUMNS: usize = 1000;

/// What is plotted over time.
const QUANTITIES: [&str; 3] = ["bed speed, °/s", "carriage speed, mm/s", "flow, mm³/s"];

/// Collects what the machine does, 16 bytes a move.
#[derive(Debug, Clone)]
pub struct MotionSink {
    filament_area: f64,
    limits: [f64; 2],
    /// Duration and the quantities of each move.
    moves: Vec<[f32; 4]>,
    has_joints: bool,
}

impl MotionSink {
    /// Returns an empty sink; the filament's cross-section in mm².
    #[must_use]
    pub fn new(printer: &Printer, filament_area: f64) -> Self {
        let limits = [printer.bed.speed.to_degrees(), printer.rail.speed];
        Self { filament_area, limits, moves: Vec::new(), has_joints: true }
    }

    /// Takes note of a segment.
    pub fn add(&mut self, segment: &Segment) {
        let took = segment.duration;
        if !(took.is_finite() && took > 0.0) {
            return;
        }
        self.has_joints &= segment.joints.is_some();
        let laid = if segment.extrudes() { segment.filament * self.filament_area } else { 0.0 };
        let speeds = [segment.bed_change().abs().to_degrees(), segment.rail_change().abs(), laid];
        let [bed, rail, flow] = speeds.map(|amount| (amount / took) as f32);
        self.moves.push([took as f32, bed, rail, flow]);
    }
}

/// Mean and greatest value of a quantity in each column of time.
struct Gathered {
    mean: Vec<f64>,
    most: Vec<f64>,
}

impl Gathered {
    fn of(moves: &[[f32; 4]], quantity: usize, total: f64) -> Self {
        let mut sums = vec![0.0; COLUMNS];
        let mut most = vec![0.0_f64; COLUMNS];
        let width = total / COLUMNS as f64;
        let mut began = 0.0;
        for step in moves {
            let (took, value) = (f64::from(step[0]), f64::from(step[1 + quantity]));
            let value = if value.is_finite() { value } else { 0.0 };
            let ended = began + took;
            let column = |time: f64| ((time / width) as usize).min(COLUMNS - 1);
            for k in column(began)..=column(ended) {
                let (from, to) = (k as f64 * width, (k + 1) as f64 * width);
                sums[k] += value * (ended.min(to) - began.max(from)).max(0.0);
                most[k] = most[k].max(value);
            }
            began = ended;
        }
        Self { mean: sums.into_iter().map(|sum| sum / width).collect(), most }
    }
}

/// Returns the plots of bed speed, carriage speed and flow over time: the greatest value of each
/// moment light, the mean dark, the machine's limit dashed.
#[must_use]
pub fn motion_svg(sink: &MotionSink) -> String {
    let total: f64 = sink.moves.iter().map(|step| f64::from(step[0])).sum();
    let mut canvas = Canvas::new(LEFT + WIDTH + RIGHT, 3.0 * (HEIGHT + GAP) + 30.0);
    for (quantity, title) in QUANTITIES.iter().enumerate() {
        let top = 34.0 + quantity as f64 * (HEIGHT + GAP);
        let limit = sink.limits.get(quantity).copied();
        if quantity < 2 && !sink.has_joints {
            let told = format!("{title}: the firmware turns these words into joints itself");
            canvas.label(LEFT, top - 10.0, 14.0, &told);
            continue;
        }
        if !(total.is_finite() && total > 0.0) {
            canvas.label(LEFT, top - 10.0, 14.0, title);
            continue;
        }
        let gathered = Gathered::of(&sink.moves, quantity, total);
        let greatest = gathered.most.iter().copied().fold(0.0, f64::max);
        let scale = Scale::up_to(greatest.max(limit.unwrap_or(0.0)));
        let words = match limit {
            Some(limit) => format!(
                "{title}: at most {}, the machine's limit is {}",
                decimal(greatest, 1),
                decimal(limit, 1)
            ),
            None => format!("{title}: at most {}", decimal(greatest, 2)),
        };
        canvas.label(LEFT, top - 10.0, 14.0, &words);
        scale.grid(&mut canvas, top);
        times(&mut canvas, top, total);
        let colour = of_height(0.25 + 0.22 * quantity as f64);
        curve(&mut canvas, &gathered.most, &scale, top, &Pen::new(colour, 1.0).faint(0.55));
        curve(&mut canvas, &gathered.mean, &scale, top, &Pen::new(colour.lit(0.8), 1.6));
        if let Some(limit) = limit {
            let y = scale.y(limit, top);
            canvas.line([LEFT, y], [LEFT + WIDTH, y], &Pen::new(AXIS, 1.2).dashed(8.0, 5.0));
        }
    }
    canvas.finish()
}

/// Values from 0 to a round number, upwards.
struct Scale {
    end: f64,
    step: f64,
}

impl Scale {
    fn up_to(greatest: f64) -> Self {
        let greatest = if greatest.is_finite() && greatest > 0.0 { greatest } else { 1.0 };
        let step = round_step(greatest / 4.0);
        Self { end: (greatest / step).ceil() * step, step }
    }

    fn y(&self, value: f64, top: f64) -> f64 {
        top + HEIGHT * (1.0 - value / self.end)
    }

    fn grid(&self, canvas: &mut Canvas, top: f64) {
        let count = (self.end / self.step).round() as usize;
        for k in 0..=count {
            let value = self.step * k as f64;
            let y = self.y(value, top);
            canvas.line([LEFT, y], [LEFT + WIDTH, y], &Pen::new(INK, 1.0).faint(0.3));
            canvas.label(16.0, y + 4.0, 12.0, &decimal(value, 2));
        }
    }
}

/// The least of 1, 2 and 5 times a power of ten that is not below.
fn round_step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|k| k * power)
        .find(|step| *step >= least)
        .unwrap_or(power * 10.0)
}

/// Marks of time below a plot: seconds, minutes or hours.
fn times(canvas: &mut Canvas, top: f64, total: f64) {
    let (unit, name) = match total {
        t if t > 5400.0 => (3600.0, "h"),
        t if t > 120.0 => (60.0, "min"),
        _ => (1.0, "s"),
    };
    let step = round_step(total / unit / 10.0);
    let count = (total / unit / step).floor() as usize;
    for k in 0..=count {
        let value = step * k as f64;
        let x = LEFT + WIDTH * (value * unit / total);
        canvas.line([x, top + HEIGHT], [x, top + HEIGHT + 5.0], &Pen::new(INK, 1.0));
        canvas.label(x - 6.0, top + HEIGHT + 18.0, 12.0, &format!("{} {name}", decimal(value, 2)));
    }
}

fn curve(canvas: &mut Canvas, values: &[f64], scale: &Scale, top: f64, pen: &Pen) {
    let mut data = PathData::with_decimals(1);
    for (k, value) in values.iter().enumerate() {
        let x = LEFT + WIDTH * (k as f64 + 0.5) / values.len() as f64;
        let y = scale.y(*value, top);
        if k == 0 { data.move_to(x, y) } else { data.line_to(x, y) }
    }
    canvas.path(&data, pen);
}

/// A horizontal face of the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Its height, mm.
    pub z: f64,
    /// Its area, mm².
    pub area: f64,
}

/// A face that the top of a layer misses by more than this is missed, mm: half a step of usual
/// lifts.
const MET: f64 = 0.005_1;

const GOOD: Colour = Colour([0x3f, 0xb6, 0x8b]);

/// Returns the plot of layer heights over height, with the flat faces of the part: green where the
/// top of a layer meets them.
#[must_use]
pub fn schedule_svg(layers: &[LayerVolume], flats: &[Flat]) -> String {
    let tops: Vec<f64> = layers.iter().filter_map(|layer| layer.top).collect();
    let mut canvas = Canvas::new(LEFT + WIDTH + RIGHT, 2.0 * HEIGHT + 120.0);
    let top = 54.0;
    let high = tops.iter().copied().chain(flats.iter().map(|flat| flat.z)).fold(0.0, f64::max);
    let thickest = layers.iter().filter_map(|layer| layer.height).fold(0.0, f64::max);
    let (height, scale) = (2.0 * HEIGHT, Scale::up_to(thickest));
    let high = if high.is_finite() && high > 0.0 { high } else { 1.0 };
    let x = |z: f64| LEFT + WIDTH * z / high;
    let y = |h: f64| top + height * (1.0 - h / scale.end);
    for k in 0..=(scale.end / scale.step).round() as usize {
        let h = scale.step * k as f64;
        canvas.line([LEFT, y(h)], [LEFT + WIDTH, y(h)], &Pen::new(INK, 1.0).faint(0.3));
        canvas.label(16.0, y(h) + 4.0, 12.0, &decimal(h, 3));
    }
    let mut data = PathData::with_decimals(2);
    for (end, thickness) in layers.iter().filter_map(|layer| layer.top.zip(layer.height)) {
        data.move_to(x((end - thickness).max(0.0)), y(0.0));
        for (z, h) in [(end - thickness, thickness), (end, thickness), (end, 0.0)] {
            data.line_to(x(z.max(0.0)), y(h));
        }
    }
    canvas.path(&data, &Pen::new(of_height(0.3), 1.2));
    let mut missed = 0;
    for flat in flats {
        let off = tops.iter().map(|z| (z - flat.z).abs()).fold(flat.z.abs(), f64::min);
        let is_met = off <= MET;
        missed += usize::from(!is_met);
        let pen = Pen::new(if is_met { GOOD } else { AXIS }, 2.0).dashed(6.0, 3.0);
        canvas.line([x(flat.z), top - 12.0], [x(flat.z), top + height], &pen);
        if !is_met {
            canvas.label(x(flat.z) + 4.0, top - 4.0, 12.0, &format!("{} mm off", decimal(off, 3)));
        }
    }
    let step = round_step(high / 10.0);
    for k in 0..=(high / step).floor() as usize {
        let z = step * k as f64;
        canvas.label(x(z) - 6.0, top + height + 18.0, 12.0, &decimal(z, 2));
    }
    let words = if flats.is_empty() {
        format!("layer height over height, mm: {} layers", layers.len())
    } else {
        format!(
            "layer height over height, mm: {} layers, {} of {} flat faces met",
            layers.len(),
            flats.len() - missed,
            flats.len()
        )
    };
    canvas.label(LEFT, 22.0, 14.0, &words);
    canvas.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, printer, segment};

    #[test]
    fn means_and_peaks_of_two_speeds() {
        let mut moves = vec![[30.0, 10.0, 0.0, 0.0]; 1];
        moves.push([10.0, 50.0, 0.0, 0.0]);
        let gathered = Gathered::of(&moves, 0, 40.0);
        let mean = gathered.mean.iter().sum::<f64>() / COLUMNS as f64;
        assert!((mean - 20.0).abs() < 1e-9, "{mean}");
        assert_eq!((gathered.most[10], gathered.most[990]), (10.0, 50.0));
    }

    #[test]
    fn the_plots_name_extremes_and_limits() {
        let mut sink = MotionSink::new(&printer(), 2.405);
        // 0.5 rad in half a second.
        let mut line = segment(joints(20.0, 0.0, 0.2), joints(20.0, 0.5, 0.2), 20.0);
        line.filament = 0.1;
        sink.add(&line);
        let svg = motion_svg(&sink);
        assert!(
            svg.contains("bed speed, °/s: at most 57.3, the machine's limit is 343.8"),
            "{svg}"
        );
        assert!(svg.contains("flow, mm³/s: at most 0.48"));
        for sink in [MotionSink::new(&printer(), 2.405), sink] {
            let svg = motion_svg(&sink);
            assert!(!svg.contains("NaN") && svg.ends_with("</svg>\n"));
        }
    }

    #[test]
    fn flats_between_layers_are_told() {
        let layer = |k: usize| LayerVolume {
            index: k,
            line: 1,
            top: Some(0.2 * (k + 1) as f64),
            height: Some(0.2),
            part: 1.0,
            other: 0.0,
            area: None,
            outline: 0.0,
            corners: 0.0,
            is_plane: true,
        };
        let layers: Vec<_> = (0..10).map(layer).collect();
        let flats =
            [Flat { z: 1.0, area: 9.0 }, Flat { z: 1.3, area: 9.0 }, Flat { z: 0.0, area: 9.0 }];
        let svg = schedule_svg(&layers, &flats);
        assert!(svg.contains("10 layers, 2 of 3 flat faces met"), "{svg}");
        assert!(svg.contains("0.1 mm off"));
        assert!(!schedule_svg(&[], &[]).contains("NaN"));
    }
}
