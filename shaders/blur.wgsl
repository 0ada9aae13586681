// Averages the occlusion, first over the 4 x 4 tile of its noise, without crossing edges of depth or normal.

@group(1) @binding(0) var geometry: texture_2d<f32>;
@group(1) @binding(1) var occlusion: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(screen_corner(index), 0.0, 1.0);
}

// Mean of the 5 x 5 neighbours `stride` apart that lie on the same surface.
fn mean(pixel: vec2<i32>, stride: i32) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(geometry)) - 1;
    let here = textureLoad(geometry, pixel, 0);
    var sum = textureLoad(occlusion, pixel, 0) * 1e-3;
    var weights = 1e-3;
    var darkest = 1.0;
    var brightest = 0.0;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let q = clamp(pixel + vec2(x, y) * stride, vec2(0), last);
            let there = textureLoad(geometry, q, 0);
            // 5 x 5 with halved borders covers each phase of the tile equally
            let border = select(1.0, 0.5, abs(x) == 2) * select(1.0, 0.5, abs(y) == 2);
            let level = max(0.0, 1.0 - abs(there.w - here.w) / (0.015 * f32(stride) * here.w + 1e-6));
            let facing = pow(max(dot(there.xyz, here.xyz), 0.0), 16.0);
            let weight = border * level * facing;
            let value = textureLoad(occlusion, q, 0);
            sum += value * weight;
            weights += weight;
            if weight > 0.0 {
                darkest = min(darkest, value.z);
                brightest = max(brightest, value.z);
            }
        }
    }
    let result = sum / weights;
    // a shadow's edge may be so sharp that it falls between two points
    return vec4(result.xyz, max(result.w, smoothstep(0.6, 0.85, brightest - darkest)));
}

@fragment
fn tile_fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return mean(vec2<i32>(at.xy), 1);
}

// The dome's visibility alone once more, wider: it has no small detail of its own, only steps between its layers.
@fragment
fn wide_fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    return vec4(mean(pixel, 4).x, textureLoad(occlusion, pixel, 0).yzw);
}
