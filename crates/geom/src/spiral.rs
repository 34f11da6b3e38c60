//! spiral
