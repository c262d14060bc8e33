//! Where everything is at one time, as the picture sees it: what reprojection needs to know of a renderer.

use std::ops::Range;
use std::sync::Arc;

use crate::Surface;

/// Where every object is in the picture at one time. Plain data: it can travel to another thread, or another machine.
///
/// A renderer fills it in [`Tracer::pose`](crate::Tracer::pose); a surface point sampled earlier is then found again
/// with [`Pose::project`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Per object number: picture from the object's coordinates.
    pub picture_from_object: Vec<Projection>,
    /// Picture from a direction to the sky; `None` where directions have no place in the picture (orthographic cameras).
    pub picture_from_sky: Option<Projection>,
    /// Per object number: its vertices now, if it deforms. May be shorter than `picture_from_object`.
    pub deformed: Vec<Option<Deformed>>,
    /// Parts of the picture in which other objects are seen than elsewhere, such as plane mirrors. Ascending by their objects,
    /// without overlap of these.
    pub windows: Vec<Window>,
}

/// A flat, convex pane: the objects that are seen in it are seen nowhere else, and all others are hidden behind it.
///
/// With p = (column, row, 1) in pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Window {
    /// Numbers of the objects that are seen in it.
    pub objects: Range<u32>,
    /// Its edges e: p is inside if e · p ≥ 0 for all of them.
    pub edges: Vec<[f32; 3]>,
    /// (n, d): where p is inside, the pane's depth is n · p / d · p; d · p is positive.
    pub depth: [[f32; 3]; 2],
}

/// Homogeneous picture coordinates from a point (x, y, z, 1), as rows: w·column, w·row, depth, w.
///
/// Columns and rows count pixels from the picture's top-left corner, as in [`crate::Request::position_px`]; the depth is the
/// distance along the direction of view in the renderer's unit of length. A point is in front of the camera if w > 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projection(pub [[f32; 4]; 4]);

/// The present vertices of an object that deforms (skinned, morphing), in the object's coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformed {
    /// The three vertices of every primitive.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// Where they are now.
    pub positions: Arc<Vec<[f32; 3]>>,
}

/// A point in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Column and row in pixels from the top-left corner; may lie outside the picture.
    pub px: [f32; 2],
    /// Distance along the direction of view; infinite for the sky.
    pub depth: f32,
}

impl Projection {
    /// Where the point is in the picture; `None` behind the camera.
    #[inline]
    pub fn project(&self, point: [f32; 3]) -> Option<Projected> {
        let [x, y, z] = point;
        let [column, row, depth, w] = self.0.map(|r| r[0] * x + r[1] * y + (r[2] * z + r[3]));
        let per_w = 1.0 / w;
        (w > 0.0).then_some(Projected { px: [column * per_w, row * per_w], depth })
    }
}

impl Pose {
    /// Where a surface point that was sampled at any time is in the picture now. `None`: behind the camera, outside its window or
    /// behind another, or the object is gone.
    #[inline]
    pub fn project(&self, surface: &Surface) -> Option<Projected> {
        let there = self.project_anywhere(surface)?;
        let is_seen = match self.window(surface.object) {
            Some(window) => window.contains(there.px),
            None => !self.windows.iter().any(|window| window.hides(&there)),
        };
        is_seen.then_some(there)
    }

    /// The only part of the picture in which an object is seen; `None`: it is seen where nothing hides it.
    #[inline]
    pub fn window(&self, object: u32) -> Option<&Window> {
        // The first is beyond most objects.
        let last = self.windows.iter().rev().find(|window| window.objects.start <= object)?;
        last.objects.contains(&object).then_some(last)
    }

    #[inline]
    fn project_anywhere(&self, surface: &Surface) -> Option<Projected> {
        if surface.object == Surface::SKY {
            let there = self.picture_from_sky?.project(surface.position)?;
            return Some(Projected { depth: f32::INFINITY, ..there });
        }
        let object = surface.object as usize;
        let projection = self.picture_from_object.get(object)?;
        match self.deformed.get(object) {
            Some(Some(deformed)) => projection.project(deformed.position(surface)?),
            _ => projection.project(surface.position),
        }
    }
}

/// Nearer to a window's depth than this, things belong to its frame.
pub(crate) const BEHIND: f32 = 1.001;

fn at([a, b, c]: &[f32; 3], px: [f32; 2]) -> f32 {
    a * px[0] + (b * px[1] + c)
}

impl Window {
    /// Whether a point of the picture, in pixels from its top-left corner, lies inside.
    #[inline]
    pub fn contains(&self, px: [f32; 2]) -> bool {
        self.edges.iter().all(|edge| at(edge, px) >= 0.0)
    }

    /// Whether what is not seen in it is hidden behind it there.
    #[inline]
    pub fn hides(&self, there: &Projected) -> bool {
        let [n, d] = self.depth.each_ref().map(|row| at(row, there.px));
        there.depth * d > n * BEHIND && self.contains(there.px)
    }
}

impl Deformed {
    /// The point with the surface's barycentric weights. `None` if the mesh no longer has that primitive.
    fn position(&self, surface: &Surface) -> Option<[f32; 3]> {
        let corners = self.triangles.get(surface.primitive as usize)?;
        let mut point = [0.0; 3];
        for (&corner, weight) in corners.iter().zip(surface.position) {
            let position = self.positions.get(corner as usize)?;
            (0..3).for_each(|k| point[k] += weight * position[k]);
        }
        Some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(object: u32, position: [f32; 3]) -> Surface {
        Surface { object, position, ..Surface::default() }
    }

    /// Looks along −z from the origin, focal length 100 pixels, middle of the picture at (50, 40).
    const PINHOLE: Projection = Projection([
        [100.0, 0.0, -50.0, 0.0],
        [0.0, -100.0, -40.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
    ]);

    #[test]
    fn a_pinhole_by_hand() {
        let pose = Pose {
            picture_from_object: vec![PINHOLE],
            picture_from_sky: Some(PINHOLE),
            ..Pose::default()
        };
        let there = pose.project(&surface(0, [1.0, 0.5, -2.0]));
        assert_eq!(there, Some(Projected { px: [100.0, 15.0], depth: 2.0 }));
        assert_eq!(pose.project(&surface(0, [0.0, 0.0, 1.0])), None, "behind the camera");
        assert_eq!(pose.project(&surface(1, [0.0, 0.0, -1.0])), None, "no such object any more");
        let sky = pose.project(&surface(Surface::SKY, [0.0, 0.0, -1.0]));
        assert_eq!(sky, Some(Projected { px: [50.0, 40.0], depth: f32::INFINITY }));
    }

    #[test]
    fn points_of_a_deforming_object_follow_its_vertices() {
        let deformed = |positions: Vec<[f32; 3]>| Deformed {
            triangles: Arc::new(vec![[2, 0, 1]]),
            positions: Arc::new(positions),
        };
        let mut pose = Pose { picture_from_object: vec![PINHOLE], ..Pose::default() };
        let middle = surface(0, [0.5, 0.25, 0.25]);
        pose.deformed =
            vec![Some(deformed(vec![[4.0, 0.0, -4.0], [0.0, 4.0, -4.0], [2.0, 2.0, -4.0]]))];
        let there = pose.project(&middle).expect("in front");
        assert_eq!(there, Projected { px: [100.0, -10.0], depth: 4.0 });
        pose.deformed = vec![Some(deformed(vec![[0.0; 3]; 2]))];
        assert_eq!(pose.project(&middle), None, "the vertex is gone");
    }

    #[test]
    fn a_window_shows_its_objects_and_hides_what_is_behind() {
        // The middle third of the picture, at depth 2.
        let middle_third = Window {
            objects: 1..3,
            edges: vec![[1.0, 0.0, -100.0 / 3.0], [-1.0, 0.0, 200.0 / 3.0]],
            depth: [[0.0, 0.0, 2.0], [0.0, 0.0, 1.0]],
        };
        let pose = Pose {
            picture_from_object: vec![PINHOLE; 4],
            picture_from_sky: Some(PINHOLE),
            windows: vec![middle_third],
            ..Pose::default()
        };
        let columns = |object, depth: f32| {
            [-0.25, -0.125, 0.125, 0.25].map(|x| {
                let there = pose.project(&surface(object, [x * depth, 0.0, -depth]));
                there.map(|there| there.px[0])
            })
        };
        for object in [0, 3] {
            assert_eq!(columns(object, 1.0), [Some(25.0), Some(37.5), Some(62.5), Some(75.0)]);
            assert_eq!(columns(object, 4.0), [Some(25.0), None, None, Some(75.0)]);
        }
        for object in [1, 2] {
            assert_eq!(columns(object, 4.0), [None, Some(37.5), Some(62.5), None]);
        }
        assert_eq!(columns(Surface::SKY, 1.0), [Some(25.0), None, None, Some(75.0)]);
    }
}
