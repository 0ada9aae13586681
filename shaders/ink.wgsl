// Ink ribbons on the canvas. The blend multiplies what is there by the ink's transmittance, so crossings darken.

struct Varying {
    @builtin(position) clip: vec4<f32>,
    // optical density for each channel, natural logarithm
    @location(0) absorb: vec3<f32>,
    // x: across the line from its middle, m; y: beyond its end, m; z: half width, m; w: m on the canvas a pixel across
    @location(1) place: vec4<f32>,
    @location(2) facing: f32,
}

// keeps ribbons in front of a canvas whose facets they cross
const LIFT: f32 = 0.00015;
const PULL: f32 = 0.0003;

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) tangent: vec3<f32>,
    // where this edge lies for each metre off the middle: a mitre is longer than 1
    @location(3) edge: vec3<f32>,
    // x: half width, m; y: share of the half width at this edge, signed; z: distance beyond the end, m
    @location(4) shape: vec3<f32>,
    @location(5) absorb: vec3<f32>,
) -> Varying {
    let toward = frame.eye.xyz - position;
    let v = normalize(toward);
    let depth = -(frame.view_from_world * vec4(position, 1.0)).z;
    let metre_px = depth * 2.0 * frame.eye.w / frame.screen.y;
    let along = dot(v, tangent);
    let facing = dot(v, normal);
    // how much narrower the line looks than it is; less is not followed, lest the edge leave a curved canvas
    let narrow = clamp(abs(facing) / sqrt(max(1.0 - along * along, 1e-4)), 0.3, 1.0);
    let pixel = metre_px / narrow;
    let reach = abs(shape.y) * shape.x + 0.75 * pixel;
    let p = position + tangent * shape.z + edge * reach + normal * LIFT + v * PULL;
    return Varying(frame.clip_from_world * vec4(p, 1.0), absorb, vec4(sign(shape.y) * reach, abs(shape.z), shape.x, pixel), facing);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let half = sqrt(max(in.place.z * in.place.z - in.place.y * in.place.y, 0.0)) / in.place.w;
    let at = in.place.x / in.place.w;
    // the part of a pixel-wide box that the line covers, which stays right for lines thinner than a pixel
    let cover = clamp(min(half, at + 0.5) - max(-half, at - 0.5), 0.0, 1.0) * smoothstep(0.02, 0.08, in.facing);
    return vec4(mix(vec3(1.0), exp(-in.absorb), cover), 1.0);
}
