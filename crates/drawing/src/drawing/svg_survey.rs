//! A first look at an SVG's XML: what would make usvg run away (depth, entity bombs), prefixes that aren't declared,
//! and the document rewritten so that it drops nothing without a word.
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use usvg::roxmltree::{Document, Node, ParsingOptions};

use super::svg_rewrite::rewrite;
use super::{DrawingError, Warning};

/// Elements nested deeper than this are refused, so that no recursion over them gets near the end of its stack.
const MAX_DEPTH: usize = 400;
/// Elements, texts and comments in a document; a million strokes of their own fit.
const MAX_NODES: u32 = 2_000_000;
/// Bytes that a document's entities may expand to.
const MAX_EXPANSION: usize = 64 << 20;
/// Elements that markers may multiply into.
const MAX_MARKED: usize = 5_000_000;
/// Prefixes without a declaration that one is made up for.
const MAX_PREFIXES: usize = 16;
/// How far clip paths, masks, patterns and markers may refer to one another in a row.
const MAX_CHAIN: usize = 100;
/// How many such elements one reference may draw in, all in all.
const MAX_DRAWN_IN: u64 = 1_000_000;

pub(super) const SVG: &str = "http://www.w3.org/2000/svg";
pub(super) const XLINK: &str = "http://www.w3.org/1999/xlink";
pub(super) const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// Name of each layer's group by its id, and whether it is a label given to it; nothing where it has neither label nor
/// id of its own.
pub(super) type Labels = BTreeMap<String, Option<(String, bool)>>;

/// What the first look finds.
pub(super) struct Survey {
    /// The document as usvg is to read it.
    pub(super) text: String,
    /// Names of the layers.
    pub(super) labels: Labels,
    /// What will be missing.
    pub(super) warnings: Vec<Warning>,
}

/// Parses the XML within bounds.
fn parse<'a>(text: &'a str, file: &Path) -> Result<Document<'a>, DrawingError> {
    let invalid = |line, message| DrawingError::Invalid { file: file.to_path_buf(), line, message };
    if expansion(text) > MAX_EXPANSION {
        return Err(invalid(1, "the document's entities could expand without bound: save it without a DTD".into()));
    }
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..Default::default() };
    Document::parse_with_options(text, options).map_err(|e| {
        // Errors about the document as a whole carry no position; an unclosed document breaks at its end.
        let line = match e {
            usvg::roxmltree::Error::UnclosedRootNode | usvg::roxmltree::Error::UnexpectedEndOfStream => {
                text.lines().count().max(1)
            }
            _ => e.pos().row as usize,
        };
        invalid(line, format!("not well-formed XML: {e}"))
    })
}

/// The text with a declaration for every prefix that has none, and what was made up. A DTD may declare one by an
/// attribute that it gives to elements, as KanjiVG's does, and drawings are cut out of files that declare theirs above.
fn declared<'a>(text: &'a str, tally: &mut Tally) -> Cow<'a, str> {
    let mut text = Cow::Borrowed(text);
    for _ in 0..MAX_PREFIXES {
        if expansion(&text) > MAX_EXPANSION {
            break;
        }
        let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..Default::default() };
        let Err(usvg::roxmltree::Error::UnknownNamespace(prefix, position)) =
            Document::parse_with_options(&text, options)
        else {
            break;
        };
        let in_dtd = text.split("<!ATTLIST").skip(1).any(|a| a.contains(&format!("xmlns:{prefix}")));
        let uri = match prefix.as_str() {
            "xlink" => XLINK,
            "inkscape" => INKSCAPE,
            "svg" => SVG,
            _ => "urn:undeclared",
        };
        // Behind the name of the root element.
        let Some(at) = root_start(&text) else { break };
        let end = at + 1 + text[at + 1..].find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(0);
        if end == at + 1 {
            break;
        }
        if !in_dtd {
            let advice =
                format!("not declared, taken as an editor's own; write xmlns:{prefix}=\"...\" on the svg element");
            tally.add(&format!("prefix `{}`", super::svg_css::short(&prefix)), &advice, position.row as usize);
        }
        text = Cow::Owned(format!("{} xmlns:{prefix}=\"{uri}\"{}", &text[..end], &text[end..]));
    }
    text
}

/// Where the root element starts, behind declarations and comments.
fn root_start(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        at += text[at..].find('<')?;
        let rest = &text[at..];
        let end = if rest.starts_with("<!--") {
            rest.find("-->")? + 3
        } else if rest.starts_with("<?") {
            rest.find("?>")? + 2
        } else if rest.starts_with("<!") {
            let subset = rest.find('[').filter(|i| rest.find('>').is_none_or(|j| *i < j));
            match subset {
                Some(_) => rest.find("]>").map(|i| i + 2).or_else(|| Some(rest.find(']')? + 1))?,
                None => rest.find('>')? + 1,
            }
        } else {
            return Some(at);
        };
        at += end;
    }
}

/// A bound on the bytes that entities expand to: every reference in the text can draw in 255 others.
fn expansion(text: &str) -> usize {
    if !text.contains("<!ENTITY") {
        return 0;
    }
    let predefined = ["amp;", "lt;", "gt;", "quot;", "apos;", "#"];
    let references = text.split('&').skip(1).filter(|r| !predefined.iter().any(|p| r.starts_with(p))).count();
    let longest = text.split("<!ENTITY").skip(1).map(|e| e.find('>').unwrap_or(e.len())).max().unwrap_or(0);
    references.saturating_mul(255).saturating_mul(longest)
}

/// Kinds of things that aren't drawn as they stand, with where the first one stands.
#[derive(Default)]
pub(super) struct Tally(BTreeMap<(String, String), (usize, usize)>);

/// Kinds beyond which only their number is told.
const MAX_KINDS: usize = 200;

impl Tally {
    pub(super) fn add(&mut self, what: &str, advice: &str, line: usize) {
        let mut key = (what.to_string(), advice.to_string());
        if self.0.len() >= MAX_KINDS && !self.0.contains_key(&key) {
            key = ("other thing".into(), "not understood either".into());
        }
        let entry = self.0.entry(key).or_insert((0, line));
        entry.0 += 1;
        entry.1 = entry.1.min(line);
    }
}

/// Takes the first look.
pub(super) fn survey(text: &str, file: &Path) -> Result<Survey, DrawingError> {
    let mut tally = Tally::default();
    let text = &*declared(text, &mut tally);
    let doc = parse(text, file)?;
    let invalid = |line, message| DrawingError::Invalid { file: file.to_path_buf(), line, message };
    // Line starts, for a quick line of any byte offset.
    let breaks: Vec<usize> = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i).collect();
    let line_of = |node: &Node| breaks.partition_point(|b| *b < node.range().start) + 1;

    let root = doc.root_element();
    if !is_svg(&root, "svg") {
        let name = root.tag_name().name();
        return Err(invalid(line_of(&root), format!("the root element is `{name}`: an SVG file starts with `svg`")));
    }
    let (mut marked, mut marker_nodes) = (0usize, 0usize);
    let mut references = References::default();
    let mut open = vec![(root, 0usize, None)];
    while let Some((node, depth, mut container)) = open.pop() {
        if depth > MAX_DEPTH {
            let message = format!("elements are nested deeper than {MAX_DEPTH}: ungroup some of them");
            return Err(invalid(line_of(&node), message));
        }
        let name = if matches!(node.tag_name().namespace(), None | Some(SVG)) { node.tag_name().name() } else { "" };
        if matches!(name, "clipPath" | "mask" | "pattern" | "marker") {
            container = Some(references.open(&node, line_of(&node)));
        }
        if let Some(container) = container {
            references.add(container, &node);
        }
        if name == "marker" {
            marker_nodes += node.descendants().count();
        }
        marked = marked.saturating_add(vertices(&node, name));
        for child in node.children().filter(Node::is_element) {
            open.push((child, depth + 1, container));
        }
    }
    if marked.saturating_mul(marker_nodes) > MAX_MARKED {
        return Err(invalid(1, "markers would multiply into millions of elements: remove them".into()));
    }
    references.check().map_err(|(line, message)| invalid(line, message))?;
    let (text, labels, more) = rewrite(&doc, &breaks);
    for ((what, advice), (count, line)) in more.0 {
        let entry = tally.0.entry((what, advice)).or_insert((0, line));
        entry.0 += count;
    }
    let warnings = tally.0.into_iter().map(|((what, advice), (count, line))| Warning {
        line: Some(line),
        message: format!("{count} x {what}: {advice}"),
    });
    Ok(Survey { text, labels, warnings: warnings.collect() })
}

/// Who refers to whom among clip paths, masks, patterns and markers. usvg resolves these by recursion and partly
/// without a cache, so a long row of them could overflow its stack and a branching one would never end.
#[derive(Default)]
struct References<'a> {
    /// Line of each, and the ids that it and its content refer to.
    elements: Vec<(usize, Vec<&'a str>)>,
    by_id: BTreeMap<&'a str, usize>,
}

impl<'a> References<'a> {
    fn open(&mut self, node: &Node<'a, '_>, line: usize) -> usize {
        self.elements.push((line, Vec::new()));
        if let Some(id) = node.attribute("id") {
            self.by_id.entry(id).or_insert(self.elements.len() - 1);
        }
        self.elements.len() - 1
    }

    fn add(&mut self, container: usize, node: &Node<'a, '_>) {
        for attribute in node.attributes() {
            let value: &'a str = attribute.value();
            let links = value.split("url(").skip(1).filter_map(|v| v.split(')').next());
            let ids = links.filter_map(|v| v.trim_matches(|c| matches!(c, ' ' | '"' | '\'')).strip_prefix('#'));
            self.elements[container].1.extend(ids);
        }
    }

    /// The line and the message of a row too long or too bushy.
    fn check(&self) -> Result<(), (usize, String)> {
        let mut known = vec![None; self.elements.len()];
        for i in 0..self.elements.len() {
            self.drawn_in(i, 0, &mut known)?;
        }
        Ok(())
    }

    /// Number of elements that a reference to this one draws in. Recursion ends at `MAX_CHAIN`.
    fn drawn_in(
        &self,
        i: usize,
        chain: usize,
        known: &mut [Option<(u64, usize)>],
    ) -> Result<(u64, usize), (usize, String)> {
        let (line, ids) = &self.elements[i];
        if let Some((count, below)) = known[i]
            && chain + below <= MAX_CHAIN
        {
            return Ok((count, below));
        }
        if chain > MAX_CHAIN {
            let message =
                format!("clip paths, masks, patterns or markers refer to one another over {MAX_CHAIN} times in a row");
            return Err((*line, message));
        }
        // usvg breaks circles, and so does this: within itself an element counts as nothing.
        known[i] = Some((0, 0));
        let (mut count, mut below) = (1u64, 0);
        for next in ids.iter().filter_map(|id| self.by_id.get(id)) {
            let (more, deeper) = self.drawn_in(*next, chain + 1, known)?;
            count = count.saturating_add(more);
            below = below.max(deeper + 1);
        }
        if count > MAX_DRAWN_IN {
            return Err((*line, "clip paths, masks, patterns or markers multiply without bound".into()));
        }
        known[i] = Some((count, below));
        Ok((count, below))
    }
}

pub(super) fn is_svg(node: &Node, name: &str) -> bool {
    matches!(node.tag_name().namespace(), None | Some(SVG)) && node.tag_name().name() == name
}

/// A bound on an element's vertices, each of which can carry a marker.
fn vertices(node: &Node, name: &str) -> usize {
    match name {
        "path" => {
            let segments = svgtypes::PathParser::from(node.attribute("d").unwrap_or(""));
            segments.take_while(Result::is_ok).count()
        }
        "polyline" | "polygon" => svgtypes::PointsParser::from(node.attribute("points").unwrap_or("")).count(),
        _ => 0,
    }
}
