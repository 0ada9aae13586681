//! The text of a URDF, checked element by element before it is interpreted.
//!
//! urdf-rs is lenient: a missing `<inertial>` or `<limit>` becomes zeros, a word among three numbers is skipped, and no
//! error has a line. So the text is first read with positions, and whatever physics would silently get wrong is refused.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node, ParsingOptions};

use super::RobotError;
use crate::diagnostic::nearest;

/// Most XML nodes of a file that is still taken for a robot.
const MOST_NODES: u32 = 400_000;

/// Deepest nesting; URDF needs 5.
const DEEPEST: usize = 16;

/// Numeric attributes by element, with how many numbers each holds.
const NUMBERS: [(&str, &str, usize); 26] = [
    ("origin", "xyz", 3),
    ("origin", "rpy", 3),
    ("axis", "xyz", 3),
    ("mass", "value", 1),
    ("inertia", "ixx", 1),
    ("inertia", "ixy", 1),
    ("inertia", "ixz", 1),
    ("inertia", "iyy", 1),
    ("inertia", "iyz", 1),
    ("inertia", "izz", 1),
    ("limit", "lower", 1),
    ("limit", "upper", 1),
    ("limit", "effort", 1),
    ("limit", "velocity", 1),
    ("dynamics", "damping", 1),
    ("dynamics", "friction", 1),
    ("mimic", "multiplier", 1),
    ("mimic", "offset", 1),
    ("box", "size", 3),
    ("sphere", "radius", 1),
    ("cylinder", "radius", 1),
    ("cylinder", "length", 1),
    ("capsule", "radius", 1),
    ("capsule", "length", 1),
    ("mesh", "scale", 3),
    ("color", "rgba", 4),
];

/// Attributes without which an element means nothing.
const REQUIRED: [(&str, &[&str]); 13] = [
    ("mass", &["value"]),
    ("inertia", &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    ("axis", &["xyz"]),
    ("parent", &["link"]),
    ("child", &["link"]),
    ("mimic", &["joint"]),
    ("box", &["size"]),
    ("sphere", &["radius"]),
    ("cylinder", &["radius", "length"]),
    ("capsule", &["radius", "length"]),
    ("mesh", &["filename"]),
    ("color", &["rgba"]),
    ("texture", &["filename"]),
];

/// Joint types of URDF 1.2.
const JOINT_TYPES: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

/// What the text of a link or a joint says that urdf-rs doesn't keep.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// 1-based line.
    pub line: usize,
    /// For a link, whether it has an `<inertial>`.
    pub has_inertial: bool,
}

/// A URDF read twice: as urdf-rs understands it, and as text with places.
pub(super) struct Source {
    /// The file, for errors.
    pub file: PathBuf,
    /// The robot as urdf-rs reads it.
    pub robot: urdf_rs::Robot,
    /// One a link, in the order of `robot.links`.
    pub links: Vec<Place>,
    /// One a joint, in the order of `robot.joints`.
    pub joints: Vec<Place>,
    /// What was seen and is not used.
    pub notes: Vec<String>,
}

impl Source {
    /// Checks and parses `text`; `file` is named in errors.
    pub fn parse(text: &str, file: &Path) -> Result<Self, RobotError> {
        let xml = |line: usize, message: String| RobotError::Xml { file: file.to_path_buf(), line, message };
        let depth = text_depth(text);
        if depth > DEEPEST {
            return Err(xml(1, format!("elements are nested {depth} deep; a robot needs 5")));
        }
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options)
            .map_err(|e| xml(e.pos().row as usize, format!("not well-formed XML: {e}")))?;
        let root = document.root_element();
        let line = |node: Node| document.text_pos_at(node.range().start).row as usize;
        if root.tag_name().name() != "robot" {
            let name = root.tag_name().name();
            let hint = if name == "sdf" || name == "mujoco" { "; convert it to URDF" } else { "" };
            return Err(xml(line(root), format!("the root element is <{name}>, not <robot>{hint}")));
        }
        let mut check = Checker { file, notes: BTreeMap::new() };
        for node in root.descendants().filter(Node::is_element) {
            if node.tag_name().namespace().is_some_and(|n| n.contains("xacro")) {
                return Err(xml(
                    line(node),
                    "xacro macros are not expanded here; run xacro and give its output".into(),
                ));
            }
        }
        let (mut links, mut joints) = (Vec::new(), Vec::new());
        for node in root.children().filter(Node::is_element) {
            let place = Place { line: line(node), has_inertial: child(node, "inertial").is_some() };
            match node.tag_name().name() {
                "link" => {
                    check.link(node, &line)?;
                    links.push(place);
                }
                "joint" => {
                    check.joint(node, &line)?;
                    joints.push(place);
                }
                "material" => check.numbers_below(node, "material", &line)?,
                other => check.note(other, line(node)),
            }
        }
        let robot = urdf_rs::read_from_string(text).map_err(|e| xml(line(root), e.to_string()))?;
        if robot.links.len() != links.len() || robot.joints.len() != joints.len() {
            return Err(xml(line(root), "the links and joints can't be told apart".to_string()));
        }
        let notes = check.notes.into_values().collect();
        Ok(Self { file: file.to_path_buf(), robot, links, joints, notes })
    }

    /// An error at link `i`.
    pub fn bad_link(&self, i: usize, message: impl Into<String>) -> RobotError {
        RobotError::Invalid {
            file: self.file.clone(),
            line: self.links[i].line,
            element: format!("link `{}`", self.robot.links[i].name),
            message: message.into(),
        }
    }

    /// An error at joint `j`.
    pub fn bad_joint(&self, j: usize, message: impl Into<String>) -> RobotError {
        RobotError::Invalid {
            file: self.file.clone(),
            line: self.joints[j].line,
            element: format!("joint `{}`", self.robot.joints[j].name),
            message: message.into(),
        }
    }

    /// Joint `j` is understood but can't be honoured.
    pub fn unsupported_joint(&self, j: usize, reason: impl Into<String>) -> RobotError {
        RobotError::Unsupported {
            file: self.file.clone(),
            line: self.joints[j].line,
            element: format!("joint `{}`", self.robot.joints[j].name),
            reason: reason.into(),
        }
    }
}

/// Nesting depth by counting tags, before anything recursive sees the text.
fn text_depth(text: &str) -> usize {
    let (mut depth, mut deepest) = (0usize, 0usize);
    let mut rest = text;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            rest = comment.find("-->").map_or("", |end| &comment[end + 3..]);
        } else if rest.starts_with('/') {
            depth = depth.saturating_sub(1);
        } else if !rest.starts_with(['!', '?']) {
            let end = rest.find('>').unwrap_or(rest.len());
            if !rest[..end].ends_with('/') {
                depth += 1;
                deepest = deepest.max(depth);
            }
        }
    }
    deepest
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|c| c.is_element() && c.tag_name().name() == name)
}

/// Walks the elements of a link or joint.
struct Checker<'f> {
    file: &'f Path,
    /// By element name, so that a hundred `<gazebo>` tags make one note.
    notes: BTreeMap<String, String>,
}

impl Checker<'_> {
    fn invalid(&self, line: usize, element: &str, message: String) -> RobotError {
        RobotError::Invalid { file: self.file.to_path_buf(), line, element: element.to_string(), message }
    }

    fn note(&mut self, element: &str, line: usize) {
        self.notes.entry(element.to_string()).or_insert_with(|| format!("<{element}> (line {line}) is not used"));
    }

    fn link<'a>(&mut self, node: Node<'a, 'a>, line: &impl Fn(Node<'a, 'a>) -> usize) -> Result<(), RobotError> {
        let title = self.title(node, line)?;
        for part in node.children().filter(Node::is_element) {
            let at = line(part);
            match part.tag_name().name() {
                "inertial" => {
                    self.only_one(node, "inertial", &title, at)?;
                    for needed in ["mass", "inertia"] {
                        if child(part, needed).is_none() {
                            let message = format!("<inertial> lacks <{needed}>");
                            return Err(self.invalid(at, &title, message));
                        }
                    }
                }
                kind @ ("visual" | "collision") => {
                    let shapes = child(part, "geometry").map_or(0, |g| g.children().filter(Node::is_element).count());
                    if shapes != 1 {
                        let message = format!("<{kind}> needs a <geometry> with one shape, and has {shapes}");
                        return Err(self.invalid(at, &title, message));
                    }
                }
                other => {
                    self.note(other, at);
                    continue;
                }
            }
            self.numbers_below(part, &title, line)?;
        }
        Ok(())
    }

    fn joint<'a>(&mut self, node: Node<'a, 'a>, line: &impl Fn(Node<'a, 'a>) -> usize) -> Result<(), RobotError> {
        let title = self.title(node, line)?;
        let at = line(node);
        let kind = node.attribute("type").unwrap_or("");
        if !JOINT_TYPES.contains(&kind) {
            let hint = nearest(kind, JOINT_TYPES).map_or(String::new(), |n| format!(": did you mean `{n}`?"));
            return Err(self.invalid(at, &title, format!("unknown joint type `{kind}`{hint}")));
        }
        for needed in ["parent", "child"] {
            if child(node, needed).is_none() {
                return Err(self.invalid(at, &title, format!("lacks <{needed} link=\"...\"/>")));
            }
        }
        let limits: &[&str] = match kind {
            "revolute" | "prismatic" => &["lower", "upper", "effort", "velocity"],
            "continuous" => &["effort", "velocity"],
            _ => &[],
        };
        for needed in limits {
            if child(node, "limit").and_then(|l| l.attribute(*needed)).is_none() {
                let unit = if kind == "prismatic" { "m, m/s, N" } else { "rad, rad/s, N m" };
                let message = format!("a {kind} joint needs <limit {needed}=\"...\"/> ({unit})");
                return Err(self.invalid(at, &title, message));
            }
        }
        for part in node.children().filter(Node::is_element) {
            match part.tag_name().name() {
                name @ ("origin" | "parent" | "child" | "axis" | "limit" | "dynamics" | "mimic") => {
                    self.only_one(node, name, &title, line(part))?;
                    self.numbers_below(part, &title, line)?;
                }
                other => self.note(other, line(part)),
            }
        }
        Ok(())
    }

    /// "link `name`", or an error when there is no name.
    fn title<'a>(&self, node: Node<'a, 'a>, line: &impl Fn(Node<'a, 'a>) -> usize) -> Result<String, RobotError> {
        let kind = node.tag_name().name();
        match node.attribute("name") {
            Some(name) if !name.trim().is_empty() => Ok(format!("{kind} `{name}`")),
            _ => Err(self.invalid(line(node), kind, "has no name".to_string())),
        }
    }

    fn only_one<'a>(&self, node: Node<'a, 'a>, name: &str, title: &str, line: usize) -> Result<(), RobotError> {
        match node.children().filter(|c| c.is_element() && c.tag_name().name() == name).count() {
            0 | 1 => Ok(()),
            n => Err(self.invalid(line, title, format!("has {n} <{name}> elements; one is meant"))),
        }
    }

    /// Every known attribute at and below `node` is there and holds the right count of finite numbers.
    fn numbers_below<'a>(
        &self,
        node: Node<'a, 'a>,
        title: &str,
        line: &impl Fn(Node<'a, 'a>) -> usize,
    ) -> Result<(), RobotError> {
        for part in node.descendants().filter(Node::is_element) {
            let name = part.tag_name().name();
            let required = REQUIRED.iter().filter(|(element, _)| *element == name).flat_map(|(_, needed)| *needed);
            for attribute in required {
                if part.attribute(*attribute).is_none() {
                    return Err(self.invalid(line(part), title, format!("<{name}> lacks {attribute}=\"...\"")));
                }
            }
            for (_, attribute, count) in NUMBERS.iter().filter(|(element, ..)| *element == name) {
                let Some(value) = part.attribute(*attribute) else { continue };
                let words: Vec<&str> = value.split_whitespace().collect();
                let finite = words.iter().all(|w| w.parse::<f64>().is_ok_and(f64::is_finite));
                if words.len() != *count || !finite {
                    let what =
                        if *count == 1 { "a finite number".to_string() } else { format!("{count} finite numbers") };
                    let message = format!("<{name} {attribute}=\"{value}\"> must be {what}");
                    return Err(self.invalid(line(part), title, message));
                }
            }
        }
        Ok(())
    }
}
