//! Many rays through everything: neighbours that go much the same way are walked together where it is worth it ([`crate::packet`]), all
//! others by turns ([`crate::stream`]). So they go through what stands, which is in one tree; what moves is asked after that, ray by ray.

use std::marker::PhantomData;

#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx512;
use crate::kernel::turns::Turns;
use crate::kernel::{Isa, Kernel, Portable};
use crate::packet::{Any, Finds, Nearest, Packet, TOGETHER};
use crate::ray::{Hit, Ray};
use crate::standing::Standing;
use crate::stream::Ways;
use crate::top::Targets;
use crate::traverse::Stack;

/// Rays from the camera that are traced at once, and rays of a bounce: a bit each. Fewer: ways are empty while the last rays end.
pub const WAVE: usize = u64::BITS as usize;
/// Of these so many are shaded at once, and their rays to a light traced, so that the points stay in the nearest cache and little is made ready
/// for waves that are not full. All 64: pictures of spheres take 3 % longer, waves of 16 a third longer.
pub const SHADED: usize = 16;

/// Fewer rays than that are asked about one by one: to walk by turns takes memory that has to be made.
const FEWEST: usize = 4;

/// Trees of so many bytes do not fit into caches that a processor has for itself. Those of unit tests are small and large all the same.
const LARGE: usize = if cfg!(test) { 1 << 11 } else { 16 << 20 };

/// What is known of some rays. Bits by ray; of those that are neither blocked nor passed nothing is known.
pub(crate) struct Occluded {
    /// Those that are stopped.
    pub(crate) blocked: u64,
    /// Those that nothing stops that stands.
    pub(crate) passed: u64,
    /// Those that do not meet anything else.
    pub(crate) is_all: u64,
}

impl Targets<'_> {
    /// What [`Targets::closest`] says of each ray.
    pub(crate) fn closest_of(&self, rays: &[Ray], found: &mut [Option<Hit>], stack: &mut Stack) {
        let Some(tree) = self.standing.filter(|_| rays.len() >= FEWEST) else {
            for (ray, found) in rays.iter().zip(found) {
                *found = self.closest(ray, stack);
            }
            return;
        };
        found.fill(None);
        let rest = Targets { standing: None, ..*self };
        let mut alone = std::mem::take(&mut stack.alone);
        alone.clear();
        for first in (0..rays.len()).step_by(TOGETHER) {
            let group = first..(first + TOGETHER).min(rays.len());
            let (rays, found) = (&rays[group.clone()], &mut found[group.clone()]);
            let finds = &mut Nearest(found);
            match self.together(tree, (rays, f32::MAX), finds, 0, stack) {
                None => alone.extend(group.map(|index| index as u32)),
                Some(true) => rest.also_closest(rays, found, stack),
                Some(false) => (),
            }
        }
        let is_worth_it = self.is_worth_taking_turns(tree);
        if is_worth_it {
            let each = (rays, &*alone, f32::MAX);
            self.by_turns::<_, false>(tree, each, &mut Nearest(found), &mut stack.ways);
        } else {
            for &index in &alone {
                found[index as usize] = self.closest(&rays[index as usize], stack);
            }
        }
        if is_worth_it && !self.top.is_empty() {
            for &index in &alone {
                let one = index as usize..index as usize + 1;
                rest.also_closest(&rays[one.clone()], &mut found[one], stack);
            }
        }
        stack.alone = alone;
    }

    /// Which of at most [`WAVE`] rays hit anything at 0 < t < t_max. `asks`: whether an instance may let rays pass.
    pub(crate) fn occluded_of(
        &self,
        (rays, t_max): (&[Ray], f32),
        asks: impl Fn(u32) -> bool,
        stack: &mut Stack,
    ) -> Occluded {
        let mut known = Occluded { blocked: 0, passed: 0, is_all: 0 };
        let Some(tree) = self.standing.filter(|_| rays.len() >= FEWEST) else { return known };
        let until = Hit::none_before(t_max).t;
        let mut any = Any { asks, first: 0, blocked: 0, doubtful: 0 };
        let mut alone = std::mem::take(&mut stack.alone);
        alone.clear();
        for first in (0..rays.len()).step_by(TOGETHER) {
            let group = first..(first + TOGETHER).min(rays.len());
            any.first = first;
            match self.together(tree, (&rays[group.clone()], until), &mut any, 1, stack) {
                None => alone.extend(group.map(|index| index as u32)),
                Some(true) => (),
                Some(false) => group.for_each(|index| known.is_all |= 1 << index),
            }
        }
        any.first = 0;
        match self.is_worth_taking_turns(tree) {
            true => {
                self.by_turns::<_, true>(tree, (rays, &alone, until), &mut any, &mut stack.ways)
            }
            false => alone.iter().for_each(|index| any.doubtful |= 1 << index),
        }
        stack.alone = alone;
        known.blocked = any.blocked;
        known.passed = !(any.blocked | any.doubtful);
        if self.top.is_empty() {
            known.is_all = u64::MAX;
        }
        known
    }

    /// At most [`TOGETHER`] rays through what stands. `None` if they are better walked by turns; else whether any of them may meet what does
    /// not stand. `kind`: in which of [`Stack::worth`] it is learned what comes of it.
    fn together<F: Finds>(
        &self,
        tree: &Standing,
        (rays, t_max): (&[Ray], f32),
        finds: &mut F,
        kind: usize,
        stack: &mut Stack,
    ) -> Option<bool> {
        let group = Group { targets: self, tree, rays, t_max, finds, kind, stack };
        match self.isa {
            Isa::Portable => group.walk::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, group),
        }
    }

    /// Whether rays that have nothing in common are better walked by turns. Without the registers of AVX-512 a step takes more than the same
    /// of a ray alone, which is worth it where rays alone wait for memory.
    fn is_worth_taking_turns(&self, tree: &Standing) -> bool {
        match self.isa {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) if proof.wider.is_some() => true,
            _ => tree.bytes() > LARGE,
        }
    }

    /// Those of the rays that have these indices through what stands.
    fn by_turns<F: Finds, const ANY: bool>(
        &self,
        tree: &Standing,
        rays: (&[Ray], &[u32], f32),
        finds: &mut F,
        ways: &mut Ways,
    ) {
        if rays.1.is_empty() {
            return;
        }
        match self.isa {
            Isa::Portable => tree.walk_by_turns::<Portable, ANY>(rays, finds, ways),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => match proof.wider {
                None => avx2::with(
                    proof,
                    Each::<_, avx2::Avx2, ANY> { tree, rays, finds, ways, steps: PhantomData },
                ),
                Some(proof) => avx512::with(
                    proof,
                    Each::<_, avx512::Avx512, ANY> { tree, rays, finds, ways, steps: PhantomData },
                ),
            },
        }
    }
}

/// See [`Targets::together`].
struct Group<'a, F> {
    targets: &'a Targets<'a>,
    tree: &'a Standing,
    rays: &'a [Ray],
    t_max: f32,
    finds: &'a mut F,
    kind: usize,
    stack: &'a mut Stack,
}

impl<F: Finds> Group<'_, F> {
    #[inline(always)]
    fn walk<K: Kernel>(self) -> Option<bool> {
        let Group { targets, tree, rays, t_max, finds, kind, stack } = self;
        let mut packet = Packet::worth::<K>(rays, t_max, &mut stack.worth[kind])?;
        let met = tree.walk_together::<K>(&mut packet, finds, stack);
        stack.worth[kind].learn(met);
        Some(targets.top.may_be_met::<K>(&packet))
    }
}

#[cfg(target_arch = "x86_64")]
impl<F: Finds> avx2::Task for Group<'_, F> {
    type Output = Option<bool>;
    #[inline(always)]
    fn run(self) -> Option<bool> {
        self.walk::<avx2::Avx2>()
    }
}

/// See [`Targets::by_turns`].
#[cfg(target_arch = "x86_64")]
struct Each<'a, F, T, const ANY: bool> {
    tree: &'a Standing,
    rays: (&'a [Ray], &'a [u32], f32),
    finds: &'a mut F,
    ways: &'a mut Ways,
    steps: PhantomData<T>,
}

#[cfg(target_arch = "x86_64")]
impl<F: Finds, T: Turns, const ANY: bool> avx2::Task for Each<'_, F, T, ANY> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.tree.walk_by_turns::<T, ANY>(self.rays, self.finds, self.ways);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless::Rng;
    use frameless_scene::{Geometry, Scene, Transform, builtin};
    use glam::Vec3;

    use super::*;
    use crate::reference::{random_rays, random_soup, ray};
    use crate::test_scenes as scenes;
    use crate::world::World;

    /// Rays with nothing in common, and some that are none or meet edges exactly.
    fn rays(rng: &mut Rng, count: usize) -> Vec<Ray> {
        let mut rays = random_rays(rng, count);
        let bad = [f32::NAN, f32::INFINITY, 3e38, 0.0, -0.0, 1e-30];
        for all in rays.iter_mut().step_by(5) {
            let (number, axis) = (bad[rng.below(6) as usize], rng.below(3) as usize);
            match rng.below(4) {
                0 => all.direction[axis] = number,
                1 => all.origin[axis] = number,
                2 => *all = ray(9.0 * Vec3::AXES[axis], -Vec3::AXES[axis]),
                _ => *all = ray(Vec3::splat(number), Vec3::ZERO),
            }
        }
        rays
    }

    /// All kinds of instances, surfaces that coincide, and a mesh whose edges are met.
    fn scene() -> Arc<Scene> {
        let mut scene = Scene::clone(&scenes::mixed());
        let soup = random_soup(&mut Rng::new(8), 2_000, 0.3);
        scenes::add(&mut scene, Geometry::Mesh(soup.clone()), Transform::IDENTITY);
        scenes::add(&mut scene, Geometry::Mesh(soup), Transform::IDENTITY);
        scenes::add(&mut scene, scenes::triangle_sphere(8, 12, 0), Transform::IDENTITY);
        Arc::new(scene)
    }

    #[test]
    fn each_of_many_rays_finds_what_it_finds_alone() {
        let reference = World::with_isa(scene(), Isa::Portable);
        for isa in Isa::all() {
            let world = World::with_isa(scene(), isa);
            let (moment, there) = (world.moment(0.0), reference.moment(0.0));
            let (targets, plain) = (moment.targets(&world), there.targets(&reference));
            let (mut stack, mut rng) = (Stack::new(), Rng::new(31));
            let mut hits = 0;
            for count in (0..70).chain([127, 128, 129, 1_000]) {
                let rays = rays(&mut rng, count);
                let mut found = vec![None; count];
                targets.closest_of(&rays, &mut found, &mut stack);
                for (ray, found) in rays.iter().zip(&found) {
                    assert_eq!(*found, targets.closest(ray, &mut stack), "{isa:?}: {ray:?}");
                    assert_eq!(*found, plain.closest(ray, &mut stack), "{isa:?}: {ray:?}");
                    hits += usize::from(found.is_some());
                }
            }
            assert!(hits > 500, "{hits}");
        }
    }

    /// Some of the instances may let rays pass: what is said of the others has to be true all the same, and not nothing.
    #[test]
    fn each_of_many_rays_is_blocked_as_it_is_alone() {
        for isa in Isa::all() {
            let world = World::with_isa(scene(), isa);
            let moment = world.moment(0.0);
            let targets = moment.targets(&world);
            let rest = Targets { standing: None, ..targets };
            let (mut stack, mut rng) = (Stack::new(), Rng::new(32));
            let [mut blocked, mut passed, mut unknown] = [0; 3];
            for count in (0..=WAVE).chain([WAVE; 20]) {
                let rays = rays(&mut rng, count);
                let t_max = [1.0, 0.6, f32::INFINITY][rng.below(3) as usize];
                let opaque = targets.placed.len() as u32 - if count % 3 == 0 { 3 } else { 0 };
                let asks = |instance: u32| instance >= opaque;
                let known = targets.occluded_of((&rays, t_max), asks, &mut stack);
                for (index, ray) in rays.iter().enumerate() {
                    let is_occluded = targets.occluded(ray, t_max, &mut stack);
                    let has = |rays: u64| rays >> index & 1 != 0;
                    if has(known.blocked) {
                        assert!(is_occluded, "{isa:?}: {ray:?}");
                        blocked += 1;
                    } else if has(known.passed) {
                        let by_rest = rest.occluded(ray, t_max, &mut stack);
                        assert_eq!(is_occluded, by_rest, "{isa:?}: {ray:?}");
                        assert!(!has(known.is_all) || !is_occluded, "{isa:?}: {ray:?}");
                        passed += 1;
                    } else {
                        unknown += 1;
                    }
                }
            }
            let enough = blocked > 300 && passed > 300 && unknown > 10;
            assert!(enough, "{blocked} blocked, {passed} passed, {unknown} unknown");
        }
    }

    #[test]
    fn what_has_moved_is_found_by_many_rays() {
        let world = World::new(Arc::new(builtin("shadow").expect("it is built in")));
        let mut moment = world.moment(0.5);
        let standing = moment.targets(&world).standing.expect("something stands");
        let moved = (0..world.scene().instances.len()).find(|&k| standing.has(k));
        let node = world.scene().instances[moved.expect("one of them")].node as usize;
        world.update_moment_with(0.5, &mut moment, |state| {
            state.world_from_node[node].translation.y -= 0.1;
        });
        let targets = moment.targets(&world);
        assert!(targets.standing.is_none(), "what has moved counts as standing");
        let (mut stack, rays) = (Stack::new(), random_rays(&mut Rng::new(33), 300));
        let mut found = vec![None; rays.len()];
        targets.closest_of(&rays, &mut found, &mut stack);
        let alone: Vec<_> = rays.iter().map(|ray| targets.closest(ray, &mut stack)).collect();
        assert_eq!(found, alone);
        assert!(found.iter().flatten().count() > 30);
    }

    /// Whatever was left behind by rays before, and without a ray at all.
    #[test]
    fn no_rays_find_nothing() {
        let world = World::new(scene());
        let moment = world.moment(0.0);
        let (targets, mut stack) = (moment.targets(&world), Stack::new());
        targets.closest_of(&[], &mut [], &mut stack);
        let known = targets.occluded_of((&[], 1.0), |_| false, &mut stack);
        assert_eq!(known.blocked, 0);
        let nowhere = [Ray::NONE; 9];
        let mut found = [Some(Hit::NONE); 9];
        targets.closest_of(&nowhere, &mut found, &mut stack);
        assert_eq!(found, [None; 9]);
    }
}
