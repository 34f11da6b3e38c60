//! A little reader of programs, for tests alone.
//!
//! It knows the printer `generic-polar` and the contract of the text, and nothing of the crates:
//! what they get wrong together, it should not get wrong with them. Millimetres, seconds, degrees.

use std::f64::consts::PI;

/// The printer `generic-polar`: least and greatest carriage position.
pub(crate) const RAIL: [f64; 2] = [-25.0, 120.0];
/// Its greatest lift.
pub(crate) const LIFT: f64 = 200.0;
/// Cross-section of its filament, mm².
pub(crate) const FILAMENT_AREA: f64 = PI * 1.75 * 1.75 / 4.0;
/// Where it stands after homing: carriage, bed, lift.
const HOME: [f64; 3] = [120.0, 0.0, 5.0];

/// One `G1` of a program in the dialect `polar`.
#[derive(Debug, Clone)]
pub(crate) struct Motion<'a> {
    /// Counted from 1.
    pub(crate) line: usize,
    /// Carriage, bed, lift before and after.
    pub(crate) from: [f64; 3],
    pub(crate) to: [f64; 3],
    /// Filament.
    pub(crate) e: f64,
    /// Of the nozzle over the part, or of the filament where the nozzle stands, mm/s.
    pub(crate) speed: f64,
    /// What `;TYPE:`, `;WIDTH:`, `;LAYER:` and `;HEIGHT:` last said.
    pub(crate) role: &'a str,
    pub(crate) width: f64,
    pub(crate) layer: Option<usize>,
    pub(crate) height: f64,
}

impl Motion<'_> {
    /// Joints at a share of the way; the axes run together from end to end.
    fn joints(&self, share: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.from[k] + (self.to[k] - self.from[k]) * share)
    }

    /// Where the nozzle stands in the part at a share of the way.
    pub(crate) fn at(&self, share: f64) -> [f64; 3] {
        let [s, turn, z] = self.joints(share);
        let (sin, cos) = turn.to_radians().sin_cos();
        [s * cos, s * sin, z]
    }

    /// Length of the nozzle's way over the part: the speed of the nozzle, integrated by Simpson's
    /// rule in pieces of at most a degree.
    pub(crate) fn path(&self) -> f64 {
        let [run, turn, rise] = [0, 1, 2].map(|k| self.to[k] - self.from[k]);
        let turn = turn.to_radians();
        let speed = |share: f64| (run.hypot(self.joints(share)[0] * turn)).hypot(rise);
        let pieces = turn.abs().to_degrees().ceil().max(1.0) as u32;
        let at = |i: u32, share: f64| speed((f64::from(i) + share) / f64::from(pieces));
        let sum: f64 = (0..pieces).map(|i| at(i, 0.0) + 4.0 * at(i, 0.5) + at(i, 1.0)).sum();
        sum / (6.0 * f64::from(pieces))
    }

    pub(crate) fn duration(&self) -> f64 {
        let path = self.path();
        let way = if path > 0.0 { path } else { self.e.abs() };
        way / self.speed
    }

    /// Whether it lays material.
    pub(crate) fn lays(&self) -> bool {
        self.e > 0.0 && self.path() > 0.0
    }

    pub(crate) fn volume(&self) -> f64 {
        self.e * FILAMENT_AREA
    }
}

/// Reads all motions of a program; panics at anything that the contract does not allow.
pub(crate) fn motions(text: &str) -> Vec<Motion<'_>> {
    let mut motions = Vec::new();
    let mut at = HOME;
    let (mut speed, mut width, mut height) = (f64::NAN, f64::NAN, f64::NAN);
    let (mut role, mut layer) = ("", None);
    for (line, words) in (1..).zip(text.lines()) {
        if let Some(value) = words.strip_prefix(";TYPE:") {
            role = value;
        } else if let Some(value) = words.strip_prefix(";WIDTH:") {
            width = value.parse().unwrap();
        } else if let Some(value) = words.strip_prefix(";HEIGHT:") {
            height = value.parse().unwrap();
        } else if let Some(value) = words.strip_prefix(";LAYER:") {
            layer = Some(value.parse().unwrap());
        }
        let Some(words) = words.trim_end_matches(" ;E").strip_prefix("G1 ") else { continue };
        let from = at;
        let mut e = 0.0;
        for word in words.split(' ') {
            let (letter, number) = word.split_at(1);
            let number: f64 = number.parse().unwrap();
            match letter {
                "R" => at[0] = number,
                "T" => at[1] = number,
                "Z" => at[2] = number,
                "E" => e = number,
                "F" => speed = number / 60.0,
                other => panic!("line {line}: no printer was told of {other}"),
            }
        }
        motions.push(Motion { line, from, to: at, e, speed, role, width, layer, height });
    }
    motions
}

/// The stretches of a role that are laid without a break, as the motions they are made of.
pub(crate) fn beads<'a, 'b>(motions: &'b [Motion<'a>], role: &str) -> Vec<&'b [Motion<'a>]> {
    motions
        .chunk_by(|a, b| a.lays() && b.lays() && a.role == b.role && a.layer == b.layer)
        .filter(|bead| bead[0].lays() && bead[0].role == role)
        .collect()
}

/// The walls, each in one with what of it hangs over.
pub(crate) fn walls<'a, 'b>(motions: &'b [Motion<'a>]) -> Vec<&'b [Motion<'a>]> {
    let is_wall = |m: &Motion| {
        m.lays() && ["Perimeter", "External perimeter", "Overhang perimeter"].contains(&m.role)
    };
    motions
        .chunk_by(|a, b| is_wall(a) && is_wall(b) && a.layer == b.layer)
        .filter(|wall| is_wall(&wall[0]))
        .collect()
}

/// The volume that the triangles of a binary STL enclose, mm³.
pub(crate) fn stl_volume(bytes: &[u8]) -> f64 {
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
    let facets = bytes[84..].chunks_exact(50).map(|facet| {
        let c: Vec<f64> = facet[12..48].chunks_exact(4).map(number).collect();
        c[0] * (c[4] * c[8] - c[5] * c[7])
            + c[1] * (c[5] * c[6] - c[3] * c[8])
            + c[2] * (c[3] * c[7] - c[4] * c[6])
    });
    facets.sum::<f64>() / 6.0
}
