//! The listener's side of the line: the map as it was heard.

mod picture;

pub use picture::Picture;
