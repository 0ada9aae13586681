//! Names of colours.
use crate::math::Rgb;
use crate::picture::color::{Oklab, oklab_difference2, oklab_from_rgb};

/// Plain names and a colour that most would call so.
const NAMES: [(&str, [u8; 3]); 41] = [
    ("white", [255, 255, 255]),
    ("light grey", [205, 205, 205]),
    ("grey", [140, 140, 140]),
    ("dark grey", [75, 75, 75]),
    ("black", [15, 15, 15]),
    ("red", [220, 25, 30]),
    ("dark red", [130, 15, 20]),
    ("pink", [250, 170, 190]),
    ("deep pink", [225, 80, 130]),
    ("salmon", [240, 130, 110]),
    ("orange", [250, 140, 20]),
    ("dark orange", [200, 95, 20]),
    ("peach", [255, 205, 165]),
    ("cream", [250, 240, 210]),
    ("beige", [215, 195, 160]),
    ("tan", [190, 150, 105]),
    ("light brown", [160, 110, 70]),
    ("brown", [115, 70, 40]),
    ("dark brown", [65, 40, 25]),
    ("light yellow", [255, 250, 160]),
    ("yellow", [255, 225, 20]),
    ("dark yellow", [195, 160, 20]),
    ("olive", [110, 110, 30]),
    ("light green", [150, 220, 140]),
    ("lime", [160, 215, 30]),
    ("green", [40, 160, 60]),
    ("dark green", [20, 80, 35]),
    ("grey green", [125, 145, 120]),
    ("mint", [170, 235, 205]),
    ("teal", [20, 130, 130]),
    ("dark teal", [15, 70, 75]),
    ("cyan", [30, 190, 225]),
    ("light blue", [165, 205, 240]),
    ("blue", [35, 95, 205]),
    ("dark blue", [20, 35, 95]),
    ("grey blue", [110, 130, 155]),
    ("lavender", [195, 180, 235]),
    ("purple", [120, 50, 160]),
    ("dark purple", [65, 25, 85]),
    ("magenta", [215, 25, 145]),
    ("mauve", [155, 115, 135]),
];

/// The plain name that comes nearest to a colour.
pub(super) fn name(color: Oklab) -> &'static str {
    let far = |c: &[u8; 3]| oklab_difference2(oklab_from_rgb(Rgb(*c)), color);
    NAMES.iter().min_by(|a, b| far(&a.1).total_cmp(&far(&b.1))).map_or("ink", |n| n.0)
}

/// A name for each colour, those of the same name numbered from 2.
pub(super) fn unique_names(colors: &[Oklab]) -> Vec<String> {
    let plain: Vec<&str> = colors.iter().map(|c| name(*c)).collect();
    let numbered = |(i, n): (usize, &&str)| match plain[..i].iter().filter(|p| p == &n).count() {
        0 => n.to_string(),
        before => format!("{n} {}", before + 1),
    };
    plain.iter().enumerate().map(numbered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_called_what_one_would_call_them() {
        let named = |c| name(oklab_from_rgb(Rgb(c)));
        assert_eq!(named([255, 0, 0]), "red");
        assert_eq!(named([0, 0, 128]), "dark blue");
        assert_eq!(named([250, 250, 248]), "white");
        assert_eq!(named([0, 158, 224]), "cyan");
        assert_eq!(named([90, 60, 35]), "brown");
        let twice = [[255, 0, 0], [10, 10, 10], [215, 20, 20]].map(|c| oklab_from_rgb(Rgb(c)));
        assert_eq!(unique_names(&twice), ["red", "black", "red 2"]);
    }
}
