//! What of the punctual lights reaches a point.

use std::f32::consts::FRAC_1_PI;

use frameless::Light;
use glam::Vec3A;

use crate::direct::Probe;
use crate::integrator::Settings;
use crate::many::SHADED;
use crate::moment::Moment;
use crate::numbers::mixed;
use crate::point::Point;
use crate::ray::Ray;
use crate::traverse::Stack;
use crate::world::World;

/// The answer of all lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// Σ E cosθ V / π.
    pub(crate) all: Vec3A,
    /// Of those lights that nothing stands before.
    pub(crate) unhindered: Vec3A,
    /// Which these are, see [`frameless::Surface::lit`]; the first 32.
    pub(crate) lit: u32,
    /// What `all` were if nothing stood anywhere.
    offered: Vec3A,
    /// What [`World::ask_lights`] had to do: for each ray one, and one for each hole that it passes.
    pub(crate) effort: u32,
}

/// The effort of a ray to a light of which nothing arrives: how many holes it was asked about before that was known depends on the order in
/// which they were met.
const BLOCKED: u32 = 4;

/// How long lights are asked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    /// Of each so many in the order of the scene one is asked; and none any more
    pub(crate) stride: usize,
    /// once [`Stack::boxes`] is so many.
    pub(crate) until: u64,
    pub(crate) then: Then,
}

/// What comes of lights that are not asked.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Then {
    /// The part of their light arrives that does of those that have been, or this one if these are none.
    Assume(Vec3A),
    /// One of them is asked for all, which a number in [0, 1) chooses: right in the mean. Without a stride.
    Draw(f32),
}

/// The numbers of all lights, first those that are asked: of each `stride` that follow each other one that is drawn, since each so many'th of a
/// file may be all of one room.
fn in_turn(all: usize, stride: usize) -> impl Iterator<Item = usize> + Clone {
    let of_group = move |group: usize| {
        let first = group * stride;
        let lights = stride.min(all - first);
        first + if lights == 1 { 0 } else { mixed(group as u32) as usize % lights }
    };
    let asked = (0..all.div_ceil(stride)).map(of_group);
    asked.chain((0..all).filter(move |&light| light != of_group(light / stride)))
}

/// Light that reaches a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Unit length, world coordinates.
    pub(crate) to_light: Vec3A,
    /// Of a surface that faces the light.
    pub(crate) irradiance: Vec3A,
    /// To the shading normal; positive.
    cos: f32,
}

impl Arriving {
    /// Before anything is known of what stands in between; `None` where a light gives nothing that anybody asks for.
    #[inline(always)]
    fn at(point: &Point, light: &Light, settings: &Settings) -> Option<Arriving> {
        let arriving = light.at(point.position.to_array());
        let to_light = Vec3A::from(arriving.direction);
        let irradiance = Vec3A::from(arriving.irradiance);
        let cos = point.normal.dot(to_light);
        let is_off = irradiance == Vec3A::ZERO;
        let is_asked = !(cos <= 0.0 || (is_off && !settings.surfaces));
        is_asked.then_some(Arriving { to_light, irradiance, cos })
    }

    #[inline(always)]
    fn shadow_ray(&self, point: &Point, light: &Light) -> Ray {
        let origin = point.shadow_origin;
        let direction = match light.position {
            Some(position) => Vec3A::from(position) - origin,
            None => self.to_light,
        };
        Ray { origin, direction }
    }

    /// What a matte surface sends back of it, per albedo.
    #[inline(always)]
    fn per_albedo(&self) -> Vec3A {
        self.irradiance * (self.cos * FRAC_1_PI)
    }
}

/// How far along its shadow rays a light is.
fn reach(light: &Light) -> f32 {
    if light.position.is_some() { 1.0 } else { f32::INFINITY }
}

impl Asked {
    /// Before any light is asked.
    pub(crate) const NOBODY: Asked = Asked {
        all: Vec3A::ZERO,
        unhindered: Vec3A::ZERO,
        lit: u32::MAX,
        offered: Vec3A::ZERO,
        effort: 0,
    };

    /// Which part of the light arrives, of all lights together; `unknown` where there is none.
    #[inline(always)]
    pub(crate) fn share(&self, unknown: Vec3A) -> Vec3A {
        let share = (self.all / self.offered).min(Vec3A::ONE);
        Vec3A::select(self.offered.cmpgt(Vec3A::ZERO), share, unknown)
    }

    /// The answers of these lights, if this part of their light arrives.
    #[inline(never)]
    fn assume(
        &mut self,
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        lights: impl Iterator<Item = usize>,
        share: Vec3A,
    ) {
        for index in lights {
            if let Some(arriving) = Arriving::at(point, &moment.lights[index], settings) {
                self.add(index, arriving, share);
            }
        }
    }

    /// Of the lights from this one on nobody knows whether something stands before them.
    fn forget_from(&mut self, light: usize) {
        if light < 32 {
            self.lit &= (1 << light) - 1;
        }
    }

    /// A light's answer, of which this part passes; returns what arrives, if anything does.
    #[inline(always)]
    fn add(&mut self, index: usize, arriving: Arriving, passes: Vec3A) -> Option<Arriving> {
        self.offered += arriving.per_albedo();
        let arriving = Arriving { irradiance: passes * arriving.irradiance, ..arriving };
        let arrives = passes != Vec3A::ZERO;
        if arrives {
            self.all += arriving.per_albedo();
        }
        if passes == Vec3A::ONE {
            self.unhindered += arriving.per_albedo();
        } else if index < 32 {
            self.lit &= !(1 << index);
        }
        arrives.then_some(arriving)
    }
}

impl World {
    /// Hands what reaches the point to `take`, and sums it up.
    #[inline(always)]
    pub(crate) fn ask_lights(
        &self,
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        (stack, patience): (&mut Stack, Patience),
        probe: &mut impl Probe,
        mut take: impl FnMut(Arriving),
    ) -> Asked {
        let (mut asked, all) = (Asked::NOBODY, moment.lights.len());
        stack.boxes += all as u64;
        for (turn, index) in in_turn(all, patience.stride).enumerate() {
            let is_asked = turn * patience.stride < all && stack.boxes < patience.until;
            let (index, stands_for) = match patience.then {
                _ if is_asked => (index, 1),
                Then::Draw(number) => {
                    let left = all - turn;
                    let drawn = ((number * left as f32) as usize).min(left - 1);
                    asked.forget_from(turn);
                    (turn + drawn, left)
                }
                Then::Assume(unknown) => {
                    let share = asked.share(unknown);
                    probe.note(|| {
                        format!("  of those after light {index} {share:.3} is taken to arrive")
                    });
                    let rest = in_turn(all, patience.stride).skip(turn);
                    asked.assume(moment, point, settings, rest, share);
                    break;
                }
            };
            let light = &moment.lights[index];
            if let Some(mut arriving) = Arriving::at(point, light, settings) {
                arriving.irradiance *= stands_for as f32;
                let shadow_ray = arriving.shadow_ray(point, light);
                let way = (&shadow_ray, reach(light));
                let (passes, holes) = self.passing_counted(moment, way, true, stack);
                asked.effort += if passes == Vec3A::ZERO { BLOCKED } else { 1 + holes };
                let arrived = asked.add(index, arriving, passes);
                probe.note(|| {
                    let (cos, contribution) = (arriving.cos, arrived.map_or(Vec3A::ZERO, |a| a.per_albedo()));
                    format!("  light {index}: {passes:.3} of it passes: {contribution:.5} per albedo (cos {cos:.4})")
                });
                if let Some(arrived) = arrived {
                    take(arrived);
                }
            } else {
                probe.note(|| format!("  light {index}: faces away or gives nothing"));
            }
            if stands_for > 1 {
                break;
            }
        }
        asked
    }

    /// What [`World::ask_lights`] may say if this part of the light arrives: no ray is sent.
    #[inline(never)]
    pub(crate) fn assume_lights(
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        share: Vec3A,
    ) -> Asked {
        let mut asked = Asked::NOBODY;
        asked.assume(moment, point, settings, 0..moment.lights.len(), share);
        asked
    }

    /// The sums of [`World::ask_lights`] for at most [`SHADED`] points, where there are any; shadow rays are asked about together.
    #[inline(always)]
    pub(crate) fn ask_lights_of(
        &self,
        moment: &Moment,
        points: &[Option<&Point>],
        settings: &Settings,
        stack: &mut Stack,
    ) -> [Asked; SHADED] {
        let mut asked = [Asked::NOBODY; SHADED];
        let all = moment.lights.len();
        let stride = self.efforts.stride;
        for index in in_turn(all, stride).take(all.div_ceil(stride)) {
            let light = &moment.lights[index];
            let mut arriving = [None; SHADED];
            let (mut rays, mut count) = ([Ray::NONE; SHADED], 0);
            for (arriving, point) in arriving.iter_mut().zip(points) {
                let Some(point) = point else { continue };
                *arriving = Arriving::at(point, light, settings);
                if let Some(arriving) = arriving {
                    rays[count % SHADED] = arriving.shadow_ray(point, light);
                    count += 1;
                }
            }
            let rays = &rays[..count.min(SHADED)];
            let mut passes = self.passing_of(moment, rays, reach(light), stack).into_iter();
            for (asked, arriving) in asked.iter_mut().zip(arriving) {
                if let Some(arriving) = arriving
                    && let Some(passes) = passes.next()
                {
                    asked.add(index, arriving, passes);
                }
            }
        }
        if stride > 1 {
            let others = in_turn(all, stride).skip(all.div_ceil(stride));
            for (asked, point) in asked.iter_mut().zip(points) {
                let Some(point) = point else { continue };
                let share = asked.share(Vec3A::ONE);
                asked.assume(moment, point, settings, others.clone(), share);
            }
        }
        asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_has_its_turn_and_those_that_are_asked_are_of_no_kind() {
        for (all, stride) in [(60, 1), (60, 2), (61, 4), (7, 3), (300, 80), (1, 5), (0, 2)] {
            let turns: Vec<usize> = in_turn(all, stride).collect();
            let mut sorted = turns.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..all), "{turns:?}");
            let asked = &turns[..all.div_ceil(stride)];
            assert!(asked.iter().enumerate().all(|(k, light)| light / stride == k), "{asked:?}");
            if asked.len() > 10 {
                let odd = asked.iter().filter(|&light| light % 2 == 1).count();
                assert!(odd * 4 > asked.len() && odd * 4 < asked.len() * 3, "{odd} of {asked:?}");
            }
        }
    }
}
