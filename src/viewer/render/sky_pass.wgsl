// The picture of the sky behind everything: radiance times exposure, alpha says that it is light.
// Lookup as in `SkyPicture::radiance`.

@group(1) @binding(0) var sky: texture_2d<f32>;

struct Seen {
    @builtin(position) at: vec4<f32>,
    // Place in the picture, -1 to 1, y up.
    @location(0) place: vec2<f32>,
};

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> Seen {
    // One triangle that covers the picture.
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return Seen(vec4<f32>(corner, 0.0, 1.0), corner);
}

@fragment
fn fs_main(seen: Seen) -> @location(0) vec4<f32> {
    let ray = view.sky_forward.xyz + seen.place.x * view.sky_right.xyz + seen.place.y * view.sky_up.xyz;
    let direction = normalize(ray);
    let size = vec2<i32>(textureDimensions(sky));
    let across = atan2(direction.x, -direction.z) / 6.2831853;
    let down = acos(clamp(direction.y, -1.0, 1.0)) / 3.1415927;
    let at = vec2<f32>(across - floor(across), down) * vec2<f32>(size) - 0.5;
    let low = floor(at);
    let part = at - low;
    let columns = (vec2<i32>(i32(low.x), i32(low.x) + 1) + size.x) % size.x;
    let rows = clamp(vec2<i32>(i32(low.y), i32(low.y) + 1), vec2<i32>(0), vec2<i32>(size.y - 1));
    let above = mix(
        textureLoad(sky, vec2<i32>(columns.x, rows.x), 0).rgb,
        textureLoad(sky, vec2<i32>(columns.y, rows.x), 0).rgb,
        part.x,
    );
    let below = mix(
        textureLoad(sky, vec2<i32>(columns.x, rows.y), 0).rgb,
        textureLoad(sky, vec2<i32>(columns.y, rows.y), 0).rgb,
        part.x,
    );
    let light = mix(above, below, part.y) * view.sky_scale.rgb;
    // Suns of pictures may be brighter than half floats go.
    return vec4<f32>(min(light, vec3<f32>(60000.0)), 1.0);
}
