//! Files that a person or a program reads.

mod cell;
mod cover_figure;
mod distortion;
mod drawing_svg;
mod figure;
mod file_list;
mod heights;
mod html;
mod looks_csv;
mod npy;
mod output;
mod page;
mod plan_file;
mod plot;
mod reach_figure;
mod record_file;
#[cfg(test)]
mod sample;
mod seam_picture;
mod stages_csv;
mod summary;

pub use cell::cell;
pub use cover_figure::{CoverSketch, cover_svg};
pub use distortion::distortion_picture;
pub use drawing_svg::drawing_svg;
pub use figure::{Figure, FigureError, heat_color, svg_png};
pub use heights::{heights_csv, heights_figure};
pub use html::{document, escape};
pub use looks_csv::looks_csv;
pub use npy::{npy_bytes, read_npy_bytes};
pub use output::{OutputDir, OutputError};
pub use page::{Page, report_html};
pub use plan_file::{plan_json, plan_npy};
pub use plot::{Frame, Plot, WIDTH, series_color};
pub use reach_figure::{ShownCanvas, reach_figure};
pub use record_file::{RecordFileError, write_record};
pub use seam_picture::seam_picture;
pub use stages_csv::{StagesOf, snapshot_name, stages_csv};
pub use summary::{duration, metrics_json, summary};
