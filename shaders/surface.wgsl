// The lit scene: surfaces, floor and background, linear light.

@group(1) @binding(2) var geometry: texture_2d<f32>;
@group(1) @binding(3) var occlusion: texture_2d<f32>;

const PI: f32 = 3.14159265;
// radiance of a white surface that faces the light, by light
const KEY: vec3<f32> = vec3(0.760, 0.742, 0.718);
const FILL: vec3<f32> = vec3(0.070, 0.076, 0.084);
const SKY: vec3<f32> = vec3(0.345, 0.356, 0.372);
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

// What the occlusion passes found, at this pixel, from its half-size neighbours on the same surface. Where there is no
// such neighbour, its last component asks for the key light to be sampled here.
fn occlusion_at(pixel: vec2<f32>, distance: f32, n: vec3<f32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(geometry)) - 1;
    let at = pixel * 0.5 - 0.5;
    let corner = vec2<i32>(floor(at));
    let part = at - floor(at);
    var sum = vec4(0.0);
    var weights = 0.0;
    var alike = 0.0;
    for (var k = 0; k < 4; k++) {
        let step = vec2(k & 1, k >> 1);
        let q = clamp(corner + step, vec2(0), last);
        let there = textureLoad(geometry, q, 0);
        let bilinear = mix(1.0 - part, part, vec2<f32>(step));
        let level = max(0.0, 1.0 - abs(there.w - distance) / (0.02 * distance));
        let facing = max(dot(there.xyz, n), 0.0);
        let weight = (bilinear.x * bilinear.y + 0.01) * (level * facing * facing + 1e-4);
        sum += textureLoad(occlusion, q, 0) * weight;
        weights += weight;
        alike = max(alike, level * facing);
    }
    let result = sum / weights;
    return vec4(result.xyz, select(result.w, 1.0, alike < 0.5));
}

// The key light's share: from the blurred half-size samples in wide penumbras, sampled here where shadows are sharp.
fn key_light(world: vec3<f32>, n: vec3<f32>, seen: vec4<f32>) -> f32 {
    let sharp = clamp(4.0 * seen.w, 0.0, 1.0);
    var lit = select(0.0, seen.z, dot(n, frame.key.xyz) > 0.0);
    if lit > 0.0 && sharp > 0.0 {
        lit = mix(lit, key_visibility_sharp(world, n), sharp);
    }
    return lit;
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
    let lit = key_light(in.world, n, seen);
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
        let lit = key_light(in.world, n, seen);
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
