//! Style sheets of an SVG: which rule holds for which element.
//!
//! Understood: selectors by type, id, class, attribute and place among siblings, `:root`, `:not()`, `:is()`, `:where()`,
//! all combinators; `@media`, `@supports` and `@layer` blocks; `!important`. A screen shows the drawing, in light colours.
use std::cell::Cell;
use std::collections::{BTreeMap, HashMap};

use usvg::roxmltree::{Node, NodeId};

use super::svg_selector::{Selector, Simple, selector};

/// Elements looked at for selectors beyond which no more are: sheets that are this dear are mistakes.
const MAX_STEPS: u64 = 500_000_000;
/// How deep blocks may be nested.
const MAX_NESTING: usize = 16;

/// One `name: value`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Declaration {
    /// In lower case, but for custom properties.
    pub(super) name: String,
    pub(super) value: String,
    pub(super) important: bool,
}

struct Rule {
    selector: Selector,
    declarations: std::rc::Rc<Vec<Declaration>>,
}

/// All rules of a document.
#[derive(Default)]
pub(super) struct Sheet {
    rules: Vec<Rule>,
    /// What isn't understood, with its line.
    pub(super) unknown: Vec<(usize, String)>,
    steps: Cell<u64>,
    places: HashMap<NodeId, Place>,
}

/// Place of an element among its siblings, and among those of its name: from the first and from the last, from 1.
#[derive(Clone, Copy, Default)]
struct Place {
    child: (usize, usize),
    of_type: (usize, usize),
}

impl Sheet {
    /// Reads one `style` element's text, which starts on `line`.
    pub(super) fn add(&mut self, text: &str, line: usize) {
        let text = without_comments(text).replace("<!--", "    ").replace("-->", "   ");
        self.block(&text, line, 0);
    }

    /// Sorts the rules and counts siblings; to be called once after the last `add`.
    pub(super) fn finish(&mut self, root: Node) {
        self.rules.sort_by_cached_key(|r| r.selector.specificity());
        if self.rules.iter().any(|r| r.selector.counts()) {
            for parent in root.ancestors().last().unwrap_or(root).descendants() {
                self.count(parent);
            }
        }
    }

    fn count(&mut self, parent: Node) {
        let children: Vec<Node> = parent.children().filter(Node::is_element).collect();
        let (n, mut seen) = (children.len(), BTreeMap::<&str, usize>::new());
        for (i, c) in children.iter().enumerate() {
            let of_type = seen.entry(c.tag_name().name()).or_default();
            *of_type += 1;
            self.places.insert(c.id(), Place { child: (i + 1, n - i), of_type: (*of_type, 0) });
        }
        for c in &children {
            if let Some(p) = self.places.get_mut(&c.id()) {
                p.of_type.1 = seen[c.tag_name().name()] - p.of_type.0 + 1;
            }
        }
    }

    fn block(&mut self, text: &str, line: usize, depth: usize) {
        let (mut rest, mut line) = (text, line);
        let newlines = |t: &str| t.matches('\n').count();
        while let Some(at) = find_outside(rest, &['{', ';', '}']) {
            let here = line + leading_newlines(rest);
            let (prelude, mark) = (rest[..at].trim(), rest.as_bytes()[at]);
            if mark != b'{' {
                if prelude.starts_with("@import") {
                    self.unknown.push((here, "style sheet `@import`: not read".into()));
                }
                line += newlines(&rest[..at]);
                rest = &rest[at + 1..];
                continue;
            }
            let body = &rest[at + 1..];
            let end = block_end(body);
            let inside = &body[..end];
            let inside_line = line + newlines(&rest[..at]);
            line = inside_line + newlines(inside);
            rest = body.get(end + 1..).unwrap_or("");
            match prelude.strip_prefix('@') {
                Some(rule) if depth < MAX_NESTING => self.at_rule(rule, inside, here, inside_line, depth),
                Some(_) => self.unknown.push((here, "style sheet rules nested too deep: not read".into())),
                None => self.rule(prelude, inside, here),
            }
        }
        if !rest.trim().is_empty() {
            self.unknown
                .push((line + leading_newlines(rest), format!("style sheet ends within `{}`: not read", short(rest))));
        }
    }

    fn at_rule(&mut self, rule: &str, inside: &str, line: usize, inside_line: usize, depth: usize) {
        let lower = rule.to_ascii_lowercase();
        let (name, query) =
            lower.split_at(lower.find(|c: char| !c.is_ascii_alphabetic() && c != '-').unwrap_or(lower.len()));
        match name {
            "media" => match media(query) {
                Some(true) => self.block(inside, inside_line, depth + 1),
                Some(false) => {}
                None => {
                    self.unknown.push((line, format!("style sheet rule `@{}`: not understood, not read", short(rule))))
                }
            },
            "supports" | "layer" => self.block(inside, inside_line, depth + 1),
            "font-face" | "keyframes" | "-webkit-keyframes" | "page" | "property" | "font-feature-values" => {}
            _ => self.unknown.push((line, format!("style sheet rule `@{}`: not understood, not read", short(rule)))),
        }
    }

    fn rule(&mut self, prelude: &str, inside: &str, line: usize) {
        if find_outside(inside, &['{']).is_some() {
            self.unknown.push((line, format!("style sheet rule nested in `{}`: not read", short(prelude))));
        }
        let declarations = std::rc::Rc::new(declarations(inside));
        for text in split_outside(prelude, ',') {
            match selector(text.trim(), 0) {
                Some(selector) => self.rules.push(Rule { selector, declarations: declarations.clone() }),
                None => self.unknown.push((
                    line,
                    format!("style sheet selector `{}`: not understood, its rule doesn't count", short(text)),
                )),
            }
        }
    }

    /// Declarations that hold for an element, the strongest last within each importance.
    pub(super) fn of<'s>(&'s self, node: Node<'_, '_>) -> impl Iterator<Item = &'s Declaration> {
        let hit: Vec<_> = self.rules.iter().filter(|r| self.matches(&r.selector, node)).collect();
        hit.into_iter().flat_map(|r| r.declarations.iter())
    }

    /// Whether the sheets were too dear to be applied to the end.
    pub(super) fn exhausted(&self) -> bool {
        self.steps.get() > MAX_STEPS
    }

    fn matches(&self, selector: &Selector, node: Node) -> bool {
        self.matches_from(&selector.0, node)
    }

    fn matches_from(&self, parts: &[(char, Vec<Simple>)], node: Node) -> bool {
        self.steps.set(self.steps.get() + 1);
        let Some(((combinator, compound), left)) = parts.split_last() else { return true };
        if self.exhausted() || !compound.iter().all(|s| self.holds(s, node)) {
            return false;
        }
        if left.is_empty() {
            return true;
        }
        let parent = |n: Node<'_, '_>| n.parent().filter(Node::is_element).map(|p| p.id());
        let doc = node.document();
        let get = |id: Option<NodeId>| id.and_then(|id| doc.get_node(id));
        match combinator {
            '>' => get(parent(node)).is_some_and(|p| self.matches_from(left, p)),
            '+' => node.prev_sibling_element().is_some_and(|s| self.matches_from(left, s)),
            '~' => {
                let mut at = node;
                while let Some(s) = at.prev_sibling_element() {
                    if self.matches_from(left, s) {
                        return true;
                    }
                    if self.exhausted() {
                        return false;
                    }
                    at = s;
                }
                false
            }
            _ => node.ancestors().skip(1).filter(Node::is_element).any(|a| self.matches_from(left, a)),
        }
    }

    fn holds(&self, simple: &Simple, node: Node) -> bool {
        match simple {
            Simple::Type(name) => node.tag_name().name() == name,
            Simple::Id(id) => node.attribute("id") == Some(id),
            Simple::Class(class) => {
                node.attribute("class").is_some_and(|c| c.split_ascii_whitespace().any(|c| c == class))
            }
            Simple::Attribute(name, operator, value) => {
                let has = node.attributes().find(|a| a.name() == name).map(|a| a.value());
                has.is_some_and(|has| match operator {
                    '=' => has == value,
                    '~' => has.split_ascii_whitespace().any(|w| w == value),
                    '|' => has == value || has.strip_prefix(value.as_str()).is_some_and(|r| r.starts_with('-')),
                    '^' => !value.is_empty() && has.starts_with(value.as_str()),
                    '$' => !value.is_empty() && has.ends_with(value.as_str()),
                    '*' => !value.is_empty() && has.contains(value.as_str()),
                    _ => true,
                })
            }
            Simple::Root => node.parent().is_some_and(|p| p.is_root()),
            Simple::Empty => !node.children().any(|c| c.is_element() || c.text().is_some_and(|t| !t.is_empty())),
            Simple::Nth(a, b, of_type, last) => {
                let place = self.places.get(&node.id()).copied().unwrap_or_default();
                let pair = if *of_type { place.of_type } else { place.child };
                let n = if *last { pair.1 } else { pair.0 } as i64 - b;
                if *a == 0 { n == 0 } else { n % a == 0 && n / a >= 0 }
            }
            Simple::Any(list, _) => list.iter().any(|s| self.matches(s, node)),
            Simple::Not(list) => !list.iter().any(|s| self.matches(s, node)),
            Simple::Never => false,
        }
    }
}

/// The declarations of a block or of a `style` attribute.
pub(super) fn declarations(text: &str) -> Vec<Declaration> {
    let text = without_comments(text);
    let parts = split_outside(&text, ';');
    parts
        .into_iter()
        .filter_map(|part| {
            let (name, value) = part.split_once(':')?;
            let (name, value) = (name.trim().trim_start_matches('*'), value.trim());
            let name = if name.starts_with("--") { name.to_string() } else { name.to_ascii_lowercase() };
            let bare = value.rsplit_once('!').filter(|(_, w)| w.trim().eq_ignore_ascii_case("important"));
            let (value, important) = bare.map_or((value, false), |(v, _)| (v.trim_end(), true));
            (!name.is_empty() && !value.is_empty()).then(|| Declaration { name, value: value.to_string(), important })
        })
        .collect()
}

/// Whether a list of media queries holds for a picture on a screen; `None` where it isn't understood.
fn media(queries: &str) -> Option<bool> {
    let one = |query: &str| {
        let query = query.trim();
        let (negated, query) = match query.strip_prefix("not ") {
            Some(q) => (true, q),
            None => (false, query.strip_prefix("only ").unwrap_or(query)),
        };
        let mut holds = true;
        for part in query.split(" and ") {
            holds &= match part.trim().trim_matches(|c| c == '(' || c == ')').replace(' ', "").as_str() {
                "" | "all" | "screen" | "prefers-color-scheme:light" | "prefers-reduced-motion:reduce" | "color" => {
                    true
                }
                "print" | "speech" | "prefers-color-scheme:dark" | "prefers-contrast:more" | "monochrome" => false,
                "prefers-reduced-motion:no-preference" | "forced-colors:active" | "inverted-colors:inverted" => false,
                _ => return None,
            };
        }
        Some(holds != negated)
    };
    let all: Vec<_> = queries.split(',').map(one).collect();
    match all.contains(&Some(true)) {
        true => Some(true),
        false if all.contains(&None) => None,
        false => Some(false),
    }
}

/// Comments become blanks, so that lines stay.
fn without_comments(text: &str) -> String {
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(at) = rest.find("/*") {
        out.push_str(&rest[..at]);
        let end = rest[at + 2..].find("*/").map_or(rest.len(), |e| at + e + 4);
        out.extend(rest[at..end].chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        rest = &rest[end..];
    }
    out + rest
}

/// Byte of the first of these marks outside quotes, parentheses and brackets.
pub(super) fn find_outside(text: &str, marks: &[char]) -> Option<usize> {
    let (mut quote, mut open, mut escaped) = (None, 0usize, false);
    for (i, c) in text.char_indices() {
        if std::mem::take(&mut escaped) {
            continue;
        }
        match (quote, c) {
            (_, '\\') => escaped = true,
            (Some(q), c) if c == q => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, c) if open == 0 && marks.contains(&c) => return Some(i),
            (None, '(' | '[') => open += 1,
            (None, ')' | ']') => open = open.saturating_sub(1),
            _ => {}
        }
    }
    None
}

pub(super) fn split_outside(text: &str, mark: char) -> Vec<&str> {
    let (mut parts, mut rest) = (Vec::new(), text);
    while let Some(at) = find_outside(rest, &[mark]) {
        parts.push(&rest[..at]);
        rest = &rest[at + mark.len_utf8()..];
    }
    parts.push(rest);
    parts
}

/// Where the block that `text` starts within ends.
fn block_end(text: &str) -> usize {
    let (mut depth, mut quote) = (0usize, None);
    for (i, c) in text.char_indices() {
        match (quote, c) {
            (Some(q), c) if c == q => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '{') => depth += 1,
            (None, '}') if depth == 0 => return i,
            (None, '}') => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

fn leading_newlines(text: &str) -> usize {
    text[..text.len() - text.trim_start().len()].matches('\n').count()
}

/// A piece of the file for a message.
pub(super) fn short(text: &str) -> String {
    let text = text.trim();
    let cut: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(40).collect();
    if text.chars().count() > 40 { cut + "..." } else { cut }
}
