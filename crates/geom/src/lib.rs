//! Numbers, tolerances and planar geometry that any CAM program could use.
//!
//! Lengths are millimetres, angles radians, numbers `f64`; planar regions live on one integer
//! grid ([`grid`]). No module here knows of meshes, printers or files.
//!
//! In reading order: [`grid`] and [`tolerance`] say what "equal" means; [`region`] holds closed
//! planar areas with their booleans, [`bands`] sorts their sides, [`offset`] moves their borders,
//! [`simplify`] thins them out; [`polyline`] measures open and closed lines; [`spiral`] is the
//! Archimedean spiral, [`spherical`] its kin on a sphere;
//! [`circle`] encloses points; [`triangulate`] fills rings with triangles; [`bounding`] finds
//! boxes that meet; [`lift`] says how far a tool must be raised to clear a bead.
//!
//! Three other libraries do the groundwork, each named in one place only: the polygon overlay
//! engine in [`region`], the Delaunay triangulation in [`triangulate`], the bounding volume
//! hierarchy in [`bounding`], its distances in [`lift`].

pub mod bands;
mod boolean;
pub mod bounding;
pub mod circle;
pub mod grid;
pub mod lift;
pub mod offset;
pub mod polyline;
pub mod region;
pub mod simplify;
pub mod spherical;
pub mod spiral;
pub mod tolerance;
pub mod triangulate;
