// The lit surfaces. Writes colour and, in alpha, whether it is light (1: exposed, to be tone-mapped) or a display
// colour (0).

struct Detail {
    // rgb: what multiplies the texture; w: 1 where there is a texture.
    reflectance: vec4<f32>,
    emission: vec4<f32>,
    // rgb: the part of the light that passes; w: 1 where something is cut out.
    passing: vec4<f32>,
    // rgb: colour of what is reflected in preferred directions; w: square of the roughness.
    gloss: vec4<f32>,
    // For cosines of the angle to the eye from 0 to 1, moments of the lobe: the part that it reflects, its mean direction along
    // the normal and across it; w: what a single direction counts.
    moments: array<vec4<f32>, 16>,
};

// Length of `Detail::moments`.
const COSINES: u32 = 16u;

@group(1) @binding(0) var<uniform> detail: Detail;
@group(1) @binding(1) var reflectance_texture: texture_2d<f32>;
@group(1) @binding(2) var emission_texture: texture_2d<f32>;
@group(1) @binding(3) var detail_sampler: sampler;
@group(1) @binding(4) var cutout_texture: texture_2d<f32>;

struct Surface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) texcoord: vec2<f32>,
    @location(3) reflectance: vec3<f32>,
    @location(4) emission: vec3<f32>,
    // Within the triangle: at the rim of one that is seen edge-on, light would be extrapolated without bounds.
    @location(5) @interpolate(perspective, centroid) light: vec3<f32>,
};

@vertex
fn vs_main(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) texcoord: vec2<f32>,
    @location(3) reflectance: vec3<f32>,
    @location(4) emission: vec3<f32>,
    @location(5) light: vec3<f32>,
) -> Surface {
    var out: Surface;
    out.clip = view.clip_from_frame * vec4<f32>(position, 1.0);
    out.position = position;
    out.normal = normal;
    out.texcoord = texcoord;
    out.reflectance = reflectance;
    out.emission = emission;
    out.light = light;
    return out;
}

const PI: f32 = 3.14159265;

// Whether what stands before the room is cut away.
override CUTS: bool = false;

// Whether a point stands on the way from the viewer into the room: see `Interior::entered`.
fn is_before_room(position: vec3<f32>) -> bool {
    // From the viewer to the point, or, where the projection is parallel, from before everything: 1 is at the point.
    var way = position - view.eye.xyz;
    if (view.eye.w > 0.5) {
        way = -view.backward.xyz * 1e5;
    }
    let direction = select(way, vec3<f32>(1e-9), abs(way) < vec3<f32>(1e-9));
    let a = (view.room_min.xyz - position) / direction + 1.0;
    let b = (view.room_max.xyz - position) / direction + 1.0;
    let near = min(a, b);
    let far = max(a, b);
    let entered = max(near.x, max(near.y, near.z));
    let left = min(far.x, min(far.y, far.z));
    return view.room_min.w > 0.5 && entered >= 1.0 && entered <= left;
}

// Share of the way from the middle of the room to its sides, from which on a surface that faces it is one of its walls:
// see `Interior::is_wall`.
override WALL: f32;

// Whether a surface with this normal towards the viewer is a wall of the room, seen from the side of the room.
fn is_wall(position: vec3<f32>, normal: vec3<f32>) -> bool {
    let middle = 0.5 * (view.room_min.xyz + view.room_max.xyz);
    let half = 0.5 * (view.room_max.xyz - view.room_min.xyz);
    return dot(normal, middle - position) > WALL * dot(abs(normal), half);
}

// Discard what stands before the room; `normal` points to either side.
fn cut(position: vec3<f32>, normal: vec3<f32>) {
    if (CUTS && is_before_room(position)) {
        let towards = select(-normal, normal, dot(normal, towards_viewer(position)) > 0.0);
        if (!is_wall(position, towards)) {
            discard;
        }
    }
}
// Largest value of a half float, a little less.
const BRIGHTEST: f32 = 60000.0;

fn luminance(color: vec3<f32>) -> f32 {
    return dot(color, vec3<f32>(0.2126, 0.7152, 0.0722));
}

// Below the range black, above it white.
fn false_color(value: f32) -> vec3<f32> {
    let low = view.range.x;
    let high = view.range.y;
    var t = (value - low) / max(high - low, 1e-30);
    if (view.range.z > 0.5) {
        t = log(max(value, 1e-30) / max(low, 1e-30)) / max(log(max(high, 1e-30) / max(low, 1e-30)), 1e-6);
    }
    if (t < -0.001) {
        return vec3<f32>(0.0);
    }
    if (t > 1.001) {
        return vec3<f32>(1.0);
    }
    let at = clamp(t, 0.0, 1.0) * 8.0;
    let below = u32(min(floor(at), 7.0));
    return mix(view.ramp[below].rgb, view.ramp[below + 1u].rgb, at - f32(below));
}

fn towards_viewer(position: vec3<f32>) -> vec3<f32> {
    if (view.eye.w > 0.5) {
        return view.backward.xyz;
    }
    return normalize(view.eye.xyz - position);
}

fn to_viewer(surface: Surface) -> vec3<f32> {
    return towards_viewer(surface.position);
}

fn exposed(radiance: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(clamp(radiance * view.display.y, vec3<f32>(0.0), vec3<f32>(BRIGHTEST)), 1.0);
}

// A colour of the surface, with its texture where that shows in detail.
fn in_detail(map: texture_2d<f32>, paint: vec4<f32>, mean: vec3<f32>, texcoord: vec2<f32>) -> vec3<f32> {
    let texel = textureSample(map, detail_sampler, vec2<f32>(texcoord.x, 1.0 - texcoord.y));
    if (paint.w * view.display.w > 0.5) {
        return paint.rgb * texel.rgb;
    }
    return mean;
}

fn shown_reflectance(surface: Surface) -> vec3<f32> {
    return in_detail(reflectance_texture, detail.reflectance, surface.reflectance, surface.texcoord);
}

fn shown_emission(surface: Surface) -> vec3<f32> {
    return in_detail(emission_texture, detail.emission, surface.emission, surface.texcoord);
}

fn shown(surface: Surface) -> vec4<f32> {
    cut(surface.position, surface.normal);
    let reflectance = shown_reflectance(surface);
    let radiance = shown_emission(surface) + reflectance * surface.light / PI;
    let facing = abs(dot(normalize(surface.normal), to_viewer(surface)));
    switch u32(view.display.x) {
        case 1u: { return exposed(surface.light / PI); }
        case 3u: { return vec4<f32>(reflectance, 0.0); }
        case 4u: { return vec4<f32>(pow(0.5 + 0.5 * normalize(surface.normal), vec3<f32>(2.2)), 0.0); }
        case 5u: { return vec4<f32>(vec3<f32>(0.12 + 0.5 * facing), 0.0); }
        case 6u: { return vec4<f32>(vec3<f32>(0.05, 0.14, 0.6) * (0.3 + 0.7 * facing), 0.0); }
        case 7u: { return vec4<f32>(false_color(luminance(surface.light)), 0.0); }
        case 8u: { return vec4<f32>(false_color(luminance(surface.emission + surface.reflectance * surface.light / PI)), 0.0); }
        // The estimated error. Shaded, so that surfaces without an error are told from each other.
        case 9u: { return vec4<f32>(false_color(surface.light.x) * (0.5 + 0.5 * facing), 0.0); }
        // The measured error.
        case 10u: { return vec4<f32>(false_color(surface.light.x), 0.0); }
        // No light yet: the surfaces as a lamp beside the eye would show them.
        case 255u: { return vec4<f32>(reflectance * (0.15 + 0.6 * facing), 0.0); }
        default: { return exposed(radiance); }
    }
}

@fragment
fn fs_main(surface: Surface) -> @location(0) vec4<f32> {
    return shown(surface);
}

// The part of a pixel that is not cut out: the edge, where the cut-out is a half, is one pixel wide.
fn coverage(surface: Surface) -> f32 {
    let at = vec2<f32>(surface.texcoord.x, 1.0 - surface.texcoord.y);
    let there = textureSample(cutout_texture, detail_sampler, at).r;
    let slope = max(fwidth(there), 1e-3);
    if (detail.passing.w < 0.5) {
        return 1.0;
    }
    return clamp((there - 0.5) / slope + 0.5, 0.0, 1.0);
}

// What is left of a surface; alpha is its coverage.
@fragment
fn fs_cut_out(surface: Surface) -> @location(0) vec4<f32> {
    let color = shown(surface).rgb;
    let covered = coverage(surface);
    if (covered < 0.125) {
        discard;
    }
    return vec4<f32>(color, covered);
}

// What a pane lets pass.
@fragment
fn fs_filter(surface: Surface) -> @location(0) vec4<f32> {
    cut(surface.position, surface.normal);
    if (coverage(surface) < 0.5) {
        discard;
    }
    return vec4<f32>(detail.passing.rgb, 1.0);
}

// What a pane reflects and emits; alpha is the part of what is behind that it hides.
@fragment
fn fs_pane(surface: Surface) -> @location(0) vec4<f32> {
    let color = shown(surface);
    if (coverage(surface) < 0.5) {
        discard;
    }
    return color * (1.0 - dot(detail.passing.rgb, vec3<f32>(1.0 / 3.0)));
}

@fragment
fn fs_meter_cut_out(surface: Surface) -> @location(0) vec4<u32> {
    let seen = metered(surface);
    if (coverage(surface) < 0.5) {
        discard;
    }
    return seen;
}

// Bits of the luminance that a light mode shows, before emission scale and exposure: with the sign set where most of it
// is emitted, 0 where there is none. Read by `Meter`.
fn metered(surface: Surface) -> vec4<u32> {
    cut(surface.position, surface.normal);
    let reflectance = shown_reflectance(surface);
    var emitted = luminance(shown_emission(surface));
    var reflected = luminance(reflectance * surface.light / PI);
    if (u32(view.display.x) == 1u) {
        emitted = 0.0;
        reflected = luminance(surface.light / PI);
    }
    let seen = max(emitted + reflected, 0.0);
    return vec4<u32>(bitcast<u32>(select(seen, -seen, emitted > reflected)), 0u, 0u, 0u);
}

@fragment
fn fs_meter(surface: Surface) -> @location(0) vec4<u32> {
    return metered(surface);
}

@fragment
fn fs_meter_back(surface: Surface) -> @location(0) vec4<u32> {
    cut(surface.position, surface.normal);
    return vec4<u32>(0u);
}

// The back of a face.
@fragment
fn fs_back(surface: Surface) -> @location(0) vec4<f32> {
    cut(surface.position, surface.normal);
    let facing = abs(dot(normalize(surface.normal), to_viewer(surface)));
    if (u32(view.display.x) == 6u) {
        return vec4<f32>(vec3<f32>(0.6, 0.05, 0.04) * (0.3 + 0.7 * facing), 0.0);
    }
    return vec4<f32>(vec3<f32>(view.range.w) * (0.4 + 0.6 * facing), 0.0);
}

struct Edge {
    @builtin(position) clip: vec4<f32>,
    @location(0) facing: f32,
    @location(1) position: vec3<f32>,
    @location(2) normal: vec3<f32>,
};

@vertex
fn vs_edge(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Edge {
    var to_eye = view.eye.xyz - position;
    if (view.eye.w > 0.5) {
        to_eye = view.backward.xyz;
    }
    var out: Edge;
    out.clip = lifted(view.clip_from_frame * vec4<f32>(position, 1.0));
    out.facing = dot(normal, to_eye);
    out.position = position;
    out.normal = normal;
    return out;
}

// Edges of faces that are looked through are not drawn, else they would hide what is behind.
@fragment
fn fs_edge(edge: Edge) -> @location(0) vec4<f32> {
    cut(edge.position, edge.normal);
    if (edge.facing < 0.0 && view.backward.w < 0.5) {
        discard;
    }
    return vec4<f32>(0.008, 0.012, 0.02, view.viewport.w);
}

struct GlossySurface {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    // By channel, light as a linear function of its direction; solid angles of the lamps.
    @location(2) @interpolate(perspective, centroid) red: vec4<f32>,
    @location(3) @interpolate(perspective, centroid) green: vec4<f32>,
    @location(4) @interpolate(perspective, centroid) blue: vec4<f32>,
    @location(5) @interpolate(perspective, centroid) lamps: vec4<f32>,
};

@vertex
fn vs_gloss(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) red: vec4<f32>,
    @location(3) green: vec4<f32>,
    @location(4) blue: vec4<f32>,
    @location(5) lamps: vec4<f32>,
) -> GlossySurface {
    var out: GlossySurface;
    out.clip = view.clip_from_frame * vec4<f32>(position, 1.0);
    out.position = position;
    out.normal = normal;
    out.red = red;
    out.green = green;
    out.blue = blue;
    out.lamps = lamps;
    return out;
}

// The part of the facets that no others hide: see `Gloss::unmasked`.
fn unmasked(cosine: f32, roughness_squared: f32) -> f32 {
    let root = sqrt(roughness_squared + (1.0 - roughness_squared) * cosine * cosine);
    return 2.0 * cosine / max(cosine + root, 1e-12);
}

// Value of the BSDF of gloss times the cosine towards a lamp: see `Gloss::value`. The lobe is wider by the lamp's solid angle, so
// that a mirror shows the lamp as bright as it is.
fn lobe(normal: vec3<f32>, to_eye: vec3<f32>, to_light: vec3<f32>, solid_angle: f32) -> f32 {
    let cosine_eye = max(dot(normal, to_eye), 1e-3);
    let cosine_light = dot(normal, to_light);
    if (cosine_light <= 0.0) {
        return 0.0;
    }
    let half = normalize(to_eye + to_light + 1e-6 * normal);
    let widening = solid_angle / (4.0 * PI * max(dot(half, to_eye), 0.1));
    let roughness_squared = min(detail.gloss.w + widening, 1.0);
    let cosine = max(dot(normal, half), 0.0);
    let across = cross(normal, half);
    let spread = roughness_squared * cosine * cosine + dot(across, across);
    let facets = roughness_squared / max(PI * spread * spread, 1e-20);
    return facets * unmasked(cosine_eye, roughness_squared) * unmasked(cosine_light, roughness_squared)
        / (4.0 * cosine_eye);
}

// Largest gloss: with the brightest surface it is still a half float.
const BRIGHTEST_GLOSS: f32 = 5000.0;

// What gloss adds to what is drawn.
@fragment
fn fs_gloss(surface: GlossySurface) -> @location(0) vec4<f32> {
    cut(surface.position, surface.normal);
    let normal = normalize(surface.normal);
    let to_eye = towards_viewer(surface.position);
    let cosine = clamp(dot(normal, to_eye), 0.0, 1.0);
    let place = cosine * f32(COSINES - 1u);
    let below = u32(min(floor(place), f32(COSINES - 2u)));
    let moments = mix(detail.moments[below], detail.moments[below + 1u], place - f32(below));
    // Of light that is linear in the direction, a lobe reflects what comes along its mean direction.
    let across = normal * dot(normal, to_eye) - to_eye;
    let mean = normal * moments.y + across * (moments.z / max(length(across), 1e-6));
    let along = vec4<f32>(mean, moments.x);
    var radiance = vec3<f32>(dot(surface.red, along), dot(surface.green, along), dot(surface.blue, along));
    radiance = max(radiance, vec3<f32>(0.0));
    var solid_angles = surface.lamps;
    for (var lamp = 0u; lamp < LAMPS; lamp++) {
        let solid_angle = solid_angles[lamp];
        if (solid_angle > 0.0) {
            let middle = view.lamp_places[lamp];
            let to_light = normalize(middle.xyz - surface.position * middle.w);
            let value = lobe(normal, to_eye, to_light, solid_angle);
            radiance += view.lamp_radiance[lamp].rgb * (moments.w * solid_angle * value);
        }
    }
    return min(exposed(detail.gloss.rgb * radiance), vec4<f32>(vec3<f32>(BRIGHTEST_GLOSS), 1.0));
}
