//! What the fuzz targets share: frames with a right checksum, whatever is in them, and robust filters to save and restore.

pub mod filters;
pub mod line;
