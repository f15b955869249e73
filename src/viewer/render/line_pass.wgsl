// Instanced boxes as twelve thin edges, and segments as ribbons of a width in pixels, with or without an arrowhead.

struct Colored {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec3<f32>,
};

// Corner of a box for each end of its twelve edges; bits of the corner are x, y, z.
fn edge_corner(index: u32) -> u32 {
    let edge = index / 2u;
    let axis = edge / 4u;
    let other = edge % 4u;
    let end = index % 2u;
    switch axis {
        case 0u: { return end | (other << 1u); }
        case 1u: { return (end << 1u) | (other & 1u) | ((other >> 1u) << 2u); }
        default: { return (end << 2u) | other; }
    }
}

@vertex
fn vs_box(
    @builtin(vertex_index) index: u32,
    @location(0) low: vec3<f32>,
    @location(1) high: vec3<f32>,
    @location(2) color: vec3<f32>,
) -> Colored {
    let corner = edge_corner(index);
    let pick = vec3<f32>(f32(corner & 1u), f32((corner >> 1u) & 1u), f32((corner >> 2u) & 1u));
    var out: Colored;
    out.clip = lifted(view.clip_from_frame * vec4<f32>(mix(low, high, pick), 1.0));
    out.color = color;
    return out;
}

@vertex
fn vs_segment(
    @builtin(vertex_index) index: u32,
    @location(0) start: vec3<f32>,
    @location(1) end: vec3<f32>,
    @location(2) color: vec3<f32>,
    @location(3) arrow: f32,
) -> Colored {
    var a = view.clip_from_frame * vec4<f32>(start, 1.0);
    var b = view.clip_from_frame * vec4<f32>(end, 1.0);
    // Cut at the eye's plane: a point behind it has no place in the picture.
    let nearest = 0.02;
    if (a.w < nearest && b.w > nearest) {
        a = mix(a, b, (nearest - a.w) / (b.w - a.w));
    }
    if (b.w < nearest && a.w > nearest) {
        b = mix(b, a, (nearest - b.w) / (a.w - b.w));
    }
    let half_size = 0.5 * view.viewport.xy;
    let from_px = a.xy / max(a.w, nearest) * half_size;
    let to_px = b.xy / max(b.w, nearest) * half_size;
    let along = to_px - from_px;
    let length_px = max(length(along), 1e-3);
    let direction = along / length_px;
    let across = vec2<f32>(-direction.y, direction.x);
    let width = view.viewport.z;
    let head = min(6.0 * width, 0.6 * length_px) * arrow;
    // Six corners of the ribbon, then three of the head. Without a head its triangle repeats the first of the ribbon:
    // one without area makes the software rasteriser lose the ribbon, too.
    let corner = select(index, index - 6u, index >= 6u && arrow < 0.5);
    var clip = a;
    var offset = vec2<f32>(0.0);
    switch corner {
        case 0u, 3u: { offset = -0.5 * width * across; }
        case 1u: { offset = 0.5 * width * across; }
        case 2u, 4u: { clip = b; offset = 0.5 * width * across - head * direction; }
        case 5u: { clip = b; offset = -0.5 * width * across - head * direction; }
        case 6u: { clip = b; offset = 0.4 * head * across - head * direction; }
        case 7u: { clip = b; offset = -0.4 * head * across - head * direction; }
        default: { clip = b; }
    }
    var out: Colored;
    out.clip = lifted(vec4<f32>(clip.xy + offset / half_size * clip.w, clip.zw));
    out.color = color;
    return out;
}

@fragment
fn fs_main(in: Colored) -> @location(0) vec4<f32> {
    return vec4<f32>(in.color, 0.0);
}
