//! Where the material goes, in the part frame.
//!
//! Lengths are mm. The part frame has z up, the rotation axis of the bed as its z axis and the bed
//! at z = 0. This crate knows no machine: not how fast anything runs, nor by which axes.
//!
//! In the order of the data: [`surface`] is the family of layers and [`chart`] the flat map of one,
//! [`level`] says where they lie, [`section`] cuts the mesh, [`walls`], [`thin`], [`skins`] and
//! [`infill`] fill an island, [`adhesion`] surrounds the first layer, [`layer`] puts it together
//! into [`toolpath`]s of [`bead`]s. [`stacking`] tells how thick beads are on a flat base,
//! [`overhang`] what hangs in the air, [`bridge`] what spans a gap, [`support`] what is
//! built under the rest, [`clearance`] how steep layers may
//! be; [`compensation`] and [`fuzzy`] move outlines on purpose.

pub mod adhesion;
pub mod bead;
pub mod blend;
pub mod bridge;
pub mod chart;
pub mod clearance;
pub mod compensation;
pub mod fuzzy;
pub(crate) mod hanging;
pub mod infill;
pub mod layer;
pub mod level;
pub mod lift;
mod nearby;
pub mod overhang;
pub mod polyhole;
pub mod section;
pub mod skins;
pub mod stacking;
pub mod support;
pub mod surface;
pub mod thin;
pub mod toolpath;
pub mod walls;
