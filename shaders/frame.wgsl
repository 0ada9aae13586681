// What every pass knows: the camera, the lights and where their shadow layers lie. Prepended to the other shaders.
// World: z up, m. View: x right, y up, z towards the viewer, m. Colours are linear.

struct Frame {
    clip_from_world: mat4x4<f32>,
    view_from_world: mat4x4<f32>,
    // xyz: eye in the world; w: tangent of half the vertical field of view
    eye: vec4<f32>,
    // width, height (px), aspect, near distance (m)
    screen: vec4<f32>,
    // xyz: unit direction to the key light; w: edge of a key shadow texel, m
    key: vec4<f32>,
    // xyz: unit direction to the fill light; w: edge of a dome shadow texel, m
    fill: vec4<f32>,
    // xy: where the floor is lit brightest, z: its height (m), w: radius at which it has faded into the background (m)
    ground: vec4<f32>,
    // x: radius of the screen-space occlusion, m; y: width of the key light's penumbra, m for each unit of depth;
    // zw: how far a point on the key light's rim shifts a shadow, in u and v for each unit of depth
    occlusion: vec4<f32>,
    // rows of the shadow layer of the key light's middle
    key_u: vec4<f32>,
    key_v: vec4<f32>,
    key_depth: vec4<f32>,
    // x: number of layers of the key light. Not a constant of the shader: a software driver would unroll loops over it
    // and then run them even where no pixel asks for them.
    layers: vec4<u32>,
}

// A shadow layer as three rows: dot(row, (p, 1)) gives u, v and depth, all 0..1; `toward` is the direction to the light.
struct Layer {
    u: vec4<f32>,
    v: vec4<f32>,
    depth: vec4<f32>,
    toward: vec4<f32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3(0.0031308));
}

// The seamless paper background, by the height of the view ray: light below, lightest at the horizon, a cool grey above.
fn background(ray: vec3<f32>) -> vec3<f32> {
    let below = vec3(0.760, 0.756, 0.748);
    let horizon = vec3(0.835, 0.838, 0.840);
    let above = vec3(0.620, 0.645, 0.680);
    let up = smoothstep(0.0, 0.75, ray.z);
    let down = smoothstep(0.0, 0.7, -ray.z);
    return mix(mix(horizon, above, up), below, down);
}

// Noise that looks even at every scale, 0..1 (interleaved gradient noise, Jimenez 2014).
fn gradient_noise(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// Noise without any order, two values 0..1 (PCG, Jarzynski and Olano 2020).
fn white_noise(pixel: vec2<f32>) -> vec2<f32> {
    var v = vec2<u32>(pixel) * 1664525u + 1013904223u;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> vec2(16u);
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> vec2(16u);
    return vec2<f32>(v >> vec2(8u)) / 16777216.0;
}

// A full-screen triangle.
fn screen_corner(index: u32) -> vec2<f32> {
    return vec2(f32((index << 1u) & 2u) * 2.0 - 1.0, f32(index & 2u) * 2.0 - 1.0);
}
