//! Pictures of what was replayed, as SVG text.
//!
//! Segments are collected by a sink ([`layer::LayerSink`], [`print::PrintSink`]) whose memory is
//! bounded by what is drawn, and drawn by a function of the same module. Nothing but replayed
//! segments is drawn, so a picture cannot show what the machine would not do. Colours of lines and
//! text are of middle lightness: pictures have no background of their own and are legible on
//! white and on black. [`fit`] and [`error_map`] draw a calibration instead of a program.

pub mod error_map;
pub mod fit;
pub mod layer;
mod palette;
pub mod print;
mod svg;
mod trace;
