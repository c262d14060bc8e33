//! How much room a scene takes.

use glam::{Affine3A, Vec3};

use crate::{Deformation, Deformed, Geometry, Scene, State};

/// An axis-aligned box, in metres. Both corners belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest x, y and z.
    pub min: Vec3,
    /// Largest x, y and z.
    pub max: Vec3,
}

impl Bounds {
    /// The smallest box around `points`; `None` if there are none.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Option<Bounds> {
        points.into_iter().map(|point| Bounds { min: point, max: point }).reduce(Bounds::union)
    }

    /// The smallest box around both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The middle.
    pub fn centre(&self) -> Vec3 {
        // Halved first: the sum of two large finite numbers may not be finite.
        0.5 * self.min + 0.5 * self.max
    }

    /// Half the diagonal: radius of the sphere through the corners.
    pub fn radius(&self) -> f32 {
        (0.5 * self.max - 0.5 * self.min).length()
    }

    /// The smallest box around this box moved by `transform`. (Arvo, Graphics Gems I, 1990: extents add
    /// up with the absolute values of the matrix.)
    pub fn transformed(&self, transform: &Affine3A) -> Bounds {
        let half = 0.5 * self.max - 0.5 * self.min;
        let matrix = transform.matrix3;
        let half = matrix.x_axis.abs() * half.x
            + matrix.y_axis.abs() * half.y
            + matrix.z_axis.abs() * half.z;
        let centre = transform.transform_point3(self.centre());
        Bounds { min: centre - Vec3::from(half), max: centre + Vec3::from(half) }
    }
}

impl Geometry {
    /// The smallest box around the shape, in its own coordinates; `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<Bounds> {
        match self {
            Geometry::Sphere { .. } => Some(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE }),
            Geometry::Mesh(mesh) => Bounds::of_points(mesh.positions.iter().copied()),
        }
    }
}

impl Scene {
    /// A box around all instances at the moment of `state`: around each shape's own box, so up to √3 too
    /// large where things are turned. `None` if there is nothing to be seen.
    pub fn bounds_at(&self, state: &State) -> Option<Bounds> {
        let local: Vec<_> = self.geometries.iter().map(Geometry::bounds).collect();
        let mut deformations = self.deformations.iter().enumerate().peekable();
        let mut deformed = Deformed::default();
        let boxes = self.instances.iter().enumerate().filter_map(|(index, instance)| {
            let deforms = |&(_, d): &(usize, &Deformation)| d.instance as usize == index;
            let local = match deformations.next_if(deforms) {
                Some((number, _)) => {
                    self.deform(number, state, &mut deformed);
                    let points = deformed.positions().iter().map(|&point| Vec3::from(point));
                    Bounds::of_points(points.filter(|point| point.is_finite()))
                }
                None => local[instance.geometry as usize],
            };
            local.map(|bounds| bounds.transformed(&self.world_from_instance(index, state)))
        });
        boxes.reduce(Bounds::union)
    }
}
