// The key light, an area light sampled by one sheared shadow layer for each of its points.

@group(1) @binding(0) var<uniform> lights: Lights;
@group(1) @binding(1) var key_map: texture_depth_2d_array;
@group(1) @binding(2) var compare: sampler_comparison;

fn key_sample(i: u32, p: vec4<f32>, shift: vec2<f32>) -> f32 {
    let uv = vec2(dot(lights.key[i].u, p), dot(lights.key[i].v, p)) + shift;
    let depth = clamp(dot(lights.key[i].depth, p), 0.0, 1.0);
    let lit = textureSampleCompareLevel(key_map, compare, uv, i, depth);
    return select(lit, 1.0, any(uv < vec2(0.0)) || any(uv > vec2(1.0)));
}

// Share of the key light that reaches a point (x), and the width of the penumbra it is in, m (y; 0 outside of any), from
// every `step`th layer after the `first`.
fn key_visibility(first: u32, step: u32, pixel: vec2<f32>, world: vec3<f32>, n: vec3<f32>) -> vec2<f32> {
    let facing = clamp(dot(n, frame.key.xyz), 0.0, 1.0);
    let offset = frame.key.w * (1.0 + 1.5 * sqrt(1.0 - facing * facing));
    let p = vec4(world + n * offset, 1.0);
    let all = f32(KEY_LAYERS / step);
    var count = 0.0;
    for (var i = first; i < KEY_LAYERS; i += step) {
        count += key_sample(i, p, vec2(0.0));
    }
    if count <= 0.0 || count >= all {
        return vec2(count / all, 0.0);
    }
    // Each point stands for its part of the light, and a random place in that part hides the steps between points.
    // How far that moves the shadow depends on how far away what casts it is.
    var gaps = 0.0;
    var hits = 1e-4;
    let size = vec2<f32>(textureDimensions(key_map));
    for (var i = first; i < KEY_LAYERS; i += 4u) {
        let uv = clamp(vec2(dot(lights.key[i].u, p), dot(lights.key[i].v, p)), vec2(0.0), vec2(0.999));
        let gap = dot(lights.key[i].depth, p) - textureLoad(key_map, vec2<i32>(uv * size), i, 0);
        if gap > 0.0 {
            gaps += gap;
            hits += 1.0;
        }
    }
    let gap = gaps / hits;
    let part = count / all;
    let reach = frame.occlusion.zw * (gap * min(1.0, 8.0 * part * (1.0 - part)));
    let noise = white_noise(pixel);
    var lit = 0.0;
    var weights = 0.0;
    for (var i = first; i < KEY_LAYERS; i += step) {
        let angle = 6.2831853 * fract(noise.x + f32(i) * 0.61803399);
        let radius = sqrt(fract(noise.y + f32(i) * 0.75487767));
        let weight = lights.key[i].toward.w;
        lit += weight * key_sample(i, p, reach * radius * vec2(cos(angle), sin(angle)));
        weights += weight;
    }
    return vec2(lit / weights, max(gap * frame.occlusion.y, 1e-6));
}
