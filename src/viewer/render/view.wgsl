// What every pass knows of the picture. Twin of `ViewUniforms` in uniforms.rs; put in front of each pass's own text.
struct View {
    clip_from_frame: mat4x4<f32>,
    // xyz: position of the eye; w: 1 where the projection is parallel.
    eye: vec4<f32>,
    // xyz: direction to the viewer, for parallel projection; w: 1 where backs are drawn.
    backward: vec4<f32>,
    // Low and high end of the false colours; 1 where they are logarithmic; lightness of the backs.
    range: vec4<f32>,
    // Number of the mode; exposure factor; number of the tone map; 1 where textures show in detail.
    display: vec4<f32>,
    // Width and height in pixels; width of a line in pixels; opacity of the edges.
    viewport: vec4<f32>,
    // Lower corner of the room, w: 1 where what stands before it is not drawn; upper corner.
    room_min: vec4<f32>,
    room_max: vec4<f32>,
    // From a place of the picture to the direction that is seen there, in the coordinates of the picture of the sky: of its
    // middle, and what its right edge and its upper edge differ by.
    sky_forward: vec4<f32>,
    sky_right: vec4<f32>,
    sky_up: vec4<f32>,
    // Factor on the picture of the sky, exposure included.
    sky_scale: vec4<f32>,
    // Display-linear colours of the false-colour ramp, evenly spaced.
    ramp: array<vec4<f32>, 9>,
    // Lamps that gloss shows: middle and 1, or direction and 0; rgb: radiance.
    lamp_places: array<vec4<f32>, 4>,
    lamp_radiance: array<vec4<f32>, 4>,
};

// Length of `View::lamp_places`.
const LAMPS: u32 = 4u;

@group(0) @binding(0) var<uniform> view: View;

// Lines lie a little before the surface that they belong to.
fn lifted(clip: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(clip.xy, clip.z * 1.0006 + view.eye.w * 2e-5, clip.w);
}
