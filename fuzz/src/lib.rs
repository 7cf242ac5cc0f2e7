//! Shared by the fuzz targets: frames with a valid CRC and arbitrary contents, and robust filters to save and restore.

pub mod filters;
pub mod line;
