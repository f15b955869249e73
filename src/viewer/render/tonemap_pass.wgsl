// From the linear picture to display colours: tone map where alpha says light, then the sRGB curve. The samples of a pixel
// are averaged between the two: the mean of a lamp and a wall beside it is as bright as the lamp before the tone map.
// Twin of `crate::export::color`.

@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var samples: texture_multisampled_2d<f32>;
// Of a picture without its background, the same over light.
@group(1) @binding(2) var picture_over_light: texture_2d<f32>;
@group(1) @binding(3) var samples_over_light: texture_multisampled_2d<f32>;

@vertex
fn vs_main(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the picture.
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0);
}

// Khronos PBR Neutral.
fn neutral(light: vec3<f32>) -> vec3<f32> {
    let start = 0.8 - 0.04;
    let desaturation = 0.15;
    let smallest = min(light.r, min(light.g, light.b));
    let offset = select(0.04, smallest - 6.25 * smallest * smallest, smallest < 0.08);
    let shifted = light - offset;
    let peak = max(shifted.r, max(shifted.g, shifted.b));
    if (peak < start) {
        return shifted;
    }
    let span = 1.0 - start;
    let new_peak = 1.0 - span * span / (peak + span - start);
    let scaled = shifted * (new_peak / peak);
    let share = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(scaled, vec3<f32>(new_peak), share);
}

fn srgb(x: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(x, vec3<f32>(1.0 / 2.4)) - 0.055, x * 12.92, x <= vec3<f32>(0.0031308));
}

// Display-linear colour, 0 to 1.
fn shown(pixel: vec4<f32>) -> vec3<f32> {
    var mapped = pixel.rgb;
    if (view.display.z < 0.5) {
        mapped = neutral(pixel.rgb);
    }
    return clamp(mix(pixel.rgb, mapped, pixel.a), vec3<f32>(0.0), vec3<f32>(1.0));
}

@fragment
fn fs_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(srgb(shown(textureLoad(picture, vec2<i32>(at.xy), 0))), 1.0);
}

// Of a picture whose samples can be read.
@fragment
fn fs_samples(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let count = i32(textureNumSamples(samples));
    var sum = vec3<f32>(0.0);
    for (var index = 0; index < count; index++) {
        sum += shown(textureLoad(samples, vec2<i32>(at.xy), index));
    }
    return vec4<f32>(srgb(sum / f32(count)), 1.0);
}

// What is covered, of a pixel over nothing and the alpha of the same over light: display-linear colour times coverage, and
// coverage.
fn covered(over_nothing: vec4<f32>, alpha_over_light: f32) -> vec4<f32> {
    let coverage = clamp(1.0 - (alpha_over_light - over_nothing.a), 0.0, 1.0);
    if (coverage <= 0.0) {
        return vec4<f32>(0.0);
    }
    let light = clamp(over_nothing.a, 0.0, coverage);
    let color = shown(vec4<f32>(over_nothing.rgb, light) / coverage);
    return vec4<f32>(color * coverage, coverage);
}

// Straight alpha: colours are not darkened towards the edges.
fn straight(sum: vec4<f32>) -> vec4<f32> {
    if (sum.a <= 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(srgb(sum.rgb / sum.a), sum.a);
}

@fragment
fn fs_cutout(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let place = vec2<i32>(at.xy);
    let over_light = textureLoad(picture_over_light, place, 0);
    return straight(covered(textureLoad(picture, place, 0), over_light.a));
}

@fragment
fn fs_cutout_samples(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let place = vec2<i32>(at.xy);
    let count = i32(textureNumSamples(samples));
    var sum = vec4<f32>(0.0);
    for (var index = 0; index < count; index++) {
        let over_light = textureLoad(samples_over_light, place, index);
        sum += covered(textureLoad(samples, place, index), over_light.a);
    }
    return straight(sum / f32(count));
}
