//! Keys and what they do: one table, read by the window and by the key sheet.

use eframe::egui::{Event, InputState, Key, Modifiers};

use super::{
    action::{Action, Scale},
    camera::AxisView,
    view::ViewMode,
};

use crate::scene::UpAxis;

/// Where a binding stands on the key sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Moving the camera.
    Camera,
    /// What is shown.
    View,
    /// The solve.
    Solve,
    /// Files, pictures and the window.
    File,
}

impl Group {
    /// All, in the order of the sheet.
    pub const ALL: [Self; 4] = [Self::Camera, Self::View, Self::Solve, Self::File];

    /// Heading.
    pub fn label(self) -> &'static str {
        match self {
            Self::Camera => "Camera",
            Self::View => "View",
            Self::Solve => "Light",
            Self::File => "Files and window",
        }
    }
}

/// A key with modifiers, and what it does.
pub struct Binding {
    /// The key.
    pub key: Key,
    /// Modifiers that must be held.
    pub modifiers: Modifiers,
    /// Whether it does not matter if Shift is held: `?` and `+` are typed with it on some keyboards.
    pub ignores_shift: bool,
    /// Where it stands on the sheet.
    pub group: Group,
    /// What it does, in a few words.
    pub text: &'static str,
    /// What it does.
    pub action: Action,
}

impl Binding {
    /// Whether a key press is meant. Held keys repeat only what is done in steps.
    fn fits(&self, key: Key, modifiers: Modifiers, is_repeat: bool) -> bool {
        let goes_in_steps = matches!(
            self.action,
            Action::ExposureBy(_) | Action::ClusterLevelBy(_) | Action::Scale(_)
        );
        let shift = self.ignores_shift || modifiers.shift == self.modifiers.shift;
        key == self.key
            && shift
            && modifiers.command == self.modifiers.command
            && modifiers.alt == self.modifiers.alt
            && (goes_in_steps || !is_repeat)
    }

    /// The key as people write it.
    pub fn keys(&self) -> String {
        let mut text = String::new();
        for (is_down, name) in [
            (self.modifiers.command, "Ctrl+"),
            (self.modifiers.alt, "Alt+"),
            (self.modifiers.shift, "Shift+"),
        ] {
            if is_down {
                text.push_str(name);
            }
        }
        text + key_name(self.key)
    }
}

/// What the mouse does in the viewport, for the key sheet.
pub const MOUSE: [(&str, &str); 10] = [
    ("Left drag", "Orbit"),
    ("Middle drag, Shift+left drag", "Pan"),
    ("Wheel, pinch, Ctrl+right drag", "Zoom to the cursor"),
    ("Right drag", "Look around"),
    ("Right drag + W A S D Q E", "Fly; Shift faster, Ctrl slower"),
    ("Wheel while flying", "Flying speed"),
    ("Click", "Pick a surface"),
    ("Double-click a surface", "Set orbit centre"),
    ("Double-click the background", "Show the whole scene"),
    ("Drop a file", "Open it"),
];

/// What keys do with the controls of the panels, for the key sheet.
pub const FOCUS: [(&str, &str); 3] = [
    ("Tab, Shift+Tab", "Next or previous control"),
    ("Space, Enter", "Press the control with the focus"),
    ("Esc", "Leave the control"),
];

/// Keys that move the camera while the right button is held; Ctrl slows it then, and means nothing else.
const FLYING: [Key; 6] = [Key::W, Key::A, Key::S, Key::D, Key::Q, Key::E];

/// The row of digits in the order of the keyboard: of view modes, and its first keys of bookmarks.
const ROW: [Key; ViewMode::ALL.len()] = [
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
    Key::Num0,
    Key::Minus,
];

/// Bookmarks that have a key.
const BOOKMARK_KEYS: usize = 9;

/// What two keys do, since one of them needs Shift on some keyboards.
const LARGER: &str = "Larger text and panels";

/// All bindings.
pub fn bindings() -> Vec<Binding> {
    use Group::{Camera, File, Solve, View};
    let plain = |key, group, text, action| bind(Modifiers::NONE, key, group, text, action);
    let command = |key, group, text, action| bind(Modifiers::COMMAND, key, group, text, action);
    let shift = |key, group, text, action| bind(Modifiers::SHIFT, key, group, text, action);
    let alt =
        |key, mode: ViewMode| bind(Modifiers::ALT, key, View, mode.label(), Action::Mode(mode));
    let mut all = vec![
        plain(
            Key::Home,
            Camera,
            "Back to the first view",
            Action::FirstLook,
        ),
        plain(Key::Enter, Camera, "Show the whole scene", Action::FrameAll),
        plain(Key::F, Camera, "Show the selection", Action::FrameSelected),
        plain(
            Key::Period,
            Camera,
            "Show the selection",
            Action::FrameSelected,
        ),
        plain(
            Key::Num1,
            Camera,
            "From the front, again from behind",
            Action::LookFrom(AxisView::Front),
        ),
        plain(
            Key::Num3,
            Camera,
            "From the right, again from the left",
            Action::LookFrom(AxisView::Right),
        ),
        plain(
            Key::Num7,
            Camera,
            "From above, again from below",
            Action::LookFrom(AxisView::Top),
        ),
        plain(
            Key::Num9,
            Camera,
            "Isometric",
            Action::LookFrom(AxisView::Isometric),
        ),
        command(
            Key::D,
            Camera,
            "Keep this view as a bookmark",
            Action::AddBookmark,
        ),
        bind(
            Modifiers::COMMAND | Modifiers::SHIFT,
            Key::C,
            Camera,
            "Copy the camera as flags of the command line",
            Action::CopyCamera,
        ),
        plain(
            Key::Num5,
            Camera,
            "Perspective or parallel",
            Action::ToggleProjection,
        ),
        shift(Key::Y, Camera, "Y is up", Action::Up(UpAxis::Y)),
        shift(Key::Z, Camera, "Z is up", Action::Up(UpAxis::Z)),
        plain(
            Key::M,
            View,
            "Element mesh over the light",
            Action::ToggleEdges,
        ),
        plain(Key::B, View, "Cluster boxes", Action::ToggleClusters),
        plain(
            Key::OpenBracket,
            View,
            "Larger clusters",
            Action::ClusterLevelBy(-1),
        ),
        plain(
            Key::CloseBracket,
            View,
            "Smaller clusters",
            Action::ClusterLevelBy(1),
        ),
        plain(Key::L, View, "Links of what is picked", Action::ToggleLinks),
        plain(Key::N, View, "Normals and back", Action::ToggleNormals),
        plain(Key::K, View, "Backs of faces", Action::ToggleBacks),
        plain(
            Key::V,
            View,
            "Traced picture of the view at rest",
            Action::ToggleTraced,
        ),
        plain(Key::G, View, "Gloss in the drawn view", Action::ToggleGloss),
        plain(
            Key::X,
            View,
            "See through walls from outside",
            Action::ToggleSeeThrough,
        ),
        plain(Key::Minus, View, "Darker by ½ EV", Action::ExposureBy(-0.5)),
        plain(
            Key::Equals,
            View,
            "Brighter by ½ EV",
            Action::ExposureBy(0.5),
        ),
        plain(Key::Num0, View, "Automatic exposure", Action::AutoExposure),
        plain(Key::T, View, "Tone map", Action::ToggleToneMap),
        plain(
            Key::Space,
            Solve,
            "Pause or continue",
            Action::PauseContinue,
        ),
        plain(
            Key::Escape,
            Solve,
            "Close a dialog, else stop, else clear the selection",
            Action::Stop,
        ),
        command(Key::R, Solve, "Restart", Action::Reset),
        plain(
            Key::U,
            Solve,
            "Left drag moves the sun, or the camera again",
            Action::ToggleSunDrag,
        ),
        command(
            Key::Z,
            Solve,
            "Undo a change of lights and materials",
            Action::Undo,
        ),
        bind(
            Modifiers::COMMAND | Modifiers::SHIFT,
            Key::Z,
            Solve,
            "Make the change again",
            Action::Redo,
        ),
        plain(
            Key::R,
            Solve,
            "Trace the reference, or pause it",
            Action::TraceReference,
        ),
        command(Key::O, File, "Open…", Action::OpenDialog),
        plain(
            Key::F5,
            File,
            "Reload, keeping camera and settings",
            Action::Reload,
        ),
        command(
            Key::S,
            File,
            "Save camera, settings and changed lights beside the scene",
            Action::SaveSidecar,
        ),
        command(Key::E, File, "Export the lit mesh…", Action::MeshDialog),
        plain(
            Key::F12,
            File,
            "Picture of the window",
            Action::ScreenshotWithWindow,
        ),
        command(
            Key::F12,
            File,
            "Picture without the window",
            Action::Screenshot,
        ),
        command(Key::P, File, "Picture of any size…", Action::PictureDialog),
        command(
            Key::B,
            File,
            "Hide or show the panels",
            Action::TogglePanels,
        ),
        plain(Key::F11, File, "Full screen", Action::ToggleFullScreen),
        command(Key::Plus, File, LARGER, Action::Scale(Scale::Larger)),
        command(Key::Equals, File, LARGER, Action::Scale(Scale::Larger)),
        command(
            Key::Minus,
            File,
            "Smaller text and panels",
            Action::Scale(Scale::Smaller),
        ),
        command(
            Key::Num0,
            File,
            "Text and panels at their default size",
            Action::Scale(Scale::Whole),
        ),
        plain(Key::F1, File, "This sheet", Action::ToggleHelp),
        plain(Key::Questionmark, File, "This sheet", Action::ToggleHelp),
        command(Key::Q, File, "Quit", Action::Quit),
    ];
    for (index, key) in ROW.into_iter().take(BOOKMARK_KEYS).enumerate() {
        all.push(command(
            key,
            Camera,
            "Bookmark of this number",
            Action::GoTo(index),
        ));
    }
    all.extend(
        ROW.into_iter()
            .zip(ViewMode::ALL)
            .map(|(key, mode)| alt(key, mode)),
    );
    all
}

/// The actions whose keys were pressed, with exactly their modifiers; the key presses are used up. Those of `in_use` are
/// left to the control that has the focus.
pub fn pressed(input: &mut InputState, table: &[Binding], in_use: &[Key]) -> Vec<Action> {
    let mut actions = Vec::new();
    let flies = input.pointer.secondary_down();
    input.events.retain(|event| {
        // The modifiers of the press count, not those that are held when the frame begins.
        let Event::Key {
            key,
            pressed: true,
            repeat,
            modifiers,
            ..
        } = event
        else {
            return true;
        };
        let is_taken = in_use.contains(key) && modifiers.is_none();
        if is_taken || flies && FLYING.contains(key) {
            return true;
        }
        let fits = |binding: &&Binding| binding.fits(*key, *modifiers, *repeat);
        let found = table.iter().find(fits);
        actions.extend(found.map(|binding| binding.action.clone()));
        found.is_none()
    });
    actions
}

/// The key of an action as a hint for menus, empty where it has none.
pub fn hint(table: &[Binding], action: &Action) -> String {
    table
        .iter()
        .find(|binding| binding.action == *action)
        .map(Binding::keys)
        .unwrap_or_default()
}

fn bind(
    modifiers: Modifiers,
    key: Key,
    group: Group,
    text: &'static str,
    action: Action,
) -> Binding {
    Binding {
        key,
        modifiers,
        ignores_shift: matches!(key, Key::Questionmark | Key::Plus),
        group,
        text,
        action,
    }
}

fn key_name(key: Key) -> &'static str {
    match key {
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::Minus => "-",
        Key::Equals => "=",
        Key::Plus => "+",
        Key::Period => ".",
        Key::Questionmark => "?",
        Key::Escape => "Esc",
        _ => key.name(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        let table = bindings();
        for (index, one) in table.iter().enumerate() {
            for other in &table[index + 1..] {
                assert!(
                    one.key != other.key || one.modifiers != other.modifiers,
                    "{} is both '{}' and '{}'",
                    one.keys(),
                    one.text,
                    other.text
                );
            }
        }
    }

    #[test]
    fn modifiers_must_be_exactly_those() {
        let table = bindings();
        let found = |key, modifiers| {
            let mut fitting = table
                .iter()
                .filter(|binding| binding.fits(key, modifiers, false));
            let action = fitting.next().map(|binding| binding.action.clone());
            assert!(fitting.next().is_none());
            action
        };
        let front = Action::LookFrom(AxisView::Front);
        assert_eq!(found(Key::Num1, Modifiers::NONE), Some(front));
        let radiance = Action::Mode(ViewMode::Radiance);
        assert_eq!(found(Key::Num1, Modifiers::ALT), Some(radiance));
        let error = Action::Mode(ViewMode::Error);
        assert_eq!(found(Key::Minus, Modifiers::ALT), Some(error));
        let estimated = Action::Mode(ViewMode::EstimatedError);
        assert_eq!(found(Key::Num0, Modifiers::ALT), Some(estimated));
        assert_eq!(
            found(Key::F12, Modifiers::COMMAND),
            Some(Action::Screenshot)
        );
        assert_eq!(found(Key::F12, Modifiers::SHIFT), None);
        assert_eq!(
            found(Key::Questionmark, Modifiers::SHIFT),
            Some(Action::ToggleHelp)
        );
    }

    #[test]
    fn text_is_scaled_by_the_keys_of_browsers() {
        let table = bindings();
        for (key, modifiers, scale) in [
            (
                Key::Plus,
                Modifiers::COMMAND | Modifiers::SHIFT,
                Scale::Larger,
            ),
            (Key::Equals, Modifiers::COMMAND, Scale::Larger),
            (Key::Minus, Modifiers::COMMAND, Scale::Smaller),
            (Key::Num0, Modifiers::COMMAND, Scale::Whole),
        ] {
            let found = table
                .iter()
                .find(|binding| binding.fits(key, modifiers, true));
            assert_eq!(
                found.map(|binding| &binding.action),
                Some(&Action::Scale(scale))
            );
        }
    }

    #[test]
    fn flying_keys_are_free() {
        for binding in bindings() {
            let flies = FLYING.contains(&binding.key);
            assert!(!flies || binding.modifiers.command, "{}", binding.keys());
        }
    }
}
