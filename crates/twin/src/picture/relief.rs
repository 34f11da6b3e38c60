//! Height map and section of what was laid, as PNG.
//!
//! A [height map](height_png) is the print seen from straight above: of every place the highest material,
//! coloured by its height and lit from the upper left, so that beads and seams show. A
//! [section](section_png) is the print cut upright through the rotation axis: every bead that the plane
//! meets as the plane meets it, with a dark rim, so that voids between beads and beads that hang show.
//! Beads are bodies with round sides, as wide as announced and as thick as their filament makes them;
//! their tops are those of the replayed path. What nothing covers is left transparent. mm, part frame.

use std::io;

use nalgebra::{Point2, Point3, Vector2};

use super::deposit::{Bead, DepositSink, LARGEST, double};
use super::palette::{Colour, of_height, of_role};
use super::print::Shade;

/// Room around the print, as a share of the picture.
const MARGIN: f64 = 0.03;

/// Width of the dark rim of a bead that is cut, as a share of its thickness.
const RIM: f64 = 0.12;

/// How dark a rim is.
const RIM_LIGHT: f64 = 0.45;

/// Slope that the light of a height map tells from level: 1 is 45°.
const RELIEF: f64 = 0.35;

/// A picture, and what its colours and pixels stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    /// The PNG file.
    pub png: Vec<u8>,
    /// The least and the greatest height that is shown, mm; none where nothing is.
    pub heights: Option<[f64; 2]>,
    /// The side of a pixel, mm.
    pub pixel: f64,
}

/// A picture in the making: of every pixel a number and a colour.
struct Sheet {
    width: usize,
    height: usize,
    /// Where the middle of the lower left pixel lies.
    origin: [f64; 2],
    pixel: f64,
    paint: Vec<Option<(f64, Colour)>>,
}

impl Sheet {
    /// A sheet that shows `low` to `high`, right and up.
    fn around(low: [f64; 2], high: [f64; 2], size: [usize; 2]) -> Self {
        let [width, height] = size.map(|side| side.clamp(1, LARGEST));
        let span = [0, 1].map(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let room = 1.0 - 2.0 * MARGIN;
        let pixel = (span[0] / (width as f64 * room)).max(span[1] / (height as f64 * room));
        let origin = [(low[0] + high[0], width), (low[1] + high[1], height)]
            .map(|(twice, side)| twice / 2.0 - pixel * (side as f64 - 1.0) / 2.0);
        Self { width, height, origin, pixel, paint: vec![None; width * height] }
    }

    /// The columns (0) or rows (1, from below) whose middles lie within a range.
    fn within(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let side = if axis == 0 { self.width } else { self.height };
        let index = |c: f64| ((c - self.origin[axis]) / self.pixel).clamp(0.0, side as f64);
        index(low).ceil() as usize..((index(high).floor() + 1.0) as usize).min(side)
    }

    fn middle(&self, column: usize, row: usize) -> [f64; 2] {
        [self.origin[0] + column as f64 * self.pixel, self.origin[1] + row as f64 * self.pixel]
    }

    fn heights(&self) -> Option<[f64; 2]> {
        self.paint.iter().flatten().fold(None, |range, (z, _)| {
            let [low, high] = range.unwrap_or([*z, *z]);
            Some([low.min(*z), high.max(*z)])
        })
    }

    fn finish(self, heights: Option<[f64; 2]>) -> io::Result<Relief> {
        let mut pixels = Vec::with_capacity(4 * self.paint.len());
        for row in self.paint.chunks(self.width).rev() {
            for paint in row {
                match paint {
                    Some((_, Colour([r, g, b]))) => pixels.extend([*r, *g, *b, 255]),
                    None => pixels.extend([0; 4]),
                }
            }
        }
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&pixels).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(Relief { png, heights, pixel: self.pixel })
    }
}

/// A bead as a body.
struct Body {
    from: Point3<f64>,
    to: Point3<f64>,
    half_width: f64,
    half_thickness: f64,
}

impl Body {
    fn of(bead: &Bead) -> Self {
        let width = f64::from(bead.width);
        Self {
            from: double(bead.from),
            to: double(bead.to),
            half_width: width / 2.0,
            half_thickness: f64::from(bead.thickness).min(width) / 2.0,
        }
    }

    /// The distance of a place from the bead's line, seen from above, and the bead's top there.
    fn over(&self, at: &Point2<f64>) -> (f64, f64) {
        let along = self.to.xy() - self.from.xy();
        let square = along.norm_squared();
        let from = at - self.from.xy();
        let share = if square > 0.0 { (from.dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
        let top = self.from.z + (self.to.z - self.from.z) * share;
        ((from - along * share).norm(), top)
    }

    /// How far from the middle of its thickness the bead reaches at a distance from its line, mm; none
    /// beyond its width.
    fn reach(&self, distance: f64) -> Option<f64> {
        let beyond = distance - (self.half_width - self.half_thickness);
        let square = self.half_thickness * self.half_thickness - beyond.max(0.0) * beyond.max(0.0);
        (square >= 0.0).then(|| square.sqrt())
    }

    /// Its least and greatest coordinate along x (0) or y (1).
    fn range(&self, axis: usize) -> [f64; 2] {
        let (a, b) = (self.from[axis], self.to[axis]);
        [a.min(b) - self.half_width, a.max(b) + self.half_width]
    }
}

/// Returns the print from straight above, x to the right and y upwards.
///
/// # Errors
///
/// None that a picture in memory can have.
pub fn height_png(sink: &DepositSink, size: [usize; 2]) -> io::Result<Relief> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for body in sink.beads().iter().map(Body::of) {
        for k in 0..2 {
            let [least, most] = body.range(k);
            (low[k], high[k]) = (low[k].min(least), high[k].max(most));
        }
    }
    if sink.beads().is_empty() {
        (low, high) = ([-1.0; 2], [1.0; 2]);
    }
    let mut sheet = Sheet::around(low, high, size);
    let none = Colour([0; 3]);
    for body in sink.beads().iter().map(Body::of) {
        let [[left, right], [below, above]] = [0, 1].map(|k| body.range(k));
        for row in sheet.within(1, below, above) {
            for column in sheet.within(0, left, right) {
                let (distance, top) = body.over(&Point2::from(sheet.middle(column, row)));
                let Some(reach) = body.reach(distance) else { continue };
                let z = top - body.half_thickness + reach;
                let paint = &mut sheet.paint[row * sheet.width + column];
                if paint.is_none_or(|(highest, _)| z > highest) {
                    *paint = Some((z, none));
                }
            }
        }
    }
    let heights = sheet.heights();
    if let Some([low, high]) = heights {
        shade(&mut sheet, low, high);
    }
    sheet.finish(heights)
}

/// Gives every place the colour of its height, in the light of its slope.
fn shade(sheet: &mut Sheet, low: f64, high: f64) {
    let span = (high - low).max(f64::MIN_POSITIVE);
    let heights: Vec<Option<f64>> = sheet.paint.iter().map(|paint| paint.map(|(z, _)| z)).collect();
    for (k, paint) in sheet.paint.iter_mut().enumerate() {
        let Some((z, colour)) = paint else { continue };
        let before = |step: usize| k.checked_sub(step).and_then(|k| heights[k]).unwrap_or(*z);
        // To the left and upwards, where the light is.
        let left = if k % sheet.width == 0 { *z } else { before(1) };
        let up = heights.get(k + sheet.width).copied().flatten().unwrap_or(*z);
        let slope = (2.0 * *z - left - up) / (2.0 * sheet.pixel);
        let light = 1.0 + RELIEF * (slope / (1.0 + slope.abs()));
        *colour = of_height((*z - low) / span).lit(light);
    }
}

/// Returns the upright plane through the axis at this azimuth (radians): what lies in its direction to
/// the right, up upwards.
///
/// # Errors
///
/// None that a picture in memory can have.
pub fn section_png(
    sink: &DepositSink,
    azimuth: f64,
    shade: Shade,
    size: [usize; 2],
) -> io::Result<Relief> {
    let axis = sink.axis();
    let (sin, cos) = azimuth.sin_cos();
    let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
    let cut: Vec<(Body, &Bead, [f64; 2])> = sink
        .beads()
        .iter()
        .filter_map(|bead| {
            let body = Body::of(bead);
            let range = met(&body, &axis, &along, &across)?;
            Some((body, bead, range))
        })
        .collect();
    let (mut low, mut high) = ([f64::INFINITY, 0.0], [f64::NEG_INFINITY, 0.0_f64]);
    for (body, _, [left, right]) in &cut {
        (low[0], high[0]) = (low[0].min(*left), high[0].max(*right));
        high[1] = high[1].max(body.from.z.max(body.to.z));
    }
    if cut.is_empty() {
        (low, high) = ([-1.0; 2], [1.0; 2]);
    }
    let mut sheet = Sheet::around(low, high, size);
    for (body, bead, [left, right]) in &cut {
        let (least, most) = (body.from.z.min(body.to.z), body.from.z.max(body.to.z));
        let colour = match shade {
            Shade::Height => of_height(most / high[1].max(f64::MIN_POSITIVE)),
            Shade::Role => of_role(bead.role),
        };
        for column in sheet.within(0, *left, *right) {
            for row in sheet.within(1, least - 2.0 * body.half_thickness, most) {
                let [s, z] = sheet.middle(column, row);
                let (distance, top) = body.over(&(axis + along * s));
                let Some(reach) = body.reach(distance) else { continue };
                let inside = reach - (z - (top - body.half_thickness)).abs();
                if inside >= 0.0 {
                    let is_rim = inside < 2.0 * RIM * body.half_thickness;
                    let light = if is_rim { RIM_LIGHT } else { 1.0 };
                    sheet.paint[row * sheet.width + column] = Some((z, colour.lit(light)));
                }
            }
        }
    }
    let heights = sheet.heights();
    sheet.finish(heights)
}

/// Where along the plane a bead may meet it; none when it stays on one side.
fn met(
    body: &Body,
    axis: &Point2<f64>,
    along: &Vector2<f64>,
    across: &Vector2<f64>,
) -> Option<[f64; 2]> {
    let ends = [body.from.xy() - axis, body.to.xy() - axis];
    let [a, b] = ends.map(|end| across.dot(&end));
    let [s, t] = ends.map(|end| along.dot(&end));
    let room = body.half_width;
    if (a > room && b > room) || (a < -room && b < -room) {
        return None;
    }
    // The part of the bead that is nearer to the plane than half its width.
    let share = |side: f64| if a == b { 0.0 } else { ((side - a) / (b - a)).clamp(0.0, 1.0) };
    let shares = if a == b { [0.0, 1.0] } else { [share(-room), share(room)] };
    let [s, t] = shares.map(|share| s + (t - s) * share);
    Some([s.min(t) - room, s.max(t) + room])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, printer, segment};

    /// Rings of 20 mm radius with beads of 0.45 by 0.2 mm, one on the other.
    fn rings(layers: u32) -> DepositSink {
        let mut sink = DepositSink::new(&printer(), 2.405);
        for layer in 0..layers {
            for k in 0..24 {
                let turn = |k: u32| f64::from(k) * std::f64::consts::TAU / 24.0;
                let z = 0.2 * f64::from(layer + 1);
                let mut line =
                    segment(joints(20.0, turn(k), z), joints(20.0, turn(k + 1), z), 20.0);
                line.filament =
                    line.path * 0.2 * (0.45 - 0.2 * (1.0 - std::f64::consts::FRAC_PI_4)) / 2.405;
                sink.add(&line);
            }
        }
        sink
    }

    /// Pixels that show something.
    fn covered(relief: &Relief) -> f64 {
        let mut reader = png::Decoder::new(io::Cursor::new(&relief.png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let count = pixels.chunks_exact(4).filter(|pixel| pixel[3] > 0).count();
        count as f64 * relief.pixel * relief.pixel
    }

    #[test]
    fn a_ring_from_above_has_its_area_and_its_height() {
        let relief = height_png(&rings(5), [900, 900]).unwrap();
        let area = std::f64::consts::TAU * 20.0 * 0.45;
        assert!((covered(&relief) / area - 1.0).abs() < 0.03, "{} {area}", covered(&relief));
        let [low, high] = relief.heights.unwrap();
        // The round sides begin half a bead below the top.
        assert!((high - 1.0).abs() < 1e-3 && low > 0.89 && low < 1.0, "{low} {high}");
    }

    #[test]
    fn a_cut_ring_is_two_stacks_of_beads() {
        for azimuth in [0.0, 0.7, 2.0] {
            let relief = section_png(&rings(5), azimuth, Shade::Role, [3000, 200]).unwrap();
            let area = 2.0 * 5.0 * 0.2 * (0.45 - 0.2 * (1.0 - std::f64::consts::FRAC_PI_4));
            assert!((covered(&relief) / area - 1.0).abs() < 0.06, "{} {area}", covered(&relief));
        }
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        let sink = DepositSink::new(&printer(), 2.405);
        for relief in [
            height_png(&sink, [20, 10]).unwrap(),
            section_png(&sink, 0.0, Shade::Height, [20, 10]).unwrap(),
        ] {
            assert_eq!((relief.heights, covered(&relief)), (None, 0.0));
        }
    }
}
