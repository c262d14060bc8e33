// The picture in its rectangle, and nothing else.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

// One triangle over the whole viewport and beyond it: uv (0, 0), (2, 0), (0, 2).
@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

@fragment
fn pixel(at: Corner) -> @location(0) vec4f {
    return textureSample(picture, picture_sampler, at.uv);
}
