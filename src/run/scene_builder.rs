//! What docks, tools and hands look like: for views of the scene, and for pictures of a tool change stage by stage.
use nalgebra::{Point3, Vector3};

use super::RunError;
use super::perform::Performance;
use super::pictures::Extra;
use super::setup::Setup;
use crate::math::Rgb;
use crate::render::{Item, View, dock_items, hand_items, tool_items};
use crate::report::snapshot_name;
use crate::scenario::Scenario;
use crate::skill::{GripperKit, Order, last_from_grip};
use crate::twin::grasp::{ChangeRecord, Snapshot};

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

/// Hands, docks and tools as they stand in the end, and pictures of the first fetch, the first return and a failure.
pub(super) fn tools(
    scenario: &Scenario,
    setup: &Setup,
    performance: &Performance,
) -> Result<(Extra, Vec<StageView>), RunError> {
    let colors: Vec<Rgb> = setup.drawing.layers.iter().map(|l| l.color).collect();
    let (mut extra, mut stages) = (Extra::default(), Vec::new());
    for (arm, kit) in setup.kits.iter().enumerate() {
        let Some(kit) = kit else { continue };
        let changes = &performance.changes[arm];
        let mut inks: Vec<(usize, Rgb)> =
            performance.places.iter().zip(&colors).filter(|(p, _)| p.0 == arm).map(|(p, c)| (p.1, *c)).collect();
        inks.dedup();
        let ending = performance.stops[arm].as_ref().and_then(|s| s.tool.as_ref());
        extra.items.extend(dock_items(kit, &inks, ending.map(|t| t.place.dock)).map_err(RunError::Tool)?);
        if let Some(ending) = ending {
            let held = tool_items(kit, colors[ending.place.layer], &ending.world_from_tool);
            extra.items.extend(held.map_err(RunError::Tool)?);
        }
        extra.models.push(kit.bare.clone());
        if !scenario.render.tool_stages || !stages.is_empty() {
            continue;
        }
        let first = |order| changes.iter().find(|c| c.order == order);
        let mut shown: Vec<(&ChangeRecord, &str)> =
            [Order::Pick, Order::Return].into_iter().filter_map(first).map(|c| (c, "stage")).collect();
        let lost = &performance.lost[arm];
        let failed = changes.iter().find(|c| c.snapshots.iter().any(|s| s.failed));
        let failed = failed.or_else(|| changes.last().filter(|_| !lost.is_empty()));
        if let Some(failed) = failed.filter(|f| shown.iter().all(|(s, _)| !std::ptr::eq(*s, *f))) {
            shown.push((failed, "stage-failed"));
        }
        for (change, prefix) in shown {
            let last = changes.last().is_some_and(|c| std::ptr::eq(c, change));
            let mut snapshots = change.snapshots.clone();
            snapshots.extend(lost.iter().filter(|_| last).cloned());
            stages.extend(stage_views(kit, change, &snapshots, &inks, &colors, scenario.render.view_px, prefix)?);
        }
    }
    Ok((extra, stages))
}

/// One picture a stage of a tool change, close to the dock; names of files begin with `prefix`.
fn stage_views(
    kit: &GripperKit,
    change: &ChangeRecord,
    snapshots: &[Snapshot],
    inks: &[(usize, Rgb)],
    colors: &[Rgb],
    size: [u32; 2],
    prefix: &str,
) -> Result<Vec<StageView>, RunError> {
    let place = kit.docks[change.place.dock];
    let (order, verb) = match change.order {
        Order::Pick => ("fetch", "Fetching"),
        Order::Return => ("return", "Bringing back"),
    };
    let mut views = Vec::new();
    let around = dock_items(kit, inks, Some(change.place.dock)).map_err(RunError::Tool)?;
    for (i, snapshot) in snapshots.iter().enumerate() {
        let stage = snapshot_name(snapshot);
        let mut items = around.clone();
        items.extend(hand_items(kit, snapshot, colors[change.place.layer]).map_err(RunError::Tool)?);
        // from the front and the side of the fingers, a little from above, over the way of hand and tool
        let grip = kit.arm.kinematics(&snapshot.q);
        let last = grip.world_from_link(kit.arm.dof()) * last_from_grip(&kit.arm, &kit.hand);
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
