//! The solids of a dock, in the frame of a tool seated in it.
use crate::mesh::{MeshError, TriMesh};
use crate::tool::{ConvexPart, ToolSet, mesh_of};

/// Depth of the chamber for the nib below its point, m.
const CHAMBER: f64 = 4e-3;

impl ToolSet {
    /// The solids of the dock that collide: two rings of wedges - a cone that matches the nose, and a guide that opens into a flare.
    /// Guide and flare are of one piece: where two solids meet in the bore, a nose that slides over the seam catches on the hidden face
    /// of the next.
    pub fn dock_parts(&self) -> Vec<ConvexPart> {
        let (d, n) = (&self.dock, &self.tool.nose);
        let low = self.tool.nose_end();
        let seat = low + n.cone;
        let (guide, top) = (seat + d.guide, seat + d.guide + d.flare);
        let bore = n.stem_radius + d.guide_clearance;
        let outer = d.flare_radius + d.wall;
        let cone = [[n.tip_radius, low], [n.stem_radius, seat]];
        let guide = [[bore, seat], [bore, guide], [d.flare_radius, top]];
        let ring = |inner: &[[f64; 2]]| -> Vec<_> {
            (0..d.wedges).map(|i| ConvexPart::wedge(n.axis, inner, outer, i, d.wedges)).collect()
        };
        [ring(&cone), ring(&guide)].concat()
    }

    /// The closed chamber round the nib, with the seal's lip on top: to be seen only.
    pub fn dock_chamber(&self) -> Vec<ConvexPart> {
        let (d, n) = (&self.dock, &self.tool.nose);
        let low = self.tool.nose_end();
        let floor = low - n.pen_reach - CHAMBER;
        let outer = d.flare_radius + d.wall;
        let wall = |section: [[f64; 2]; 2], i| ConvexPart::wedge(n.axis, &section, outer, i, d.wedges);
        let mut parts: Vec<_> = (0..d.wedges).map(|i| wall([[n.tip_radius, floor], [n.tip_radius, low]], i)).collect();
        parts.push(ConvexPart::turned(n.axis, &[[outer, floor - CHAMBER], [outer, floor]], d.wedges));
        if let Some(seal) = &d.seal {
            let lip = [[n.pen_radius.max(0.8 * n.tip_radius), low - seal.height], [n.tip_radius, low]];
            parts.extend((0..d.wedges).map(|i| ConvexPart::wedge(n.axis, &lip, n.tip_radius + 1e-3, i, d.wedges)));
        }
        parts
    }

    /// How far a tool must be lifted until its nose is clear of the dock, m.
    pub fn clear_lift(&self) -> f64 {
        self.tool.nose.cone + self.dock.guide + self.dock.flare
    }

    /// Whether the seal closes when the nose stands `gap` m off its seat; false of a dock without a seal.
    pub fn sealed(&self, gap: f64) -> bool {
        self.dock.seal.is_some_and(|seal| gap <= seal.gap)
    }

    /// The dock as one sees it.
    ///
    /// # Errors
    /// None of a design that was read from a file.
    pub fn dock_mesh(&self) -> Result<TriMesh, MeshError> {
        let mut parts = self.dock_parts();
        parts.extend(self.dock_chamber());
        mesh_of(&parts)
    }
}

#[cfg(test)]
mod tests {
    use crate::tool::ToolSet;

    #[test]
    fn every_wedge_is_convex() {
        let set = ToolSet::pen_tool().unwrap();
        let parts = set.dock_parts();
        assert_eq!(parts.len(), 2 * set.dock.wedges);
        assert!(parts.iter().chain(&set.dock_chamber()).all(|p| p.concavity() < 1e-9 && p.volume() > 0.0));
        assert!(set.dock_mesh().is_ok());
    }

    #[test]
    fn the_nose_fits_its_seat_and_clears_the_guide() {
        let set = ToolSet::pen_tool().unwrap();
        // no corner of a dock's bore lies within the stem
        let n = &set.tool.nose;
        let seat = set.tool.nose_end() + n.cone;
        for p in set.dock_parts().iter().flat_map(|part| part.points().to_vec()) {
            let r = (p.x - n.axis).hypot(p.y);
            assert!(p.z <= seat + 1e-9 || r >= n.stem_radius - 1e-9);
        }
    }
}
