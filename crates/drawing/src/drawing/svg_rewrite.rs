//! An SVG rewritten as usvg reads it: styles resolved into attributes, lengths, colours and transforms of CSS in plain
//! numbers, layers named by ids of their own. What neither side understands is noted with its line.
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use usvg::roxmltree::{Document, Node, NodeId};

use super::svg_css::{Sheet, declarations, short};
use super::svg_names::{self, nearest};
use super::svg_shape::{Far, page_size};
use super::svg_survey::{INKSCAPE, Labels, SVG, Tally, XLINK, is_svg};
use super::svg_value::{self as value, Axis, Scale};

/// How often one `var()` may lead to another.
const MAX_VARIABLES: usize = 12;
/// Bytes that a value with its variables may grow to.
const MAX_VALUE: usize = 1 << 16;
/// Attributes of one element by name, as usvg is to see them.
pub(super) type Attributes = BTreeMap<String, String>;

/// What an element takes over from those around it.
#[derive(Clone)]
pub(super) struct Context {
    pub(super) variables: Rc<BTreeMap<String, String>>,
    pub(super) scale: Scale,
    /// Computed values of the properties that decide what a shape looks like.
    pub(super) inherited: Rc<BTreeMap<&'static str, String>>,
    /// Whether a viewer would show it.
    pub(super) shown: bool,
    pub(super) visible: bool,
    /// Whether it is drawn by reference alone.
    pub(super) defined: bool,
    pub(super) far: Far,
}

impl Context {
    /// Whether a viewer would show what is missing here.
    pub(super) fn seen(&self) -> bool {
        self.shown && self.visible
    }
}

/// Inherited properties that are looked at.
const INHERITED: [&str; 5] = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-dashoffset"];

pub(super) struct Rewriter<'d> {
    pub(super) doc: &'d Document<'d>,
    breaks: &'d [usize],
    sheet: Sheet,
    pub(super) ids: BTreeMap<&'d str, NodeId>,
    used: BTreeSet<&'d str>,
    layers: HashMap<NodeId, String>,
    labels: Labels,
    pub(super) tally: Tally,
    out: String,
}

/// The document as usvg reads it, its layers' labels by id, and what was noted.
pub(super) fn rewrite<'d>(doc: &'d Document<'d>, breaks: &'d [usize]) -> (String, Labels, Tally) {
    let root = doc.root_element();
    let mut ids = BTreeMap::new();
    let mut used = BTreeSet::new();
    for n in root.descendants().filter(Node::is_element) {
        if let Some(id) = n.attribute("id") {
            ids.entry(id).or_insert(n.id());
        }
        if is_svg(&n, "use") {
            used.extend(href(&n).and_then(|h| h.trim().strip_prefix('#')));
        }
    }
    let mut rewriter = Rewriter {
        doc,
        breaks,
        sheet: Sheet::default(),
        ids,
        used,
        layers: HashMap::new(),
        labels: BTreeMap::new(),
        tally: Tally::default(),
        out: String::new(),
    };
    rewriter.styles(root);
    rewriter.name_layers(root);
    let context = rewriter.start(root);
    rewriter.element(root, &context);
    if rewriter.sheet.exhausted() {
        rewriter.tally.add("style sheet", "too many rules for so many elements, not all of them count", 1);
    }
    (rewriter.out, rewriter.labels, rewriter.tally)
}

fn href<'a>(node: &Node<'a, '_>) -> Option<&'a str> {
    node.attribute("href").or_else(|| node.attribute((XLINK, "href")))
}

impl<'d> Rewriter<'d> {
    fn line(&self, node: &Node) -> usize {
        self.breaks.partition_point(|b| *b < node.range().start) + 1
    }

    fn styles(&mut self, root: Node<'d, 'd>) {
        for style in root.descendants().filter(|n| is_svg(n, "style")) {
            if style.attribute("type").is_some_and(|t| !t.is_empty() && !t.eq_ignore_ascii_case("text/css")) {
                let line = self.line(&style);
                self.tally.add("style sheet", "not CSS, not read", line);
                continue;
            }
            for text in style.children().filter(Node::is_text) {
                let line = self.breaks.partition_point(|b| *b < text.range().start) + 1;
                self.sheet.add(text.text().unwrap_or(""), line);
            }
        }
        for (line, what) in std::mem::take(&mut self.sheet.unknown) {
            let (what, advice) = what.rsplit_once(": ").unwrap_or((&what, "not read"));
            self.tally.add(what, advice, line);
        }
        self.sheet.finish(root);
    }

    /// Finds the groups that are layers: children of the root, or of a lone group round all of them.
    fn name_layers(&mut self, root: Node<'d, 'd>) {
        let layer = |n: &Node| n.attribute((INKSCAPE, "groupmode")) == Some("layer");
        let group = |n: &Node| is_svg(n, "g") || is_svg(n, "a");
        let (mut at, mut parent) = (root, root);
        loop {
            let mut drawn = at.children().filter(|n| n.is_element() && svg_names::draws(n));
            let (Some(only), None) = (drawn.next(), drawn.next()) else { break };
            if !(group(&only) || is_svg(&only, "switch")) || layer(&only) {
                break;
            }
            at = only;
            let named = only.attribute("id").is_some() || only.attribute((INKSCAPE, "label")).is_some();
            let groups = at.children().filter(group).count();
            if at.children().any(|n| layer(&n)) || (!named && group(&only) && groups > 1) {
                parent = at;
                break;
            }
        }
        for (i, g) in parent.children().filter(group).enumerate() {
            let label = g.attribute((INKSCAPE, "label")).map(str::trim).filter(|l| !l.is_empty());
            let own = g.attribute("id").filter(|id| self.ids.get(id) == Some(&g.id()));
            let id = own.map_or_else(|| format!("calamus-layer-{i}"), str::to_string);
            let name = label.map(|l| (l.to_string(), true)).or(g.attribute("id").map(|id| (id.to_string(), false)));
            self.labels.insert(id.clone(), name);
            self.layers.insert(g.id(), id);
        }
    }

    fn start(&mut self, root: Node<'d, 'd>) -> Context {
        let unknown = Scale { viewport: (100.0, 100.0), page: (100.0, 100.0), font: 16.0 };
        let page = page_size(&root, &unknown);
        Context {
            variables: Rc::default(),
            scale: Scale { viewport: page, page, ..unknown },
            inherited: Rc::default(),
            shown: true,
            visible: true,
            defined: false,
            far: Far::of(&root, page),
        }
    }

    /// Writes one element and what it holds.
    fn element(&mut self, node: Node<'d, 'd>, around: &Context) {
        if !matches!(node.tag_name().namespace(), None | Some(SVG)) {
            return;
        }
        let name = node.tag_name().name();
        let line = self.line(&node);
        let mut context = around.clone();
        let mut attributes = self.attributes(node, &mut context);
        if matches!(name, "defs" | "symbol" | "clipPath" | "mask" | "pattern" | "marker") {
            context.defined = true;
        }
        if node.attribute("id").is_some_and(|id| self.used.contains(id)) {
            context.defined = false;
        }
        let told = context.seen() && !context.defined;
        if svg_names::skipped(name) {
            if told && let Some(advice) = svg_names::advice(name) {
                self.tally.add(svg_names::title(name), advice, line);
            }
            return;
        }
        if !svg_names::known(name) {
            if told {
                let advice = match nearest(name, svg_names::ELEMENTS.iter().copied()) {
                    Some(near) => format!("no element of SVG, not drawn; did you mean `{near}`?"),
                    None => "no element of SVG, not drawn".to_string(),
                };
                self.tally.add(&format!("`{}`", short(name)), &advice, line);
            }
            return;
        }
        self.finish(node, name, &mut attributes, &mut context, line);
        let written = if name == "switch" { "g" } else { name };
        self.out.push('<');
        self.out.push_str(written);
        if node.id() == self.doc.root_element().id() {
            self.out.push_str(" xmlns=\"http://www.w3.org/2000/svg\"");
        }
        for (name, value) in &attributes {
            self.out.push(' ');
            self.out.push_str(name);
            self.out.push_str("=\"");
            escape(value, &mut self.out);
            self.out.push('"');
        }
        self.out.push('>');
        match name {
            "switch" => {
                if let Some(child) = chosen(&node) {
                    self.element(child, &context);
                }
            }
            _ => node.children().filter(Node::is_element).for_each(|c| self.element(c, &context)),
        }
        self.out.push_str("</");
        self.out.push_str(written);
        self.out.push('>');
    }

    /// Attributes and styles of one element, resolved; `context` takes over what it hands on.
    fn attributes(&mut self, node: Node<'d, 'd>, context: &mut Context) -> Attributes {
        let mut all = Attributes::new();
        let plain_link = node.attributes().any(|a| a.namespace().is_none() && a.name() == "href");
        for a in node.attributes() {
            match a.namespace() {
                None | Some(SVG) => {}
                Some(XLINK) if a.name() == "href" && !plain_link => {}
                _ => continue,
            }
            if !matches!(a.name(), "style" | "class" | "id") {
                all.insert(a.name().to_string(), a.value().to_string());
            }
        }
        self.tell_misspelt(&node, &all, context.seen() && !context.defined);
        let style = node.attribute("style").map(declarations).unwrap_or_default();
        let mut css: Vec<_> = self.sheet.of(node).chain(&style).cloned().collect();
        css.sort_by_key(|d| d.important);
        let mut variables = BTreeMap::new();
        for d in &css {
            if d.name.starts_with("--") {
                variables.insert(d.name.clone(), d.value.clone());
            } else if d.name == "marker" {
                ["marker-start", "marker-mid", "marker-end"]
                    .into_iter()
                    .for_each(|n| drop(all.insert(n.into(), d.value.clone())));
            } else if svg_names::styled(&d.name) {
                // Words of CSS are the same in any case.
                let plain = !d.value.contains(['(', '"', '\'']) && d.name != "font-family";
                all.insert(d.name.clone(), if plain { d.value.to_ascii_lowercase() } else { d.value.clone() });
                if d.name == "transform" {
                    all.insert("transform-css".into(), String::new());
                }
            }
        }
        if !variables.is_empty() {
            let mut outer = (*context.variables).clone();
            outer.append(&mut variables);
            context.variables = Rc::new(outer);
        }
        self.put_variables(&node, &mut all, context);
        let zero = |v: &String| value::number(v).is_some_and(|(v, _)| v == 0.0);
        if all.get("display").is_some_and(|d| d == "none") || all.get("opacity").is_some_and(zero) {
            context.shown = false;
        }
        if let Some(v) = all.get("visibility").filter(|v| *v != "inherit") {
            context.visible = v == "visible";
        }
        if let Some(id) = self.layers.get(&node.id()) {
            all.insert("id".into(), id.clone());
        } else if let Some(id) = node.attribute("id").filter(|id| self.ids.get(id) == Some(&node.id())) {
            all.insert("id".into(), id.to_string());
        }
        self.paints(&node, &mut all, context);
        self.hand_on(&mut all, context);
        all
    }

    /// Tells of attributes and properties that are almost the name of a known one.
    fn tell_misspelt(&mut self, node: &Node, all: &Attributes, told: bool) {
        if !told || !svg_names::known(node.tag_name().name()) {
            return;
        }
        for name in all.keys().filter(|n| !svg_names::VITAL.contains(&n.as_str())) {
            if let Some(near) = svg_names::misspelt(name) {
                let what = format!("attribute `{}`", short(name));
                self.tally.add(&what, &format!("not known, doesn't count; did you mean `{near}`?"), self.line(node));
            }
        }
    }

    fn put_variables(&mut self, node: &Node, all: &mut Attributes, context: &Context) {
        let line = self.line(node);
        let with: Vec<String> = all.iter().filter(|(_, v)| v.contains("var(")).map(|(n, _)| n.clone()).collect();
        for name in with {
            match substitute(&all[&name], &context.variables, 0) {
                Some(value) => drop(all.insert(name, value)),
                None => {
                    let what = format!("`{name}: {}`", short(&all[&name]));
                    if context.seen() {
                        self.tally.add(&what, "the variable var() names has no value, doesn't count", line);
                    }
                    all.remove(&name);
                }
            }
        }
    }

    /// Colours in a spelling that usvg reads.
    fn paints(&mut self, node: &Node, all: &mut Attributes, context: &Context) {
        let line = self.line(node);
        for name in ["fill", "stroke", "color", "stop-color"] {
            let Some(text) = all.get(name) else { continue };
            match value::paint(text) {
                Some(paint) => {
                    let link = paint.strip_prefix("url(#").and_then(|p| p.split(')').next());
                    if context.seen()
                        && let Some(id) = link.filter(|id| !self.ids.contains_key(id))
                    {
                        let what = format!("{name} `url(#{})`", short(id));
                        self.tally.add(&what, "refers to nothing in this file", line);
                    }
                    all.insert(name.into(), paint);
                }
                None => {
                    if context.seen() {
                        let what = format!("colour `{}`", short(text));
                        self.tally.add(&what, &format!("not understood, its {name} doesn't count"), line);
                    }
                    all.remove(name);
                }
            }
        }
        if let Some(filter) = all.remove("filter")
            && filter != "none"
            && context.seen()
        {
            self.tally.add("filter", "ignored, the shape is drawn without", line);
        }
    }

    /// Computes what children inherit.
    fn hand_on(&mut self, all: &mut Attributes, context: &mut Context) {
        if let Some(size) = all.get("font-size") {
            let parent = Scale { viewport: (context.scale.font, context.scale.font), ..context.scale };
            if let Some(px) = parent.length(size, Axis::X).filter(|p| *p >= 0.0) {
                context.scale.font = px;
                if size.parse::<svgtypes::Length>().is_err() {
                    all.insert("font-size".into(), px.to_string());
                }
            }
        }
        if INHERITED.iter().any(|n| all.contains_key(*n)) {
            let mut inherited = (*context.inherited).clone();
            for name in INHERITED {
                if let Some(v) = all.get(name).filter(|v| *v != "inherit") {
                    inherited.insert(name, v.clone());
                }
            }
            context.inherited = Rc::new(inherited);
        }
    }
}

/// The child of a `switch` that viewers show: the first whose conditions hold.
fn chosen<'a, 'i>(switch: &Node<'a, 'i>) -> Option<Node<'a, 'i>> {
    let language = |l: &str| l.split(',').any(|l| l.trim() == "en" || l.trim().starts_with("en-"));
    let holds = |n: &Node| {
        n.attribute("requiredExtensions").is_none_or(|e| e.trim().is_empty())
            && n.attribute("systemLanguage").is_none_or(language)
            && matches!(n.tag_name().namespace(), None | Some(SVG))
            && !matches!(n.tag_name().name(), "title" | "desc" | "metadata")
    };
    let passing: Vec<_> = switch.children().filter(|n| n.is_element() && holds(n)).collect();
    // What can be drawn goes before what can't.
    passing.iter().find(|n| !svg_names::skipped(n.tag_name().name())).or(passing.first()).copied()
}

fn substitute(text: &str, variables: &BTreeMap<String, String>, depth: usize) -> Option<String> {
    let Some(at) = text.find("var(") else { return Some(text.to_string()) };
    if depth > MAX_VARIABLES || text.len() > MAX_VALUE {
        return None;
    }
    let body = &text[at + 4..];
    let end = value::closing(body)?;
    let (name, fallback) = body[..end].split_once(',').map_or((&body[..end], None), |(n, f)| (n, Some(f.trim())));
    let value = match variables.get(name.trim()) {
        Some(v) => substitute(v, variables, depth + 1).or_else(|| substitute(fallback?, variables, depth + 1)),
        None => substitute(fallback?, variables, depth + 1),
    }?;
    substitute(&format!("{}{value}{}", &text[..at], &body[end + 1..]), variables, depth + 1)
}

pub(super) fn join(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

fn escape(text: &str, out: &mut String) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            '\t' => out.push_str("&#9;"),
            '\r' => out.push_str("&#13;"),
            c => out.push(c),
        }
    }
}
