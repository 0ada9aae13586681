//! A part of a drawing: some inks, strokes from one to another, what lies in a rectangle of the sheet.
use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use crate::drawing::{Drawing, StrokeRef};

/// What of a drawing is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// The strokes of these inks.
    Inks(BTreeSet<String>),
    /// Strokes from one to another, both included, counted from 1 in the order of drawing.
    Strokes(usize, usize),
    /// Strokes that lie wholly in a rectangle of the sheet: left, bottom, right, top, mm from the sheet's middle.
    Rectangle([f64; 4]),
}

/// Why a part can't be read, or isn't there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// The text means no part.
    #[error(
        "`{0}` is no part of a drawing: say inks=RED,BLUE, strokes=10-20 or rect=LEFT,BOTTOM,RIGHT,TOP (mm from the sheet's middle)"
    )]
    Text(String),
    /// An ink that the drawing hasn't.
    #[error("the drawing has no ink {ink}, but {inks}")]
    NoSuchInk {
        /// The ink asked for.
        ink: String,
        /// Those that there are.
        inks: String,
    },
    /// A part with nothing in it.
    #[error("{part}: none of the drawing's {strokes} strokes is in this part")]
    Nothing {
        /// The part.
        part: String,
        /// Strokes of the drawing.
        strokes: usize,
    },
}

impl FromStr for Part {
    type Err = PartError;

    fn from_str(text: &str) -> Result<Self, PartError> {
        let wrong = || PartError::Text(text.to_string());
        let (what, which) = text.split_once('=').ok_or_else(wrong)?;
        match what {
            "inks" => {
                let inks: BTreeSet<String> = which.split(',').map(|i| i.trim().to_string()).collect();
                if inks.contains("") { Err(wrong()) } else { Ok(Self::Inks(inks)) }
            }
            "strokes" => {
                let (from, to) = which.split_once('-').unwrap_or((which, which));
                let count = |s: &str| s.trim().parse::<usize>().ok().filter(|n| *n > 0).ok_or_else(wrong);
                let (from, to) = (count(from)?, count(to)?);
                if from <= to { Ok(Self::Strokes(from, to)) } else { Err(wrong()) }
            }
            "rect" => {
                let sides: Option<Vec<f64>> =
                    which.split(',').map(|s| s.trim().parse::<f64>().ok().filter(|x| x.is_finite())).collect();
                let sides: [f64; 4] = sides.and_then(|s| s.try_into().ok()).ok_or_else(wrong)?;
                if sides[0] < sides[2] && sides[1] < sides[3] { Ok(Self::Rectangle(sides)) } else { Err(wrong()) }
            }
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Inks(inks) => write!(f, "inks={}", inks.iter().cloned().collect::<Vec<_>>().join(",")),
            Self::Strokes(from, to) => write!(f, "strokes={from}-{to}"),
            Self::Rectangle([a, b, c, d]) => write!(f, "rect={a},{b},{c},{d}"),
        }
    }
}

impl Part {
    /// This part of a drawing. Layers stay where they are, and may be empty.
    ///
    /// # Errors
    /// Nothing of the drawing is in it.
    pub(crate) fn of(&self, drawing: &Drawing) -> Result<Drawing, PartError> {
        if let Self::Inks(inks) = self
            && let Some(missing) = inks.iter().find(|i| drawing.layers.iter().all(|l| l.name != **i))
        {
            let known = drawing.layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(PartError::NoSuchInk { ink: missing.clone(), inks: known });
        }
        let kept: Vec<StrokeRef> = drawing
            .sequence()
            .into_iter()
            .enumerate()
            .filter(|(i, r)| self.has(drawing, *i, r))
            .map(|(_, r)| r)
            .collect();
        if kept.is_empty() {
            return Err(PartError::Nothing { part: self.to_string(), strokes: drawing.stroke_count() });
        }
        let mut part = drawing.clone();
        let mut place = vec![Vec::new(); drawing.layers.len()];
        for (l, layer) in part.layers.iter_mut().enumerate() {
            let mine: BTreeSet<usize> = kept.iter().filter(|r| r.layer == l).map(|r| r.stroke).collect();
            let mut next = 0;
            place[l] = (0..layer.strokes.len())
                .map(|i| {
                    let at = next;
                    next += usize::from(mine.contains(&i));
                    at
                })
                .collect();
            let mut i = 0;
            layer.strokes.retain(|_| {
                i += 1;
                mine.contains(&(i - 1))
            });
        }
        part.order = kept.iter().map(|r| StrokeRef { layer: r.layer, stroke: place[r.layer][r.stroke] }).collect();
        Ok(part)
    }

    fn has(&self, drawing: &Drawing, index: usize, r: &StrokeRef) -> bool {
        let layer = &drawing.layers[r.layer];
        match self {
            Self::Inks(inks) => inks.contains(&layer.name),
            Self::Strokes(from, to) => (*from..=*to).contains(&(index + 1)),
            Self::Rectangle([left, bottom, right, top]) => layer.strokes[r.stroke].points.iter().all(|p| {
                let (x, y) = (p.x * 1e3, p.y * 1e3);
                (*left..=*right).contains(&x) && (*bottom..=*top).contains(&y)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{InkLayer, Stroke};
    use crate::math::Rgb;
    use nalgebra::Point2;
    use proptest::prelude::*;

    fn drawing() -> Drawing {
        let line = |x: f64| Stroke::new(vec![Point2::new(x, 0.0), Point2::new(x, 0.01)]);
        let layer = |name: &str, xs: &[f64]| InkLayer {
            name: name.into(),
            color: Rgb([0; 3]),
            width_hint: None,
            strokes: xs.iter().map(|x| line(*x)).collect(),
        };
        Drawing::new(0.1, 0.1, vec![layer("red", &[0.0, 0.01, 0.02]), layer("blue", &[-0.01, -0.02])])
    }

    #[test]
    fn inks_strokes_and_rectangles_are_drawn_alone() {
        let count = |part: &str| {
            let part = part.parse::<Part>().unwrap().of(&drawing()).unwrap();
            assert_eq!(part.sequence().len(), part.stroke_count());
            [part.layers[0].strokes.len(), part.layers[1].strokes.len()]
        };
        assert_eq!(count("inks=blue"), [0, 2]);
        assert_eq!(count("strokes=2-4"), [2, 1]);
        assert_eq!(count("strokes=3"), [1, 0]);
        assert_eq!(count("rect=-15,-1,15,11"), [2, 1]);
        assert!(matches!("inks=green".parse::<Part>().unwrap().of(&drawing()), Err(PartError::NoSuchInk { .. })));
        assert!(matches!("strokes=9-12".parse::<Part>().unwrap().of(&drawing()), Err(PartError::Nothing { .. })));
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused_and_written_back_the_same(text in "(inks|strokes|rect)?=?[a-z0-9,.\\-]{0,16}") {
            if let Ok(part) = text.parse::<Part>() {
                prop_assert_eq!(part.to_string().parse::<Part>(), Ok(part));
            }
        }
    }
}
