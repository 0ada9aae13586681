//! A first look at an SVG's XML: what usvg would drop without a word (layer labels, text, images, broken path data),
//! and what would make it run away (depth, entity bombs).
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use usvg::roxmltree::{Document, Node, ParsingOptions};

use super::{DrawingError, Warning};

/// Elements nested deeper than this are refused, so that no recursion over them gets near the end of its stack.
const MAX_DEPTH: usize = 400;
/// Elements, texts and comments in a document; a million strokes of their own fit.
const MAX_NODES: u32 = 2_000_000;
/// Bytes that a document's entities may expand to.
const MAX_EXPANSION: usize = 64 << 20;
/// Elements that markers may multiply into.
const MAX_MARKED: usize = 5_000_000;
/// How far clip paths, masks, patterns and markers may refer to one another in a row.
const MAX_CHAIN: usize = 100;
/// How many such elements one reference may draw in, all in all.
const MAX_DRAWN_IN: u64 = 1_000_000;

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";
const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// What the first look finds.
pub(super) struct Survey {
    /// The document, with an id given to every top-level group that had none.
    pub(super) text: String,
    /// Label of each top-level group by its id; `None` where neither a label nor an id of its own names it.
    pub(super) labels: BTreeMap<String, Option<String>>,
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

/// Kinds of things that can't be drawn, with where the first one stands.
#[derive(Default)]
struct Tally(BTreeMap<(&'static str, &'static str), (usize, usize)>);

impl Tally {
    fn add(&mut self, what: &'static str, advice: &'static str, line: usize) {
        let entry = self.0.entry((what, advice)).or_insert((0, line));
        entry.0 += 1;
        entry.1 = entry.1.min(line);
    }
}

/// Takes the first look.
pub(super) fn survey(text: &str, file: &Path) -> Result<Survey, DrawingError> {
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
    let ids: BTreeSet<&str> = root.descendants().filter_map(|n| n.attribute("id")).collect();
    let uses_definitions = root.descendants().any(|n| is_svg(&n, "use"));

    let mut tally = Tally::default();
    let (mut marked, mut marker_nodes) = (0usize, 0usize);
    let mut references = References::default();
    let mut open = vec![(root, 0usize, true, None)];
    while let Some((node, depth, shown, mut container)) = open.pop() {
        if depth > MAX_DEPTH {
            let message = format!("elements are nested deeper than {MAX_DEPTH}: ungroup some of them");
            return Err(invalid(line_of(&node), message));
        }
        let name = if matches!(node.tag_name().namespace(), None | Some(SVG)) { node.tag_name().name() } else { "" };
        let hidden = node.attribute("display") == Some("none")
            || node.attribute("style").is_some_and(|s| s.replace(' ', "").contains("display:none"))
            || name == "metadata"
            || (name == "defs" && !uses_definitions);
        let shown = shown && !hidden;
        if matches!(name, "clipPath" | "mask" | "pattern" | "marker") {
            container = Some(references.open(&node, line_of(&node)));
        }
        if let Some(container) = container {
            references.add(container, &node);
        }
        if name == "marker" {
            marker_nodes += node.descendants().count();
        }
        if shown {
            marked = marked.saturating_add(inspect(&node, name, &ids, &mut tally, line_of(&node)));
        }
        for child in node.children().filter(Node::is_element) {
            open.push((child, depth + 1, shown, container));
        }
    }
    if marked.saturating_mul(marker_nodes) > MAX_MARKED {
        return Err(invalid(1, "markers would multiply into millions of elements: remove them".into()));
    }
    references.check().map_err(|(line, message)| invalid(line, message))?;
    let (labels, text) = name_groups(&root, text);
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

fn is_svg(node: &Node, name: &str) -> bool {
    matches!(node.tag_name().namespace(), None | Some(SVG)) && node.tag_name().name() == name
}

/// Notes what of one element will be missing; returns a bound on its vertices, each of which can carry a marker.
fn inspect(node: &Node, name: &str, ids: &BTreeSet<&str>, tally: &mut Tally, line: usize) -> usize {
    match name {
        "text" => tally.add("text", "not drawn; convert it to paths", line),
        "image" => tally.add("image", "not drawn; trace it, or draw it as a picture", line),
        "foreignObject" => tally.add("foreignObject", "not drawn", line),
        "animate" | "animateTransform" | "animateMotion" | "set" => tally.add("animation", "drawn as it starts", line),
        "use" => {
            let href = node.attribute("href").or_else(|| node.attribute((XLINK, "href"))).unwrap_or("");
            if !href.strip_prefix('#').is_some_and(|id| ids.contains(id)) {
                tally.add("use", "not drawn; it refers to nothing in this file", line);
            }
        }
        _ => {}
    }
    if node.attribute("transform").is_some_and(|t| t.parse::<svgtypes::Transform>().is_err()) {
        tally.add("broken transform", "ignored", line);
    }
    let mut vertices = 0;
    if name == "path" {
        for segment in svgtypes::PathParser::from(node.attribute("d").unwrap_or("")) {
            if segment.is_err() {
                tally.add("broken path data", "drawn up to the error", line);
                break;
            }
            vertices += 1;
        }
    }
    if matches!(name, "polyline" | "polygon") {
        let text = node.attribute("points").unwrap_or("");
        vertices = svgtypes::PointsParser::from(text).count();
        let numbers = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).count();
        if numbers % 2 == 1 && numbers > 2 * vertices {
            tally.add("broken list of points", "drawn up to the error", line);
        }
    }
    vertices
}

/// Labels of the top-level groups by id, and the text with an id for each group that had none.
fn name_groups(root: &Node, text: &str) -> (BTreeMap<String, Option<String>>, String) {
    let (mut labels, mut edited, mut copied) = (BTreeMap::new(), String::new(), 0);
    for (i, group) in root.children().filter(|n| is_svg(n, "g") || is_svg(n, "a")).enumerate() {
        let label = group.attribute((INKSCAPE, "label")).map(str::trim).filter(|l| !l.is_empty());
        if let Some(id) = group.attribute("id") {
            labels.entry(id.to_string()).or_insert_with(|| Some(label.unwrap_or(id).to_string()));
            continue;
        }
        // The id goes right behind the tag's name.
        let start = group.range().start;
        let name = text
            .get(start + 1..)
            .map_or(0, |t| t.find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(0));
        if start < copied || name == 0 || !text[start..].starts_with('<') {
            continue;
        }
        let id = format!("calamus-unnamed-group-{i}");
        edited.push_str(&text[copied..start + 1 + name]);
        edited.push_str(&format!(" id=\"{id}\""));
        copied = start + 1 + name;
        labels.insert(id, label.map(str::to_string));
    }
    edited.push_str(&text[copied..]);
    // An edit inside an entity's definition can break the document; then such groups stay without a name.
    if copied > 0
        && Document::parse_with_options(
            &edited,
            ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..Default::default() },
        )
        .is_err()
    {
        edited = text.to_string();
    }
    (labels, edited)
}
