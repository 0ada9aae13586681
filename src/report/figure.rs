//! Figures: one or several plots under a title, as SVG that stands by itself and as PNG.
use std::fmt::Write as _;

use epaint_default_fonts::UBUNTU_LIGHT;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use crate::math::Rgb;
use crate::picture::{Image, PictureError};

use super::html::{PLOT_STYLE, escape};
use super::plot::{Plot, WIDTH};

/// Pixels of a PNG for one of the figure's.
const SCALE: f32 = 2.0;
/// Where a figure's title and legend end and its plots may begin, px.
const HEAD: f64 = 62.0;
/// Width of a letter of a legend, px: enough for most of them.
const LETTER: f64 = 6.4;

/// A figure that can't be made a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// The SVG can't be read back.
    #[error("a plot can't be drawn: {0}")]
    Svg(#[from] resvg::usvg::Error),
    /// It has no size.
    #[error("a plot of {width} x {height} px can't be drawn")]
    Size {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
    },
    /// The picture can't be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// A figure being put together, 960 px wide.
pub struct Figure {
    title: String,
    height: f64,
    legend: Vec<(&'static str, String)>,
    plots: String,
}

impl Figure {
    /// Where plots may begin, px from the top.
    pub const HEAD: f64 = HEAD;

    /// An empty figure, `height` px high.
    pub fn new(title: &str, height: f64) -> Self {
        Self { title: title.into(), height, legend: Vec::new(), plots: String::new() }
    }

    /// Adds an entry of the legend.
    pub fn legend(&mut self, color: &'static str, label: &str) {
        self.legend.push((color, label.into()));
    }

    /// Adds a plot with the labels of its axes.
    pub fn add(&mut self, plot: &Plot, x_label: &str, y_label: &str) {
        self.plots += &plot.group(x_label, y_label);
    }

    /// The figure as SVG that needs nothing else.
    pub fn svg(&self) -> String {
        let height = self.height;
        let title = escape(&self.title);
        let mut legend = String::new();
        let mut x = 20.0;
        for (color, label) in &self.legend {
            let _ = writeln!(
                legend,
                r#"<path fill="none" stroke="{color}" stroke-width="3" d="M{x:.1} 46H{:.1}"/><text class="caption" x="{:.1}" y="50">{}</text>"#,
                x + 18.0,
                x + 24.0,
                escape(label)
            );
            x += 24.0 + LETTER * label.chars().count() as f64 + 22.0;
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
             role=\"img\" aria-label=\"{title}\">\n<style>\n{PLOT_STYLE}</style>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
             <text class=\"title\" x=\"20\" y=\"26\">{title}</text>\n{legend}{}</svg>\n",
            self.plots
        )
    }

    /// The figure as PNG, twice as many pixels wide and high. Its font comes with the program.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        svg_png(&self.svg())
    }
}

/// An SVG on an opaque ground as PNG, twice as many pixels wide and high. Its font comes with the program.
pub fn svg_png(svg: &str) -> Result<Vec<u8>, FigureError> {
    let mut options = Options { font_family: "Ubuntu".into(), ..Options::default() };
    options.fontdb_mut().load_font_data(UBUNTU_LIGHT.to_vec());
    options.fontdb_mut().set_sans_serif_family("Ubuntu");
    let tree = Tree::from_str(svg, &options)?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|x| (x * SCALE).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(FigureError::Size { width, height })?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    // the ground is white and opaque, so that premultiplied colours are plain ones
    let rgb = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Image::new(width, height, rgb)?.to_png(None)?)
}

/// The colour of a share from 0, light, to 1, dark: even in lightness, one hue, so that it reads in grey too.
pub fn heat_color(share: f64) -> Rgb {
    const STOPS: [[f64; 3]; 4] =
        [[246.0, 242.0, 232.0], [164.0, 196.0, 218.0], [64.0, 120.0, 172.0], [18.0, 42.0, 84.0]];
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let i = (at as usize).min(STOPS.len() - 2);
    let f = at - i as f64;
    Rgb([0, 1, 2].map(|c| (STOPS[i][c] + f * (STOPS[i + 1][c] - STOPS[i][c])).round() as u8))
}

#[cfg(test)]
mod tests {
    use super::super::plot::Frame;
    use super::*;

    #[test]
    fn a_figure_shows_its_marks_and_its_letters() {
        let dark = |figure: &Figure| {
            let png = figure.png().unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
            assert_eq!(reader.info().size(), (1920, 600));
            let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut rgb).unwrap();
            rgb.iter().filter(|b| **b < 160).count()
        };
        let empty = Figure::new("", 300.0);
        let titled = Figure::new("A title <&>", 300.0);
        assert_eq!(dark(&empty), 0);
        assert!(dark(&titled) > 300, "letters are drawn without a font on the machine");
        let mut full = Figure::new("A title", 300.0);
        let mut plot =
            Plot::within(Frame { left: 70.0, top: HEAD, right: 900.0, bottom: 250.0 }, (0.0, 1.0), (0.0, 1.0));
        plot.curve("#000000", &[(0.0, 0.0), (1.0, 1.0), (f64::NAN, 0.0)]);
        full.add(&plot, "x", "y");
        assert!(dark(&full) > dark(&titled) + 3000);
        assert!(!full.svg().contains("NaN"));
    }
}
