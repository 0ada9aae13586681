//! Values of an SVG as browsers read them and usvg doesn't: CSS lengths, `calc()`, transforms with units, modern colours.
use kurbo::Affine;

use super::svg_css::split_outside;

/// User units an inch.
const PX_PER_INCH: f64 = 96.0;
/// Size of `rem`, px.
const ROOT_FONT: f64 = 16.0;
/// How deep sums of `calc()` may be nested.
const MAX_NESTING: usize = 32;

/// What relative lengths refer to, user units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Size of the nearest viewport.
    pub(super) viewport: (f64, f64),
    /// Size of the page, which `vw` and `vh` are shares of.
    pub(super) page: (f64, f64),
    /// Size of `em`.
    pub(super) font: f64,
}

/// Which side of the viewport a percentage is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    X,
    Y,
    Diagonal,
}

impl Scale {
    fn percent(&self, axis: Axis) -> f64 {
        let (w, h) = self.viewport;
        0.01 * match axis {
            Axis::X => w,
            Axis::Y => h,
            Axis::Diagonal => w.hypot(h) / std::f64::consts::SQRT_2,
        }
    }

    /// User units per unit; `None` for a unit that doesn't exist.
    fn unit(&self, unit: &str, axis: Axis) -> Option<f64> {
        let (w, h) = self.page;
        Some(match unit.to_ascii_lowercase().as_str() {
            "" | "px" => 1.0,
            "mm" => PX_PER_INCH / 25.4,
            "cm" => PX_PER_INCH / 2.54,
            "q" => PX_PER_INCH / 101.6,
            "in" => PX_PER_INCH,
            "pt" => PX_PER_INCH / 72.0,
            "pc" => PX_PER_INCH / 6.0,
            "em" => self.font,
            "ex" | "ch" => 0.5 * self.font,
            "rem" => ROOT_FONT,
            "vw" | "svw" | "lvw" | "dvw" | "vi" => 0.01 * w,
            "vh" | "svh" | "lvh" | "dvh" | "vb" => 0.01 * h,
            "vmin" => 0.01 * w.min(h),
            "vmax" => 0.01 * w.max(h),
            "%" => self.percent(axis),
            _ => return None,
        })
    }

    /// A length in user units.
    pub(super) fn length(&self, text: &str, axis: Axis) -> Option<f64> {
        let value = self.sum(text.trim(), axis, 0)?;
        value.is_finite().then_some(value)
    }

    /// One number with its unit, or a mathematical function.
    fn term(&self, text: &str, axis: Axis, depth: usize) -> Option<f64> {
        let text = text.trim();
        if let Some(body) = text.strip_suffix(')') {
            let (name, body) = body.split_once('(')?;
            let values = |s: &Self| {
                split_outside(body, ',').into_iter().map(|p| s.sum(p, axis, depth + 1)).collect::<Option<Vec<_>>>()
            };
            return match (name.trim().to_ascii_lowercase().as_str(), values(self)?.as_slice()) {
                ("" | "calc" | "-webkit-calc", [v]) => Some(*v),
                ("min", all) => all.iter().copied().reduce(f64::min),
                ("max", all) => all.iter().copied().reduce(f64::max),
                ("clamp", [low, v, high]) => Some(v.min(*high).max(*low)),
                ("abs", [v]) => Some(v.abs()),
                _ => None,
            };
        }
        let (number, unit) = number(text)?;
        Some(number * self.unit(unit, axis)?)
    }

    /// Sums and products, within `calc()` or outside.
    fn sum(&self, text: &str, axis: Axis, depth: usize) -> Option<f64> {
        if depth > MAX_NESTING {
            return None;
        }
        if depth == 0 {
            return self.term(text, axis, 0);
        }
        // Plus and minus stand between blanks; the last one splits first, so that they go from left to right.
        let mut open = 0i32;
        let bytes = text.as_bytes();
        let blank = |i: usize| bytes.get(i) == Some(&b' ');
        for i in (0..bytes.len()).rev() {
            match bytes[i] {
                b')' => open += 1,
                b'(' => open -= 1,
                sign @ (b'+' | b'-') if open == 0 && i > 0 && blank(i - 1) && blank(i + 1) => {
                    let (left, right) =
                        (self.sum(&text[..i], axis, depth + 1)?, self.sum(&text[i + 1..], axis, depth + 1)?);
                    return Some(if sign == b'+' { left + right } else { left - right });
                }
                _ => {}
            }
        }
        let mut open = 0i32;
        for i in (0..bytes.len()).rev() {
            match bytes[i] {
                b')' => open += 1,
                b'(' => open -= 1,
                sign @ (b'*' | b'/') if open == 0 => {
                    let (left, right) =
                        (self.sum(&text[..i], axis, depth + 1)?, self.sum(&text[i + 1..], axis, depth + 1)?);
                    return Some(if sign == b'*' { left * right } else { left / right });
                }
                _ => {}
            }
        }
        self.term(text, axis, depth)
    }
}

/// A number and what follows it.
pub(super) fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let bytes = text.as_bytes();
    let mut end = 0;
    let mut digits = false;
    while end < bytes.len() {
        match bytes[end] {
            b'0'..=b'9' => digits = true,
            b'+' | b'-' if end == 0 => {}
            b'.' if !text[..end].contains('.') => {}
            _ => break,
        }
        end += 1;
    }
    if !digits {
        return None;
    }
    // An exponent, unless it is the start of `em` or `ex`.
    if end < bytes.len() && matches!(bytes[end], b'e' | b'E') {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let tail = text[end + 1 + sign..].bytes().take_while(u8::is_ascii_digit).count();
        if tail > 0 {
            end += 1 + sign + tail;
        }
    }
    let value: f64 = text[..end].trim_start_matches('+').parse().ok()?;
    value.is_finite().then(|| (value, text[end..].trim()))
}

/// A number written with a decimal comma, `100,0mm`, as meant.
pub(super) fn decimal_comma(text: &str) -> Option<String> {
    let (whole, rest) = text.trim().split_once(',')?;
    let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
    let fits = digits(whole.trim_start_matches(['+', '-'])) && rest.starts_with(|c: char| c.is_ascii_digit());
    (fits && !rest.contains([',', ' ', '.'])).then(|| format!("{whole}.{rest}"))
}

/// An angle in degrees.
fn angle(text: &str) -> Option<f64> {
    let (value, unit) = number(text)?;
    Some(match unit.to_ascii_lowercase().as_str() {
        "" | "deg" => value,
        "rad" => value.to_degrees(),
        "grad" => 0.9 * value,
        "turn" => 360.0 * value,
        _ => return None,
    })
}

fn factor(text: &str) -> Option<f64> {
    let (value, unit) = number(text)?;
    match unit {
        "" => Some(value),
        "%" => Some(0.01 * value),
        _ => None,
    }
}

/// A list of CSS transform functions as one map; `box_size` is what percentages of a translation are of.
pub(super) fn transform(text: &str, scale: &Scale, box_size: (f64, f64)) -> Option<Affine> {
    let (mut all, mut rest) = (Affine::IDENTITY, text.trim());
    if rest.eq_ignore_ascii_case("none") {
        return Some(all);
    }
    let of_box = Scale { viewport: box_size, ..*scale };
    while !rest.is_empty() {
        let (name, after) = rest.split_once('(')?;
        let close = closing(after)?;
        let body = &after[..close];
        rest = after[close + 1..].trim_start_matches(|c: char| c.is_whitespace() || c == ',');
        let mut arguments: Vec<&str> = split_outside(body, ',').into_iter().map(str::trim).collect();
        if let [one] = arguments[..] {
            arguments = split_outside(one, ' ').into_iter().filter(|a| !a.is_empty()).collect();
        }
        all *= function(name.trim(), &arguments, &of_box)?;
    }
    Some(all)
}

/// Where the bracket closes that was open before `text`.
pub(super) fn closing(text: &str) -> Option<usize> {
    let mut open = 1usize;
    let at = text.char_indices().find(|(_, c)| {
        open = match c {
            '(' => open + 1,
            ')' => open - 1,
            _ => open,
        };
        open == 0
    });
    at.map(|(at, _)| at)
}

fn function(name: &str, arguments: &[&str], scale: &Scale) -> Option<Affine> {
    let x = |t: &str| scale.length(t, Axis::X);
    let y = |t: &str| scale.length(t, Axis::Y);
    Some(match (name.to_ascii_lowercase().as_str(), arguments) {
        ("translate" | "translatex", [a]) => Affine::translate((x(a)?, 0.0)),
        ("translatey", [a]) => Affine::translate((0.0, y(a)?)),
        ("translate", [a, b]) => Affine::translate((x(a)?, y(b)?)),
        ("translate3d", [a, b, c]) if scale.length(c, Axis::X)? == 0.0 => Affine::translate((x(a)?, y(b)?)),
        ("scale", [a]) => Affine::scale(factor(a)?),
        ("scalex", [a]) => Affine::scale_non_uniform(factor(a)?, 1.0),
        ("scaley", [a]) => Affine::scale_non_uniform(1.0, factor(a)?),
        ("scale", [a, b]) => Affine::scale_non_uniform(factor(a)?, factor(b)?),
        ("rotate" | "rotatez", [a]) => Affine::rotate(angle(a)?.to_radians()),
        ("rotate", [a, cx, cy]) => Affine::rotate_about(angle(a)?.to_radians(), kurbo::Point::new(x(cx)?, y(cy)?)),
        ("skew" | "skewx", [a]) => Affine::skew(angle(a)?.to_radians().tan(), 0.0),
        ("skewy", [a]) => Affine::skew(0.0, angle(a)?.to_radians().tan()),
        ("skew", [a, b]) => Affine::skew(angle(a)?.to_radians().tan(), angle(b)?.to_radians().tan()),
        ("matrix", [..]) if arguments.len() == 6 => {
            let mut m = [0.0; 6];
            for (m, a) in m.iter_mut().zip(arguments) {
                *m = scale.length(a, Axis::X)?;
            }
            Affine::new(m)
        }
        _ => return None,
    })
}

/// Centre of a transform, in user units from the corner of a box of this size.
pub(super) fn origin(text: &str, scale: &Scale, (w, h): (f64, f64)) -> Option<(f64, f64)> {
    let of_box = Scale { viewport: (w, h), ..*scale };
    let (mut x, mut y) = (None, None);
    for word in split_outside(text.trim(), ' ').into_iter().filter(|w| !w.is_empty()).take(2) {
        match word.to_ascii_lowercase().as_str() {
            "left" => x = Some(0.0),
            "right" => x = Some(w),
            "top" => y = Some(0.0),
            "bottom" => y = Some(h),
            "center" if x.is_none() => x = Some(0.5 * w),
            "center" => y = Some(0.5 * h),
            word if x.is_none() => x = Some(of_box.length(word, Axis::X)?),
            word => y = Some(of_box.length(word, Axis::Y)?),
        }
    }
    Some((x.unwrap_or(0.5 * w), y.unwrap_or(0.5 * h)))
}

/// A paint in a spelling that usvg reads; `None` where it isn't a paint.
pub(super) fn paint(text: &str) -> Option<String> {
    let text = text.trim();
    let lower = text.to_ascii_lowercase();
    if let "none" | "inherit" | "transparent" | "context-fill" | "context-stroke" = lower.as_str() {
        return Some(lower);
    }
    if lower == "currentcolor" {
        return Some("currentColor".into());
    }
    if lower.starts_with("url(") {
        let end = find_close(text)?;
        let link = text[4..end].trim().trim_matches(['"', '\'']).trim();
        let link = link.strip_prefix('#')?;
        let fallback = text[end + 1..].trim();
        return match fallback {
            "" => Some(format!("url(#{link})")),
            f => Some(format!("url(#{link}) {}", paint(f)?)),
        };
    }
    // Colours with a profile's behind them are read, too.
    color(text).or_else(|| svgtypes::Paint::from_str(text).is_ok().then(|| text.to_string()))
}

/// A colour in a spelling that usvg reads.
pub(super) fn color(text: &str) -> Option<String> {
    let text = text.trim();
    if text.parse::<svgtypes::Color>().is_ok() {
        return Some(text.to_string());
    }
    let lower = text.to_ascii_lowercase();
    if lower.parse::<svgtypes::Color>().is_ok() || lower == "transparent" {
        return Some(lower);
    }
    let (name, body) = lower.split_once('(')?;
    let body = body.strip_suffix(')')?.replace(['/', ','], " ");
    let mut words: Vec<&str> = body.split_whitespace().collect();
    let space = if name == "color" && !words.is_empty() { words.remove(0) } else { "" };
    if !(3..=4).contains(&words.len()) {
        return None;
    }
    let share = |w: &str, full: f64| match number(w) {
        Some((v, "%")) => Some(0.01 * v * full),
        Some((v, "")) => Some(v),
        None if w == "none" => Some(0.0),
        _ => None,
    };
    let alpha = words.get(3).map_or(Some(1.0), |a| share(a, 1.0))?;
    let hue = |w: &str| if w == "none" { Some(0.0) } else { angle(w) };
    let rgb = match name.trim() {
        "rgb" | "rgba" => {
            [share(words[0], 255.0)?, share(words[1], 255.0)?, share(words[2], 255.0)?].map(|v| v / 255.0)
        }
        "hsl" | "hsla" => {
            let (h, s, l) = (hue(words[0])?, 0.01 * share(words[1], 100.0)?, 0.01 * share(words[2], 100.0)?);
            hsl(h, s, l)
        }
        "hwb" => {
            let (h, w, b) = (hue(words[0])?, 0.01 * share(words[1], 100.0)?, 0.01 * share(words[2], 100.0)?);
            let sum = (w + b).max(1.0);
            hsl(h, 1.0, 0.5).map(|c| c * (1.0 - (w + b) / sum) + w / sum)
        }
        "oklab" => oklab(share(words[0], 1.0)?, share(words[1], 0.4)?, share(words[2], 0.4)?),
        "oklch" => {
            let (l, c, h) = (share(words[0], 1.0)?, share(words[1], 0.4)?, hue(words[2])?.to_radians());
            oklab(l, c * h.cos(), c * h.sin())
        }
        "lab" => lab(share(words[0], 100.0)?, share(words[1], 125.0)?, share(words[2], 125.0)?),
        "lch" => {
            let (l, c, h) = (share(words[0], 100.0)?, share(words[1], 150.0)?, hue(words[2])?.to_radians());
            lab(l, c * h.cos(), c * h.sin())
        }
        "color" if space == "srgb" => [share(words[0], 1.0)?, share(words[1], 1.0)?, share(words[2], 1.0)?],
        "color" if space == "srgb-linear" => {
            [share(words[0], 1.0)?, share(words[1], 1.0)?, share(words[2], 1.0)?].map(encode)
        }
        _ => return None,
    };
    let [r, g, b] = rgb.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8);
    Some(match alpha < 1.0 {
        true => format!("rgba({r}, {g}, {b}, {})", alpha.max(0.0)),
        false => format!("#{r:02x}{g:02x}{b:02x}"),
    })
}

fn find_close(text: &str) -> Option<usize> {
    text.find(')')
}

/// Hue in degrees, saturation and lightness as shares.
fn hsl(h: f64, s: f64, l: f64) -> [f64; 3] {
    [0.0, 8.0, 4.0].map(|n| {
        let k = (n + h.rem_euclid(360.0) / 30.0).rem_euclid(12.0);
        l - s * l.min(1.0 - l) * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0)
    })
}

/// The transfer function of sRGB.
fn encode(c: f64) -> f64 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// Ottosson's Oklab to sRGB.
fn oklab(l: f64, a: f64, b: f64) -> [f64; 3] {
    let cone = |x: f64, y: f64| (l + x * a + y * b).powi(3);
    let (l, m, s) = (
        cone(0.396_337_777_4, 0.215_803_757_3),
        cone(-0.105_561_345_8, -0.063_854_172_8),
        cone(-0.089_484_177_5, -1.291_485_548),
    );
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
    .map(encode)
}

/// CIE Lab of white D50 to sRGB (CSS Color 4, Bradford adaption).
fn lab(l: f64, a: f64, b: f64) -> [f64; 3] {
    let fy = (l + 16.0) / 116.0;
    let back = |f: f64| if f > 6.0 / 29.0 { f.powi(3) } else { (116.0 * f - 16.0) / (24_389.0 / 27.0) };
    let (x, y, z) = (0.964_295_676 * back(fy + a / 500.0), back(fy), 0.825_104_603 * back(fy - b / 200.0));
    [
        3.134_136 * x - 1.617_386 * y - 0.490_662 * z,
        -0.978_795 * x + 1.916_254 * y + 0.033_443 * z,
        0.071_955 * x - 0.228_977 * y + 1.405_387 * z,
    ]
    .map(encode)
}
