//! Settings: what a printer is, what a material needs, what a print should be.
//!
//! Three files, each may inherit from another; the command line wins over all. [`key`] lists every
//! setting with its unit, range, default and meaning, [`mod@file`] reads TOML, [`merge`] puts the
//! sources together and remembers which one each value came from, [`resolve`] turns the result into
//! the parameters of each stage (`machine`, `schedule`, `paths`, `motion`, each with its own), [`template`] fills the start and end programs, and [`page`] is the
//! documentation of them all.

mod expression;
pub mod file;
mod head;
pub mod key;
mod lookup;
mod machine;
pub mod material;
pub mod merge;
mod motion;
pub mod orca;
pub mod page;
mod paths;
pub mod prusa;
pub mod ranges;
pub mod resolve;
mod schedule;
mod surface;
pub mod template;

pub use key::{KEYS, Key, Kind, Section, Value};
pub use merge::{Settings, Source, Sources};
pub use resolve::Job;
