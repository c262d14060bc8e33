//! Many rays, each walked on its own way, by turns: a step of one, then a step of the next.
//!
//! A ray alone waits: for memory, for the end of a chain of instructions at every node, and for the right guess of which children
//! it meets. None of that depends on the other rays, so that a processor which looks some hundred instructions ahead works on several of
//! them at once. Rays do not have to have anything in common, unlike those of a [`crate::packet`]; each meets the same nodes as alone, or
//! nearly so, and finds the same, bit for bit: triangles are tested by the same operations, and which of several hits is best, or whether
//! there is one, does not depend on their order.
//!
//! Those at a node are stepped first, all of them, without a branch that could be guessed wrongly; then those at a leaf, and where one ends,
//! the next begins.

use crate::kernel::ShearRay;
use crate::kernel::turns::{BoxRay, Turns, Waiting};
use crate::leaf::Leaf;
use crate::packet::Finds;
use crate::ray::Ray;
use crate::traverse::place_of;
use crate::wide::{Child, Node};

/// Rays that are under way at once. 8: half of what there is to win; 64: no more than with 32, and more memory.
const WAYS: usize = 32;

/// A ray under way.
struct Way {
    /// Where it is; [`Node::UNUSED`]: nowhere, it has ended.
    current: Child,
    /// Which of the rays.
    index: usize,
    /// Up to where it looks for hits.
    t_max: f32,
    for_boxes: BoxRay,
    for_triangles: ShearRay,
    waiting: Waiting,
}

/// Memory for those that are under way, made when it is needed first.
#[derive(Default)]
pub(crate) struct Ways(Vec<Way>);

impl Ways {
    fn ready(&mut self) -> &mut [Way; WAYS] {
        if self.0.is_empty() {
            self.0.resize_with(WAYS, Way::nowhere);
        }
        self.0.first_chunk_mut().expect("made above")
    }
}

impl Way {
    fn nowhere() -> Way {
        Way {
            current: Node::UNUSED,
            index: 0,
            t_max: 0.0,
            for_boxes: BoxRay::NONE,
            for_triangles: ShearRay::new(&Ray::NONE),
            waiting: Waiting::NOTHING,
        }
    }

    #[inline(always)]
    fn begin(&mut self, index: usize, ray: &Ray, t_max: f32) {
        self.current = Child::ROOT;
        self.index = index;
        self.t_max = t_max;
        self.for_boxes.set(ray);
        self.for_triangles = ShearRay::new(ray);
        self.waiting.clear();
    }

    /// To what it visits next, whose memory is asked for: there is time until its turn comes.
    #[inline(always)]
    fn go_on<T: Turns>(&mut self, places: [*const u8; 2]) {
        self.current = self.waiting.pop();
        T::ask_for(place_of(self.current, places));
    }

    /// Tells `finds` of what it hits in a leaf.
    #[inline(always)]
    fn visit<T: Turns, const ANY: bool>(
        &mut self,
        leaf: Leaf<'_>,
        finds: &mut impl Finds,
        place: &impl Fn(u32) -> (u32, u32),
    ) {
        let lanes = T::hits(leaf, &self.for_triangles, self.t_max);
        if lanes.mask == 0 {
            return;
        }
        let mut nearer = None;
        for hit in lanes.hits(leaf, place) {
            if let Some(t_max) = finds.hit(self.index, &hit) {
                nearer = Some(t_max);
                if ANY {
                    self.waiting.clear();
                    return;
                }
            }
        }
        if let Some(t_max) = nearer {
            self.t_max = t_max;
            T::shorten(&mut self.waiting, t_max);
        }
    }
}

/// Tells `finds` of what the rays with these indices hit at 0 < t ≤ t_max; with `ANY`, until it says of a ray that it is enough. `place`:
/// instance and triangle of what is in the leaves.
#[inline(always)]
pub(crate) fn walk_by_turns<T: Turns, const ANY: bool>(
    (nodes, leaves): (&[Node], &[u32]),
    (rays, indices, t_max): (&[Ray], &[u32], f32),
    finds: &mut impl Finds,
    ways: &mut Ways,
    place: impl Fn(u32) -> (u32, u32),
) {
    let ways = ways.ready();
    let places = [nodes.as_ptr().cast(), leaves.as_ptr().cast()];
    let mut next = indices.iter();
    let mut inner = Few::none();
    let mut outer = Few::first(indices.len());
    for way in ways.iter_mut().take(outer.count) {
        way.current = Node::UNUSED;
    }
    loop {
        for turn in 0..outer.start_over() {
            let number = outer.at(turn);
            let way = &mut ways[number];
            if way.current == Node::UNUSED {
                // Until there is one that can be traced.
                for &index in next.by_ref() {
                    let ray = &rays[index as usize];
                    if ray.is_traceable() {
                        way.begin(index as usize, ray, t_max);
                        inner.add_if(number, true);
                        break;
                    }
                }
                continue;
            }
            let leaf = Leaf::at(leaves, way.current.place());
            way.visit::<T, ANY>(leaf, finds, &place);
            way.go_on::<T>(places);
            inner.add_if(number, !way.current.is_leaf());
            outer.add_if(number, way.current.is_leaf());
        }
        if inner.count + outer.count == 0 {
            return;
        }
        for turn in 0..inner.start_over() {
            let number = inner.at(turn);
            let way = &mut ways[number];
            let node = &nodes[way.current.node()];
            T::descend::<ANY>(node, &way.for_boxes, way.t_max, &mut way.waiting);
            way.go_on::<T>(places);
            inner.add_if(number, !way.current.is_leaf());
            outer.add_if(number, way.current.is_leaf());
        }
    }
}

/// Some of the ways, each once.
struct Few {
    numbers: [u8; WAYS],
    count: usize,
}

impl Few {
    fn none() -> Few {
        Few { numbers: [0; WAYS], count: 0 }
    }

    /// So many, or all.
    fn first(count: usize) -> Few {
        Few { numbers: std::array::from_fn(|number| number as u8), count: count.min(WAYS) }
    }

    /// Forgets them, but for [`Few::at`] until as many are added; how many there were.
    #[inline(always)]
    fn start_over(&mut self) -> usize {
        std::mem::take(&mut self.count)
    }

    #[inline(always)]
    fn at(&self, turn: usize) -> usize {
        self.numbers[turn % WAYS] as usize % WAYS
    }

    /// Does not branch on whether.
    #[inline(always)]
    fn add_if(&mut self, number: usize, is_one: bool) {
        self.numbers[self.count % WAYS] = number as u8;
        self.count += usize::from(is_one);
    }
}
