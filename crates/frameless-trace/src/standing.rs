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

use frameless_scene::{Geometry, Instance, Mesh, Scene};
use glam::Affine3A;

use crate::build::{Blas, Triangles, corners_at};
use crate::kernel::turns::Turns;
use crate::kernel::{Kernel, ShearRay, SlabRay};
use crate::leaf::{Corner, Leaf};
use crate::packet::{Finds, Packet, walk_together};
use crate::ray::{Hit, Ray};
use crate::sift::Stops;
use crate::stream::{Ways, walk_by_turns};
use crate::top::{Placed, take};
use crate::traverse::{Leaves, Stack, walk};
use crate::wide::Child;

/// The instances that stand still, if there are any, and their tree.
pub(crate) struct Standing {
    /// Its triangles are numbered through all instances.
    tree: Blas,
    numbers: Numbers,
    /// Where each instance of the scene stands; `None`: it is not in the tree.
    places: Vec<Option<Affine3A>>,
}

/// Numbers for the triangles of several instances.
struct Numbers {
    /// Per instance its first number, and which it is; then one for the end. Ascending.
    first: Vec<(u32, u32)>,
    /// Per block of numbers: the place in `first` of the instance that its first number belongs to.
    places: Vec<u32>,
}

impl Numbers {
    const BLOCK: u32 = 256;

    /// For instances with so many triangles each.
    fn new(counts: impl IntoIterator<Item = (u32, usize)>) -> Numbers {
        let (mut numbers, mut next) = (Numbers { first: Vec::new(), places: Vec::new() }, 0u32);
        for (instance, count) in counts.into_iter().filter(|&(_, count)| count > 0) {
            numbers.first.push((next, instance));
            next = next.checked_add(count as u32).expect("less than 2³² triangles");
            let blocks = next.div_ceil(Numbers::BLOCK) as usize;
            numbers.places.resize(blocks, numbers.first.len() as u32 - 1);
        }
        numbers.first.push((next, u32::MAX));
        numbers
    }

    /// How many there are.
    fn count(&self) -> u32 {
        self.first.last().map_or(0, |&(end, _)| end)
    }

    /// Which instance and which of its triangles that is.
    #[inline(always)]
    fn which(&self, number: u32) -> (u32, u32) {
        let mut place = self.places[(number / Numbers::BLOCK) as usize] as usize;
        while self.first[place + 1].0 <= number {
            place += 1;
        }
        let (first, instance) = self.first[place];
        (instance, number - first)
    }
}

/// The triangles of all instances that stand.
struct All<'a> {
    scene: &'a Scene,
    places: &'a [Option<Affine3A>],
    numbers: &'a Numbers,
}

impl Triangles for All<'_> {
    fn count(&self) -> u32 {
        self.numbers.count()
    }

    fn corners(&self, triangle: u32) -> [Corner; 3] {
        let (instance, primitive) = self.numbers.which(triangle);
        let mesh = mesh_of(self.scene, instance as usize);
        match (&self.places[instance as usize], mesh) {
            (Some(place), Some(mesh)) => corners_at(place, mesh, primitive),
            _ => unreachable!("only meshes that stand have numbers"),
        }
    }
}

impl Standing {
    /// What its nodes and leaves take.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.tree.nodes) + size_of_val(&*self.tree.leaves)
    }

    /// `None` if nothing stands.
    pub(crate) fn new(scene: &Scene) -> Option<Standing> {
        let places = places(scene);
        if places.iter().all(Option::is_none) {
            return None;
        }
        let standing = (0..places.len()).filter(|&instance| places[instance].is_some());
        let numbers = Numbers::new(standing.filter_map(|instance| {
            Some((instance as u32, mesh_of(scene, instance)?.triangles.len()))
        }));
        let tree = Blas::new(&All { scene, places: &places, numbers: &numbers });
        Some(Standing { tree, numbers, places })
    }

    pub(crate) fn tree(&self) -> &Blas {
        &self.tree
    }

    /// Which instance a triangle of the tree is of, and which of its triangles.
    pub(crate) fn which(&self, number: u32) -> (u32, u32) {
        self.numbers.which(number)
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
        let Blas { nodes, leaves, .. } = &self.tree;
        let which = |number| self.numbers.which(number);
        walk_together::<K>((nodes, leaves), packet, finds, stack, which)
    }

    /// Tells `finds` what the rays with these indices hit; see [`walk_by_turns`].
    #[inline(always)]
    pub(crate) fn walk_by_turns<T: Turns, const ANY: bool>(
        &self,
        rays: (&[Ray], &[u32], f32),
        finds: &mut impl Finds,
        ways: &mut Ways,
    ) {
        let Blas { nodes, leaves, .. } = &self.tree;
        let which = |number| self.numbers.which(number);
        walk_by_turns::<T, ANY>((nodes, leaves), rays, finds, ways, which);
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
        let mut leaves = Meshes::<K, S, ANY> { standing: self, placed, ray, sieve, kernel };
        walk::<K, ANY>(&self.tree.nodes, slab, best, stack, &mut leaves)
    }
}

/// Per instance of the scene: where it stands, if it is a rigid mesh of its own, nothing moves it, and rays can be taken into its
/// coordinates. Meshes that several instances share stay apart: they would be in the tree as often.
fn places(scene: &Scene) -> Vec<Option<Affine3A>> {
    let mut uses = vec![0u32; scene.geometries.len()];
    scene.instances.iter().for_each(|instance| uses[instance.geometry as usize] += 1);
    let (moves, state) = (scene.moving_nodes(), scene.state_at(0.0));
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

fn mesh_of(scene: &Scene, instance: usize) -> Option<&Mesh> {
    match &scene.geometries[scene.instances[instance].geometry as usize] {
        Geometry::Mesh(mesh) => Some(mesh),
        Geometry::Sphere { .. } => None,
    }
}

/// The leaves.
struct Meshes<'a, K, S, const ANY: bool> {
    standing: &'a Standing,
    placed: &'a [Placed],
    ray: ShearRay,
    sieve: &'a mut S,
    kernel: PhantomData<K>,
}

impl<K: Kernel, S: Stops, const ANY: bool> Leaves for Meshes<'_, K, S, ANY> {
    #[inline(always)]
    fn words(&self) -> &[u32] {
        &self.standing.tree.leaves
    }

    #[inline(always)]
    fn visit(&mut self, leaf: Child, best: &mut Hit, _stack: &mut Stack) -> bool {
        let Meshes { standing, placed, sieve, .. } = self;
        let leaf = Leaf::at(&standing.tree.leaves, leaf.place());
        let lanes = K::triangles(leaf, &self.ray, best.t);
        lanes.mask != 0
            && take::<ANY>(
                leaf,
                &lanes,
                best,
                |number| standing.numbers.which(number),
                |hit| !sieve.asks(&placed[hit.instance as usize]) || sieve.stops(hit),
            )
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless::{Request, Size};
    use frameless_scene::builtin;

    use super::Numbers;
    use crate::camera::{Camera, ViewSource};
    use crate::moment::Moment;
    use crate::traverse::Stack;
    use crate::world::World;

    #[test]
    fn numbers_say_which_triangle_of_which_instance() {
        let counts = [(3, 700), (4, 0), (7, 1), (8, 1), (9, 255), (12, 1000)];
        let numbers = Numbers::new(counts);
        let all = counts.into_iter().flat_map(|(k, count)| (0..count as u32).map(move |p| (k, p)));
        assert!(all.eq((0..numbers.count()).map(|number| numbers.which(number))));
        assert_eq!(Numbers::new([]).count(), 0);
    }

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
