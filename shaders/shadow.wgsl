// Depth of the scene from one direction of light.

@group(1) @binding(0) var<uniform> layer: Layer;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    let p = vec4(position, 1.0);
    return vec4(2.0 * dot(layer.u, p) - 1.0, 1.0 - 2.0 * dot(layer.v, p), dot(layer.depth, p), 1.0);
}
