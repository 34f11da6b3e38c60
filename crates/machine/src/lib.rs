//! All that changes when another printer is bought.
//!
//! [`profile`] is the printer as facts: axes, limits, nozzle. [`kinematics`] turns places in the
//! part into joint positions and back, with the machine's own misalignment. [`program`] is the
//! motion program in joints, and [`gcode`] writes it as text in the words of a firmware and reads
//! text back. [`height_map`], [`backlash`] and [`plate_shift`] are corrections that stand beside the
//! kinematics, and [`head`] is for nozzles that tilt or stand on legs. [`drive`] is what turns pulses into motion. [`calibration`] finds the misalignment of a real machine.
//!
//! This crate knows neither meshes nor slicing: it must stay useful alone, for calibration.

pub mod backlash;
pub mod calibration;
pub mod drive;
pub mod gcode;
pub mod head;
pub mod height_map;
pub mod kinematics;
pub mod plate_shift;
pub mod profile;
pub mod program;
