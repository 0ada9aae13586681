//! Files that a person or a program reads.

mod drawing_svg;

pub use drawing_svg::drawing_svg;
