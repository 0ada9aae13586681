// How much of the sky and of the key light each point sees, at half size: a dome of shadow layers gives the sky's large
// scale, screen-space horizons the small one. Result: x the dome's visibility, y the near visibility, z the key light's,
// all 0..1; w is 1 where the key light's shadow is too sharp for half size.

@group(1) @binding(2) var geometry: texture_2d<f32>;
@group(1) @binding(3) var<uniform> dome: array<Layer, 48>;
@group(1) @binding(4) var dome_map: texture_depth_2d_array;

const SLICES: i32 = 2;
const STEPS: i32 = 5;
// all pixels need all of them, so that this one is a constant
const DOME_LAYERS: u32 = 48u;
const PI: f32 = 3.14159265;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(screen_corner(index), 0.0, 1.0);
}

fn view_position(pixel: vec2<i32>, size: vec2<f32>) -> vec3<f32> {
    let distance = textureLoad(geometry, clamp(pixel, vec2(0), vec2<i32>(size) - 1), 0).w;
    let ndc = (vec2<f32>(pixel) + 0.5) / size * 2.0 - 1.0;
    let depth = select(distance, 1e4, distance <= 0.0);
    return vec3(ndc.x * frame.eye.w * frame.screen.z, -ndc.y * frame.eye.w, -1.0) * depth;
}

// Sixteen well-spread values, one for each pixel of a 4 x 4 tile, so that a 4 x 4 blur averages them all.
fn tile(pixel: vec2<i32>, salt: i32) -> f32 {
    let x = (pixel.x + salt) & 3;
    let y = (pixel.y + salt * 2) & 3;
    let k = ((x ^ y) & 1) * 8 + (y & 1) * 4 + (((x ^ y) >> 1) & 1) * 2 + ((y >> 1) & 1);
    return (f32(k) + 0.5) / 16.0;
}

// Which quarter of the key light's layers a pixel asks; the blur brings the results of neighbours together.
fn phase(pixel: vec2<i32>) -> u32 {
    return u32((pixel.x & 1) + 2 * (pixel.y & 1));
}

// Ground-truth ambient occlusion (Jimenez et al. 2016, "Practical real-time strategies for accurate indirect
// occlusion"): horizons along screen directions, and the cosine-weighted visibility between them in closed form.
fn near_visibility(pixel: vec2<i32>, size: vec2<f32>, p: vec3<f32>, n: vec3<f32>) -> f32 {
    let radius = frame.occlusion.x;
    let radius_px = min(radius / (-p.z * frame.eye.w) * 0.5 * size.y, 0.2 * size.y);
    if radius_px < 1.0 {
        return 1.0;
    }
    let v = normalize(-p);
    var visible = 0.0;
    for (var s = 0; s < SLICES; s++) {
        let phi = (f32(s) + tile(pixel, 0)) * PI / f32(SLICES);
        let along = vec3(cos(phi), sin(phi), 0.0);
        let ortho = along - dot(along, v) * v;
        let axis = normalize(cross(along, v));
        let projected = n - axis * dot(n, axis);
        let length_n = max(length(projected), 1e-5);
        let cos_n = clamp(dot(projected, v) / length_n, -1.0, 1.0);
        let angle_n = select(-1.0, 1.0, dot(ortho, projected) >= 0.0) * acos(cos_n);
        var horizon: array<f32, 2>;
        for (var side = 0; side < 2; side++) {
            let sign = 1.0 - 2.0 * f32(side);
            let lowest = cos(angle_n + sign * 0.5 * PI);
            var h = lowest;
            for (var k = 0; k < STEPS; k++) {
                let t = (f32(k) + tile(pixel, 1)) / f32(STEPS);
                let offset = sign * along.xy * max(t * t * radius_px, f32(k) + 1.0);
                let at = pixel + vec2<i32>(round(vec2(offset.x, -offset.y)));
                let q = view_position(at, size) - p;
                let d = length(q);
                let inside = all(at >= vec2(0)) && all(vec2<f32>(at) < size);
                let weight = select(0.0, clamp(2.0 - 2.0 * d / radius, 0.0, 1.0), inside);
                h = max(h, mix(lowest, dot(q, v) / max(d, 1e-6), weight));
            }
            horizon[side] = h;
        }
        let h0 = -acos(clamp(horizon[1], -1.0, 1.0));
        let h1 = acos(clamp(horizon[0], -1.0, 1.0));
        let a = clamp(h0, angle_n - 0.5 * PI, angle_n + 0.5 * PI);
        let b = clamp(h1, angle_n - 0.5 * PI, angle_n + 0.5 * PI);
        let arc = 0.25 * (2.0 * cos_n + 2.0 * (a + b) * sin(angle_n) - cos(2.0 * a - angle_n) - cos(2.0 * b - angle_n));
        visible += length_n * arc;
    }
    return clamp(visible / f32(SLICES), 0.0, 1.0);
}

// Share of the sky above the horizon that is seen, weighted by the cosine to the normal.
fn dome_visibility(pixel: vec2<i32>, world: vec3<f32>, n: vec3<f32>) -> f32 {
    let jitter = (vec2(tile(pixel, 2), tile(pixel, 3)) - 0.5) * 12.0 / f32(textureDimensions(dome_map).x);
    let p = vec4(world + n * 1.5 * frame.fill.w, 1.0);
    var seen = 1e-4;
    var all = 1e-4;
    for (var i = 0u; i < DOME_LAYERS; i++) {
        let toward = dome[i].toward;
        let cosine = dot(n, toward.xyz);
        if cosine > 0.0 {
            let uv = vec2(dot(dome[i].u, p), dot(dome[i].v, p)) + jitter;
            let depth = clamp(dot(dome[i].depth, p), 0.0, 1.0);
            var lit = textureSampleCompareLevel(dome_map, compare, uv, i, depth);
            if any(uv < vec2(0.0)) || any(uv > vec2(1.0)) {
                lit = 1.0;
            }
            seen += cosine * lit;
            all += cosine;
        }
    }
    return seen / all;
}

@fragment
fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let size = vec2<f32>(textureDimensions(geometry));
    let here = textureLoad(geometry, pixel, 0);
    if here.w <= 0.0 {
        return vec4(1.0, 1.0, 1.0, 0.0);
    }
    let p = view_position(pixel, size);
    // the view's rows are its axes in the world, so the transpose of its rotation leads back
    let rotation = mat3x3(frame.view_from_world[0].xyz, frame.view_from_world[1].xyz, frame.view_from_world[2].xyz);
    let world = transpose(rotation) * p + frame.eye.xyz;
    let near = near_visibility(pixel, size, p, rotation * here.xyz);
    var key = vec2(0.0);
    if dot(here.xyz, frame.key.xyz) > 0.0 {
        key = key_visibility(phase(pixel), at.xy, world, here.xyz);
    }
    // metres that a pixel of the picture covers here
    let metre_px = here.w * 2.0 * frame.eye.w / frame.screen.y;
    let sharp = select(0.0, 1.0 - smoothstep(6.0, 14.0, key.y / metre_px), key.y > 0.0);
    return vec4(dome_visibility(pixel, world, here.xyz), near, key.x, sharp);
}
