// The lit scene: surfaces, floor and background, linear light.

@group(1) @binding(0) var<uniform> lights: Lights;
@group(1) @binding(1) var key_map: texture_depth_2d_array;
@group(1) @binding(2) var compare: sampler_comparison;
@group(1) @binding(3) var geometry: texture_2d<f32>;
@group(1) @binding(4) var occlusion: texture_2d<f32>;

const PI: f32 = 3.14159265;
// radiance of a white surface that faces the light, by light
const KEY: vec3<f32> = vec3(0.830, 0.808, 0.780);
const FILL: vec3<f32> = vec3(0.070, 0.076, 0.084);
const SKY: vec3<f32> = vec3(0.310, 0.320, 0.335);
const BOUNCE: vec3<f32> = vec3(0.200, 0.195, 0.188);

struct Varying {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    // sRGB colour and roughness
    @location(2) color: vec4<f32>,
    // metallic, clear coat, grain
    @location(3) finish: vec4<f32>,
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) color: vec4<f32>,
    @location(3) finish: vec4<f32>,
) -> Varying {
    return Varying(frame.clip_from_world * vec4(position, 1.0), position, normal, color, finish);
}

// Share of the key light, an area light sampled by one sheared shadow layer for each of its points.
fn key_visibility(pixel: vec2<f32>, world: vec3<f32>, n: vec3<f32>) -> f32 {
    let facing = clamp(dot(n, frame.key.xyz), 0.0, 1.0);
    let offset = frame.key.w * (1.0 + 1.5 * sqrt(1.0 - facing * facing));
    let p = vec4(world + n * offset, 1.0);
    // where the rim of the light is wholly seen or wholly hidden, so is the rest
    var lit = 0.0;
    for (var i = 0u; i < KEY_PROBES; i++) {
        lit += key_sample(i, p, vec2(0.0));
    }
    if lit <= 0.0 || lit >= f32(KEY_PROBES) {
        return lit / f32(KEY_PROBES);
    }
    // how far what hides it is, in units of depth: each point stands for its part of the light, and a random place in
    // that part hides the steps between points
    var distance = 0.0;
    var hits = 1e-4;
    let size = vec2<f32>(textureDimensions(key_map));
    for (var i = 0u; i < KEY_PROBES; i++) {
        let uv = vec2(dot(lights.key[i].u, p), dot(lights.key[i].v, p));
        let gap = dot(lights.key[i].depth, p) - textureLoad(key_map, vec2<i32>(clamp(uv, vec2(0.0), vec2(0.999)) * size), i, 0);
        if gap > 0.0 {
            distance += gap;
            hits += 1.0;
        }
    }
    // none of it at the border to full light and full shadow, where the probes alone decide
    let part = lit / f32(KEY_PROBES);
    let reach = frame.occlusion.zw * (distance / hits * min(1.0, 8.0 * part * (1.0 - part)));
    let noise = white_noise(pixel);
    lit = 0.0;
    for (var i = 0u; i < KEY_LAYERS; i++) {
        let angle = 6.2831853 * fract(noise.x + f32(i) * 0.61803399);
        let radius = sqrt(fract(noise.y + f32(i) * 0.75487767));
        lit += key_sample(i, p, reach * radius * vec2(cos(angle), sin(angle)));
    }
    return lit / f32(KEY_LAYERS);
}

fn key_sample(i: u32, p: vec4<f32>, shift: vec2<f32>) -> f32 {
    let uv = vec2(dot(lights.key[i].u, p), dot(lights.key[i].v, p)) + shift;
    let depth = clamp(dot(lights.key[i].depth, p), 0.0, 1.0);
    let lit = textureSampleCompareLevel(key_map, compare, uv, i, depth);
    return select(lit, 1.0, any(uv < vec2(0.0)) || any(uv > vec2(1.0)));
}

// Occlusion (dome, near) at this pixel from its half-size neighbours on the same surface.
fn occlusion_at(pixel: vec2<f32>, distance: f32, n: vec3<f32>) -> vec2<f32> {
    let last = vec2<i32>(textureDimensions(geometry)) - 1;
    let at = pixel * 0.5 - 0.5;
    let corner = vec2<i32>(floor(at));
    let part = at - floor(at);
    var sum = vec2(0.0);
    var weights = 0.0;
    for (var k = 0; k < 4; k++) {
        let step = vec2(k & 1, k >> 1);
        let q = clamp(corner + step, vec2(0), last);
        let there = textureLoad(geometry, q, 0);
        let bilinear = mix(1.0 - part, part, vec2<f32>(step));
        let level = max(0.0, 1.0 - abs(there.w - distance) / (0.02 * distance));
        let facing = max(dot(there.xyz, n), 0.0);
        let weight = (bilinear.x * bilinear.y + 0.01) * (level * facing * facing + 1e-4);
        sum += textureLoad(occlusion, q, 0).xy * weight;
        weights += weight;
    }
    return sum / weights;
}

// What a mirror in the studio would see: sky, floor, an overhead softbox and a tall strip, blurred by roughness.
fn studio(ray: vec3<f32>, roughness: f32) -> vec3<f32> {
    let soft = 0.06 + 0.9 * roughness;
    let up = smoothstep(-soft, soft, ray.z + 0.05);
    let ground = vec3(0.42, 0.41, 0.40);
    let sky = mix(vec3(0.62, 0.64, 0.67), vec3(0.30, 0.33, 0.37), smoothstep(0.0, 1.0, ray.z));
    let along = normalize(vec3(frame.fill.xy, 0.25));
    let strip = smoothstep(0.90 - 0.5 * soft, 0.97 + 0.2 * soft, dot(ray, along));
    let box = smoothstep(0.80 - 0.7 * soft, 0.92 + 0.3 * soft, dot(ray, normalize(vec3(-0.25 * frame.key.xy, 1.0))));
    return mix(ground, sky, up) + vec3(1.10) * box / (1.0 + 2.0 * soft) + vec3(0.9, 0.95, 1.0) * strip / (1.0 + 3.0 * soft);
}

// Split-sum environment term (Karis 2014, "Physically based shading on mobile").
fn environment_share(f0: vec3<f32>, roughness: f32, cosine: f32) -> vec3<f32> {
    let r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    let ab = vec2(-1.04, 1.04) * a + r.zw;
    return f0 * ab.x + ab.y;
}

// GGX lobe with the height-correlated Smith term (Hammon's approximation), times pi.
fn highlight(n: vec3<f32>, v: vec3<f32>, l: vec3<f32>, roughness: f32, f0: vec3<f32>) -> vec3<f32> {
    let h = normalize(v + l);
    let nh = clamp(dot(n, h), 0.0, 1.0);
    let nl = clamp(dot(n, l), 0.0, 1.0);
    let nv = clamp(dot(n, v), 0.02, 1.0);
    let a = roughness * roughness;
    let a2 = a * a;
    let d = nh * nh * (a2 - 1.0) + 1.0;
    let smith = 0.5 / mix(2.0 * nl * nv, nl + nv, a);
    let fresnel = f0 + (1.0 - f0) * pow(1.0 - clamp(dot(v, h), 0.0, 1.0), 5.0);
    return fresnel * (a2 / (d * d) * smith * nl);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let toward = frame.eye.xyz - in.world;
    let v = normalize(toward);
    let facet = cross(dpdx(in.world), dpdy(in.world));
    var n = normalize(in.normal);
    if dot(n, facet) * dot(facet, toward) < 0.0 {
        n = -n;
    }
    // curvature within a pixel widens the highlight instead of letting it sparkle (Kaplanyan et al. 2016)
    let bend = dpdx(n);
    let bend_y = dpdy(n);
    let variance = min(0.25 * (dot(bend, bend) + dot(bend_y, bend_y)), 0.18);
    let roughness = sqrt(sqrt(clamp(pow(in.color.w, 4.0) + variance, 0.0, 1.0)));

    let albedo = linear_from_srgb(in.color.xyz);
    let metallic = in.finish.x;
    let coat = in.finish.y;
    let diffuse = albedo * (1.0 - metallic);
    let f0 = mix(vec3(0.04 * (1.0 - in.finish.z)), albedo, metallic);

    let seen = occlusion_at(in.clip.xy, -(frame.view_from_world * vec4(in.world, 1.0)).z, n);
    let l = frame.key.xyz;
    let nl = clamp(dot(n, l), 0.0, 1.0);
    var lit = 0.0;
    if nl > 0.0 {
        lit = key_visibility(in.clip.xy, in.world, n);
    }
    let up = 0.5 + 0.5 * n.z;
    // light that comes back from bright neighbours lifts the occlusion of bright surfaces (Jimenez et al. 2016)
    let near = max(vec3(seen.y), ((seen.y * (2.0404 * albedo - 0.3324) - (4.7951 * albedo - 0.6417)) * seen.y + (2.7552 * albedo + 0.6903)) * seen.y);
    let ambient = (SKY * up * seen.x + BOUNCE * (1.0 - up) * (0.4 + 0.6 * seen.x) + 0.04) * near;
    let fill = FILL * clamp(0.3 + 0.7 * dot(n, frame.fill.xyz), 0.0, 1.0) * near;
    var color = diffuse * (KEY * (nl * lit) + fill + ambient);

    let ray = reflect(-v, n);
    let nv = clamp(dot(n, v), 0.02, 1.0);
    let open = clamp(pow(nv + seen.y, 0.5 + 0.5 * roughness) - 1.0 + seen.y, 0.0, 1.0) * mix(0.35, 1.0, seen.x);
    color += environment_share(f0, roughness, nv) * studio(ray, roughness) * open;
    color += highlight(n, v, l, max(roughness, 0.22), f0) * KEY * (PI * 0.5) * lit;
    if coat > 0.0 {
        let gloss = max(0.22, sqrt(sqrt(variance)));
        color += coat * environment_share(vec3(0.04), gloss, nv).x * studio(ray, gloss) * open;
        color += coat * highlight(n, v, l, gloss, vec3(0.04)) * KEY * (PI * 0.5) * lit;
    }
    return vec4(color, 1.0);
}

struct FloorVarying {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
}

@vertex
fn floor_vertex(@builtin(vertex_index) index: u32) -> FloorVarying {
    let corner = vec2(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let p = vec3(frame.ground.xy + corner * frame.ground.w, frame.ground.z);
    return FloorVarying(frame.clip_from_world * vec4(p, 1.0), p);
}

// The floor is the background itself, dimmed by what stands on it: so it has no edge.
@fragment
fn floor_fragment(in: FloorVarying) -> @location(0) vec4<f32> {
    let n = vec3(0.0, 0.0, 1.0);
    let toward = frame.eye.xyz - in.world;
    let far = length(in.world.xy - frame.ground.xy) / frame.ground.w;
    var share = vec3(1.0);
    if toward.z > 0.0 {
        let seen = occlusion_at(in.clip.xy, -(frame.view_from_world * vec4(in.world, 1.0)).z, n);
        let lit = key_visibility(in.clip.xy, in.world, n);
        let key = KEY * frame.key.z;
        // the last few hundredths are the steps between the sky's layers, which a bare floor would show
        let sky = min(1.0, 1.04 * seen.x) * seen.y;
        share = (key * lit + SKY * sky) / (key + SKY);
        let pool = exp(-60.0 * far * far);
        share *= 1.0 + 0.10 * pool;
    }
    let fade = smoothstep(0.25, 0.95, far);
    return vec4(background(-normalize(toward)) * mix(share, vec3(1.0), fade), 1.0);
}

struct SkyVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) ray: vec3<f32>,
}

@vertex
fn sky_vertex(@builtin(vertex_index) index: u32) -> SkyVarying {
    let corner = screen_corner(index);
    let ray = vec3(corner * vec2(frame.screen.z, 1.0) * frame.eye.w, -1.0);
    let rotation = mat3x3(frame.view_from_world[0].xyz, frame.view_from_world[1].xyz, frame.view_from_world[2].xyz);
    return SkyVarying(vec4(corner, 0.0, 1.0), transpose(rotation) * ray);
}

@fragment
fn sky_fragment(in: SkyVarying) -> @location(0) vec4<f32> {
    return vec4(background(normalize(in.ray)), 1.0);
}
