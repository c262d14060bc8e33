//! What every scene promises, said as code: for tests, and for scenes put together by hand.

use std::ops::Range;

use glam::Vec3;

use crate::{
    Channel, Deformation, Geometry, Influences, Interpolation, Mesh, Projection, Scene, Target,
    UV_SETS, Values,
};

/// How far from 1 the length of a unit vector or quaternion may be: a few roundings.
const UNIT_TOLERANCE: f32 = 1e-3;

impl Scene {
    /// Whether the scene keeps every promise of its documentation: indices in bounds, numbers finite, parents
    /// first. The error names the first that is broken. Looks at everything: not for every sample.
    pub fn check(&self) -> Result<(), String> {
        self.check_surfaces()?;
        self.check_nodes()?;
        for (i, geometry) in self.geometries.iter().enumerate() {
            self.check_geometry(geometry).map_err(|why| format!("geometry {i}: {why}"))?;
        }
        self.check_deformations()?;
        self.check_cameras_and_lights()?;
        wanted(
            self.animation.duration_secs.is_finite() && self.animation.duration_secs >= 0.0,
            "a finite animation length of at least 0",
        )?;
        for (i, channel) in self.animation.channels.iter().enumerate() {
            self.check_channel(channel).map_err(|why| format!("channel {i}: {why}"))?;
        }
        let mut targets = std::collections::HashSet::new();
        let once = self.animation.channels.iter().all(|channel| targets.insert(channel.target));
        wanted(once, "each property of each node driven at most once")
    }

    fn check_surfaces(&self) -> Result<(), String> {
        for (i, image) in self.images.iter().enumerate() {
            let texels = image.width as usize * image.height as usize;
            wanted(
                texels > 0 && texels == image.rgba.len(),
                &format!("image {i}: all its texels"),
            )?;
        }
        for (i, texture) in self.textures.iter().enumerate() {
            wanted(within(texture.image, &self.images), &format!("texture {i}: an image"))?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            let found = material.textures().all(|(reference, _)| {
                within(reference.texture, &self.textures)
                    && (reference.uv_set as usize) < UV_SETS
                    && reference.picture_from_uv.is_finite()
            });
            wanted(found, &format!("material {i}: textures, found by finite coordinates"))?;
            material.check().map_err(|why| format!("material {i}: {why}"))?;
        }
        Ok(())
    }

    fn check_nodes(&self) -> Result<(), String> {
        for (i, node) in self.nodes.iter().enumerate() {
            let parent_first = node.parent.is_none_or(|parent| (parent as usize) < i);
            wanted(parent_first, &format!("node {i}: a parent before it"))?;
            let rest = node.rest;
            let finite = rest.translation.is_finite() && rest.scale.is_finite();
            wanted(finite && is_unit(rest.rotation.length()), &format!("node {i}: a transform"))?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            let found =
                within(instance.node, &self.nodes) && within(instance.geometry, &self.geometries);
            wanted(found, &format!("instance {i}: a node and a geometry"))?;
        }
        Ok(())
    }

    fn check_geometry(&self, geometry: &Geometry) -> Result<(), String> {
        match geometry {
            Geometry::Sphere { material } => {
                wanted(within(*material, &self.materials), "a material")
            }
            Geometry::Mesh(mesh) => check_mesh(mesh, self.materials.len()),
        }
    }

    fn check_deformations(&self) -> Result<(), String> {
        wanted(self.morph_weights.iter().all(|w| w.is_finite()), "finite morph weights")?;
        for (i, skin) in self.skins.iter().enumerate() {
            let found = skin.joints.iter().all(|&joint| within(joint, &self.nodes));
            let bound = skin.inverse_bind.len() == skin.joints.len()
                && skin.inverse_bind.iter().all(|matrix| matrix.is_finite());
            wanted(found && bound, &format!("skin {i}: nodes, each with a finite matrix"))?;
        }
        let ascending = self.deformations.windows(2).all(|two| two[0].instance < two[1].instance);
        wanted(ascending, "deformations in the order of their instances")?;
        for (i, deformation) in self.deformations.iter().enumerate() {
            self.check_deformation(deformation).map_err(|why| format!("deformation {i}: {why}"))?;
        }
        Ok(())
    }

    fn check_deformation(&self, deformation: &Deformation) -> Result<(), String> {
        wanted(within(deformation.instance, &self.instances), "an instance")?;
        let instance = self.instances[deformation.instance as usize];
        let Geometry::Mesh(mesh) = &self.geometries[instance.geometry as usize] else {
            return Err("wanted a mesh, as nothing else deforms".to_owned());
        };
        let Range { start, end } = deformation.weights;
        let known = start <= end && end as usize <= self.morph_weights.len();
        wanted(known && (end - start) as usize == mesh.targets.len(), "a weight per target")?;
        let Some(skin) = deformation.skin else { return Ok(()) };
        wanted(within(skin, &self.skins) && !mesh.influences.is_empty(), "a skin and its joints")?;
        let joints = &self.skins[skin as usize].joints;
        let mut used = mesh.influences.iter().flat_map(|set| set.joints.as_flattened());
        wanted(used.all(|&joint| usize::from(joint) < joints.len()), "joints that the skin has")
    }

    fn check_cameras_and_lights(&self) -> Result<(), String> {
        wanted(!self.cameras.is_empty(), "a camera")?;
        for (i, camera) in self.cameras.iter().enumerate() {
            let sane = match camera.projection {
                Projection::Perspective { yfov_rad } => {
                    yfov_rad > 0.0 && yfov_rad < std::f32::consts::PI
                }
                Projection::Orthographic { ymag } => ymag > 0.0 && ymag.is_finite(),
            };
            wanted(
                sane && within(camera.node, &self.nodes),
                &format!("camera {i}: a node, an angle"),
            )?;
        }
        let environment = self.environment.as_ref();
        wanted(environment.is_none_or(|e| e.is_sane()), "an environment of finite texels")?;
        let is_lit = !self.lights.is_empty() || self.ambient != Vec3::ZERO || environment.is_some();
        wanted(is_lit, "some light")?;
        let backdrop = [self.ambient, self.sky[0], self.sky[1]];
        wanted(backdrop.iter().all(|c| c.is_finite()), "finite ambient and sky")?;
        for (i, light) in self.lights.iter().enumerate() {
            let sane = light.intensity.is_finite() && light.range > 0.0;
            wanted(
                sane && within(light.node, &self.nodes),
                &format!("light {i}: a node, a strength"),
            )?;
        }
        Ok(())
    }

    fn check_channel(&self, channel: &Channel) -> Result<(), String> {
        let (found, rotation) = match channel.target {
            Target::Translation(i) | Target::Scale(i) => (within(i, &self.nodes), false),
            Target::Rotation(i) => (within(i, &self.nodes), true),
            Target::LightIntensity(i) => (within(i, &self.lights), false),
            Target::MorphWeight(i) => (within(i, &self.morph_weights), false),
        };
        wanted(found, "a target")?;
        let times = &channel.times;
        let ordered = times.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = times.iter().all(|time| time.is_finite() && *time >= 0.0);
        wanted(!times.is_empty() && ordered && finite, "strictly increasing key times from 0 on")?;
        let spline = channel.interpolation == Interpolation::CubicSpline;
        let values_per_key = if spline { 3 } else { 1 };
        let (count, finite) = match &channel.values {
            Values::Vec3(values) => (values.len(), values.iter().all(|v| v.is_finite())),
            Values::Quat(values) => (values.len(), values.iter().all(|q| q.is_finite())),
            Values::Scalar(values) => (values.len(), values.iter().all(|w| w.is_finite())),
        };
        wanted(count == times.len() * values_per_key && finite, "a finite value for each key")?;
        let scalar = matches!(channel.target, Target::MorphWeight(_));
        let matching = match channel.values {
            Values::Vec3(_) => !rotation && !scalar,
            Values::Quat(_) => rotation,
            Values::Scalar(_) => scalar,
        };
        wanted(matching, "values of the target's kind")?;
        let Values::Quat(values) = &channel.values else { return Ok(()) };
        let keys = values.iter().skip(usize::from(spline)).step_by(values_per_key);
        wanted(keys.into_iter().all(|q| is_unit(q.length())), "unit quaternions")
    }
}

fn check_targets(mesh: &Mesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    let fits = |len: usize| len == 0 || len == vertices;
    for target in &mesh.targets {
        let lengths = fits(target.positions.len())
            && (target.normals.is_empty() || target.normals.len() == mesh.normals.len())
            && (target.colors.is_empty() || target.colors.len() == mesh.colors.len());
        wanted(lengths, "morph targets as long as what they are added to")?;
        let finite = target.positions.iter().chain(&target.normals).all(|v| v.is_finite())
            && target.colors.iter().all(|c| c.is_finite());
        wanted(finite, "finite morph targets")?;
    }
    let long = |set: &Influences| set.joints.len() == vertices && set.weights.len() == vertices;
    wanted(mesh.influences.iter().all(long), "as many joints and weights as positions")?;
    let sums_to_one = |vertex: usize| {
        let weights = mesh.influences.iter().flat_map(|set| set.weights[vertex]);
        let sum: f32 = weights.clone().sum();
        weights.into_iter().all(|w| w >= 0.0) && (sum - 1.0).abs() <= UNIT_TOLERANCE
    };
    let sums = mesh.influences.is_empty() || (0..vertices).all(sums_to_one);
    wanted(sums, "joint weights that sum to 1")
}

fn check_mesh(mesh: &Mesh, materials: usize) -> Result<(), String> {
    let vertices = mesh.positions.len();
    wanted(mesh.positions.iter().all(|p| p.is_finite()), "finite positions")?;
    wanted(mesh.normals.iter().all(|n| is_unit(n.length())), "unit normals")?;
    let uvs = mesh.uvs.iter().flatten();
    wanted(uvs.into_iter().all(|uv| uv.is_finite()), "finite texture coordinates")?;
    wanted(mesh.colors.iter().all(|color| color.is_finite()), "finite colours")?;
    let sets = mesh.uvs.iter().map(Vec::len);
    let mut lengths = sets.chain([mesh.normals.len(), mesh.colors.len()]);
    wanted(lengths.all(|n| n == 0 || n == vertices), "as many attributes as positions")?;
    let corners = [0, 3 * mesh.triangles.len()].contains(&mesh.tangents.len());
    let known = mesh.tangents.iter().all(|t| {
        let length = t.truncate().length();
        t.w.abs() == 1.0 && (length == 0.0 || is_unit(length))
    });
    wanted(corners && known, "three unit tangents per triangle")?;
    let in_bounds = mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices);
    wanted(in_bounds, "triangles of existing vertices")?;
    check_targets(mesh)?;
    let known = mesh.triangle_materials.used().all(|m| (m as usize) < materials);
    wanted(
        known && mesh.triangle_materials.len() == mesh.triangles.len(),
        "a material per triangle",
    )
}

fn within<T>(index: u32, of: &[T]) -> bool {
    (index as usize) < of.len()
}

fn is_unit(length: f32) -> bool {
    (length - 1.0).abs() <= UNIT_TOLERANCE
}

fn wanted(holds: bool, what: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(format!("wanted {what}")) }
}
