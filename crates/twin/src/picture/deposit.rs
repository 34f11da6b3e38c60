//! The print as it would stand there: every bead a body with light on it, in any view, as PNG.

use std::io;

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::Role;
use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::camera::{Camera, Gaze};
use super::palette::{Colour, INK, of_height, of_role};
use super::print::Shade;
use super::raster::{Corner, Raster};
use crate::segment::Segment;

/// How far drawn lines may lie from replayed ones, mm.
const TOLERANCE: f64 = 0.03;

/// Samples of a pixel's side.
const FINE: usize = 2;

/// Room around the print, as a share of the picture.
const MARGIN: f64 = 0.03;

/// Largest side of a picture, pixels: four such samples a pixel are a gigabyte.
pub const LARGEST: usize = 4096;

/// How far beads reach beyond their ends, as a share of their width: corners have no gaps.
const BEYOND: f64 = 0.3;

/// A bead that says no width is drawn as wide as a usual nozzle, mm.
const USUAL_WIDTH: f64 = 0.4;

/// Collects the beads of a print; about 40 bytes each.
#[derive(Debug, Clone)]
pub struct DepositSink {
    alignment: Alignment,
    filament_area: f64,
    beads: Vec<Bead>,
}

/// A straight piece of material. mm; single precision is ample for pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bead {
    /// The nozzle's way, on the bead's top.
    pub(super) from: [f32; 3],
    pub(super) to: [f32; 3],
    pub(super) width: f32,
    pub(super) thickness: f32,
    pub(super) role: Role,
}

impl DepositSink {
    /// Returns a sink; the filament's cross-section (mm²) says how thick beads are.
    #[must_use]
    pub fn new(printer: &Printer, filament_area: f64) -> Self {
        Self { alignment: printer.alignment, filament_area, beads: Vec::new() }
    }

    /// The beads, in the order in which they were laid.
    pub(super) fn beads(&self) -> &[Bead] {
        &self.beads
    }

    /// Where the rotation axis passes through the part.
    pub(super) fn axis(&self) -> Point2<f64> {
        self.alignment.part_from_bed(&Vector2::zeros())
    }

    /// Takes note of a segment.
    pub fn add(&mut self, segment: &Segment) {
        let is_finite = segment.part.iter().all(|p| p.coords.iter().all(|c| c.is_finite()));
        if !segment.extrudes() || !is_finite {
            return;
        }
        let width = if segment.width > 0.0 { segment.width } else { USUAL_WIDTH };
        let section = segment.filament * self.filament_area / segment.path;
        let thickness = thickness(section, width);
        let single = |p: &Point3<f64>| [p.x as f32, p.y as f32, p.z as f32];
        let mut from = single(&segment.part[0]);
        for place in segment.pieces(&self.alignment, TOLERANCE) {
            let to = single(&place);
            let (width, thickness) = (width as f32, thickness as f32);
            self.beads.push(Bead { from, to, width, thickness, role: segment.role });
            from = to;
        }
    }
}

/// The thickness of a bead, a rounded rectangle, out of its cross-section and width.
fn thickness(section: f64, width: f64) -> f64 {
    let corner = 1.0 - std::f64::consts::FRAC_PI_4;
    let square = width * width - 4.0 * corner * section;
    // Rounder than round: as thick as wide.
    if square > 0.0 { (width - square.sqrt()) / (2.0 * corner) } else { width }
}

/// What a picture is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// Pixels to the right.
    pub width: usize,
    /// Pixels downwards.
    pub height: usize,
    /// From where the print is seen.
    pub gaze: Gaze,
    /// What the colours mean.
    pub shade: Shade,
}

/// Returns the picture of a print as a PNG file, on nothing.
///
/// # Errors
///
/// None that a picture in memory can have.
pub fn deposit_png(sink: &DepositSink, picture: &Picture) -> io::Result<Vec<u8>> {
    let size = [picture.width, picture.height].map(|side| side.clamp(1, LARGEST));
    let camera = Camera::new(&picture.gaze);
    let axis = sink.axis();
    let view = View::around(&sink.beads, &axis, &camera, size);
    let mut raster = Raster::new(size[0] * FINE, size[1] * FINE);
    bed(&mut raster, &view, &axis);
    for bead in &sink.beads {
        let colour = match picture.shade {
            Shade::Height => of_height(view.share_of_height(f64::from(bead.to[2]))),
            Shade::Role => of_role(bead.role),
        };
        body(&mut raster, &view, bead, colour);
    }
    png(&raster, size)
}

/// How places of the part become samples.
struct View<'a> {
    camera: &'a Camera,
    scale: f64,
    middle: [f64; 2],
    half: [f64; 2],
    heights: [f64; 2],
    /// How far from the axis the bed is drawn, mm.
    bed: f64,
}

pub(super) fn double(p: [f32; 3]) -> Point3<f64> {
    Point3::from(p.map(f64::from))
}

impl<'a> View<'a> {
    fn around(beads: &[Bead], axis: &Point2<f64>, camera: &'a Camera, size: [usize; 2]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut heights = [f64::INFINITY, f64::NEG_INFINITY];
        let mut radius: f64 = 0.0;
        let mut add = |p: &Point3<f64>| {
            let seen = camera.seen(p);
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(seen[k]), high[k].max(seen[k]));
            }
        };
        for bead in beads {
            for end in [bead.from, bead.to].map(double) {
                add(&end);
                heights = [heights[0].min(end.z), heights[1].max(end.z)];
                radius = radius.max((end.xy() - axis).norm());
            }
        }
        let bed = (radius * 1.12 / 10.0).ceil().max(1.0) * 10.0;
        for k in 0..RING {
            add(&on_ring(axis, bed, k));
        }
        let room =
            |k: usize| size[k] as f64 * FINE as f64 * (1.0 - 2.0 * MARGIN) / (high[k] - low[k]);
        let scale = room(0).min(room(1));
        Self {
            camera,
            scale,
            middle: [0, 1].map(|k| f64::midpoint(low[k], high[k])),
            half: size.map(|side| (side * FINE) as f64 / 2.0),
            heights,
            bed,
        }
    }

    fn corner(&self, p: &Point3<f64>) -> Corner {
        let [x, y, near] = self.camera.seen(p);
        Corner::new(
            self.half[0] + (x - self.middle[0]) * self.scale,
            self.half[1] - (y - self.middle[1]) * self.scale,
            near,
        )
    }

    fn share_of_height(&self, z: f64) -> f64 {
        let span = self.heights[1] - self.heights[0];
        if span > 0.0 { (z - self.heights[0]) / span } else { 0.5 }
    }
}

/// Pieces of a ring of the bed.
const RING: usize = 128;

fn on_ring(axis: &Point2<f64>, radius: f64, k: usize) -> Point3<f64> {
    let (sin, cos) = (std::f64::consts::TAU * k as f64 / RING as f64).sin_cos();
    Point3::new(axis.x + radius * cos, axis.y + radius * sin, 0.0)
}

/// The turning bed: rings 10 mm apart about its axis, a line of one or two pixels each.
fn bed(raster: &mut Raster, view: &View<'_>, axis: &Point2<f64>) {
    let mut radius = 10.0;
    while radius <= view.bed {
        let is_rim = radius + 10.0 > view.bed;
        let half = if is_rim { 1.6 } else { 0.8 } / view.scale;
        for k in 0..RING {
            let [a, b] = [radius - half, radius + half]
                .map(|r| [k, k + 1].map(|k| view.corner(&on_ring(axis, r, k))));
            let paint = packed(INK.lit(if is_rim { 1.0 } else { 1.35 }));
            raster.triangle([a[0], a[1], b[1]], || paint);
            raster.triangle([a[0], b[1], b[0]], || paint);
        }
        radius += 10.0;
    }
}

/// A prism of six sides about the bead: flat above and below, with a ridge on either side.
fn body(raster: &mut Raster, view: &View<'_>, bead: &Bead, colour: Colour) {
    let (from, to) = (double(bead.from), double(bead.to));
    let Some(along) = (to - from).try_normalize(f64::MIN_POSITIVE) else { return };
    let side = Vector3::new(along.y, -along.x, 0.0);
    let Some(side) = side.try_normalize(1e-6) else { return };
    let down = side.cross(&along);
    let down = if down.z > 0.0 { -down } else { down };
    let (half, thickness) = (f64::from(bead.width) / 2.0, f64::from(bead.thickness));
    let flat = (half - thickness / 2.0).max(0.25 * half);
    let outline = [[flat, 0.0], [half, 0.5], [flat, 1.0], [-flat, 1.0], [-half, 0.5], [-flat, 0.0]]
        .map(|[across, depth]| side * across + down * (depth * thickness));
    let beyond = along * (f64::from(bead.width) * BEYOND);
    let middle = down * (0.5 * thickness);
    for k in 0..outline.len() {
        let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
        let normal = along.cross(&(b - a));
        let normal = if normal.dot(&((a + b) / 2.0 - middle)) < 0.0 { -normal } else { normal };
        if normal.dot(&view.camera.towards_eye) <= 0.0 {
            continue;
        }
        let [p, q] =
            [from - beyond, to + beyond].map(|end| [a, b].map(|off| view.corner(&(end + off))));
        let paint = || packed(colour.lit(0.12 + 1.05 * view.camera.brightness(&normal)));
        raster.triangle([p[0], p[1], q[1]], paint);
        raster.triangle([p[0], q[1], q[0]], paint);
    }
}

fn packed(colour: Colour) -> u32 {
    let [r, g, b] = colour.0;
    u32::from_be_bytes([0, r, g, b])
}

/// Gathers samples to pixels and writes them.
fn png(raster: &Raster, [width, height]: [usize; 2]) -> io::Result<Vec<u8>> {
    let mut pixels = Vec::with_capacity(width * height * 4);
    for y in 0..height {
        for x in 0..width {
            let (mut sums, mut covered) = ([0; 3], 0);
            for k in 0..FINE * FINE {
                let row = y * FINE + k / FINE;
                let paint = raster.paint[row * raster.width + x * FINE + k % FINE];
                if paint == Raster::BARE {
                    continue;
                }
                let [_, r, g, b] = paint.to_be_bytes();
                for (sum, c) in sums.iter_mut().zip([r, g, b]) {
                    *sum += u32::from(c);
                }
                covered += 1;
            }
            pixels.extend(sums.map(|sum| (sum / covered.max(1)) as u8));
            pixels.push((covered * 255 / (FINE * FINE) as u32) as u8);
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(&pixels).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, printer, segment};

    fn decoded(bytes: &[u8]) -> (usize, Vec<[u8; 4]>) {
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let pixels = pixels.chunks_exact(4).map(|p| p.try_into().unwrap()).collect();
        (info.width as usize, pixels)
    }

    /// A ring of beads of this height.
    fn ring(layers: u32) -> DepositSink {
        let mut sink = DepositSink::new(&printer(), 2.405);
        for layer in 0..layers {
            for k in 0..24 {
                let turn = |k: u32| f64::from(k) * std::f64::consts::TAU / 24.0;
                let z = 0.2 * f64::from(layer + 1);
                let mut line =
                    segment(joints(20.0, turn(k), z), joints(20.0, turn(k + 1), z), 20.0);
                line.filament = line.path * 0.45 * 0.2 / 2.405;
                sink.add(&line);
            }
        }
        sink
    }

    #[test]
    fn thickness_is_that_of_the_section() {
        let (w, t) = (0.45, 0.2);
        let section = w * t - t * t * (1.0 - std::f64::consts::FRAC_PI_4);
        assert!((thickness(section, w) - t).abs() < 1e-12);
        assert_eq!(thickness(9.0, w), w);
    }

    #[test]
    fn a_taller_print_covers_more_and_stands_in_the_picture() {
        let picture =
            Picture { width: 240, height: 180, gaze: Gaze::default(), shade: Shade::Role };
        let seen = |layers: u32| {
            let (width, pixels) = decoded(&deposit_png(&ring(layers), &picture).unwrap());
            assert_eq!((width, pixels.len()), (240, 240 * 180));
            pixels
        };
        let walls = |pixels: &[[u8; 4]]| {
            // Orange of walls, not the grey of the bed.
            pixels.iter().filter(|[r, _, b, a]| *a == 255 && *r > *b + 40).count()
        };
        let (low, high) = (seen(1), seen(40));
        assert!(walls(&low) > 200, "{}", walls(&low));
        assert!(walls(&high) > 4 * walls(&low), "{} {}", walls(&low), walls(&high));
    }

    #[test]
    fn from_above_a_ring_is_round() {
        let gaze = Gaze { azimuth: -1.0, elevation: std::f64::consts::FRAC_PI_2 };
        let picture = Picture { width: 200, height: 200, gaze, shade: Shade::Height };
        let (_, pixels) = decoded(&deposit_png(&ring(1), &picture).unwrap());
        let opaque = |x: usize, y: usize| pixels[y * 200 + x][3] > 128;
        let places = (0..200).flat_map(|y| (0..100).map(move |x| (x, y)));
        let unlike = places.filter(|(x, y)| opaque(*x, *y) != opaque(199 - x, *y)).count();
        // The ring has 24 corners, which lie to the left and right a little unlike.
        assert!(unlike < 200, "{unlike}");
        assert!(!opaque(100, 100));
    }

    #[test]
    fn nothing_laid_is_a_bare_bed() {
        let sink = DepositSink::new(&printer(), 2.405);
        let picture =
            Picture { width: 64, height: 48, gaze: Gaze::default(), shade: Shade::Height };
        let (_, pixels) = decoded(&deposit_png(&sink, &picture).unwrap());
        assert!(pixels.iter().any(|p| p[3] > 0));
    }
}
