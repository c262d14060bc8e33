//! Instances of one shape in one place: whoever sees one of them has seen them all, but every ray would pay for each.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::{AlphaMode, Geometry, Material, Scene, State, Target};

use super::warnings::Warnings;

/// Of what lets light pass, so many are kept: as many veils as `direct` shows one behind the other.
const MOST_VEILS: u32 = 16;

/// Leaves out what is there already, as long as nothing moves: the same mesh in the same place and pose, to the last bit. `state`: the
/// scene's at rest.
pub(super) fn leave_out_twins(scene: &mut Scene, state: &State, warnings: &mut Warnings) {
    let is_shown = shown(scene, state);
    let left_out = is_shown.iter().filter(|shown| !**shown).count();
    if left_out == 0 {
        return;
    }
    warnings.add(format!(
        "{left_out} instances were left out, as the same mesh stands in the same place already"
    ));
    let mut next = 0..;
    let numbers: Vec<Option<u32>> =
        is_shown.iter().map(|&shown| shown.then(|| next.next()).flatten()).collect();
    let mut shown = is_shown.iter();
    scene.instances.retain(|_| *shown.next().expect("one for each"));
    scene.deformations.retain_mut(|deformation| {
        let number = numbers[deformation.instance as usize];
        deformation.instance = number.unwrap_or_default();
        number.is_some()
    });
}

/// Per instance.
fn shown(scene: &Scene, state: &State) -> Vec<bool> {
    let (stands, most) = (Standing::new(scene), most_of_each(scene));
    let mut uses = vec![0_u32; scene.geometries.len()];
    scene.instances.iter().for_each(|instance| uses[instance.geometry as usize] += 1);
    // By a hash of all that makes them the same: the first of them, and how many there are.
    let mut known: HashMap<u64, (usize, u32)> = HashMap::new();
    let mut is_shown = |index: usize| {
        let geometry = scene.instances[index].geometry as usize;
        if uses[geometry] <= most[geometry] || !stands.instance(scene, index) {
            return true;
        }
        let mut hasher = DefaultHasher::new();
        look(scene, state, index).for_each(|bits| bits.hash(&mut hasher));
        let (first, count) = known.entry(hasher.finish()).or_insert((index, 0));
        if !look(scene, state, *first).eq(look(scene, state, index)) {
            return true;
        }
        *count += 1;
        *count <= most[geometry]
    };
    (0..scene.instances.len()).map(&mut is_shown).collect()
}

/// Which mesh it is, in which place and which pose.
fn look<'a>(
    scene: &'a Scene,
    state: &'a State,
    index: usize,
) -> impl Iterator<Item = u32> + use<'a> {
    let place = scene.world_from_instance(index, state).to_cols_array();
    let deformation = scene.deformation_of(index).map(|number| &scene.deformations[number]);
    let skin = deformation.and_then(|deformation| deformation.skin);
    let weights = deformation.map_or(0..0, |deformation| deformation.weights.clone());
    let weights = state.morph_weights[weights.start as usize..weights.end as usize].iter();
    let which = [scene.instances[index].geometry, skin.map_or(0, |skin| skin + 1)];
    // Of the two zeros one is as good as the other.
    let numbers = place.into_iter().chain(weights.copied()).map(|x| (x + 0.0).to_bits());
    which.into_iter().chain(numbers)
}

/// Per geometry: how many of it are seen in one place.
fn most_of_each(scene: &Scene) -> Vec<u32> {
    let of_material = |material: u32| most_in_one_place(&scene.materials[material as usize]);
    let most = |geometry: &Geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangle_materials.used().map(of_material).max().unwrap_or(1),
        Geometry::Sphere { .. } => 1,
    };
    scene.geometries.iter().map(most).collect()
}

/// How many surfaces of a material are seen in one place.
pub(super) fn most_in_one_place(material: &Material) -> u32 {
    let is_clear = material.layers.as_ref().is_some_and(|layers| layers.transmission > 0.0);
    if is_clear || material.alpha_mode == AlphaMode::Blend { MOST_VEILS } else { 1 }
}

/// What the animation leaves alone.
struct Standing {
    node_moves: Vec<bool>,
    weight_moves: Vec<bool>,
    skin_moves: Vec<bool>,
}

impl Standing {
    fn new(scene: &Scene) -> Standing {
        let node_moves = scene.moving_nodes();
        let mut weight_moves = vec![false; scene.morph_weights.len()];
        for channel in &scene.animation.channels {
            if let Target::MorphWeight(weight) = channel.target {
                weight_moves[weight as usize] = true;
            }
        }
        let moves = |joints: &[u32]| joints.iter().any(|&joint| node_moves[joint as usize]);
        let skin_moves = scene.skins.iter().map(|skin| moves(&skin.joints)).collect();
        Standing { node_moves, weight_moves, skin_moves }
    }

    fn instance(&self, scene: &Scene, index: usize) -> bool {
        let node = scene.instances[index].node as usize;
        let Some(number) = scene.deformation_of(index) else { return !self.node_moves[node] };
        let deformation = &scene.deformations[number];
        let weights = deformation.weights.start as usize..deformation.weights.end as usize;
        let moves =
            deformation.skin.map_or(self.node_moves[node], |skin| self.skin_moves[skin as usize]);
        !moves && !self.weight_moves[weights].contains(&true)
    }
}
