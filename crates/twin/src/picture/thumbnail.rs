//! Small pictures of a part, for the screens of printers and print servers.
//!
//! The placed mesh, shaded, on nothing. The colours are a palette of lights and coverages of one
//! hue, which keeps the files small: they are part of every program. Samples are drawn once and
//! gathered to the sizes that are wanted.

use std::io;

use mesh::topology::Solid;
use nalgebra::Point3;

use super::camera::{Camera, Gaze};
use super::palette::Colour;
use super::raster::{Corner, Raster};

/// Samples of a side: two for each pixel of the largest thumbnail.
const SAMPLES: usize = 600;

/// The largest side of a thumbnail, pixels.
pub const LARGEST: usize = SAMPLES / 2;

/// Room around the part, samples.
const MARGIN: f64 = 12.0;

/// Lights that are told apart: 4 of 255 between two, which no eye sees.
const LIGHTS: u32 = 63;

/// Shares of a pixel that are told apart.
const COVERS: u32 = 4;

/// The colour of the part in full light.
const HUE: Colour = Colour([0x3c, 0xc8, 0xb4]);

/// A part as it is seen, to be gathered to thumbnails.
#[derive(Debug, Clone)]
pub struct Thumbnail {
    raster: Raster,
}

impl Thumbnail {
    /// Draws a part. Of one without holes only the outside is looked at.
    #[must_use]
    pub fn draw(solid: &Solid) -> Self {
        let mesh = solid.mesh();
        let is_closed = solid.open_sides() == 0;
        let camera = Camera::new(&Gaze::default());
        let seen: Vec<[f64; 3]> = mesh.vertices.iter().map(|p| camera.seen(p)).collect();
        let fit = Fit::of(&seen);
        let corners: Vec<Corner> = seen.iter().map(|p| fit.corner(p)).collect();
        let mut raster = Raster::new(SAMPLES, SAMPLES);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| v as usize);
            let paint = || {
                let [a, b, c]: [&Point3<f64>; 3] = [a, b, c].map(|v| &mesh.vertices[v]);
                let light = camera.brightness(&(b - a).cross(&(c - a)));
                (light * f64::from(LIGHTS - 1)).round() as u32
            };
            let corners = [corners[a], corners[b], corners[c]];
            if is_closed {
                raster.front(corners, paint);
            } else {
                raster.triangle(corners, paint);
            }
        }
        Self { raster }
    }

    /// Returns it as a PNG file of `side` times `side` pixels, at most [`LARGEST`].
    ///
    /// # Errors
    ///
    /// None that a picture in memory can have.
    pub fn png(&self, side: usize) -> io::Result<Vec<u8>> {
        let side = side.clamp(1, LARGEST);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side as u32, side as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let (colours, opacities) = palette();
        encoder.set_palette(colours);
        encoder.set_trns(opacities);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&self.gathered(side)).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(bytes)
    }

    /// The entries of the palette that the samples of each pixel come to.
    fn gathered(&self, side: usize) -> Vec<u8> {
        let bounds: Vec<usize> = (0..=side).map(|k| k * SAMPLES / side).collect();
        let mut pixels = Vec::with_capacity(side * side);
        for rows in bounds.windows(2) {
            for columns in bounds.windows(2) {
                let (mut lights, mut covered) = (0, 0);
                for row in rows[0]..rows[1] {
                    let samples = &self.raster.paint[row * SAMPLES..][columns[0]..columns[1]];
                    for paint in samples.iter().filter(|paint| **paint != Raster::BARE) {
                        lights += paint;
                        covered += 1;
                    }
                }
                let all = (columns[1] - columns[0]) * (rows[1] - rows[0]);
                pixels.push(pixel(lights, covered, all as u32));
            }
        }
        pixels
    }
}

/// The entry of the palette for a pixel of which so many of `all` samples are covered, with so much light
/// together.
fn pixel(lights: u32, covered: u32, all: u32) -> u8 {
    if covered == 0 {
        return 0;
    }
    // Rounded: a pixel that is hardly covered is bare.
    let cover = (covered * COVERS + all / 2) / all;
    if cover == 0 { 0 } else { entry((lights + covered / 2) / covered, cover) }
}

/// How the part is laid into the square.
#[derive(Debug, Clone, Copy)]
struct Fit {
    middle: [f64; 2],
    scale: f64,
}

impl Fit {
    fn of(seen: &[[f64; 3]]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in seen {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let scale = if extent > 0.0 { (SAMPLES as f64 - 2.0 * MARGIN) / extent } else { 1.0 };
        Self { middle: [0, 1].map(|k| f64::midpoint(low[k], high[k])), scale }
    }

    fn corner(&self, seen: &[f64; 3]) -> Corner {
        let half = SAMPLES as f64 / 2.0;
        Corner::new(
            half + (seen[0] - self.middle[0]) * self.scale,
            half - (seen[1] - self.middle[1]) * self.scale,
            seen[2],
        )
    }
}

/// The place of a light and a coverage in the palette; the first one is bare.
fn entry(light: u32, cover: u32) -> u8 {
    (1 + light.min(LIGHTS - 1) * COVERS + cover.min(COVERS) - 1) as u8
}

/// Colours and opacities of the palette.
fn palette() -> (Vec<u8>, Vec<u8>) {
    let (mut colours, mut opacities) = (vec![0; 3], vec![0]);
    for light in 0..LIGHTS {
        // From dark through the hue itself to a little white.
        let share = f64::from(light) / f64::from(LIGHTS - 1);
        let colour = HUE.lit(0.18 + 1.0 * share);
        for cover in 1..=COVERS {
            colours.extend(colour.0);
            opacities.push((cover * 255 / COVERS) as u8);
        }
    }
    (colours, opacities)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::mesh::Mesh;
    use mesh::shapes;

    /// The opacities of a thumbnail's pixels, as a reader of PNG files sees them, and its colours.
    fn decoded(bytes: &[u8]) -> (usize, Vec<[u8; 4]>) {
        let mut decoder = png::Decoder::new(io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.color_type), (info.height, png::ColorType::Rgba));
        let pixels = pixels.chunks_exact(4).map(|p| p.try_into().unwrap()).collect();
        (info.width as usize, pixels)
    }

    #[test]
    fn a_cube_shows_three_faces_of_different_light() {
        let bytes = Thumbnail::draw(&Solid::new(shapes::cube(20.0))).png(300).unwrap();
        assert!(bytes.len() < 8000, "{}", bytes.len());
        let (side, pixels) = decoded(&bytes);
        assert_eq!(side, 300);
        let mut colours: Vec<[u8; 4]> = pixels.iter().copied().filter(|p| p[3] == 255).collect();
        // Three faces, and the pixels on the edges between them.
        let covered = colours.len();
        colours.sort_unstable();
        let large: Vec<usize> =
            colours.chunk_by(|a, b| a == b).map(<[_]>::len).filter(|n| *n > 5000).collect();
        assert_eq!(large.len(), 3, "{large:?}");
        assert!(covered > 35_000 && covered < 80_000, "{covered}");
        assert_eq!(pixels[0][3], 0);
        // The part touches the margin of one side, on both ends alike.
        let rows: Vec<usize> =
            (0..300).filter(|y| (0..300).any(|x| pixels[y * 300 + x][3] > 0)).collect();
        let columns: Vec<usize> =
            (0..300).filter(|x| (0..300).any(|y| pixels[y * 300 + x][3] > 0)).collect();
        let ends = |all: &[usize]| (all[0], 299 - all[all.len() - 1]);
        assert!(ends(&rows) == (6, 6) || ends(&columns) == (6, 6), "{rows:?} {columns:?}");
    }

    #[test]
    fn small_ones_are_the_same_picture() {
        let thumbnail = Thumbnail::draw(&Solid::new(shapes::cube(20.0)));
        let (side, small) = decoded(&thumbnail.png(32).unwrap());
        assert_eq!(side, 32);
        let (_, large) = decoded(&thumbnail.png(300).unwrap());
        let share = |pixels: &[[u8; 4]]| {
            pixels.iter().map(|p| f64::from(p[3])).sum::<f64>() / pixels.len() as f64 / 255.0
        };
        assert!((share(&small) - share(&large)).abs() < 0.01);
    }

    #[test]
    fn the_near_side_is_seen_and_not_the_far_one() {
        let closed = Thumbnail::draw(&Solid::new(shapes::cube(20.0))).gathered(300);
        let mut open = shapes::cube(20.0);
        // One facet of the underside is never seen.
        let down = |t: &[u32; 3]| t.iter().all(|v| open.vertices[*v as usize].z < 1.0);
        let under = open.triangles.iter().position(down).unwrap();
        open.triangles.remove(under);
        assert!(closed == Thumbnail::draw(&Solid::new(open)).gathered(300));
    }

    #[test]
    fn one_sees_into_an_open_box() {
        let mut mesh = shapes::cube(20.0);
        let top = |v: &u32| mesh.vertices[*v as usize].z > 19.0;
        let sides = mesh.triangles.iter().filter(|t| !t.iter().all(top)).copied().collect();
        mesh.triangles = sides;
        let opaque = |mesh: Mesh| {
            let (_, pixels) = decoded(&Thumbnail::draw(&Solid::new(mesh)).png(300).unwrap());
            pixels.iter().filter(|p| p[3] == 255).count()
        };
        let (open, whole) = (opaque(mesh), opaque(shapes::cube(20.0)));
        assert!(open.abs_diff(whole) < whole / 100, "{open} {whole}");
    }

    #[test]
    fn nothing_to_draw_is_an_empty_picture() {
        let (_, pixels) = decoded(&Thumbnail::draw(&Solid::new(Mesh::default())).png(300).unwrap());
        assert!(pixels.iter().all(|p| p[3] == 0));
    }
}
