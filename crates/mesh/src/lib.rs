//! From untrusted bytes to a solid with a report.
//!
//! A mesh file is garbage until proven otherwise. This crate reads STL from any bytes, joins the
//! corners, repairs what is broken and says what it did; measures the result, finds the side it
//! should lie on and puts it on the bed. It takes bytes and gives values: no files, no clock, no
//! printing, and no input makes it panic.
//!
//! ```text
//! bytes ── stl::read ──► Soup ── weld ──► Mesh ── repair ──► Mesh ── topology ──► Solid
//!                                  └── health::solid_from_soup does these three ──┘
//!                                                                      + Health, with its notes
//! ```
//!
//! In reading order: [`soup`] holds loose facets and [`mesh`] shared vertices; [`stl`] reads and
//! writes files, and [`model`] reads 3MF and OBJ too; [`weld`] joins corners; [`topology`] finds sides and shells; [`repair`] closes
//! and turns; [`overlap`] finds surfaces that cross; [`health`] does it all and sums it up in
//! [`note`]s; [`measure`] gives volumes and moments; [`orient`] and [`place`] put a part on the
//! bed; [`flats`] are the faces that its layers should meet; [`shapes`] are solids that are known exactly.
//!
//! Lengths are millimetres, angles radians. Everything up to [`orient`] is in the Model frame, as
//! in the file; [`place`] leads to the Part frame. The same facets give the same solid, bit for
//! bit, on any number of threads.
//!
//! ```
//! use mesh::{health, shapes, stl};
//!
//! let file = stl::write(&shapes::cube(20.0));
//! let (soup, read) = stl::read(&file).expect("a file of our own");
//! let (solid, health) = health::solid_from_soup(&soup).expect("a cube encloses a volume");
//! assert_eq!(solid.shells().len(), 1);
//! assert_eq!(health.volume_mm3.round(), 8000.0);
//! assert!(health.with_read(&read).notes.is_empty());
//! ```

pub mod cut;
pub mod flats;
mod groups;
pub mod health;
mod inside;
pub mod measure;
pub mod mesh;
pub mod model;
pub mod note;
pub mod orient;
pub mod overlap;
mod parts;
pub mod place;
pub mod repair;
pub mod shapes;
pub mod soup;
pub mod split;
pub mod stl;
pub mod topology;
pub mod weld;
