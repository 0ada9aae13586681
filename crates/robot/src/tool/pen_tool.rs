//! The solids of a pen tool, in the tool frame.
use nalgebra::Point3;

use crate::mesh::{MeshError, TriMesh};
use crate::tool::{ConvexPart, ToolDesign, mesh_of};

/// Corners of round parts. So many that they turn freely in a dock: with the dock's own number, faces lock into faces.
const SIDES: usize = 72;
/// Depth in front of the flats, as a share of the width, of a tool without bevels: that of a tool with them.
const SQUARE_FRONT: f64 = 0.3;

impl ToolDesign {
    /// Height of the cone's lower end, m, tool frame: negative, below the gripper's middle.
    pub fn nose_end(&self) -> f64 {
        -(0.5 * self.height + self.nose.stem + self.nose.cone)
    }

    /// The nib, m, tool frame.
    pub fn pen_tip(&self) -> Point3<f64> {
        Point3::new(self.nose.axis, 0.0, self.nose_end() - self.nose.pen_reach)
    }

    /// Outline of the body from above, m, counter-clockwise.
    fn outline(&self) -> Vec<[f64; 2]> {
        let (half, chamfer) = (0.5 * self.width, self.back_chamfer);
        let mut outline = vec![[0.0, half - chamfer], [0.0, chamfer - half], [chamfer, -half]];
        match &self.bevel {
            Some(bevel) => {
                let front = 0.5 * bevel.front_width;
                let depth = self.flat + (half - front) / bevel.angle.tan();
                outline.extend([[self.flat, -half], [depth, -front], [depth, front], [self.flat, half]]);
            }
            None => {
                let depth = self.flat + SQUARE_FRONT * self.width;
                outline.extend([[depth, -half], [depth, half]]);
            }
        }
        outline.push([chamfer, half]);
        outline
    }

    /// The solids that collide: the body, the plates (over the upper finger at +y, over the thumb at -y), the stem, the cone.
    /// The nib collides with nothing here: it is soft, and the canvas has its own contact law.
    pub fn parts(&self) -> Vec<ConvexPart> {
        let half = 0.5 * self.width;
        let mut parts = vec![ConvexPart::prism(&self.outline(), -0.5 * self.height, 0.5 * self.height)];
        if let Some(p) = &self.plates {
            // rooted in the body, so that plate and body are one piece also in pictures
            let (root, end) = (half - 2e-3, half + p.reach);
            let (back, front) = (self.back_chamfer, self.flat);
            let over_finger = [[back, root], [front, root], [front, end], [back, end]];
            let over_thumb = [[back, -end], [front, -end], [front, -root], [back, -root]];
            for (outline, top) in [(over_finger, p.finger_top), (over_thumb, p.thumb_top)] {
                parts.push(ConvexPart::prism(&outline, top + p.gap, top + p.gap + p.thickness));
            }
        }
        let (n, low) = (&self.nose, self.nose_end());
        let seat = low + n.cone;
        parts.push(ConvexPart::turned(n.axis, &[[n.stem_radius, seat], [n.stem_radius, -0.5 * self.height]], SIDES));
        parts.push(ConvexPart::turned(n.axis, &[[n.tip_radius, low], [n.stem_radius, seat]], SIDES));
        parts
    }

    /// Density that gives the solids of [`parts`](Self::parts) the tool's mass, kg/m^3.
    pub fn density(&self) -> f64 {
        self.mass / self.parts().iter().map(ConvexPart::volume).sum::<f64>()
    }

    /// The pen, from the cone to the nib: to be seen only.
    pub fn pen(&self) -> ConvexPart {
        let (n, low) = (&self.nose, self.nose_end());
        let tip = low - n.pen_reach;
        let shoulder = tip + 0.4 * n.pen_reach;
        ConvexPart::turned(n.axis, &[[0.15 * n.pen_radius, tip], [n.pen_radius, shoulder], [n.pen_radius, low]], SIDES)
    }

    /// The tool as one sees it, without the pen.
    ///
    /// # Errors
    /// None of a design that was read from a file.
    pub fn mesh(&self) -> Result<TriMesh, MeshError> {
        mesh_of(&self.parts())
    }
}

#[cfg(test)]
mod tests {
    use crate::tool::ToolSet;

    #[test]
    fn every_part_is_convex_with_outward_faces() {
        let set = ToolSet::pen_tool().unwrap();
        for tool in [set.tool.clone(), set.clone().without_plates().tool, set.without_bevels().tool] {
            for part in tool.parts() {
                assert!(part.concavity() < 1e-12 && part.volume() > 0.0);
            }
            assert!(tool.mesh().unwrap().signed_volume() > 0.0);
        }
    }

    #[test]
    fn its_solids_weigh_what_the_tool_weighs() {
        let tool = ToolSet::pen_tool().unwrap().tool;
        let mass: f64 = tool.parts().iter().map(|p| p.volume() * tool.density()).sum();
        assert!((mass - 0.25).abs() < 1e-12);
    }
}
