// Linear samples to a picture: each sample is toned, then the samples of a pixel are averaged and encoded as sRGB.

@group(1) @binding(0) var samples: texture_multisampled_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(screen_corner(index), 0.0, 1.0);
}

// Identity up to paper white, above it a shoulder that keeps the hue (as in Khronos PBR Neutral, without its toe).
fn tone(c: vec3<f32>) -> vec3<f32> {
    let start = 0.80;
    let peak = max(c.x, max(c.y, c.z));
    if peak <= start {
        return c;
    }
    let room = 1.0 - start;
    let top = 1.0 - room * room / (peak + room - start);
    let white = 1.0 - 1.0 / (0.15 * (peak - top) + 1.0);
    return mix(c * (top / peak), vec3(top), white);
}

@fragment
fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    var sum = vec3(0.0);
    for (var i = 0; i < 4; i++) {
        sum += tone(textureLoad(samples, pixel, i).xyz);
    }
    // half a step of ordered noise hides the steps of wide gradients
    let noise = gradient_noise(at.xy) - 0.5;
    return vec4(srgb_from_linear(sum * 0.25) + noise / 255.0, 1.0);
}
