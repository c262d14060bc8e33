//! Up to sixteen rays that go much the same way, walked together: a node is tested once for all of them, and a triangle for eight at a time.
//!
//! A node's boxes are tested against the beam that the rays form, by interval arithmetic: with o in [o⁻, o⁺] the origins and r in [r⁻, r⁺]
//! the reciprocal directions, all of one sign, a plane p is met at (p − o)·r. That is least at one of o⁻ and o⁺, by the sign of r, and at r⁻
//! or r⁺, and greatest at the other origin. Rounding is monotonic, so that the bounds hold for what each ray alone would compute. A leaf's
//! own box is tested for each ray. Boxes have room for what rounding takes, here as on a ray's own way (see [`crate::wide`]), so that no test
//! loses a triangle. What is found is the same, bit for bit, as for each ray alone: triangles are tested by the same operations, and which of
//! several hits is best, or whether there is one, does not depend on their order.

use glam::Vec3A;

use crate::kernel::{Eight, Kernel, SLAB_MARGIN, ShearRay};
use crate::leaf::Leaf;
use crate::ray::{Hit, Ray};
use crate::traverse::{Entry, Stack};
use crate::wide::{Child, Node};

/// Rays that are walked together, at most.
pub(crate) const TOGETHER: usize = 16;
/// Directions may differ by this much of their length per axis. More: neighbours part before they reach what they hit, and each node is
/// visited for a few of them only.
const WIDEST: f32 = 0.12;
/// So many rays or fewer in a leaf's box test its triangles one by one, four triangles at a time.
const FEW: u32 = 2;

/// Rays that are worth being made a packet of.
const FEWEST: usize = 4;
/// Leaves that fewer of its rays reach on average are cheaper one by one: then triangles are about as small as the rays are apart. The beam
/// that all of them share counts as much as a leaf that each has to itself, so that groups that meet next to nothing go on together.
const LEAST: u32 = 3;
/// Groups that go without after a try that was not worth it, which costs some percent of what it may save. Twice as many: packets on the sorted
/// rays of an apartment are a tenth slower.
const RESTS: u32 = 15;

/// The t_max of a ray that looks for nothing, or for nothing more: before all boxes and triangles.
const DONE: f32 = -1.0;

/// A number per ray, in halves.
type PerRay = [[f32; 8]; 2];

/// See the module.
pub(crate) struct Packet {
    origin: [PerRay; 3],
    reciprocal: [PerRay; 3],
    /// Of the origins that from which a plane is met first, and that from which it is met last.
    first_origin: [f32; 3],
    last_origin: [f32; 3],
    least_reciprocal: [f32; 3],
    most_reciprocal: [f32; 3],
    entry: [usize; 3],
    /// As in [`ShearRay`].
    shear: [PerRay; 3],
    axes: [usize; 3],
    /// Up to where each ray looks for hits.
    t_max: PerRay,
}

impl Packet {
    /// As [`Packet::new`]; `None` also if there are few rays, or if the last groups have shown that it is not worth it.
    #[inline(always)]
    pub(crate) fn worth<K: Kernel>(rays: &[Ray], t_max: f32, worth: &mut Worth) -> Option<Packet> {
        (rays.len() >= FEWEST && worth.is_worth_trying())
            .then(|| Packet::new::<K>(rays, t_max))
            .flatten()
    }

    /// Of 1 to [`TOGETHER`] rays, whose hits count up to `t_max`. `None` if they are better walked one by one.
    #[inline(always)]
    pub(crate) fn new<K: Kernel>(rays: &[Ray], t_max: f32) -> Option<Packet> {
        let first = rays.first()?;
        let (mut least, mut most) = (first.direction, first.direction);
        let (mut low, mut high) = (first.origin, first.origin);
        let (mut directions, mut origins) = (Vec3A::ZERO, Vec3A::ZERO);
        for ray in rays {
            (least, most) = (least.min(ray.direction), most.max(ray.direction));
            (low, high) = (low.min(ray.origin), high.max(ray.origin));
            // Not finite if any of them is not.
            directions += ray.direction;
            origins += ray.origin;
        }
        let is_narrow = (most - least).max_element() <= WIDEST * first.direction.length();
        if !(is_narrow && directions.is_finite() && origins.is_finite()) {
            return None;
        }
        // Of one sign and not zero, so that reciprocals are finite.
        let (smallest, largest) = (least.abs().min(most.abs()), least.abs().max(most.abs()));
        let one_way = least.signum().cmpeq(most.signum()) & smallest.cmpgt(Vec3A::splat(1e-15));
        let axes = ShearRay::new(first).axes;
        let [kx, ky, kz] = axes;
        // The axis along which all of them go farthest.
        let is_one_axis = smallest[kz] > largest[kx] && smallest[kz] > largest[ky];
        if !(one_way.all() && is_one_axis) {
            return None;
        }
        // Those that are not there are as the first, and done.
        let (mut direction, mut origin) = ([[[0.0; 8]; 2]; 3], [[[0.0; 8]; 2]; 3]);
        let mut until = [[DONE; 8]; 2];
        for ray in 0..TOGETHER {
            let (half, lane) = (ray / 8, ray % 8);
            let Ray { origin: from, direction: along } = rays.get(ray).unwrap_or(first);
            for axis in 0..3 {
                origin[axis][half][lane] = from[axis];
                direction[axis][half][lane] = along[axis];
            }
            if ray < rays.len() {
                until[half][lane] = t_max;
            }
        }
        let upwards = first.direction.cmpgt(Vec3A::ZERO);
        let mut packet = Packet {
            origin,
            reciprocal: [[[0.0; 8]; 2]; 3],
            first_origin: Vec3A::select(upwards, high, low).to_array(),
            last_origin: Vec3A::select(upwards, low, high).to_array(),
            // Of one sign: the reciprocal falls as the direction grows.
            least_reciprocal: most.recip().to_array(),
            most_reciprocal: least.recip().to_array(),
            entry: first.direction.to_array().map(|d| usize::from(d < 0.0)),
            shear: [[[0.0; 8]; 2]; 3],
            axes,
            t_max: until,
        };
        let one = K::Eight::splat(1.0);
        for half in [0, 1] {
            for (axis, per_ray) in direction.iter().enumerate() {
                let reciprocal = one.div(K::Eight::load(&per_ray[half]));
                packet.reciprocal[axis][half] = reciprocal.store();
            }
            let z = K::Eight::load(&direction[kz][half]);
            packet.shear[0][half] = K::Eight::load(&direction[kx][half]).div(z).store();
            packet.shear[1][half] = K::Eight::load(&direction[ky][half]).div(z).store();
            packet.shear[2][half] = packet.reciprocal[kz][half];
        }
        Some(packet)
    }

    /// Up to where the ray that looks farthest does so.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        self.t_max.as_flattened().iter().copied().fold(DONE, f32::max)
    }

    /// Whether any of the rays may meet a child of this node.
    #[inline(always)]
    pub(crate) fn may_meet<K: Kernel>(&self, node: &Node) -> bool {
        self.boxes::<K>(node, self.farthest()).0 != 0
    }

    /// One of the rays.
    #[inline(always)]
    fn one(&self, ray: usize) -> ShearRay {
        let (half, lane) = (ray / 8 % 2, ray % 8);
        let shear =
            [self.shear[0][half][lane], self.shear[1][half][lane], self.shear[2][half][lane]];
        let origin = self.origin.map(|origin| origin[half][lane]);
        ShearRay { origin, axes: self.axes, shear }
    }

    // Small functions instead of closures, since those cannot be made to be inlined, and calls would cost more than what is in them.

    /// The planes through which rays enter the children's boxes, or leave them, as the node has them.
    #[inline(always)]
    fn row(&self, axis: usize, leaves: usize) -> usize {
        2 * axis + ((self.entry[axis] ^ leaves) & 1)
    }

    /// The children that the beam meets before any of its rays has hit something, and where at the earliest.
    #[inline(always)]
    fn boxes<K: Kernel>(&self, node: &Node, t_max: f32) -> (u32, [f32; 8]) {
        let (mut near, mut far) = (K::Eight::splat(0.0), K::Eight::splat(t_max));
        for axis in 0..3 {
            let first = K::Eight::splat(self.first_origin[axis]);
            let last = K::Eight::splat(self.last_origin[axis]);
            let least = K::Eight::splat(self.least_reciprocal[axis]);
            let most = K::Eight::splat(self.most_reciprocal[axis]);
            let enters = K::planes(node, self.row(axis, 0)).sub(first);
            let leaves = K::planes(node, self.row(axis, 1)).sub(last);
            near = enters.mul(least).min(enters.mul(most)).max(near);
            far = leaves.mul(least).max(leaves.mul(most)).min(far);
        }
        (near.at_most(far.mul(K::Eight::splat(SLAB_MARGIN))) & node.used(), near.store())
    }

    /// Bit i: ray i meets a child's box.
    #[inline(always)]
    fn rays_in<K: Kernel>(&self, node: &Node, slot: usize) -> u32 {
        self.half_in::<K>(node, slot, 0) | self.half_in::<K>(node, slot, 1) << 8
    }

    #[inline(always)]
    fn half_in<K: Kernel>(&self, node: &Node, slot: usize, half: usize) -> u32 {
        let (mut near, mut far) = (K::Eight::splat(0.0), K::Eight::load(&self.t_max[half]));
        for axis in 0..3 {
            let origin = K::Eight::load(&self.origin[axis][half]);
            let reciprocal = K::Eight::load(&self.reciprocal[axis][half]);
            let enters = K::Eight::splat(node.plane(self.row(axis, 0), slot)).sub(origin);
            let leaves = K::Eight::splat(node.plane(self.row(axis, 1), slot)).sub(origin);
            near = enters.mul(reciprocal).max(near);
            far = leaves.mul(reciprocal).min(far);
        }
        near.at_most(far.mul(K::Eight::splat(SLAB_MARGIN)))
    }

    /// A corner of a triangle in the sheared space of eight rays.
    #[inline(always)]
    fn sheared<K: Kernel>(&self, corner: [f32; 3], half: usize) -> [K::Eight; 3] {
        let [kx, ky, kz] = self.axes;
        let x = K::Eight::splat(corner[kx]).sub(K::Eight::load(&self.origin[kx][half]));
        let y = K::Eight::splat(corner[ky]).sub(K::Eight::load(&self.origin[ky][half]));
        let z = K::Eight::splat(corner[kz]).sub(K::Eight::load(&self.origin[kz][half]));
        let sx = K::Eight::load(&self.shear[0][half]);
        let sy = K::Eight::load(&self.shear[1][half]);
        let sz = K::Eight::load(&self.shear[2][half]);
        [x.sub(sx.mul(z)), y.sub(sy.mul(z)), sz.mul(z)]
    }

    /// One triangle of a leaf and eight rays, as [`Kernel::triangles`] for each: which hit it, which have to be asked alone since they
    /// meet an edge; and t and the weights of the second and third vertex.
    #[inline(always)]
    fn meet<K: Kernel>(
        &self,
        leaf: Leaf<'_>,
        lane: usize,
        half: usize,
    ) -> (u32, u32, [K::Eight; 3]) {
        let [ax, ay, az] = self.sheared::<K>(leaf.corner(lane, 0), half);
        let [bx, by, bz] = self.sheared::<K>(leaf.corner(lane, 1), half);
        let [cx, cy, cz] = self.sheared::<K>(leaf.corner(lane, 2), half);
        let u = cx.mul(by).sub(cy.mul(bx));
        let v = ax.mul(cy).sub(ay.mul(cx));
        let w = bx.mul(ay).sub(by.mul(ax));
        let zero = K::Eight::splat(0.0);
        let (least, most) = (u.min(v.min(w)), u.max(v.max(w)));
        let inside = zero.at_most(least) | most.at_most(zero);
        if inside == 0 {
            return (0, 0, [zero; 3]);
        }
        let on_edge = inside & (u.equals(zero) | v.equals(zero) | w.equals(zero));
        let determinant = u.add(v).add(w);
        let inverse = K::Eight::splat(1.0).div(determinant);
        let t = u.mul(az).add(v.mul(bz)).add(w.mul(cz)).mul(inverse);
        let in_range = !t.at_most(zero) & t.at_most(K::Eight::load(&self.t_max[half]));
        let hit = inside & in_range & !determinant.equals(zero) & !on_edge;
        (hit & 0xff, on_edge, [t, v.mul(inverse), w.mul(inverse)])
    }
}

/// Whether walking together has been worth it lately: who goes without for a while tries again, since what lies ahead changes.
#[derive(Clone, Copy, Default)]
pub(crate) struct Worth {
    /// Of the last groups, the older the less: leaves visited, and rays in their boxes.
    leaves: u32,
    rays: u32,
    /// Groups that go without before the next try.
    rests: u32,
}

impl Worth {
    /// Whether the next group is to be walked together.
    #[inline(always)]
    pub(crate) fn is_worth_trying(&mut self) -> bool {
        let rests = self.rests;
        self.rests = rests.saturating_sub(1);
        rests == 0
    }

    /// What came of it: leaves that were visited, and rays that were in their boxes.
    #[inline(always)]
    pub(crate) fn learn(&mut self, [leaves, rays]: [u32; 2]) {
        self.leaves = self.leaves - self.leaves / 4 + leaves;
        self.rays = self.rays - self.rays / 4 + rays + TOGETHER as u32;
        if self.rays < LEAST * self.leaves {
            self.rests = RESTS;
        }
    }
}

/// What rays look for.
pub(crate) trait Finds {
    /// Told of a hit within the ray's range; returns where the range ends from now on.
    fn hit(&mut self, ray: usize, hit: &Hit) -> Option<f32>;
}

/// Brings each to the nearest hit of its ray.
pub(crate) struct Nearest<'a>(pub(crate) &'a mut [Option<Hit>]);

impl Finds for Nearest<'_> {
    #[inline(always)]
    fn hit(&mut self, ray: usize, hit: &Hit) -> Option<f32> {
        let best = &mut self.0[ray];
        let is_nearer = best.is_none_or(|best| hit.is_before(&best));
        *best = if is_nearer { Some(*hit) } else { *best };
        is_nearer.then_some(hit.t)
    }
}

/// Notes which rays hit anything at all. Bits by ray.
pub(crate) struct Any<A> {
    /// Whether an instance may let rays pass, so that a ray that hits it has to be asked about alone.
    pub(crate) asks: A,
    /// The bit of the first ray.
    pub(crate) first: usize,
    /// Those that certainly hit something.
    pub(crate) blocked: u64,
    /// Those that have met something that may let them pass.
    pub(crate) doubtful: u64,
}

impl<A: Fn(u32) -> bool> Finds for Any<A> {
    #[inline(always)]
    fn hit(&mut self, ray: usize, hit: &Hit) -> Option<f32> {
        let bit = 1 << (self.first + ray);
        if (self.asks)(hit.instance) {
            self.doubtful |= bit;
            return None;
        }
        self.blocked |= bit;
        Some(DONE)
    }
}

/// Tells `finds` of the hits; returns how many leaves were visited and how many rays were in them. `place`: instance and triangle of what is
/// in the leaves.
#[inline(always)]
pub(crate) fn walk_together<K: Kernel>(
    (nodes, leaves): (&[Node], &[u32]),
    packet: &mut Packet,
    finds: &mut impl Finds,
    stack: &mut Stack,
    place: impl Fn(u32) -> (u32, u32),
) -> [u32; 2] {
    let mut met = [0; 2];
    let base = stack.length();
    let mut farthest = packet.farthest();
    let mut current = Child::ROOT;
    let mut came_from = 0;
    loop {
        if current.is_leaf() {
            let node = &nodes[came_from >> 3];
            let rays = packet.rays_in::<K>(node, came_from & 7);
            met = [met[0] + 1, met[1] + rays.count_ones()];
            let leaf = Leaf::at(leaves, current.place());
            if visit::<K>(leaf, packet, rays, finds, &place) {
                farthest = packet.farthest();
            }
        } else {
            let index = current.node();
            let node = &nodes[index];
            let (mut mask, near) = packet.boxes::<K>(node, farthest);
            let first = stack.length();
            while mask != 0 {
                let slot = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                stack.insert_from(
                    first,
                    Entry::new(node.child[slot], near[slot]),
                    index << 3 | slot,
                );
            }
        }
        loop {
            if stack.length() == base {
                return met;
            }
            let (entry, from) = stack.pop_from();
            if entry.near() <= farthest * SLAB_MARGIN {
                (current, came_from) = (entry.child(), from);
                break;
            }
        }
    }
}

/// A leaf against some of the rays. Whether any range has become shorter.
#[inline(always)]
fn visit<K: Kernel>(
    leaf: Leaf<'_>,
    packet: &mut Packet,
    rays: u32,
    finds: &mut impl Finds,
    place: &impl Fn(u32) -> (u32, u32),
) -> bool {
    let mut found = false;
    if rays.count_ones() <= FEW {
        alone::<K>(leaf, packet, rays, finds, place, &mut found);
        return found;
    }
    for lane in 0..leaf.triangles() {
        for half in 0..2 {
            let asked = rays >> (8 * half) & 0xff;
            if asked == 0 {
                continue;
            }
            let (hit, on_edge, [t, v, w]) = packet.meet::<K>(leaf, lane, half);
            let (mut hit, on_edge) = (hit & asked, on_edge & asked);
            if on_edge != 0 {
                alone::<K>(leaf, packet, on_edge << (8 * half), finds, place, &mut found);
            }
            if hit == 0 {
                continue;
            }
            let (instance, primitive) = place(leaf.triangle(lane));
            let (t, v, w) = (t.store(), v.store(), w.store());
            while hit != 0 {
                let ray = hit.trailing_zeros() as usize & 7;
                hit &= hit - 1;
                let barycentric = [v[ray], w[ray]];
                let hit = Hit { t: t[ray], barycentric, primitive, instance };
                if let Some(t_max) = finds.hit(8 * half + ray, &hit) {
                    packet.t_max[half][ray] = t_max;
                    found = true;
                }
            }
        }
    }
    found
}

/// A leaf against some rays, one by one.
#[inline(always)]
fn alone<K: Kernel>(
    leaf: Leaf<'_>,
    packet: &mut Packet,
    mut rays: u32,
    finds: &mut impl Finds,
    place: &impl Fn(u32) -> (u32, u32),
    found: &mut bool,
) {
    while rays != 0 {
        let ray = rays.trailing_zeros() as usize % TOGETHER;
        rays &= rays - 1;
        let lanes = K::triangles(leaf, &packet.one(ray), packet.t_max[ray / 8][ray % 8]);
        for hit in lanes.hits(leaf, place) {
            if let Some(t_max) = finds.hit(ray, &hit) {
                packet.t_max[ray / 8][ray % 8] = t_max;
                *found = true;
            }
        }
    }
}
