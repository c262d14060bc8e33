//! Two levels: a tree over the instances, and in each instance's own space its mesh's tree or a sphere.

use std::sync::OnceLock;

use glam::{Affine3A, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::build::{Blas, binary_by_median};
use crate::deforming::Deforming;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
use crate::kernel::{Isa, Kernel, Portable, ShearRay, SlabRay};
use crate::ray::{Hit, Ray};
use crate::sphere;
use crate::standing::Standing;
use crate::traverse::{Leaves, STACK_PER_TREE, Stack, walk};
use crate::wide::{Child, Node, collapse};

/// What stands in an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// The unit sphere.
    Sphere,
    /// Index of a bottom-level BVH, which is that of the geometry.
    Mesh(u32),
    /// Index of a bottom-level BVH that moves, which is that of the deformation.
    Deforming(u32),
}

/// The bottom-level BVHs at one moment.
#[derive(Clone, Copy)]
pub(crate) struct Trees<'a> {
    pub(crate) rigid: &'a [OnceLock<Blas>],
    pub(crate) deforming: &'a [Deforming],
}

impl<'a> Trees<'a> {
    /// `None` for spheres.
    #[inline(always)]
    pub(crate) fn of(&self, shape: Shape) -> Option<&'a Blas> {
        match shape {
            Shape::Sphere => None,
            Shape::Mesh(index) => {
                Some(self.rigid[index as usize].get().expect("made before anything is placed"))
            }
            Shape::Deforming(index) => Some(&self.deforming[index as usize].tree.blas),
        }
    }
}

/// An instance at one moment.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) world_from_object: Affine3A,
    pub(crate) object_from_world: Affine3A,
    pub(crate) shape: Shape,
    /// Whether rays may pass some of its triangles.
    pub(crate) has_holes: bool,
}

impl Placed {
    pub(crate) fn new(world_from_object: Affine3A, shape: Shape, has_holes: bool) -> Placed {
        let object_from_world = world_from_object.inverse();
        Placed { world_from_object, object_from_world, shape, has_holes }
    }

    /// World box; `None` where nothing can be hit: no triangles, or a transform without an inverse (a scale of zero).
    fn bounds(&self, trees: Trees<'_>) -> Option<Aabb> {
        let (low, high) = match trees.of(self.shape) {
            None => (Vec3A::NEG_ONE, Vec3A::ONE),
            Some(blas) => blas.bounds?,
        };
        let inverse = &self.object_from_world;
        let invertible = inverse.matrix3.is_finite() && inverse.translation.is_finite();
        if !invertible || self.world_from_object.matrix3.determinant() == 0.0 {
            return None;
        }
        let m = &self.world_from_object;
        let centre = m.transform_point3a(0.5 * (low + high));
        let half = match self.shape {
            // The farthest point of an ellipsoid along an axis is that row of the matrix long.
            Shape::Sphere => {
                let rows = m.matrix3.transpose();
                Vec3A::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length())
            }
            Shape::Mesh(_) | Shape::Deforming(_) => m.matrix3.abs() * (0.5 * (high - low)),
        };
        // Rounding in the box and in the ray's way into the instance: a handful of operations each.
        const PADDING: f32 = 16.0 * f32::EPSILON;
        let half = half + PADDING * (centre.abs() + half);
        let sane = (centre.abs() + half).max_element() < 1e15;
        sane.then(|| Aabb::new(centre - half, centre + half))
    }
}

/// The tree over the instances, with the memory to build it again.
pub(crate) struct Top {
    pub(crate) nodes: Vec<Node>,
    /// Of the instances that can be hit.
    boxes: Vec<Aabb>,
    /// Which instance each box is of.
    instances: Vec<u32>,
    /// The same instances in the order of the leaves.
    pub(crate) leaves: Vec<u32>,
    binary: Bvh2,
    builder: PlocBuilder,
}

impl Top {
    pub(crate) fn new() -> Top {
        let mut nodes = Vec::new();
        collapse(&Bvh2::zeroed(0), &mut nodes, |_| Child::ROOT);
        let (boxes, instances, leaves) = (Vec::new(), Vec::new(), Vec::new());
        let (binary, builder) = (Bvh2::zeroed(0), PlocBuilder::new());
        Top { nodes, boxes, instances, leaves, binary, builder }
    }

    /// Build from scratch: a few µs for a hundred instances. Those of `standing` are left out.
    pub(crate) fn rebuild(
        &mut self,
        placed: &[Placed],
        trees: Trees<'_>,
        standing: Option<&Standing>,
    ) {
        self.boxes.clear();
        self.instances.clear();
        for (instance, placed) in placed.iter().enumerate() {
            if standing.is_some_and(|standing| standing.has(instance)) {
                continue;
            }
            if let Some(bounds) = placed.bounds(trees) {
                self.boxes.push(bounds);
                self.instances.push(instance as u32);
            }
        }
        let mut indices = std::mem::take(&mut self.binary.primitive_indices);
        indices.clear();
        indices.extend(0..self.boxes.len() as u32);
        self.builder.build_with_bvh(
            &mut self.binary,
            PlocSearchDistance::Minimum,
            &self.boxes,
            indices,
            SortPrecision::U64,
            0,
        );
        if self.take() > STACK_PER_TREE {
            self.binary = binary_by_median(&self.boxes);
            self.take();
        }
    }

    fn take(&mut self) -> usize {
        let Top { nodes, instances, leaves, binary, .. } = self;
        leaves.clear();
        collapse(binary, nodes, |members| {
            let first = leaves.len();
            leaves.extend(members.iter().map(|&member| instances[member as usize]));
            Child::leaf(first, members.len())
        })
    }
}

/// Everything that a ray may hit at one moment.
pub(crate) struct Targets<'a> {
    pub(crate) top: &'a Top,
    pub(crate) placed: &'a [Placed],
    pub(crate) trees: Trees<'a>,
    /// What is not in `top`.
    pub(crate) standing: Option<&'a Standing>,
    pub(crate) isa: Isa,
}

impl Targets<'_> {
    /// The nearest hit at 0 < t < ∞.
    #[inline]
    pub(crate) fn closest(&self, ray: &Ray, stack: &mut Stack) -> Option<Hit> {
        match self.isa {
            Isa::Portable => self.closest_with::<Portable>(ray, stack),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, Closest { targets: self, ray, stack }),
        }
    }

    /// Whether anything is hit at 0 < t < t_max.
    #[inline]
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f32, stack: &mut Stack) -> bool {
        match self.isa {
            Isa::Portable => self.occluded_with::<Portable>(ray, t_max, stack),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, Occluded { targets: self, ray, t_max, stack }),
        }
    }

    #[inline(always)]
    fn closest_with<K: Kernel>(&self, ray: &Ray, stack: &mut Stack) -> Option<Hit> {
        let mut t_max = f32::INFINITY;
        self.walk::<K, false>(ray, &mut t_max, stack)
    }

    #[inline(always)]
    fn occluded_with<K: Kernel>(&self, ray: &Ray, mut t_max: f32, stack: &mut Stack) -> bool {
        self.walk::<K, true>(ray, &mut t_max, stack).is_some()
    }

    #[inline(always)]
    fn walk<K: Kernel, const ANY: bool>(
        &self,
        ray: &Ray,
        t_max: &mut f32,
        stack: &mut Stack,
    ) -> Option<Hit> {
        if !ray.is_traceable() {
            return None;
        }
        let hit = self
            .standing
            .and_then(|standing| standing.walk::<K, ANY>(self.placed, ray, t_max, stack));
        if self.top.leaves.is_empty() || (ANY && hit.is_some()) {
            return hit;
        }
        let mut instances =
            Instances::<K, ANY> { targets: self, ray, hit: NOTHING, kernel: Default::default() };
        let slab = SlabRay::new(ray);
        walk::<K, ANY>(&self.top.nodes, &slab, t_max, stack, &mut instances)
            .then_some(instances.hit)
            .or(hit)
    }
}

/// Before anything is hit.
pub(crate) const NOTHING: Hit = Hit { t: 0.0, barycentric: [0.0; 2], primitive: 0, instance: 0 };

#[cfg(target_arch = "x86_64")]
struct Closest<'a> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    stack: &'a mut Stack,
}

#[cfg(target_arch = "x86_64")]
impl avx2::Task for Closest<'_> {
    type Output = Option<Hit>;
    #[inline(always)]
    fn run(self) -> Option<Hit> {
        self.targets.closest_with::<avx2::Avx2>(self.ray, self.stack)
    }
}

#[cfg(target_arch = "x86_64")]
struct Occluded<'a> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    t_max: f32,
    stack: &'a mut Stack,
}

#[cfg(target_arch = "x86_64")]
impl avx2::Task for Occluded<'_> {
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        self.targets.occluded_with::<avx2::Avx2>(self.ray, self.t_max, self.stack)
    }
}

/// The top level's leaves.
struct Instances<'a, K, const ANY: bool> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    hit: Hit,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const ANY: bool> Leaves for Instances<'_, K, ANY> {
    #[inline(always)]
    fn visit(&mut self, leaf: Child, t_max: &mut f32, stack: &mut Stack) -> bool {
        let mut found = false;
        for &instance in &self.targets.top.leaves[leaf.items()] {
            let placed = &self.targets.placed[instance as usize];
            // Not normalised, so that t means the same here and in the world.
            let local = self.ray.transformed(&placed.object_from_world);
            let hit = match self.targets.trees.of(placed.shape) {
                None => sphere::intersect(&local, *t_max).map(|t| {
                    *t_max = t;
                    Hit { t, barycentric: [0.0; 2], primitive: 0, instance }
                }),
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
pub(crate) fn in_mesh<K: Kernel, const ANY: bool>(
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    t_max: &mut f32,
    stack: &mut Stack,
) -> Option<Hit> {
    if !ray.is_traceable() {
        return None;
    }
    let hit = Hit { t: 0.0, barycentric: [0.0; 2], primitive: 0, instance };
    let shear = ShearRay::new(ray);
    let mut triangles = Triangles::<K, ANY> { blas, ray: shear, hit, kernel: Default::default() };
    walk::<K, ANY>(&blas.nodes, &SlabRay::new(ray), t_max, stack, &mut triangles)
        .then_some(triangles.hit)
}

/// The bottom level's leaves.
struct Triangles<'a, K, const ANY: bool> {
    blas: &'a Blas,
    ray: ShearRay,
    hit: Hit,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const ANY: bool> Leaves for Triangles<'_, K, ANY> {
    #[inline(always)]
    fn visit(&mut self, leaf: Child, t_max: &mut f32, _stack: &mut Stack) -> bool {
        let mut found = false;
        for pack in &self.blas.packs[leaf.items()] {
            let lanes = K::triangles(pack, &self.ray, *t_max);
            if ANY && lanes.mask != 0 {
                return true;
            }
            for lane in 0..4 {
                if lanes.mask >> lane & 1 != 0 && lanes.t[lane] < *t_max {
                    *t_max = lanes.t[lane];
                    self.hit.t = lanes.t[lane];
                    self.hit.barycentric = [lanes.v[lane], lanes.w[lane]];
                    self.hit.primitive = pack.primitive[lane];
                    found = true;
                }
            }
        }
        found
    }
}
