//! Toolpaths and a machine become a motion program.
//!
//! This is the only crate that knows both arms of rhumb: where material goes (`slicer`) and what
//! the machine can do (`machine`). In the order of the data: [`order`] says which line comes after
//! which and [`seam`] where closed ones begin; [`route`] puts travel, retraction and lift between
//! them, clear of what is
//! [`printed`]; [`axis`] bends what would graze the rotation axis and [`resample`] turns strokes over the
//! part into joint moves, [`tilt`] those into moves of heads that turn the nozzle; [`speed`] finds the durations that the axes can keep, [`cooling`]
//! stretches short layers, [`time`] estimates how long the print takes; [`planner`] runs it all,
//! layer by layer.

pub mod acceleration;
pub mod arcs;
pub mod axis;
mod comb;
pub mod cooling;
pub mod follow;
pub mod helix;
pub mod objects;
pub mod order;
pub mod planner;
pub mod printed;
pub mod resample;
pub mod route;
pub mod scarf;
pub mod seam;
pub mod slow_flow;
pub mod speed;
pub mod tilt;
pub mod time;
mod winding;

#[cfg(test)]
mod testing;
