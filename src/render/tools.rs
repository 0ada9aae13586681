//! What docks, tools and hands look like.
use super::{ArmVisuals, Item, Material};
use crate::math::{Pose, Rgb};
use crate::mesh::{MeshError, TriMesh};
use crate::robot::Visual;
use crate::skill::{GripperKit, tool_visuals, with_hand};
use crate::twin::grasp::Snapshot;

/// Colour of docks.
const DOCK: Rgb = Rgb([92, 96, 102]);
/// Colour of a pen in a dock that no ink is drawn from.
const SPARE: Rgb = Rgb([170, 170, 170]);

fn placed(visuals: &[Visual], pose: &Pose) -> Vec<Item> {
    let place = |v: &Visual| {
        let item = Item::from_visual(v);
        Item { world_from_item: pose * item.world_from_item, ..item }
    };
    visuals.iter().map(place).collect()
}

/// The docks of an arm, and the tools in them but for the one in `empty`. `inks` are the colours of pens by dock.
///
/// # Errors
/// A tool or a dock makes no solid.
pub fn dock_items(kit: &GripperKit, inks: &[(usize, Rgb)], empty: Option<usize>) -> Result<Vec<Item>, MeshError> {
    let dock: TriMesh = kit.set.dock_mesh()?;
    let mut items = Vec::new();
    for (i, place) in kit.docks.iter().enumerate() {
        let ink = inks.iter().find(|(dock, _)| *dock == i).map(|(_, color)| *color);
        items.push(Item::from_mesh(&dock.transformed(place), Material::furniture(DOCK)));
        if empty != Some(i) && kit.pens.contains(&i) {
            items.extend(tool_items(kit, ink.unwrap_or(SPARE), place)?);
        }
    }
    Ok(items)
}

/// A tool with a pen of colour `ink` at a pose.
///
/// # Errors
/// The tool makes no solid.
pub fn tool_items(kit: &GripperKit, ink: Rgb, world_from_tool: &Pose) -> Result<Vec<Item>, MeshError> {
    Ok(placed(&tool_visuals(&kit.set, ink)?, world_from_tool))
}

/// An arm with its hand and the tool as they stood at an instant.
///
/// # Errors
/// The tool makes no solid.
pub fn hand_items(kit: &GripperKit, snapshot: &Snapshot, ink: Rgb) -> Result<Vec<Item>, MeshError> {
    let arm = with_hand(&kit.arm, &kit.hand, &snapshot.fingers);
    let mut items = ArmVisuals::new(&arm).items(arm.kinematics(&snapshot.q).world_from_links());
    items.extend(tool_items(kit, ink, &snapshot.world_from_tool)?);
    Ok(items)
}
