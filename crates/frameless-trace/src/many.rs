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
use crate::sift::NoSieve;
use crate::standing::Standing;
use crate::stream::Ways;
use crate::top::Targets;
use crate::traverse::Stack;

/// Rays to lights at most that are asked about at once: a bit each. Fewer: ways are empty while the last rays end.
pub(crate) const WAVE: usize = u64::BITS as usize;

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
        let Some(tree) = self.standing else {
            for (ray, found) in rays.iter().zip(found) {
                *found = self.closest(ray, stack);
            }
            return;
        };
        found.fill(None);
        let mut alone = std::mem::take(&mut stack.alone);
        alone.clear();
        for first in (0..rays.len()).step_by(TOGETHER) {
            let group = first..(first + TOGETHER).min(rays.len());
            let (rays, found) = (&rays[group.clone()], &mut found[group.clone()]);
            let finds = &mut Nearest(found);
            match self.together(tree, (rays, f32::MAX), finds, 0, stack) {
                None => alone.extend(group.map(|index| index as u32)),
                Some(meets_more) if meets_more => {
                    for (ray, found) in rays.iter().zip(found) {
                        self.also_by_rest(ray, found, stack);
                    }
                }
                Some(_) => (),
            }
        }
        let each = (rays, &*alone, f32::MAX);
        self.by_turns::<_, false>(tree, each, &mut Nearest(found), &mut stack.ways);
        if !self.top.is_empty() {
            for &index in &alone {
                let index = index as usize;
                self.also_by_rest(&rays[index], &mut found[index], stack);
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
        let Some(tree) = self.standing else { return known };
        let until = Hit::none_before(t_max).t;
        let mut any = Any { asks, first: 0, blocked: 0, doubtful: 0 };
        let mut alone = std::mem::take(&mut stack.alone);
        alone.clear();
        for first in (0..rays.len()).step_by(TOGETHER) {
            let group = first..(first + TOGETHER).min(rays.len());
            any.first = first;
            match self.together(tree, (&rays[group.clone()], until), &mut any, 1, stack) {
                None => alone.extend(group.map(|index| index as u32)),
                Some(meets_more) if meets_more => (),
                Some(_) => group.for_each(|index| known.is_all |= 1 << index),
            }
        }
        any.first = 0;
        self.by_turns::<_, true>(tree, (rays, &alone, until), &mut any, &mut stack.ways);
        stack.alone = alone;
        known.blocked = any.blocked;
        known.passed = !(any.blocked | any.doubtful);
        if self.top.is_empty() {
            known.is_all = u64::MAX;
        }
        known
    }

    /// The nearer of what a ray has hit and what it hits of what does not stand.
    fn also_by_rest(&self, ray: &Ray, found: &mut Option<Hit>, stack: &mut Stack) {
        let rest = Targets { standing: None, ..*self };
        *found = rest.find::<false, _>(ray, found.unwrap_or(Hit::NONE), NoSieve, stack);
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

    /// Those of the rays that have these indices through what stands.
    fn by_turns<F: Finds, const ANY: bool>(
        &self,
        tree: &Standing,
        rays: (&[Ray], &[u32], f32),
        finds: &mut F,
        ways: &mut Ways,
    ) {
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
