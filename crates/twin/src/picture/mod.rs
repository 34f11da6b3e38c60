//! Pictures of what was replayed, as SVG text or PNG files.
//!
//! Segments are collected by a sink ([`layer::LayerSink`], [`print::PrintSink`],
//! [`deposit::DepositSink`] (which [`relief`] draws too), [`plot::MotionSink`]) and drawn by a function of the same module. Nothing
//! but replayed segments is drawn, so a picture cannot show what the machine would not do; only
//! [`thumbnail`]s, which stand at the head of a program, are drawn from the mesh. Colours of lines and
//! text are of middle lightness: pictures have no background of their own and are legible on
//! white and on black. [`fit`] and [`error_map`] draw a calibration instead of a
//! program, [`step_map`] what whole steps of its motors make of one,
//! [`motor`] what a motor does during a turn, [`curve`] a bare curve on a sphere.

pub mod camera;
pub mod curve;
pub mod deposit;
pub mod error_map;
pub mod fit;
pub mod layer;
pub mod motor;
mod palette;
pub mod plot;
pub mod print;
mod raster;
pub mod relief;
pub mod step_map;
mod svg;
pub mod thumbnail;
mod trace;

use machine::program::Role;

/// Returns the colour of a role in all pictures, sRGB from 0 to 255.
#[must_use]
pub fn role_colour(role: Role) -> [u8; 3] {
    palette::of_role(role).0
}
