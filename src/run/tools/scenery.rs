//! What docks, tools and hands look like: for views of the scene, and for pictures of a tool change stage by stage.
use nalgebra::{Point3, Vector3};

use super::kit::Kit;
use super::work::Change;
use crate::math::{Pose, Rgb};
use crate::mesh::TriMesh;
use crate::render::{ArmVisuals, Item, Material, View};
use crate::report::snapshot_name;
use crate::robot::Visual;
use crate::run::RunError;
use crate::skill::{Order, last_from_grip, tool_visuals, with_hand};
use crate::twin::grasp::Snapshot;

/// Colour of docks.
const DOCK: Rgb = Rgb([92, 96, 102]);
/// Colour of a pen in a dock that no ink is drawn from.
const SPARE: Rgb = Rgb([170, 170, 170]);

/// A picture of one stage of a tool change.
pub(super) struct StageView {
    /// Name of its file, without ending.
    pub name: String,
    /// What it shows, in words.
    pub caption: String,
    /// Everything but the scene's canvas and furniture.
    pub items: Vec<Item>,
    pub view: View,
}

fn placed(visuals: &[Visual], pose: &Pose) -> Vec<Item> {
    let place = |v: &Visual| {
        let item = Item::from_visual(v);
        Item { world_from_item: pose * item.world_from_item, ..item }
    };
    visuals.iter().map(place).collect()
}

/// The docks of an arm, and the tools in them but for the one in `empty`. `inks` are the colours of pens by dock.
pub(super) fn docks(kit: &Kit, inks: &[(usize, Rgb)], empty: Option<usize>) -> Result<Vec<Item>, RunError> {
    let dock: TriMesh = kit.set.dock_mesh().map_err(RunError::Tool)?;
    let mut items = Vec::new();
    for (i, place) in kit.docks.iter().enumerate() {
        let ink = inks.iter().find(|(dock, _)| *dock == i).map(|(_, color)| *color);
        items.push(Item::from_mesh(&dock.transformed(place), Material::furniture(DOCK)));
        if empty != Some(i) && kit.pens.contains(&i) {
            let visuals = tool_visuals(&kit.set, ink.unwrap_or(SPARE)).map_err(RunError::Tool)?;
            items.extend(placed(&visuals, place));
        }
    }
    Ok(items)
}

/// A tool with a pen of colour `ink` at a pose.
pub(super) fn tool(kit: &Kit, ink: Rgb, world_from_tool: &Pose) -> Result<Vec<Item>, RunError> {
    Ok(placed(&tool_visuals(&kit.set, ink).map_err(RunError::Tool)?, world_from_tool))
}

/// An arm with its hand and the tool as they stood at an instant.
fn at_work(kit: &Kit, snapshot: &Snapshot, ink: Rgb) -> Result<Vec<Item>, RunError> {
    let arm = with_hand(&kit.arm.model, &kit.hand, &snapshot.fingers);
    let mut items = ArmVisuals::new(&arm).items(arm.kinematics(&snapshot.q).world_from_links());
    items.extend(tool(kit, ink, &snapshot.world_from_tool)?);
    Ok(items)
}

/// One picture a stage of a tool change, close to the dock; names of files begin with `prefix`.
pub(super) fn stage_views(
    kit: &Kit,
    change: &Change,
    inks: &[(usize, Rgb)],
    colors: &[Rgb],
    size: [u32; 2],
    prefix: &str,
) -> Result<Vec<StageView>, RunError> {
    let place = kit.docks[change.dock];
    let (order, verb) = match change.record.order {
        Order::Pick => ("fetch", "Fetching"),
        Order::Return => ("return", "Bringing back"),
    };
    let mut views = Vec::new();
    let around = docks(kit, inks, Some(change.dock))?;
    for (i, snapshot) in change.record.snapshots.iter().enumerate() {
        let stage = snapshot_name(snapshot);
        let mut items = around.clone();
        items.extend(at_work(kit, snapshot, colors[change.layer])?);
        // from the front and the side of the fingers, a little from above, over the way of hand and tool
        let grip = kit.arm.model.kinematics(&snapshot.q);
        let last = grip.world_from_link(kit.arm.model.dof()) * last_from_grip(&kit.arm.model, &kit.hand);
        let at = |x: f64, y: f64, z: f64| place * Point3::new(x, y, z);
        let mut points = vec![last * Point3::new(0.1, 0.0, 0.0)];
        if snapshot.is_lost() {
            // far from the dock: hand and pen
            points.push(last * Point3::new(-0.15, 0.1, 0.1));
            points.extend([-0.25, 0.15].map(|z| snapshot.world_from_tool * Point3::new(0.0, 0.0, z)));
        } else {
            for z in [-0.14, 0.15] {
                points.extend([at(-0.3, -0.1, z), at(-0.3, 0.1, z), at(0.1, -0.1, z), at(0.1, 0.1, z)]);
            }
        }
        let direction = place.rotation * Vector3::new(-0.55, 1.0, -0.4);
        views.push(StageView {
            name: format!("{prefix}-{order}-{i}-{stage}"),
            caption: format!("{verb} a pen: {}", stage.replace('_', " ")),
            items,
            view: View::fit(&points, direction, Vector3::z(), 0.05, size),
        });
    }
    Ok(views)
}
