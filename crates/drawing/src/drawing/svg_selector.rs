//! Selectors of style sheets: by type, id, class, attribute and place among siblings.
use super::svg_css::{find_outside, split_outside};

/// How deep selectors may be nested.
const MAX_NESTING: usize = 16;

/// Compounds from left to right, each with how it hangs on the one before.
#[derive(Clone, Debug)]
pub(super) struct Selector(pub(super) Vec<(char, Vec<Simple>)>);

#[derive(Clone, Debug)]
pub(super) enum Simple {
    Type(String),
    Id(String),
    Class(String),
    Attribute(String, char, String),
    Root,
    Empty,
    /// a n + b, of its type, from the last.
    Nth(i64, i64, bool, bool),
    Any(Vec<Selector>, bool),
    Not(Vec<Selector>),
    /// What a drawing on paper is never in: hovered, focused, first letters.
    Never,
}

impl Selector {
    fn simples(&self) -> impl Iterator<Item = &Simple> {
        self.0.iter().flat_map(|(_, c)| c)
    }

    pub(super) fn specificity(&self) -> [usize; 3] {
        let mut sum = [0; 3];
        for s in self.simples() {
            let own = match s {
                Simple::Type(_) => [0, 0, 1],
                Simple::Id(_) => [1, 0, 0],
                Simple::Any(_, false) => [0; 3],
                Simple::Any(list, true) | Simple::Not(list) => {
                    list.iter().map(Selector::specificity).max().unwrap_or_default()
                }
                _ => [0, 1, 0],
            };
            (0..3).for_each(|i| sum[i] += own[i]);
        }
        sum
    }

    /// Whether a place among siblings matters.
    pub(super) fn counts(&self) -> bool {
        self.simples().any(|s| match s {
            Simple::Nth(..) => true,
            Simple::Any(list, _) | Simple::Not(list) => list.iter().any(Selector::counts),
            _ => false,
        })
    }
}

/// Reads one selector; `None` where it isn't understood.
pub(super) fn selector(text: &str, depth: usize) -> Option<Selector> {
    if text.is_empty() || depth > MAX_NESTING {
        return None;
    }
    let (mut parts, mut compound, mut combinator) = (Vec::new(), Vec::new(), ' ');
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        match c {
            c if c.is_whitespace() || matches!(c, '>' | '+' | '~') => {
                let end =
                    rest.find(|c: char| !c.is_whitespace() && !matches!(c, '>' | '+' | '~')).unwrap_or(rest.len());
                let mark = rest[..end].trim();
                if compound.is_empty() || mark.len() > 1 || end == rest.len() {
                    return None;
                }
                parts.push((combinator, std::mem::take(&mut compound)));
                combinator = mark.chars().next().unwrap_or(' ');
                rest = &rest[end..];
            }
            '*' => {
                // Holds for all: an empty list of what it must not be.
                compound.push(Simple::Not(Vec::new()));
                rest = &rest[1..];
            }
            _ => {
                let (simple, after) = simple(rest, depth)?;
                compound.push(simple);
                rest = after;
            }
        }
    }
    if compound.is_empty() {
        return None;
    }
    parts.push((combinator, compound));
    Some(Selector(parts))
}

fn simple(text: &str, depth: usize) -> Option<(Simple, &str)> {
    let ident = |t: &'_ str| t.find(|c: char| !(c.is_alphanumeric() || matches!(c, '-' | '_'))).unwrap_or(t.len());
    match text.as_bytes()[0] {
        b'#' | b'.' => {
            let end = 1 + ident(&text[1..]);
            let name = text[1..end].to_string();
            let simple = if text.starts_with('#') { Simple::Id(name.clone()) } else { Simple::Class(name.clone()) };
            (!name.is_empty()).then_some((simple, &text[end..]))
        }
        b'[' => {
            let end = find_outside(&text[1..], &[']'])? + 1;
            Some((attribute(&text[1..end])?, &text[end + 1..]))
        }
        b':' => {
            let body = text.trim_start_matches(':');
            let end = ident(body);
            let name = body[..end].to_ascii_lowercase();
            let after = &body[end..];
            let (argument, after) = match after.strip_prefix('(') {
                Some(a) => {
                    let close = find_outside(a, &[')'])?;
                    (a[..close].trim(), &a[close + 1..])
                }
                None => ("", after),
            };
            Some((pseudo(&name, argument, text.starts_with("::"), depth)?, after))
        }
        _ => {
            let end = ident(text);
            let name = text[..end].to_string();
            let after = &text[end..];
            // A namespace before the name: `svg|path`.
            if let Some(local) = after.strip_prefix('|') {
                let end = ident(local);
                return (end > 0).then(|| (Simple::Type(local[..end].to_string()), &local[end..]));
            }
            (!name.is_empty()).then_some((Simple::Type(name), after))
        }
    }
}

fn attribute(text: &str) -> Option<Simple> {
    let bare = |v: &str| v.trim().trim_matches(|c| c == '"' || c == '\'').to_string();
    let Some(at) = text.find('=') else { return Some(Simple::Attribute(local(text), ' ', String::new())) };
    let (name, value) = (&text[..at], bare(&text[at + 1..]));
    match name.chars().last()? {
        c @ ('~' | '|' | '^' | '$' | '*') => Some(Simple::Attribute(local(&name[..name.len() - 1]), c, value)),
        _ => Some(Simple::Attribute(local(name), '=', value)),
    }
}

/// An attribute's name without prefix and escapes.
fn local(name: &str) -> String {
    name.replace("\\:", "|").rsplit(['|', ':']).next().unwrap_or("").trim().to_string()
}

fn pseudo(name: &str, argument: &str, element: bool, depth: usize) -> Option<Simple> {
    let list =
        || split_outside(argument, ',').into_iter().map(|s| selector(s.trim(), depth + 1)).collect::<Option<Vec<_>>>();
    let nth = |of_type, last| nth(argument).map(|(a, b)| Simple::Nth(a, b, of_type, last));
    if element {
        return Some(Simple::Never);
    }
    Some(match name {
        "root" => Simple::Root,
        "empty" => Simple::Empty,
        "first-child" => Simple::Nth(0, 1, false, false),
        "last-child" => Simple::Nth(0, 1, false, true),
        "first-of-type" => Simple::Nth(0, 1, true, false),
        "last-of-type" => Simple::Nth(0, 1, true, true),
        "nth-child" => nth(false, false)?,
        "nth-last-child" => nth(false, true)?,
        "nth-of-type" => nth(true, false)?,
        "nth-last-of-type" => nth(true, true)?,
        "only-child" | "only-of-type" => {
            let of_type = name == "only-of-type";
            let ends = vec![Simple::Nth(0, 1, of_type, false), Simple::Nth(0, 1, of_type, true)];
            Simple::Any(vec![Selector(vec![(' ', ends)])], true)
        }
        "not" => Simple::Not(list()?),
        "is" | "matches" | "-webkit-any" => Simple::Any(list()?, true),
        "where" => Simple::Any(list()?, false),
        "hover" | "active" | "focus" | "focus-within" | "focus-visible" | "visited" | "target" | "before" | "after"
        | "first-letter" | "first-line" | "selection" | "link" | "any-link" => Simple::Never,
        _ => return None,
    })
}

/// `odd`, `even`, `3`, `2n+1`, `-n + 3`.
fn nth(text: &str) -> Option<(i64, i64)> {
    let text = text.to_ascii_lowercase().replace(' ', "");
    match text.as_str() {
        "odd" => return Some((2, 1)),
        "even" => return Some((2, 0)),
        _ => {}
    }
    let small = |t: &str| t.parse::<i64>().ok().filter(|n| n.abs() < 1_000_000_000);
    match text.split_once('n') {
        None => Some((0, small(&text)?)),
        Some((a, b)) => {
            let a = match a {
                "" | "+" => 1,
                "-" => -1,
                a => small(a)?,
            };
            Some((a, if b.is_empty() { 0 } else { small(b)? }))
        }
    }
}
