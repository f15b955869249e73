//! Stiff and extreme scenes with known light: mirrors of what goes wrong in practice, taken to the limit.
//!
//! Lengths are in metres, and rooms have edges of one, unless a scene is about scale.

mod degenerate;
mod extent;
mod pieces;
mod stiff;

pub use degenerate::{
    crossing_boxes, doubled_furnace, lamp_in_a_box, many_lamps, needles, one_centroid,
    one_triangle, polygon_furnace, sheet_between_lamps, sliver_furnace, twin_sheet,
    two_sided_sheet, wall_between_rooms, with_collapsed_faces,
};
pub use extent::{furnished_room, moved, relit, terrain_with_lamp, two_lamps};
pub use pieces::{LAMP, WALL};
pub use stiff::{
    INNER_SPHERE, LEAK_EVERY, MAZE_OPENINGS, PIN_HOLE, black_room, colored_furnace, leaking_sphere,
    maze, nested_spheres, rooms_with_pin_hole,
};
