//! One tree over the triangles of all instances that stand still, instead of one per instance below another over the instances: where
//! their boxes overlap, as those of furniture and the room around it do, a ray would walk each of them from its root.
//!
//! The boxes are the world's; the triangles stay in their instances' coordinates, into which the ray is taken where a leaf is met, so that
//! every test is the one of two levels, bit for bit. Boxes are wider than their triangles by what rounding on that way can amount to.
//!
//! Which instances stand still is known by the animation. Should one be moved all the same (see [`World::update_moment_with`]), that moment
//! is walked on two levels.
//!
//! [`World::update_moment_with`]: crate::world::World::update_moment_with

use frameless_scene::{Geometry, Instance, Mesh, Scene, Target};
use glam::{Affine3A, Vec3A};
use obvhs::aabb::Aabb;

use crate::build::{Blas, FARTHEST, Tree, corners};
use crate::kernel::{Kernel, ShearRay, SlabRay};
use crate::ray::{Hit, Ray};
use crate::sift::Sieve;
use crate::top::{NOTHING, Placed};
use crate::traverse::{Leaves, Stack, walk};
use crate::wide::Child;

/// The instances that stand still, if there are several, and their tree.
pub(crate) struct Standing {
    tree: Blas,
    /// Of each pack of the tree.
    instance: Vec<u32>,
    /// Where each instance of the scene stands; `None`: it is not in the tree.
    places: Vec<Option<Affine3A>>,
}

/// Of what the largest coordinate is: 64 roundings, as for [`crate::point`]'s way to the world and back.
const PADDING: f32 = 64.0 * f32::EPSILON;

impl Standing {
    /// `None` where a tree of its own for every instance does as well: there is but one, or none.
    pub(crate) fn new(scene: &Scene) -> Option<Standing> {
        let places = places(scene);
        if places.iter().flatten().count() < 2 {
            return None;
        }
        let mut members = Vec::new();
        let mut boxes = Vec::new();
        for (instance, place) in places.iter().enumerate() {
            let (Some(place), Some(mesh)) = (place, mesh_of(scene, instance)) else { continue };
            for primitive in 0..mesh.triangles.len() as u32 {
                if let Some(bounds) = world_box(place, mesh, primitive) {
                    members.push((instance as u32, primitive));
                    boxes.push(bounds);
                }
            }
        }
        let farthest = boxes.iter().map(|b| b.min.abs().max(b.max.abs()).max_element());
        let padding = Vec3A::splat(PADDING * farthest.fold(0.0, f32::max));
        boxes.iter_mut().for_each(|b| *b = Aabb::new(b.min - padding, b.max + padding));
        let place = |member: u32| members[member as usize];
        let corners = |instance: u32, primitive: u32| {
            mesh_of(scene, instance as usize)
                .map_or([glam::Vec3::ZERO; 3], |m| corners(m, primitive))
        };
        let Tree { blas, instance } = Tree::over(&boxes, place, corners);
        Some(Standing { tree: blas, instance, places })
    }

    /// Whether the tree has this instance.
    #[inline]
    pub(crate) fn has(&self, instance: usize) -> bool {
        self.places[instance].is_some()
    }

    /// Whether everything is where it was when the tree was made.
    pub(crate) fn holds(&self, placed: &[Placed]) -> bool {
        let mut all = self.places.iter().zip(placed);
        all.all(|(place, placed)| place.is_none_or(|place| place == placed.world_from_object))
    }

    /// The nearest hit before `t_max`, which becomes its t; with `ANY`, any.
    #[inline(always)]
    pub(crate) fn walk<K: Kernel, const ANY: bool>(
        &self,
        placed: &[Placed],
        ray: &Ray,
        t_max: &mut f32,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let mut leaves = Packs::<K, ANY, NoSieve> {
            standing: self,
            placed,
            ray,
            local: None,
            hit: NOTHING,
            sieve: NoSieve,
            kernel: Default::default(),
        };
        walk::<K, ANY>(&self.tree.nodes, &SlabRay::new(ray), t_max, stack, &mut leaves)
            .then_some(leaves.hit)
    }

    /// The same of hits that `sieve` stops.
    #[inline(always)]
    pub(crate) fn sift<K: Kernel, const ANY: bool>(
        &self,
        placed: &[Placed],
        ray: &Ray,
        t_max: &mut f32,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let is_for_all = sieve.is_for_all();
        let mut leaves = Packs::<K, ANY, _> {
            standing: self,
            placed,
            ray,
            local: None,
            hit: NOTHING,
            sieve: Asks { sieve, is_for_all },
            kernel: Default::default(),
        };
        walk::<K, ANY>(&self.tree.nodes, &SlabRay::new(ray), t_max, stack, &mut leaves)
            .then_some(leaves.hit)
    }
}

/// Per instance of the scene: where it stands, if it is a rigid mesh of its own, nothing moves it, and rays can be taken into its
/// coordinates. Meshes that several instances share stay apart: they would be in the tree as often.
fn places(scene: &Scene) -> Vec<Option<Affine3A>> {
    let mut uses = vec![0u32; scene.geometries.len()];
    scene.instances.iter().for_each(|instance| uses[instance.geometry as usize] += 1);
    let (moves, state) = (moving_nodes(scene), scene.state_at(0.0));
    let place = |(index, instance): (usize, &Instance)| {
        let stands = !moves[instance.node as usize]
            && uses[instance.geometry as usize] == 1
            && scene.deformation_of(index).is_none()
            && mesh_of(scene, index).is_some();
        let place = scene.world_from_instance(index, &state);
        let inverse = place.inverse();
        let is_sane = inverse.matrix3.is_finite()
            && inverse.translation.is_finite()
            && place.matrix3.determinant() != 0.0;
        (stands && is_sane).then_some(place)
    };
    scene.instances.iter().enumerate().map(place).collect()
}

/// Per node: whether the animation moves it or what it hangs on.
fn moving_nodes(scene: &Scene) -> Vec<bool> {
    let mut moves = vec![false; scene.nodes.len()];
    for channel in &scene.animation.channels {
        match channel.target {
            Target::Translation(node) | Target::Rotation(node) | Target::Scale(node) => {
                moves[node as usize] = true;
            }
            Target::LightIntensity(_) | Target::MorphWeight(_) => {}
        }
    }
    for (index, node) in scene.nodes.iter().enumerate() {
        moves[index] |= node.parent.is_some_and(|parent| moves[parent as usize]);
    }
    moves
}

fn mesh_of(scene: &Scene, instance: usize) -> Option<&Mesh> {
    match &scene.geometries[scene.instances[instance].geometry as usize] {
        Geometry::Mesh(mesh) => Some(mesh),
        Geometry::Sphere { .. } => None,
    }
}

/// `None` of what cannot be hit.
fn world_box(place: &Affine3A, mesh: &Mesh, primitive: u32) -> Option<Aabb> {
    let local = corners(mesh, primitive).map(Vec3A::from);
    let there = local.map(|corner| place.transform_point3a(corner));
    let is_sane = |c: &Vec3A| c.is_finite() && c.abs().max_element() < FARTHEST;
    (local.iter().chain(&there).all(is_sane)).then(|| Aabb::from_points(&there))
}

/// Whether a hit is one.
trait Stops {
    fn stops(&mut self, placed: &Placed, hit: &Hit) -> bool;
    /// Whether hits of this instance have to be asked about one by one, the repeated lanes left out.
    fn asks(&self, placed: &Placed) -> bool;
}

struct NoSieve;

impl Stops for NoSieve {
    #[inline(always)]
    fn stops(&mut self, _placed: &Placed, _hit: &Hit) -> bool {
        true
    }

    #[inline(always)]
    fn asks(&self, _placed: &Placed) -> bool {
        false
    }
}

struct Asks<'s> {
    sieve: &'s mut dyn Sieve,
    is_for_all: bool,
}

impl Stops for Asks<'_> {
    fn stops(&mut self, placed: &Placed, hit: &Hit) -> bool {
        !self.asks(placed) || self.sieve.stops(hit)
    }

    fn asks(&self, placed: &Placed) -> bool {
        self.is_for_all || placed.has_holes
    }
}

/// The leaves: packs of triangles of one instance each.
struct Packs<'a, K, const ANY: bool, S> {
    standing: &'a Standing,
    placed: &'a [Placed],
    ray: &'a Ray,
    /// The ray in the coordinates of the instance met last; `None` in it where those have no room for it.
    local: Option<(u32, Option<ShearRay>)>,
    hit: Hit,
    sieve: S,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const ANY: bool, S: Stops> Packs<'_, K, ANY, S> {
    #[inline(always)]
    fn ray_in(&mut self, instance: u32) -> Option<ShearRay> {
        match self.local {
            Some((last, ray)) if last == instance => ray,
            _ => {
                let to_object = &self.placed[instance as usize].object_from_world;
                // Not normalised, so that t means the same here and in the world.
                let ray = self.ray.transformed(to_object);
                let ray = ray.is_traceable().then(|| ShearRay::new(&ray));
                self.local = Some((instance, ray));
                ray
            }
        }
    }
}

impl<K: Kernel, const ANY: bool, S: Stops> Leaves for Packs<'_, K, ANY, S> {
    #[inline(always)]
    fn visit(&mut self, leaf: Child, t_max: &mut f32, _stack: &mut Stack) -> bool {
        let mut found = false;
        for index in leaf.items() {
            let instance = self.standing.instance[index];
            let Some(ray) = self.ray_in(instance) else { continue };
            let pack = &self.standing.tree.packs[index];
            let lanes = K::triangles(pack, &ray, *t_max);
            if lanes.mask == 0 {
                continue;
            }
            let placed = &self.placed[instance as usize];
            let asks = self.sieve.asks(placed);
            if ANY && !asks {
                return true;
            }
            for lane in 0..4 {
                // Unused lanes repeat the last used one, which is to be asked about once.
                let repeats = asks && lane > 0 && pack.primitive[lane] == pack.primitive[lane - 1];
                if lanes.mask >> lane & 1 == 0 || repeats || lanes.t[lane] >= *t_max {
                    continue;
                }
                let hit = Hit {
                    t: lanes.t[lane],
                    barycentric: [lanes.v[lane], lanes.w[lane]],
                    primitive: pack.primitive[lane],
                    instance,
                };
                if !self.sieve.stops(placed, &hit) {
                    continue;
                }
                self.hit = hit;
                if ANY {
                    return true;
                }
                *t_max = hit.t;
                found = true;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless::{Request, Size};
    use frameless_scene::builtin;

    use crate::camera::{Camera, ViewSource};
    use crate::moment::Moment;
    use crate::traverse::Stack;
    use crate::world::World;

    const SIZE: Size = Size { width: 160, height: 120 };

    fn world() -> World {
        World::new(Arc::new(builtin("shadow").expect("it is built in")))
    }

    fn hits(world: &World, moment: &Moment) -> Vec<Option<crate::ray::Hit>> {
        let view = ViewSource::Camera(0).at(world.scene(), moment.state());
        let (camera, mut stack) = (Camera::new(&view, SIZE), Stack::new());
        let rays = (0..SIZE.pixels() as u32).map(|pixel| Request::in_sequence(pixel, 1));
        rays.map(|request| moment.targets(world).closest(&camera.ray(&request), &mut stack))
            .collect()
    }

    #[test]
    fn one_tree_finds_what_two_levels_find() {
        let world = world();
        let mut moment = world.moment(0.5);
        assert!(moment.targets(&world).standing.is_some(), "nothing stands: this tests nothing");
        let one = hits(&world, &moment);
        assert!(one.iter().flatten().count() > SIZE.pixels() / 2);
        let node = world.scene().instances[first_standing(&world)].node as usize;
        let place = |state: &mut frameless_scene::State| {
            state.world_from_node[node].translation.y -= 1e3;
        };
        world.update_moment_with(0.5, &mut moment, place);
        assert!(moment.targets(&world).standing.is_none(), "what has moved counts as standing");
        let gone = first_standing(&world) as u32;
        let two = hits(&world, &moment);
        let mut compared = 0;
        for (one, two) in
            one.iter().zip(&two).filter(|(one, _)| one.is_none_or(|hit| hit.instance != gone))
        {
            assert_eq!(one, two);
            compared += 1;
        }
        assert!(compared > 100, "{compared}");
    }

    fn first_standing(world: &World) -> usize {
        let standing = world.standing.as_ref().expect("something stands");
        (0..world.scene().instances.len()).rfind(|&k| standing.has(k)).expect("one of them")
    }
}
