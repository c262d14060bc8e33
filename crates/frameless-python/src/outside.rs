//! What the engine knows of a renderer that lives in Python: from where it looks, and where its objects are.

use std::sync::Arc;

use frameless::{Answer, Batch, Pose, Size, Surface, Tracer};
use glam::{Affine3A, Vec3};

use crate::camera::{Camera, IN_PLACE};

/// Where the renderer's objects are: world from object, by number. Those beyond the end stand where they were made.
pub(crate) type Transforms = Arc<Vec<Placed>>;

/// An object's place, both ways.
#[derive(Clone, Copy)]
pub(crate) struct Placed {
    world_from_object: Affine3A,
    object_from_world: Affine3A,
}

impl Placed {
    /// `None` if the transform flattens the object, so that there is no way back.
    pub(crate) fn new(world_from_object: Affine3A) -> Option<Placed> {
        let object_from_world = world_from_object.inverse();
        let placed = Placed { world_from_object, object_from_world };
        object_from_world.is_finite().then_some(placed)
    }
}

/// The renderer's place in the engine. Batches do not come this way: the caller fetches them.
pub(crate) struct Outside {
    pub(crate) camera: Option<Camera>,
    pub(crate) transforms: Transforms,
    pub(crate) is_noisy: bool,
    /// One more than the largest object number seen.
    objects: u32,
    /// Whether any sample has told of a surface.
    tells_surfaces: bool,
}

impl Outside {
    pub(crate) fn new(camera: Option<Camera>, is_noisy: bool) -> Outside {
        let transforms = Transforms::default();
        Outside { camera, transforms, is_noisy, objects: 0, tells_surfaces: false }
    }

    /// Samples of these surfaces have come.
    pub(crate) fn note(&mut self, surfaces: &[Surface]) {
        let objects = surfaces.iter().map(|surface| surface.object).filter(|&o| o != Surface::SKY);
        self.objects = objects.fold(self.objects, |most, object| most.max(object + 1));
        self.tells_surfaces |= !surfaces.is_empty();
    }
}

impl Tracer for Outside {
    fn submit(&mut self, batch: Batch) {
        drop(batch);
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        None
    }

    fn is_noisy(&self) -> bool {
        self.is_noisy
    }

    fn pose(&mut self, _scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        let Some(camera) = self.camera.filter(|_| self.tells_surfaces) else { return false };
        let optics = camera.optics(size);
        pose.picture_from_object.clear();
        pose.picture_from_object.extend((0..self.objects as usize).map(|object| {
            let placed = self.transforms.get(object);
            optics.picture_from(placed.map_or(&IN_PLACE, |placed| &placed.world_from_object))
        }));
        pose.picture_from_sky = optics.picture_from_direction();
        pose.deformed.clear();
        pose.windows.clear();
        true
    }
}

/// A point hit in the world, as a surface that moves with its object.
pub(crate) fn surface(
    object: u32,
    position: [f32; 3],
    normal: [f32; 3],
    transforms: &[Placed],
) -> Surface {
    let (position, normal) = match transforms.get(object as usize) {
        None => (position, normal),
        Some(placed) => {
            // A normal goes with the inverse transpose; into the object, that is the transpose.
            let linear = placed.world_from_object.matrix3.transpose();
            let normal = linear * glam::Vec3A::from(normal);
            (
                placed.object_from_world.transform_point3(Vec3::from(position)).to_array(),
                normal.normalize_or_zero().to_array(),
            )
        }
    };
    Surface { object, position, normal, ..Surface::default() }
}
