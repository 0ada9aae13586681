// The key light, an area light sampled by one sheared shadow layer for each of its points.

@group(1) @binding(0) var key_map: texture_depth_2d_array;
@group(1) @binding(1) var compare: sampler_comparison;

// angle from one point of the light's spiral to the next, and cosine and sine of one, two and four of them
const GOLDEN: f32 = 3.8832221;
const TURNS: array<vec2<f32>, 3> = array(vec2(-0.73736888, -0.67549029), vec2(0.08742572, 0.99617104), vec2(-0.98471349, 0.17418195));

// A place in the key light's shadow layers: u, v and depth in the middle layer.
// It lies a little off the surface, more so where light only grazes it.
fn key_place(world: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let facing = clamp(dot(n, frame.key.xyz), 0.0, 1.0);
    let p = vec4(world + n * frame.key.w * (1.0 + 1.5 * sqrt(1.0 - facing * facing)), 1.0);
    return vec3(dot(frame.key_u, p), dot(frame.key_v, p), dot(frame.key_depth, p));
}

// Where that place is in the layer of a point of the light's unit disc: layers are sheared about half depth.
fn sheared(place: vec3<f32>, point: vec2<f32>) -> vec2<f32> {
    return place.xy + point * frame.occlusion.zw * (place.z - 0.5);
}

fn key_sample(layer: u32, uv: vec2<f32>, depth: f32) -> f32 {
    let lit = textureSampleCompareLevel(key_map, compare, uv, layer, clamp(depth, 0.0, 1.0));
    return select(lit, 1.0, any(uv < vec2(0.0)) || any(uv > vec2(1.0)));
}

// The unit direction of point `i` of the light's spiral from its middle.
fn spoke(i: u32) -> vec2<f32> {
    return vec2(cos(GOLDEN * f32(i)), sin(GOLDEN * f32(i)));
}

// The spoke that follows by one of `TURNS`.
fn turned(spoke: vec2<f32>, turn: vec2<f32>) -> vec2<f32> {
    return vec2(spoke.x * turn.x - spoke.y * turn.y, spoke.x * turn.y + spoke.y * turn.x);
}

// Share of the key light that reaches a point, where its shadow is so sharp that the steps between layers don't show.
// The light is brightest in its middle and falls to nothing at its rim, so that a shadow begins gently.
fn key_visibility_sharp(world: vec3<f32>, n: vec3<f32>) -> f32 {
    let place = key_place(world, n);
    let all = f32(frame.layers.x);
    var lit = 0.0;
    var weights = 0.0;
    var direction = vec2(1.0, 0.0);
    for (var i = 0u; i < frame.layers.x; i += 2u) {
        let r2 = (f32(i) + 0.5) / all;
        let weight = sqrt(1.0 - r2);
        lit += weight * key_sample(i, sheared(place, direction * sqrt(r2)), place.z);
        weights += weight;
        direction = turned(direction, TURNS[1]);
    }
    return lit / weights;
}

// Share of the key light that reaches a point (x), and the width of the penumbra it is in, m (y; 0 outside of any), from
// every fourth layer after the `first`.
fn key_visibility(first: u32, pixel: vec2<f32>, world: vec3<f32>, n: vec3<f32>) -> vec2<f32> {
    let place = key_place(world, n);
    let all = f32(frame.layers.x);
    var count = 0.0;
    var direction = spoke(first);
    for (var i = first; i < frame.layers.x; i += 4u) {
        let point = direction * sqrt((f32(i) + 0.5) / all);
        count += key_sample(i, sheared(place, point), place.z);
        direction = turned(direction, TURNS[2]);
    }
    let part = count * 4.0 / all;
    if part <= 0.0 || part >= 1.0 {
        return vec2(part, 0.0);
    }
    // Each point stands for its part of the light, and a random place in that part hides the steps between points.
    // How far that moves the shadow depends on how far away what casts it is.
    var gaps = 0.0;
    var hits = 1e-4;
    direction = spoke(first);
    let size = vec2<f32>(textureDimensions(key_map));
    for (var i = first; i < frame.layers.x; i += 4u) {
        let uv = sheared(place, direction * sqrt((f32(i) + 0.5) / all));
        let gap = place.z - textureLoad(key_map, vec2<i32>(clamp(uv, vec2(0.0), vec2(0.999)) * size), i, 0);
        if gap > 0.0 {
            gaps += gap;
            hits += 1.0;
        }
        direction = turned(direction, TURNS[2]);
    }
    let gap = gaps / hits;
    let reach = frame.occlusion.zw * (gap * sqrt(2.0 / all) * min(1.0, 8.0 * part * (1.0 - part)));
    let noise = white_noise(pixel);
    var lit = 0.0;
    var weights = 0.0;
    direction = spoke(first);
    var shift = vec2(cos(6.2831853 * noise.x), sin(6.2831853 * noise.x));
    for (var i = first; i < frame.layers.x; i += 4u) {
        let r2 = (f32(i) + 0.5) / all;
        let weight = sqrt(1.0 - r2);
        let within = reach * sqrt(fract(noise.y + f32(i) * 0.75487767));
        lit += weight * key_sample(i, sheared(place, direction * sqrt(r2)) + within * shift, place.z);
        weights += weight;
        direction = turned(direction, TURNS[2]);
        shift = turned(shift, TURNS[0]);
    }
    return vec2(lit / weights, max(gap * frame.occlusion.y, 1e-6));
}
