//! Surfaces that lie on top of each other, or nearly so: every ray asks each of them. Nobody can help that, but it can be known before a
//! picture is begun, and refused.
//!
//! ```text
//! E(n) = Σ_{b below n} w(b) A(b) / A(n)      A: half the surface of a box; w: what a box costs whoever meets it
//! ```
//!
//! is what a ray costs on average, of those through the box of n that nothing stops (the surface area heuristic), in boxes of nodes and
//! leaves, about 5 ns each. What counts is the subtree with the highest E: a crowd is one wherever in the world it is, and however large
//! that is.

use std::sync::Arc;

use frameless_scene::{Limits, LoadError, Place, Problem, Scene};
use glam::{Vec3, Vec3A};

use crate::build::{Blas, TightBox};
use crate::forecast::{Efforts, Forecast, most_per_sample};
use crate::leaf::Leaf;
use crate::moment::Moment;
use crate::top::{Placed, Shape};
use crate::wide::{Bounds, Child, NOTHING, Node, half_area, union};
use crate::world::World;

/// Of an instance that is entered, besides its tree: the ray is taken there, and has other numbers from then on.
const OF_INSTANCE: f32 = 16.0;

/// Where most is asked.
#[derive(Clone, Copy, Debug)]
struct Crowd {
    /// E.
    boxes: f32,
    /// One of those in it.
    instance: usize,
    secs: f64,
}

/// What [`World::check_overlap`] says of a world that may be drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// That a ray has to ask where most surfaces lie on top of each other, at a few moments. Rooms have 2 to 100.
    pub boxes: u64,
    /// What is not quite as it ought to be in pictures, or slow.
    pub warnings: Vec<String>,
}

/// What is known of a world that may be drawn.
#[derive(Clone, Debug, Default)]
struct Weighed {
    densest: Option<Crowd>,
    /// Of some views at a few moments.
    forecasts: Vec<Forecast>,
    /// Per deformation: the highest E of its tree.
    prices: Vec<u32>,
}

impl World {
    /// The world of a scene that a stranger may have made: as [`World::new`] makes it, but samples that would take very long are not quite
    /// what they ought to be. `file` is for messages.
    ///
    /// # Errors
    /// If its surfaces lie on top of each other so much that pictures would take long: where, and the limit, see [`Limits::overlap`].
    pub fn open(file: &str, scene: Arc<Scene>, limits: &Limits) -> Result<World, LoadError> {
        let mut world = World::new(scene);
        let weighed = world.weigh(file, limits)?;
        for warning in world.overlap(&weighed, limits).warnings {
            log::warn!("{file}: {warning}");
        }
        world.efforts = world.efforts_for(limits, &weighed.forecasts);
        for (deforming, price) in world.deforming.iter_mut().zip(weighed.prices) {
            deforming.price = price;
        }
        Ok(world)
    }

    /// What [`World::open`] finds out.
    ///
    /// # Errors
    /// As of [`World::open`].
    pub fn check_overlap(&self, file: &str, limits: &Limits) -> Result<Overlap, LoadError> {
        Ok(self.overlap(&self.weigh(file, limits)?, limits))
    }

    fn overlap(&self, weighed: &Weighed, limits: &Limits) -> Overlap {
        let boxes = weighed.densest.map_or(0, |crowd| crowd.boxes as u64);
        let mut warnings = Vec::new();
        if boxes > Limits::default().overlap {
            warnings.push(format!(
                "surfaces lie on top of each other, or nearly so: a ray has about {boxes} boxes to ask, and pictures may take long"
            ));
        }
        let lights = self.scene().lights.len();
        let stride = self.efforts_for(limits, &weighed.forecasts).stride;
        if stride > 1 {
            let asked = lights.div_ceil(stride);
            warnings.push(format!(
                "pictures would take long: of {lights} lights {asked} are asked what stands before them; --max-overlap raises that"
            ));
        }
        Overlap { boxes, warnings }
    }

    fn weigh(&self, file: &str, limits: &Limits) -> Result<Weighed, LoadError> {
        /// After the first.
        const MOMENTS: u32 = 4;
        let duration = self.scene().animation.duration_secs;
        let moments = if duration > 0.0 { MOMENTS } else { 0 };
        let refused = |(place, problem)| LoadError { file: file.to_owned(), place, problem };
        let mut moment = self.moment(0.0);
        let mut weighed = Weighed { prices: vec![0; self.deforming.len()], ..Weighed::default() };
        for k in 0..=moments {
            let secs = duration * f64::from(k) / f64::from(MOMENTS);
            self.update_moment(secs, &mut moment);
            let crowd = self.densest_at(&moment, secs, &mut weighed.prices);
            crowd.iter().try_for_each(|crowd| self.bear(crowd, limits)).map_err(refused)?;
            weighed.densest = weighed.densest.into_iter().chain(crowd).reduce(denser);
            let forecasts = self.forecasts(&moment);
            forecasts.iter().try_for_each(|one| self.allow(one, limits)).map_err(refused)?;
            weighed.forecasts.extend(forecasts);
        }
        Ok(weighed)
    }

    /// # Errors
    /// If there is too much to ask in the crowd.
    fn bear(&self, crowd: &Crowd, limits: &Limits) -> Result<(), (Place, Problem)> {
        /// As if there were two lights: `direct` asks all of them from every point.
        const RAYS: u64 = 3;
        /// So many times the limit may lie on a line: rays stop at what they meet first, and what they ask until then is tried.
        const HIDDEN: u64 = 2;
        let (scene, boxes) = (self.scene(), crowd.boxes as u64);
        let of_all_rays = boxes.saturating_mul(1 + scene.lights.len() as u64);
        let most_of_all = limits.overlap.saturating_mul(RAYS);
        let most = limits.overlap.saturating_mul(HIDDEN);
        let (what, came, limit) = match crowd.secs {
            0.0 if boxes > most => {
                ("boxes of surfaces on top of each other for a ray", boxes, most)
            }
            _ if boxes > most => {
                ("boxes of surfaces on top of each other for a ray, as things move", boxes, most)
            }
            _ if of_all_rays > most_of_all => {
                ("boxes of surfaces for the rays to all lights", of_all_rays, most_of_all)
            }
            _ => return Ok(()),
        };
        let node = scene.instances[crowd.instance].node as usize;
        let place = match scene.contents.nodes.get(node) {
            Some(number) => Place::Pointer(format!("/nodes/{number}")),
            None => Place::Whole,
        };
        Err((place, Problem::Limit { what, came, limit, enough: None }))
    }

    /// # Errors
    /// If what cannot be left out is too much.
    fn allow(&self, forecast: &Forecast, limits: &Limits) -> Result<(), (Place, Problem)> {
        let (came, limit) = (forecast.two_rays(self.scene().lights.len()), most_per_sample(limits));
        let what = "boxes of surfaces for what is seen of one pixel";
        match came <= limit {
            true => Ok(()),
            false => Err((Place::Whole, Problem::Limit { what, came, limit, enough: None })),
        }
    }

    /// So that pictures of these take no longer than they may.
    fn efforts_for(&self, limits: &Limits, forecasts: &[Forecast]) -> Efforts {
        let (lights, most) = (self.scene().lights.len(), most_per_sample(limits));
        let stride = forecasts.iter().map(|one| one.stride(lights, most)).max().unwrap_or(1);
        let usual = Efforts::default();
        let direct = forecasts.iter().map(|one| one.direct(stride, most)).min();
        let path = forecasts.iter().map(|one| one.path(lights, most)).min();
        let [direct, path] = [direct.unwrap_or(usual.direct), path.unwrap_or(usual.path)];
        Efforts { stride, direct, path }
    }

    /// `prices`: per deformation the highest E of its tree so far.
    fn densest_at(&self, moment: &Moment, secs: f64, prices: &mut [u32]) -> Option<Crowd> {
        let targets = moment.targets(self);
        let mut known: Vec<Option<Sums>> = vec![None; self.scene().geometries.len()];
        let mut of_instance = |instance: usize, placed: &Placed| {
            let Some(tree) = targets.trees.of(placed.shape) else { return Sums::default() };
            match placed.shape {
                // Poses of one shape are not alike.
                Shape::Deforming(index) => {
                    let sums = Sums::of_tree(tree);
                    let price = &mut prices[index as usize];
                    *price = (*price).max(sums.whole as u32);
                    sums
                }
                Shape::Mesh(_) | Shape::Sphere => {
                    let geometry = self.scene().instances[instance].geometry as usize;
                    *known[geometry].get_or_insert_with(|| Sums::of_tree(tree))
                }
            }
        };
        let crowd = |boxes: f32, instance: usize| Crowd { boxes, instance, secs };
        let mut densest: Option<Crowd> = None;
        let mut add = |crowd: Crowd| {
            densest = Some(densest.map_or(crowd, |known| denser(known, crowd)));
        };
        let top = Sums::of(&targets.top.nodes, |leaf| {
            let instance = leaf.place();
            let sums = of_instance(instance, moment.placed(instance as u32));
            add(crowd(sums.most, instance));
            OF_INSTANCE + sums.whole
        });
        if let Some(leaf) = top.at {
            add(crowd(top.most, leaf.place()));
        }
        if let Some(standing) = targets.standing {
            let sums = Sums::of_tree(standing.tree());
            if let Some(leaf) = sums.at {
                let number = Leaf::at(&standing.tree().leaves, leaf.place()).triangle(0);
                add(crowd(sums.most, standing.which(number).0 as usize));
            }
        }
        densest
    }
}

/// Of a ray through all of a tree's box, on average: E, see the module.
pub(crate) fn expected_boxes(tree: &Blas) -> u32 {
    Sums::of_tree(tree).whole as u32
}

fn denser(a: Crowd, b: Crowd) -> Crowd {
    if b.boxes > a.boxes { b } else { a }
}

/// What is known of a tree.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// E of all of it.
    whole: f32,
    /// The highest E of its subtrees, and a leaf of that one.
    most: f32,
    at: Option<Child>,
}

impl Sums {
    fn of_tree(tree: &Blas) -> Sums {
        Sums::of(&tree.nodes, |_| 1.0)
    }

    /// `weight`: w of a leaf.
    fn of(nodes: &[Node], mut weight: impl FnMut(Child) -> f32) -> Sums {
        let mut sums = Sums::default();
        // Per node: all of it, itself included. Parents come before their children.
        let mut below: Vec<Kept> = vec![Part::NONE.kept(); nodes.len()];
        for (index, node) in nodes.iter().enumerate().rev() {
            let slots = (0..8).filter(|&slot| node.child[slot] != Node::UNUSED);
            let children = slots.map(|slot| {
                let child = node.child[slot];
                if !child.is_leaf() {
                    // With its own box: this node's steps may be longer than that is.
                    return below[child.node()].part();
                }
                let bounds = box_of(node, slot);
                Part { bounds, sum: weight(child) * half_area(bounds), leaf: Some(child) }
            });
            let (mut parts, mut count) = ([Part::NONE; 8], 0);
            for part in children {
                parts[count] = part;
                count += 1;
            }
            let parts = &parts[..count];
            let all = together(parts.iter());
            below[index] = Part { sum: all.sum + half_area(all.bounds), ..all }.kept();
            sums.whole = all.boxes();
            // A child far away is no reason to take the others apart.
            for part in parts {
                // Even with all of them in its own box.
                if all.sum > (sums.most - 1.0) * half_area(part.bounds) {
                    sums.add(&together(parts.iter().filter(|other| part.is_where(other))));
                }
            }
            sums.add(&all);
        }
        sums
    }

    fn add(&mut self, crowd: &Part) {
        let boxes = crowd.boxes();
        if boxes > self.most {
            (self.most, self.at) = (boxes, crowd.leaf);
        }
    }
}

/// A [`Part`] in fewer bytes: of a large tree there are many.
#[derive(Clone, Copy)]
struct Kept {
    bounds: TightBox,
    sum: f32,
    leaf: Child,
}

impl Kept {
    fn part(&self) -> Part {
        let Kept { bounds, sum, leaf } = *self;
        let leaf = (leaf != Node::UNUSED).then_some(leaf);
        Part { bounds: bounds.map(Vec3A::from), sum, leaf }
    }
}

/// Some of a node's children.
#[derive(Clone, Copy, Debug)]
struct Part {
    bounds: Bounds,
    /// Σ w A.
    sum: f32,
    /// One of those below.
    leaf: Option<Child>,
}

impl Part {
    const NONE: Part = Part { bounds: NOTHING, sum: 0.0, leaf: None };

    fn kept(&self) -> Kept {
        let Part { bounds, sum, leaf } = *self;
        Kept { bounds: bounds.map(Vec3::from), sum, leaf: leaf.unwrap_or(Node::UNUSED) }
    }

    /// Whether both are in one place: a box around them is hardly larger than one of them.
    fn is_where(&self, other: &Part) -> bool {
        const MOST_GROWTH: f32 = 1.5;
        let larger = half_area(self.bounds).max(half_area(other.bounds));
        half_area(union(self.bounds, other.bounds)) <= MOST_GROWTH * larger
    }

    /// E, with the box around all of it.
    fn boxes(&self) -> f32 {
        let ratio = 1.0 + self.sum / half_area(self.bounds);
        // What is a point, or infinitely large, is met by few.
        if ratio.is_finite() { ratio } else { 0.0 }
    }
}

fn together<'a>(parts: impl Iterator<Item = &'a Part>) -> Part {
    parts.fold(Part::NONE, |all, part| Part {
        bounds: union(all.bounds, part.bounds),
        sum: all.sum + part.sum,
        leaf: all.leaf.or(part.leaf),
    })
}

fn box_of(node: &Node, slot: usize) -> Bounds {
    let corner = |side: usize| [0, 1, 2].map(|axis| node.plane(2 * axis + side, slot));
    [corner(0), corner(1)].map(Vec3A::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes as scenes;
    use frameless_scene::{Geometry, Mesh, Transform, TriangleMaterials, builtin};

    fn densest(world: &World) -> f32 {
        let prices = &mut vec![0; world.deforming.len()];
        let crowd = world.densest_at(&world.moment(0.0), 0.0, prices);
        crowd.map_or(0.0, |crowd| crowd.boxes)
    }

    fn of_copies(triangles: usize, instances: usize, far: f32) -> f32 {
        let mesh = |triangles| Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]; triangles],
            triangle_materials: TriangleMaterials::all(0, triangles),
            ..Mesh::default()
        };
        let mut scene = scenes::empty();
        for k in 0..instances {
            let place = Transform { translation: k as f32 * 1e-6 * Vec3::Z, ..Transform::IDENTITY };
            scenes::add(&mut scene, Geometry::Mesh(mesh(triangles)), place);
        }
        if far > 0.0 {
            let place = Transform { translation: far * Vec3::ONE, ..Transform::IDENTITY };
            scenes::add(&mut scene, Geometry::Mesh(mesh(1)), place);
        }
        densest(&World::new(Arc::new(scene)))
    }

    /// Four of them in nearly each leaf, and a node for up to eight of these.
    #[test]
    fn copies_are_counted_however_large_the_world_is() {
        for (triangles, instances) in [(4_000, 1), (4, 1_000), (400, 10)] {
            for far in [0.0, 1e6] {
                let leaves = (triangles * instances) as f32 / 4.0;
                let found = of_copies(triangles, instances, far) / leaves;
                let case = format!("{triangles} × {instances}, {far} m: {found}");
                assert!((1.1..1.5).contains(&found), "{case}");
            }
        }
    }

    #[test]
    fn rooms_are_no_crowds() {
        for name in ["many", "shadow"] {
            let boxes = densest(&World::new(Arc::new(builtin(name).expect("it is built in"))));
            assert!(boxes < 200.0, "{name}: {boxes}");
        }
    }
}
