//! What is to be seen: surfaces with materials, ink, and a floor.
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::ribbon::Ribbons;
use super::shape::{DEFAULT_CREASE, Surface};
use crate::math::{Pose, Rgb};
use crate::mesh::TriMesh;
use crate::robot::{ArmModel, Visual, VisualShape};

/// How a surface reflects light. Shares are 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Colour, sRGB.
    pub color: Rgb,
    /// Roughness of the highlight: 0 a mirror, 1 chalk.
    pub roughness: f64,
    /// Share of metal.
    pub metallic: f64,
    /// Share of a glossy clear coat.
    pub clearcoat: f64,
    /// How matte: 1 takes away the gloss that every smooth surface has.
    pub matte: f64,
}

/// A surface in its place.
#[derive(Clone, Debug)]
pub struct Item {
    /// Triangles in the item's own frame, shared between the frames of a video.
    pub surface: Arc<Surface>,
    /// Where the item is.
    pub world_from_item: Pose,
    /// What it is made of.
    pub material: Material,
}

/// Everything in a picture but the camera and the light.
#[derive(Clone, Debug, Default)]
pub struct RenderScene {
    /// Surfaces.
    pub items: Vec<Item>,
    /// Ink on the canvas.
    pub ink: Ribbons,
    /// Height of the studio floor, m, or `None` for no floor.
    pub floor: Option<f64>,
    /// Horizontal direction from the scene to those who look at it, which is where the light comes from
    /// ([`super::Framing::facing`]); zero means +x.
    pub facing: Vector3<f64>,
}

impl Material {
    /// Paper or plaster, as a canvas is made of.
    pub fn paper(color: Rgb) -> Self {
        Material { color, roughness: 0.9, metallic: 0.0, clearcoat: 0.0, matte: 0.8 }
    }
    /// Satin paint, as on robots; dark parts are rubber and plastic and shine less.
    pub fn painted(color: Rgb) -> Self {
        let dark = color.0.iter().all(|c| *c < 70);
        let (roughness, clearcoat) = if dark { (0.5, 0.0) } else { (0.38, 0.3) };
        Material { color, roughness, metallic: 0.0, clearcoat, matte: 0.0 }
    }
    /// Brushed or anodised metal.
    pub fn metal(color: Rgb) -> Self {
        Material { color, roughness: 0.38, metallic: 0.9, clearcoat: 0.0, matte: 0.0 }
    }
    /// Oiled wood, laminate and other furniture.
    pub fn furniture(color: Rgb) -> Self {
        Material { color, roughness: 0.6, metallic: 0.0, clearcoat: 0.0, matte: 0.2 }
    }
}

impl Item {
    /// A visual of a robot, painted, where it is in its link's frame.
    pub fn from_visual(visual: &Visual) -> Self {
        let surface = match &visual.shape {
            VisualShape::Mesh { vertices, triangles } => Surface::smoothed(vertices, triangles, DEFAULT_CREASE),
            VisualShape::Cylinder { radius, length } => Surface::cylinder(*radius, *length),
            VisualShape::Sphere { radius } => Surface::sphere(*radius),
            VisualShape::Cuboid { size } => Surface::cuboid(*size),
        };
        Item {
            surface: Arc::new(surface),
            world_from_item: visual.link_from_visual,
            material: Material::painted(visual.color),
        }
    }

    /// A mesh that is already in world coordinates (a canvas, a table).
    pub fn from_mesh(mesh: &TriMesh, material: Material) -> Self {
        Item { surface: Arc::new(Surface::from_mesh(mesh)), world_from_item: Pose::identity(), material }
    }
}

/// The visuals of an arm, made ready once and then placed for each picture.
#[derive(Clone, Debug)]
pub struct ArmVisuals {
    parts: Vec<(usize, Item)>,
}

impl ArmVisuals {
    /// Reads the visuals of every link.
    pub fn new(arm: &ArmModel) -> Self {
        let mut parts = Vec::new();
        for (link, model) in arm.links.iter().enumerate() {
            parts.extend(model.visuals.iter().map(|visual| (link, Item::from_visual(visual))));
        }
        ArmVisuals { parts }
    }

    /// The visuals with link `i` at `world_from_link[i]`; links without a pose are left out.
    pub fn items(&self, world_from_link: &[Pose]) -> Vec<Item> {
        let place = |(link, item): &(usize, Item)| {
            let world_from_item = world_from_link.get(*link)? * item.world_from_item;
            Some(Item { world_from_item, ..item.clone() })
        };
        self.parts.iter().filter_map(place).collect()
    }
}

impl RenderScene {
    /// Bounds (lower, upper) of all items, m, world; `None` when there is nothing.
    pub fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        let points = self.items.iter().flat_map(|i| i.surface.positions.iter().map(|p| i.world_from_item * p));
        points.fold(None, |b, p| match b {
            None => Some((p, p)),
            Some((lo, hi)) => Some((lo.inf(&p), hi.sup(&p))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{LinkModel, SpatialInertia, Visual};
    use nalgebra::Matrix3;

    #[test]
    fn visuals_follow_their_link() {
        let link = |x: f64| LinkModel {
            name: String::new(),
            inertia: SpatialInertia { mass: 1.0, com: Point3::origin(), inertia: Matrix3::identity() },
            capsules: vec![],
            visuals: vec![Visual {
                link_from_visual: Pose::translation(x, 0.0, 0.0),
                shape: VisualShape::Cuboid { size: Vector3::repeat(0.2) },
                color: Rgb([200, 200, 200]),
            }],
        };
        let arm = ArmModel {
            name: "two".into(),
            world_from_base: Pose::identity(),
            joints: vec![],
            links: vec![link(0.0), link(1.0)],
            last_from_tip: Pose::identity(),
        };
        let items = ArmVisuals::new(&arm).items(&[Pose::identity(), Pose::translation(0.0, 2.0, 0.0)]);
        let scene = RenderScene { items, ..Default::default() };
        let (lo, hi) = scene.bounds().unwrap();
        assert!(
            (lo - Point3::new(-0.1, -0.1, -0.1)).norm() < 1e-12 && (hi - Point3::new(1.1, 2.1, 0.1)).norm() < 1e-12
        );
    }
}
