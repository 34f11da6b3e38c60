//! From untrusted bytes to a solid with a report.

pub mod health;
mod inside;
pub mod measure;
pub mod mesh;
pub mod note;
pub mod orient;
pub mod overlap;
mod parts;
pub mod place;
pub mod repair;
pub mod shapes;
pub mod soup;
pub mod stl;
pub mod topology;
pub mod weld;
