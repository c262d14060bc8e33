//! Two levels: a tree over the instances, and in each instance's own space its mesh's tree or a sphere.

use std::marker::PhantomData;
use std::sync::OnceLock;

use glam::{Affine3A, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::build::{Blas, halve};
use crate::collapse::Collapse;
use crate::deforming::Deforming;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
use crate::kernel::{Isa, Kernel, Lanes, Portable, ShearRay, SlabRay};
use crate::leaf::Leaf;
use crate::packet::Packet;
use crate::ray::{Hit, Ray};
use crate::sift::{NoSieve, Stops};
use crate::sphere;
use crate::standing::Standing;
use crate::traverse::{Leaves, STACK_PER_TREE, Stack, walk};
use crate::untied::Ploc;
use crate::wide::{Child, Node};

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
    /// From the world to the coordinates of its tree: the object's, or, of what stood still when the tree was made, the world's then.
    tree_from_world: Affine3A,
    world_from_tree: Affine3A,
    pub(crate) shape: Shape,
    /// Whether rays may pass some of its triangles.
    pub(crate) has_holes: bool,
}

impl Placed {
    /// `stood`: where it stood when its tree was made, if it did.
    pub(crate) fn new(
        world_from_object: Affine3A,
        stood: Option<&Affine3A>,
        shape: Shape,
        has_holes: bool,
    ) -> Placed {
        let object_from_world = world_from_object.inverse();
        let (tree_from_world, world_from_tree) = match stood {
            None => (object_from_world, world_from_object),
            // Where it still stands a ray is in the tree what it is in the world, to the last bit.
            Some(stood) if *stood == world_from_object => (Affine3A::IDENTITY, Affine3A::IDENTITY),
            Some(stood) => (*stood * object_from_world, world_from_object * stood.inverse()),
        };
        Placed {
            world_from_object,
            object_from_world,
            tree_from_world,
            world_from_tree,
            shape,
            has_holes,
        }
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
        let m = &self.world_from_tree;
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

/// Quickly: it is built for every moment.
const PLOC: Ploc = Ploc {
    search_distance: PlocSearchDistance::Minimum,
    sort_precision: SortPrecision::U64,
    search_depth_threshold: 0,
};

/// The tree over the instances, with the memory to build it again.
pub(crate) struct Top {
    pub(crate) nodes: Vec<Node>,
    /// Of the instances that can be hit.
    boxes: Vec<Aabb>,
    /// Which instance each box is of.
    instances: Vec<u32>,
    binary: Bvh2,
    builder: PlocBuilder,
    collapse: Collapse,
}

impl Top {
    pub(crate) fn new() -> Top {
        Top {
            nodes: Vec::new(),
            boxes: Vec::new(),
            instances: Vec::new(),
            binary: Bvh2::zeroed(0),
            builder: PlocBuilder::new(),
            collapse: Collapse::default(),
        }
    }

    /// Whether there is nothing to be hit.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether any of the packet's rays may meet an instance.
    #[inline(always)]
    pub(crate) fn may_be_met<K: Kernel>(&self, packet: &Packet) -> bool {
        match self.nodes.first() {
            Some(root) => packet.may_meet::<K>(root),
            None => false,
        }
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
        PLOC.build(&mut self.builder, &self.boxes, &mut self.binary);
        if self.take() > STACK_PER_TREE {
            self.binary = halve(&self.boxes);
            self.take();
        }
    }

    fn take(&mut self) -> usize {
        let Top { nodes, instances, binary, collapse, .. } = self;
        nodes.clear();
        if instances.is_empty() {
            return 0;
        }
        collapse.plan(binary, 1.0, |_| false);
        collapse
            .make_root(binary, nodes, |boxes| Child::leaf(instances[boxes[0] as usize] as usize))
    }
}

/// Everything that a ray may hit at one moment.
#[derive(Clone, Copy)]
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
        self.find::<false, _>(ray, Hit::NONE, NoSieve, stack)
    }

    /// Brings each to the nearer of what it is and what its ray hits.
    pub(crate) fn also_closest(&self, rays: &[Ray], found: &mut [Option<Hit>], stack: &mut Stack) {
        let also = Also { targets: self, rays, found, stack };
        match self.isa {
            Isa::Portable => also.with::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, also),
        }
    }

    /// Whether anything is hit at 0 < t < t_max.
    #[inline]
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f32, stack: &mut Stack) -> bool {
        self.find::<true, _>(ray, Hit::none_before(t_max), NoSieve, stack).is_some()
    }

    /// The nearest hit before `none` that the sieve stops; with `ANY`, whichever is found first.
    #[inline(always)]
    pub(crate) fn find<const ANY: bool, S: Stops>(
        &self,
        ray: &Ray,
        none: Hit,
        sieve: S,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let walk = Walk::<S, ANY> { targets: self, ray, none, sieve, stack };
        match self.isa {
            Isa::Portable => walk.with::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, walk),
        }
    }
}

/// The ways of several rays that may have hit something elsewhere.
struct Also<'a> {
    targets: &'a Targets<'a>,
    rays: &'a [Ray],
    found: &'a mut [Option<Hit>],
    stack: &'a mut Stack,
}

impl Also<'_> {
    #[inline(always)]
    fn with<K: Kernel>(self) {
        let Also { targets, rays, found, stack } = self;
        for (ray, found) in rays.iter().zip(found) {
            let none = found.unwrap_or(Hit::NONE);
            *found = Walk::<_, false> { targets, ray, none, sieve: NoSieve, stack }.with::<K>();
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl avx2::Task for Also<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.with::<avx2::Avx2>();
    }
}

/// A ray's way through everything.
struct Walk<'a, S, const ANY: bool> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    /// What a hit must be before.
    none: Hit,
    sieve: S,
    stack: &'a mut Stack,
}

#[cfg(target_arch = "x86_64")]
impl<S: Stops, const ANY: bool> avx2::Task for Walk<'_, S, ANY> {
    type Output = Option<Hit>;
    #[inline(always)]
    fn run(self) -> Option<Hit> {
        self.with::<avx2::Avx2>()
    }
}

impl<S: Stops, const ANY: bool> Walk<'_, S, ANY> {
    #[inline(always)]
    fn with<K: Kernel>(self) -> Option<Hit> {
        let Walk { targets, ray, none: mut best, mut sieve, stack } = self;
        if !ray.is_traceable() {
            return None;
        }
        let slab = SlabRay::new(ray);
        if let Some(standing) = targets.standing {
            let way = (ray, &slab);
            let found =
                standing.walk::<K, S, ANY>(targets.placed, way, &mut best, &mut sieve, stack);
            if ANY && found {
                return Some(best);
            }
        }
        if !targets.top.is_empty() {
            let mut instances = Instances::<K, S, ANY> { targets, ray, sieve, kernel: PhantomData };
            walk::<K, ANY>(&targets.top.nodes, &slab, &mut best, stack, &mut instances);
        }
        best.found()
    }
}

/// The top level's leaves.
struct Instances<'a, K, S, const ANY: bool> {
    targets: &'a Targets<'a>,
    ray: &'a Ray,
    sieve: S,
    kernel: PhantomData<K>,
}

impl<K: Kernel, S: Stops, const ANY: bool> Leaves for Instances<'_, K, S, ANY> {
    #[inline(always)]
    fn words(&self) -> &[u32] {
        &[]
    }

    #[inline(always)]
    fn visit(&mut self, leaf: Child, best: &mut Hit, stack: &mut Stack) -> bool {
        let instance = leaf.place() as u32;
        let placed = &self.targets.placed[instance as usize];
        // Not normalised, so that t means the same here and in the world.
        let ray = self.ray.transformed(&placed.tree_from_world);
        match self.targets.trees.of(placed.shape) {
            None => meet_sphere(&ray, instance, best),
            Some(blas) if ray.is_traceable() => {
                let asks = self.sieve.asks(placed);
                let (shear, sieve) = (ShearRay::new(&ray), &mut self.sieve);
                let mut triangles = Triangles::<K, S, ANY> {
                    leaves: &blas.leaves,
                    ray: shear,
                    instance,
                    asks,
                    sieve,
                    kernel: PhantomData,
                };
                let before = stack.boxes;
                let found =
                    walk::<K, ANY>(&blas.nodes, &SlabRay::new(&ray), best, stack, &mut triangles);
                if let Shape::Deforming(index) = placed.shape {
                    // How its tree is made depends on how it has moved before.
                    let price = self.targets.trees.deforming[index as usize].price;
                    stack.boxes = before + u64::from(price);
                }
                found
            }
            Some(_) => false,
        }
    }
}

/// Spheres have no holes and no backs: no sieve is asked.
#[inline(always)]
fn meet_sphere(ray: &Ray, instance: u32, best: &mut Hit) -> bool {
    let hit = sphere::intersect(ray, best.t)
        .map(|t| Hit { t, barycentric: [0.0; 2], primitive: 0, instance })
        .filter(|hit| hit.is_before(best));
    *best = hit.unwrap_or(*best);
    hit.is_some()
}

/// The bottom level's leaves.
struct Triangles<'a, K, S, const ANY: bool> {
    leaves: &'a [u32],
    ray: ShearRay,
    instance: u32,
    asks: bool,
    sieve: &'a mut S,
    kernel: PhantomData<K>,
}

impl<K: Kernel, S: Stops, const ANY: bool> Leaves for Triangles<'_, K, S, ANY> {
    #[inline(always)]
    fn words(&self) -> &[u32] {
        self.leaves
    }

    #[inline(always)]
    fn visit(&mut self, leaf: Child, best: &mut Hit, _stack: &mut Stack) -> bool {
        let leaf = Leaf::at(self.leaves, leaf.place());
        let lanes = K::triangles(leaf, &self.ray, best.t);
        let Triangles { instance, asks, sieve, .. } = self;
        let place = |primitive| (*instance, primitive);
        lanes.mask != 0 && take::<ANY>(leaf, &lanes, best, place, |hit| !*asks || sieve.stops(hit))
    }
}

/// Takes the best of a leaf's hits, of those that `stops` says are hits. Whether there was one. `place`: instance and triangle of what is in
/// the leaf.
#[inline(always)]
pub(crate) fn take<const ANY: bool>(
    leaf: Leaf<'_>,
    lanes: &Lanes,
    best: &mut Hit,
    place: impl Fn(u32) -> (u32, u32),
    mut stops: impl FnMut(&Hit) -> bool,
) -> bool {
    let mut found = false;
    for hit in lanes.hits(leaf, place) {
        if hit.is_before(best) && stops(&hit) {
            *best = hit;
            found = true;
            if ANY {
                break;
            }
        }
    }
    found
}
