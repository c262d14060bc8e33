//! What rays do that are walked by turns (see [`crate::stream`]).
//!
//! No branch depends on what a ray meets at a node: which way it goes could not be predicted, and a wrong guess would throw away what has
//! been begun of the next rays' steps. So all children that are met are sorted, by a network that compares eight whatever they are, and put
//! on the ray's stack, all eight of them; those that are not met lie above its top.

use glam::Vec3A;

use super::{Kernel, LARGEST_RECIPROCAL, Lanes, Portable, SLAB_MARGIN, ShearRay, SlabRay};
use crate::leaf::Leaf;
use crate::ray::Ray;
use crate::traverse::STACK_PER_TREE;
use crate::wide::{Child, Node};

/// Room for the children of a tree and for what marks the end, and a power of two, so that an index can be kept inside without asking.
const ROOM: usize = (STACK_PER_TREE + 1).next_power_of_two();

/// A ray prepared for boxes, in a form that suits registers of any width.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(crate) struct BoxRay {
    /// Twice.
    pub(crate) origin: [f32; 8],
    /// As in [`SlabRay`], and the same negated.
    pub(crate) reciprocal: [f32; 8],
    /// Per axis where in a node's two rows of counts the planes are through which the ray enters, and those through which it leaves.
    pub(crate) rows: [[u8; 16]; 3],
}

impl BoxRay {
    pub(crate) const NONE: BoxRay =
        BoxRay { origin: [0.0; 8], reciprocal: [0.0; 8], rows: [[0; 16]; 3] };

    /// Makes it that of this ray: in place, since it is read in larger pieces than it would be copied in.
    #[inline(always)]
    pub(crate) fn set(&mut self, ray: &Ray) {
        const UPWARDS: u128 = 0x0f0e_0d0c_0b0a_0908_0706_0504_0302_0100;
        const EXCHANGED: u128 = 0x0808_0808_0808_0808_0808_0808_0808_0808;
        let most = Vec3A::splat(LARGEST_RECIPROCAL);
        let r = ray.direction.recip().clamp(-most, most);
        let (o, from, to) = (ray.origin, &mut self.origin, &mut self.reciprocal);
        [from[0], from[1], from[2], from[4], from[5], from[6]] = [o.x, o.y, o.z, o.x, o.y, o.z];
        [to[0], to[1], to[2], to[4], to[5], to[6]] = [r.x, r.y, r.z, -r.x, -r.y, -r.z];
        let downwards = r.cmplt(Vec3A::ZERO).bitmask();
        for axis in 0..3 {
            let exchanged = if downwards >> axis & 1 == 1 { EXCHANGED } else { 0 };
            self.rows[axis] = (UPWARDS ^ exchanged).to_le_bytes();
        }
    }

    /// The same as it is for others.
    #[inline(always)]
    fn slab_ray(&self) -> SlabRay {
        let reciprocal = Vec3A::from_slice(&self.reciprocal);
        SlabRay {
            origin: Vec3A::from_slice(&self.origin),
            reciprocal,
            entry: reciprocal.to_array().map(|r| usize::from(r < 0.0)),
        }
    }
}

/// What a ray has still to visit; the last is next.
pub(crate) struct Waiting {
    /// Where each is entered: bits of a float, the last three of which say anything, so that the order of numbers is that of distances.
    near: [i32; ROOM + 8],
    child: [u32; ROOM + 8],
    length: usize,
}

impl Waiting {
    pub(crate) const NOTHING: Waiting =
        Waiting { near: [0; ROOM + 8], child: [0; ROOM + 8], length: 0 };

    /// Where the end is that [`Waiting::pop`] comes to, however near a ray has to look: nothing is nearer.
    const END: i32 = -1;

    /// Nothing waits: the next is [`Node::UNUSED`].
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.near[0] = Waiting::END;
        self.child[0] = Node::UNUSED.bits();
        self.length = 1;
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Child {
        self.length -= 1;
        Child::from_bits(self.child[self.length % ROOM])
    }

    /// Eight places from one on: where they are entered, and which they are.
    #[inline(always)]
    pub(super) fn eight(&mut self, from: usize) -> (&mut [i32; 8], &mut [u32; 8]) {
        let from = from % ROOM;
        let near = self.near[from..].first_chunk_mut().expect("eight more than there is room for");
        let child = self.child[from..].first_chunk_mut().expect("as long");
        (near, child)
    }

    /// Those above the top.
    #[inline(always)]
    pub(super) fn free(&mut self) -> (&mut [i32; 8], &mut [u32; 8]) {
        debug_assert!(self.length < ROOM, "the builder keeps trees within STACK_PER_TREE");
        self.eight(self.length)
    }

    #[inline(always)]
    pub(super) fn length(&self) -> usize {
        self.length
    }

    #[inline(always)]
    pub(super) fn set_length(&mut self, length: usize) {
        self.length = length;
    }

    /// The largest number that may still be worth visiting by a ray that looks no farther than `t_max`.
    #[inline(always)]
    pub(super) fn most(t_max: f32) -> i32 {
        (t_max * SLAB_MARGIN).to_bits() as i32 | 7
    }
}

/// The steps. Implementors differ in speed only.
pub(crate) trait Turns {
    /// Puts the children of a node whose boxes the ray meets at some t in [0, t_max] on the stack: the nearest last, or with `ANY` in any order.
    fn descend<const ANY: bool>(node: &Node, ray: &BoxRay, t_max: f32, waiting: &mut Waiting);

    /// Takes away what begins beyond `t_max`.
    fn shorten(waiting: &mut Waiting, t_max: f32);

    /// As [`Kernel::triangles`].
    fn hits(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes;

    /// As [`Kernel::fetch`].
    fn ask_for(place: *const u8);
}

impl Turns for Portable {
    #[inline(always)]
    fn descend<const ANY: bool>(node: &Node, ray: &BoxRay, t_max: f32, waiting: &mut Waiting) {
        let (mut mask, entered) = Portable::boxes(node, &ray.slab_ray(), t_max);
        let length = waiting.length() + mask.count_ones() as usize;
        let (near, child) = waiting.free();
        let mut count = 0;
        while mask != 0 {
            let slot = mask.trailing_zeros() as usize & 7;
            mask &= mask - 1;
            let key = (entered.0[slot].to_bits() as i32 & !7) | slot as i32;
            let mut place = count;
            while place > 0 && near[place - 1] < key {
                near[place] = near[place - 1];
                place -= 1;
            }
            near[place] = key;
            count += 1;
        }
        for place in 0..count {
            child[place] = node.child[near[place] as usize & 7].bits();
        }
        waiting.set_length(length);
    }

    #[inline(always)]
    fn shorten(waiting: &mut Waiting, t_max: f32) {
        keep_one_by_one(waiting, t_max);
    }

    #[inline(always)]
    fn hits(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes {
        Portable::triangles(leaf, ray, t_max)
    }

    #[inline(always)]
    fn ask_for(_place: *const u8) {}
}

/// As [`Turns::shorten`].
#[inline(always)]
pub(super) fn keep_one_by_one(waiting: &mut Waiting, t_max: f32) {
    let (most, mut kept) = (Waiting::most(t_max), 0);
    for from in 0..waiting.length.min(ROOM) {
        let (near, child) = (waiting.near[from], waiting.child[from]);
        (waiting.near[kept % ROOM], waiting.child[kept % ROOM]) = (near, child);
        kept += usize::from(near <= most);
    }
    waiting.length = kept;
}
