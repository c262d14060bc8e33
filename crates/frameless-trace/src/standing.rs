//! One tree over the triangles of all instances that stand still, instead of one per instance below another over the instances: where
//! their boxes overlap, as those of furniture and the room around it do, a ray would walk each of them from its root.
//!
//! The triangles are where they stand in the world, so that a ray is taken nowhere. Should one of the instances be moved all the same (see
//! [`World::update_moment_with`]), that moment is walked on two levels, with a tree per instance over the same triangles, in the
//! coordinates that the world had for them: what has not moved is hit as before, to the last bit.
//!
//! Which instances stand still is known by the animation.
//!
//! [`World::update_moment_with`]: crate::world::World::update_moment_with

use std::marker::PhantomData;

use frameless_scene::{Geometry, Instance, Mesh, Scene, Target};
use glam::{Affine3A, Vec3};

use crate::build::{Blas, corners_at, sane_box};
use crate::kernel::{Kernel, ShearRay, SlabRay};
use crate::packet::{Finds, Packet, walk_together};
use crate::pages::prefer_large_pages;
use crate::ray::{Hit, Ray};
use crate::sift::Stops;
use crate::top::{Placed, first_of, take};
use crate::traverse::{Leaves, Stack, walk};
use crate::wide::Child;

/// The instances that stand still, if there are any, and their tree.
pub(crate) struct Standing {
    /// Its primitives are indices of `members`.
    tree: Blas,
    members: Vec<Member>,
    /// Where each instance of the scene stands; `None`: it is not in the tree.
    places: Vec<Option<Affine3A>>,
}

/// A triangle of an instance.
#[derive(Clone, Copy)]
struct Member {
    instance: u32,
    primitive: u32,
}

impl Standing {
    /// `None` if nothing stands.
    pub(crate) fn new(scene: &Scene) -> Option<Standing> {
        let places = places(scene);
        let standing = |instance: u32| {
            let mesh = mesh_of(scene, instance as usize)?;
            Some((places[instance as usize].as_ref()?, mesh))
        };
        let (mut members, mut boxes) = (Vec::new(), Vec::new());
        for instance in 0..scene.instances.len() as u32 {
            let Some((place, mesh)) = standing(instance) else { continue };
            for primitive in 0..mesh.triangles.len() as u32 {
                if let Some(bounds) = sane_box(&corners_at(place, mesh, primitive)) {
                    members.push(Member { instance, primitive });
                    boxes.push(bounds);
                }
            }
        }
        if places.iter().all(Option::is_none) {
            return None;
        }
        let corners = |member: u32| {
            let Member { instance, primitive } = members[member as usize];
            standing(instance)
                .map_or([Vec3::ZERO; 3], |(place, mesh)| corners_at(place, mesh, primitive))
        };
        let all: Vec<u32> = (0..members.len() as u32).collect();
        let tree = Blas::over(&all, boxes, corners);
        prefer_large_pages(&members);
        Some(Standing { tree, members, places })
    }

    /// Where an instance of the tree stands.
    #[inline]
    pub(crate) fn place(&self, instance: usize) -> Option<&Affine3A> {
        self.places[instance].as_ref()
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

    /// Tells `finds` what the packet's rays hit; see [`walk_together`].
    #[inline(always)]
    pub(crate) fn walk_together<K: Kernel>(
        &self,
        packet: &mut Packet,
        finds: &mut impl Finds,
        stack: &mut Stack,
    ) -> [u32; 2] {
        let Blas { nodes, packs, .. } = &self.tree;
        walk_together::<K>((nodes, packs), packet, finds, stack, |member| {
            let Member { instance, primitive } = self.members[member as usize];
            (instance, primitive)
        })
    }

    /// Whether anything is hit before `best`, which becomes the nearest hit; with `ANY`, whichever is found first.
    #[inline(always)]
    pub(crate) fn walk<K: Kernel, S: Stops, const ANY: bool>(
        &self,
        placed: &[Placed],
        (ray, slab): (&Ray, &SlabRay),
        best: &mut Hit,
        sieve: &mut S,
        stack: &mut Stack,
    ) -> bool {
        let (ray, kernel) = (ShearRay::new(ray), PhantomData);
        let mut leaves = Packs::<K, S, ANY> { standing: self, placed, ray, sieve, kernel };
        walk::<K, ANY>(&self.tree.nodes, slab, best, stack, &mut leaves)
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
pub(crate) fn moving_nodes(scene: &Scene) -> Vec<bool> {
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

/// The leaves.
struct Packs<'a, K, S, const ANY: bool> {
    standing: &'a Standing,
    placed: &'a [Placed],
    ray: ShearRay,
    sieve: &'a mut S,
    kernel: PhantomData<K>,
}

impl<K: Kernel, S: Stops, const ANY: bool> Leaves for Packs<'_, K, S, ANY> {
    #[inline(always)]
    fn fetch(&self, leaf: Child) {
        K::fetch(&self.standing.tree.packs, first_of(leaf));
    }

    #[inline(always)]
    fn visit(&mut self, leaf: Child, best: &mut Hit, _stack: &mut Stack) -> bool {
        let mut found = false;
        for pack in &self.standing.tree.packs[leaf.items()] {
            let lanes = K::triangles(pack, &self.ray, best.t);
            if lanes.mask == 0 {
                continue;
            }
            let Packs { standing, placed, sieve, .. } = self;
            found |= take::<ANY>(
                pack,
                &lanes,
                best,
                |member| {
                    let Member { instance, primitive } = standing.members[member as usize];
                    (instance, primitive)
                },
                |hit| !sieve.asks(&placed[hit.instance as usize]) || sieve.stops(hit),
            );
            if ANY && found {
                return true;
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
