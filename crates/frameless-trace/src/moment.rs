//! The world at one time.

use frameless::{Light, Lighting, Placement, Pose, Size};
use frameless_scene::{Geometry, State, View};

use glam::Affine3A;
use rayon::prelude::*;

use crate::camera::Camera;
use crate::deforming::Deforming;
use crate::emitters::Lamps;
use crate::lights::lights_now;
use crate::top::{Placed, Shape, Targets, Top, Trees};
use crate::world::World;

/// A [`World`] at one time: where everything is, how bright the lights are, and the top-level BVH. Its memory can be used
/// again for another time, see [`World::update_moment`].
pub struct Moment {
    /// Which world and what time it shows; `None` before the first update.
    shows: Option<(u64, f64)>,
    state: State,
    placed: Vec<Placed>,
    /// Per deformation of the scene.
    deforming: Vec<Deforming>,
    top: Top,
    /// Whether what stands still does so now; else it is in `top` like everything else.
    standing_holds: bool,
    pub(crate) lights: Vec<Light>,
    pub(crate) lamps: Lamps,
}

impl Moment {
    /// The scene's state that this moment shows.
    pub fn state(&self) -> &State {
        &self.state
    }

    pub(crate) fn placed(&self, instance: u32) -> &Placed {
        &self.placed[instance as usize]
    }

    /// What deforms there, if it does.
    #[inline]
    pub(crate) fn deforming(&self, placed: &Placed) -> Option<&Deforming> {
        match placed.shape {
            Shape::Deforming(index) => Some(&self.deforming[index as usize]),
            Shape::Mesh(_) | Shape::Sphere => None,
        }
    }

    #[inline]
    pub(crate) fn targets<'a>(&'a self, world: &'a World) -> Targets<'a> {
        let trees = Trees { rigid: &world.blas, deforming: &self.deforming };
        let standing = world.standing.as_ref().filter(|_| self.standing_holds);
        Targets { top: &self.top, placed: &self.placed, trees, standing, isa: world.isa }
    }
}

/// Of all that deforms; below, handing it out takes longer than doing it.
const MANY_TRIANGLES: usize = 10_000;

fn placement(world_from_object: &Affine3A) -> Placement {
    let Affine3A { matrix3: m, translation } = world_from_object;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    // The columns of the inverse transpose, but for a factor that keeps the side.
    let side = m.determinant().signum();
    let [u, v, w] = [side * y.cross(z), side * z.cross(x), side * x.cross(y)];
    Placement {
        point: std::array::from_fn(|k| [x[k], y[k], z[k], translation[k]]),
        normal: std::array::from_fn(|k| [u[k], v[k], w[k]]),
    }
}

impl World {
    /// The world at `secs` of scene time.
    pub fn moment(&self, secs: f64) -> Moment {
        let mut moment = Moment {
            shows: None,
            state: State::default(),
            placed: Vec::new(),
            deforming: Vec::new(),
            top: Top::new(),
            standing_holds: false,
            lights: Vec::new(),
            lamps: Lamps::default(),
        };
        self.update_moment(secs, &mut moment);
        moment
    }

    /// Make `moment`, of this or any other world, show this world at `secs`. Does nothing if it does so already, and leaves
    /// the BVHs alone of what has not moved.
    pub fn update_moment(&self, secs: f64, moment: &mut Moment) {
        if moment.shows == Some((self.id, secs)) {
            return;
        }
        self.update_moment_with(secs, moment, |_| ());
        moment.shows = Some((self.id, secs));
    }

    /// As [`World::update_moment`], but `change` may do something to the scene's state before anything is placed: move nodes (and
    /// [compose](frameless_scene::Scene::compose_world) the world again), dim lights.
    pub fn update_moment_with(
        &self,
        secs: f64,
        moment: &mut Moment,
        change: impl FnOnce(&mut State),
    ) {
        let same_world = moment.shows.is_some_and(|(world, _)| world == self.id);
        self.scene().update_state(secs, &mut moment.state);
        change(&mut moment.state);
        lights_now(self.scene(), &moment.state, &mut moment.lights);
        if !same_world {
            moment.placed.clear();
            moment.lamps.clear();
            moment.deforming.clone_from(&self.deforming);
        }
        let mut moved = self.place_instances(moment);
        let state = &moment.state;
        let update = |(index, one): (usize, &mut Deforming)| one.update(self.scene(), index, state);
        let triangles: usize = moment.deforming.iter().map(Deforming::triangles).sum();
        moved |= match moment.deforming.len() > 1 && triangles > MANY_TRIANGLES {
            true => {
                let all = moment.deforming.par_iter_mut().enumerate();
                all.map(update).reduce(|| false, |a, b| a | b)
            }
            // Not `any`: all of them are to be updated.
            false => moment.deforming.iter_mut().enumerate().map(update).fold(false, |a, b| a | b),
        };
        if moved || !same_world {
            let standing = self.standing.as_ref().filter(|all| all.holds(&moment.placed));
            moment.standing_holds = standing.is_some();
            if standing.is_none() && self.standing.is_some() {
                self.part_what_stands();
            }
            let trees = Trees { rigid: &self.blas, deforming: &moment.deforming };
            moment.top.rebuild(&moment.placed, trees, standing);
            self.emitters.place(&moment.placed, &mut moment.lamps);
        }
        // No time equals NaN: what the scene shows by itself at this time is another picture.
        moment.shows = Some((self.id, f64::NAN));
    }

    /// Fills in where everything is in a picture of `size` at `moment`, which shows this world: every instance, and its images in
    /// mirrors.
    pub fn pose(&self, moment: &Moment, view: &View, size: Size, pose: &mut Pose) {
        let camera = Camera::new(view, size);
        pose.picture_from_object.clear();
        let instances =
            moment.placed.iter().map(|placed| camera.picture_from(&placed.world_from_object));
        pose.picture_from_object.extend(instances);
        pose.picture_from_sky = camera.picture_from_direction();
        pose.deformed.clear();
        if !moment.deforming.is_empty() {
            let deformed = |placed: &Placed| moment.deforming(placed).map(Deforming::vertices);
            pose.deformed.extend(moment.placed.iter().map(deformed));
        }
        self.mirrors.pose(&moment.placed, &camera, pose);
    }

    /// Fills in the lights of `moment`, which shows this world, and how every instance that does not deform stands in it; what is seen in mirrors is lit
    /// where it is.
    pub fn lighting(&self, moment: &Moment, lighting: &mut Lighting) {
        lighting.lights.clone_from(&moment.lights);
        lighting.world_from_object.clear();
        let placements = moment.placed.iter().map(|placed| {
            let is_rigid = moment.deforming(placed).is_none();
            is_rigid.then(|| placement(&placed.world_from_object))
        });
        lighting.world_from_object.extend(placements);
        self.mirrors.repeat(&mut lighting.world_from_object, None);
    }

    /// Whether any instance has moved.
    fn place_instances(&self, moment: &mut Moment) -> bool {
        let (mut moved, geometries) = (false, &self.scene().geometries);
        for (index, instance) in self.scene().instances.iter().enumerate() {
            let world_from_object = self.scene().world_from_instance(index, &moment.state);
            let stood = self.standing.as_ref().and_then(|standing| standing.place(index));
            match moment.placed.get_mut(index) {
                Some(placed) if placed.world_from_object == world_from_object => continue,
                Some(placed) => {
                    *placed = Placed::new(world_from_object, stood, placed.shape, placed.has_holes);
                }
                None => {
                    let deformation = self.scene().deformation_of(index);
                    let shape = match (&geometries[instance.geometry as usize], deformation) {
                        (Geometry::Mesh(_), Some(deformation)) => {
                            Shape::Deforming(deformation as u32)
                        }
                        (Geometry::Mesh(_), None) => Shape::Mesh(instance.geometry),
                        (Geometry::Sphere { .. }, _) => Shape::Sphere,
                    };
                    let has_holes = self.holes[instance.geometry as usize];
                    moment.placed.push(Placed::new(world_from_object, stood, shape, has_holes));
                }
            }
            moved = true;
        }
        moved
    }
}
