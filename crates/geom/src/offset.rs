//! offset
