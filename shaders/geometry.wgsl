// Normals and distances at half size, for the occlusion pass; the same vertex stage fills the depth buffer beforehand.

struct Varying {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Varying {
    return Varying(frame.clip_from_world * vec4(position, 1.0), position, normal);
}

@vertex
fn floor_vertex(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let p = vec3(frame.ground.xy + corner * frame.ground.w, frame.ground.z);
    return Varying(frame.clip_from_world * vec4(p, 1.0), p, vec3(0.0, 0.0, 1.0));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let facet = cross(dpdx(in.world), dpdy(in.world));
    let toward = frame.eye.xyz - in.world;
    let outward = facet * sign(dot(facet, toward));
    var n = normalize(in.normal);
    if dot(n, outward) < 0.0 {
        n = -n;
    }
    return vec4(n, -(frame.view_from_world * vec4(in.world, 1.0)).z);
}
