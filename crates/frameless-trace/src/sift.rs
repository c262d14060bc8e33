//! The walk through both levels where triangles may have holes: whoever sends the ray is asked about every hit on them.

use crate::build::Blas;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
use crate::kernel::{Isa, Kernel, Portable, ShearRay, SlabRay};
use crate::ray::{Hit, Ray};
use crate::sphere;
use crate::top::{NOTHING, Targets, in_mesh};
use crate::traverse::{Leaves, Stack, walk};
use crate::wide::Child;

/// Is asked about every hit, in any order, on instances that have holes.
pub(crate) trait Sieve {
    /// Whether it wants to be asked about all other meshes, too.
    fn is_for_all(&self) -> bool;

    /// Whether the hit is one.
    fn stops(&mut self, hit: &Hit) -> bool;
}

impl Targets<'_> {
    /// The nearest hit at 0 < t < ∞ that `sieve` stops.
    pub(crate) fn closest_through(
        &self,
        ray: &Ray,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let mut t_max = f32::INFINITY;
        match self.isa {
            Isa::Portable => self.sift::<Portable, false>(ray, &mut t_max, sieve, stack),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => {
                let t_max = &mut t_max;
                avx2::with(proof, Sifted::<false> { targets: self, ray, t_max, sieve, stack })
            }
        }
    }

    /// Whether anything is hit at 0 < t < t_max that `sieve` stops.
    pub(crate) fn occluded_through(
        &self,
        ray: &Ray,
        mut t_max: f32,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> bool {
        let hit = match self.isa {
            Isa::Portable => self.sift::<Portable, true>(ray, &mut t_max, sieve, stack),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => {
                let t_max = &mut t_max;
                avx2::with(proof, Sifted::<true> { targets: self, ray, t_max, sieve, stack })
            }
        };
        hit.is_some()
    }

    #[inline(always)]
    fn sift<K: Kernel, const ANY: bool>(
        &self,
        ray: &Ray,
        t_max: &mut f32,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> Option<Hit> {
        if !ray.is_traceable() {
            return None;
        }
        let hit = self
            .standing
            .and_then(|standing| standing.sift::<K, ANY>(self.placed, ray, t_max, sieve, stack));
        if self.top.leaves.is_empty() || (ANY && hit.is_some()) {
            return hit;
        }
        let is_for_all = sieve.is_for_all();
        let mut leaves = SiftedInstances::<K, ANY> {
            targets: self,
            ray,
            hit: NOTHING,
            sieve,
            is_for_all,
            kernel: Default::default(),
        };
        let slab = SlabRay::new(ray);
        walk::<K, ANY>(&self.top.nodes, &slab, t_max, stack, &mut leaves)
            .then_some(leaves.hit)
            .or(hit)
    }
}

#[cfg(target_arch = "x86_64")]
struct Sifted<'a, 's, const ANY: bool> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    t_max: &'a mut f32,
    sieve: &'a mut (dyn Sieve + 's),
    stack: &'a mut Stack,
}

#[cfg(target_arch = "x86_64")]
impl<const ANY: bool> avx2::Task for Sifted<'_, '_, ANY> {
    type Output = Option<Hit>;
    #[inline(always)]
    fn run(self) -> Option<Hit> {
        self.targets.sift::<avx2::Avx2, ANY>(self.ray, self.t_max, self.sieve, self.stack)
    }
}

/// The top level's leaves, where instances may have holes.
struct SiftedInstances<'a, 's, K, const ANY: bool> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    hit: Hit,
    sieve: &'a mut (dyn Sieve + 's),
    is_for_all: bool,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const ANY: bool> Leaves for SiftedInstances<'_, '_, K, ANY> {
    #[inline(always)]
    fn visit(&mut self, leaf: Child, t_max: &mut f32, stack: &mut Stack) -> bool {
        let mut found = false;
        for &instance in &self.targets.top.leaves[leaf.items()] {
            let placed = &self.targets.placed[instance as usize];
            let local = self.ray.transformed(&placed.object_from_world);
            let hit = match self.targets.trees.of(placed.shape) {
                None => sphere::intersect(&local, *t_max).map(|t| {
                    *t_max = t;
                    Hit { t, instance, ..NOTHING }
                }),
                Some(blas) if placed.has_holes || self.is_for_all => {
                    in_sifted_mesh::<K, ANY>(blas, &local, instance, t_max, self.sieve, stack)
                }
                Some(blas) => in_mesh::<K, ANY>(blas, &local, instance, t_max, stack),
            };
            if let Some(hit) = hit {
                self.hit = hit;
                found = true;
                if ANY {
                    return true;
                }
            }
        }
        found
    }
}

#[inline(always)]
fn in_sifted_mesh<K: Kernel, const ANY: bool>(
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    t_max: &mut f32,
    sieve: &mut dyn Sieve,
    stack: &mut Stack,
) -> Option<Hit> {
    if !ray.is_traceable() {
        return None;
    }
    let hit = Hit { instance, ..NOTHING };
    let (ray, slab) = (ShearRay::new(ray), SlabRay::new(ray));
    let mut triangles =
        SiftedTriangles::<K, ANY> { blas, ray, hit, sieve, kernel: Default::default() };
    walk::<K, ANY>(&blas.nodes, &slab, t_max, stack, &mut triangles).then_some(triangles.hit)
}

/// The leaves of a mesh that has holes.
struct SiftedTriangles<'a, 's, K, const ANY: bool> {
    blas: &'a Blas,
    ray: ShearRay,
    hit: Hit,
    sieve: &'a mut (dyn Sieve + 's),
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const ANY: bool> Leaves for SiftedTriangles<'_, '_, K, ANY> {
    #[inline(always)]
    fn visit(&mut self, leaf: Child, t_max: &mut f32, _stack: &mut Stack) -> bool {
        let mut found = false;
        for pack in &self.blas.packs[leaf.items()] {
            let lanes = K::triangles(pack, &self.ray, *t_max);
            for lane in 0..4 {
                // Unused lanes repeat the last used one, which is to be asked about once.
                let repeats = lane > 0 && pack.primitive[lane] == pack.primitive[lane - 1];
                if lanes.mask >> lane & 1 == 0 || repeats || lanes.t[lane] >= *t_max {
                    continue;
                }
                let hit = Hit {
                    t: lanes.t[lane],
                    barycentric: [lanes.v[lane], lanes.w[lane]],
                    primitive: pack.primitive[lane],
                    instance: self.hit.instance,
                };
                if !self.sieve.stops(&hit) {
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
