//! State that outlives a window: recent scenes, and a sidecar beside a scene with its camera, view and settings.

use std::{
    fs,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    camera::Camera, loader::SceneSource, materials::SavedMaterial, saved_light::SavedLight,
    view::ViewSettings,
};
use crate::{
    scene::{Frame, Lighting, Warning, WarningKind, folder_of, write_whole},
    solver::SolveSettings,
};

/// Scenes that the menu remembers.
const MOST_RECENT: usize = 12;

/// Recent scenes, the newest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Recent {
    /// The files.
    pub files: Vec<PathBuf>,
}

impl Recent {
    /// Put a file on top.
    pub fn push(&mut self, path: &Path) {
        // Whole paths: the next window may start in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.files.retain(|known| *known != path);
        self.files.insert(0, path);
        self.files.truncate(MOST_RECENT);
    }
}

/// Camera in world units, so that it stays right when the scene grows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedCamera {
    position: [f64; 3],
    focal_point: [f64; 3],
    view_angle_degrees: f32,
    #[serde(default)]
    parallel: bool,
    #[serde(default = "y_up")]
    view_up: [f32; 3],
}

impl SavedCamera {
    fn of(camera: &Camera, frame: &Frame) -> Self {
        Self {
            position: frame.to_world(camera.eye()).to_array(),
            focal_point: frame.to_world(camera.pivot).to_array(),
            view_angle_degrees: camera.fov_y_radians.to_degrees(),
            parallel: camera.orthographic,
            view_up: camera.up.to_array(),
        }
    }

    /// The camera in a frame, where it is valid.
    fn in_frame(&self, frame: &Frame) -> Option<Camera> {
        let in_frame = |point: [f64; 3]| -> Vec3 { frame.from_world(DVec3::from_array(point)) };
        let camera = Camera {
            fov_y_radians: self.view_angle_degrees.to_radians(),
            orthographic: self.parallel,
            ..Camera::looking(
                in_frame(self.position),
                in_frame(self.focal_point),
                Vec3::from_array(self.view_up).normalize_or(Vec3::Y),
            )
        };
        Some(camera).filter(Camera::is_valid)
    }
}

/// Of sidecars that say nothing.
fn y_up() -> [f32; 3] {
    Vec3::Y.to_array()
}

/// The sidecar file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Sidecar {
    camera: Option<SavedCamera>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    bookmarks: Vec<SavedCamera>,
    view: ViewSettings,
    settings: SolveSettings,
    #[serde(skip_serializing_if = "SavedLight::is_empty")]
    light: SavedLight,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<SavedMaterial>,
}

/// The content of a sidecar, in the scene's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The camera, where it is valid.
    pub camera: Option<Camera>,
    /// Cameras that were kept, as far as they are valid.
    pub bookmarks: Vec<Camera>,
    /// How the light is shown.
    pub view: ViewSettings,
    /// How it is computed.
    pub settings: SolveSettings,
    /// Sky and sun that were changed.
    pub light: SavedLight,
    /// Materials that differ from the file.
    pub materials: Vec<SavedMaterial>,
}

/// Where the sidecar of a scene is: the file's name with `.vecrad.toml` behind it.
pub fn sidecar_path(source: &SceneSource) -> Option<PathBuf> {
    let mut name = source.path()?.as_os_str().to_owned();
    name.push(".vecrad.toml");
    Some(PathBuf::from(name))
}

/// The sidecar as text.
pub fn to_toml(session: &Session, frame: &Frame) -> Result<String, String> {
    let saved = Sidecar {
        camera: session.camera.map(|camera| SavedCamera::of(&camera, frame)),
        bookmarks: session
            .bookmarks
            .iter()
            .map(|camera| SavedCamera::of(camera, frame))
            .collect(),
        view: session.view.clone(),
        settings: session.settings.clone(),
        light: session.light.clone(),
        materials: session.materials.clone(),
    };
    toml::to_string_pretty(&saved).map_err(|error| error.to_string())
}

/// A sidecar's text in the scene's frame.
///
/// # Errors
/// One sentence where the text is no sidecar or a number in it is out of its range.
pub fn from_toml(text: &str, frame: &Frame) -> Result<Session, String> {
    let saved: Sidecar = toml::from_str(text).map_err(|error| {
        // It may quote the text.
        error.message().replace(char::is_control, "\u{fffd}")
    })?;
    saved.settings.check()?;
    saved.view.check()?;
    saved.light.check()?;
    saved.materials.iter().try_for_each(SavedMaterial::check)?;
    let bookmarks = saved.bookmarks.iter();
    Ok(Session {
        camera: saved.camera.and_then(|camera| camera.in_frame(frame)),
        bookmarks: bookmarks
            .filter_map(|camera| camera.in_frame(frame))
            .collect(),
        view: saved.view,
        settings: saved.settings,
        light: saved.light,
        materials: saved.materials,
    })
}

/// Write the sidecar of a scene; returns where.
///
/// # Errors
/// One sentence for people.
pub fn save(source: &SceneSource, session: &Session, frame: &Frame) -> Result<PathBuf, String> {
    let path = sidecar_path(source)
        .ok_or("a built-in scene has no file to save settings beside; open a scene from a file")?;
    let text = to_toml(session, frame)?;
    write_whole(&path, |out| out.write_all(text.as_bytes()))
        .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(path)
}

/// The session beside a scene: `None` without a sidecar.
pub fn load(source: &SceneSource, frame: &Frame) -> Option<Result<Session, String>> {
    let path = sidecar_path(source)?;
    let text = match read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        text => text.map_err(|error| error.to_string()),
    };
    Some(
        text.and_then(|text| from_toml(&text, frame))
            .map_err(|error| {
                format!(
                    "the saved settings were not used: {error}: {}",
                    path.display()
                )
            }),
    )
}

/// Light of a scene as its sidecar has it.
pub fn saved_light(source: &SceneSource, lighting: &Lighting) -> SavedLight {
    SavedLight::of(lighting, source.path().map_or(Path::new(""), folder_of))
}

/// Light of a scene that is opened: its sidecar's where none is asked for. Where the picture of its sky cannot be read,
/// a warning says so; of a broken sidecar [`load`] tells.
pub fn light(source: &SceneSource, asked: &Lighting) -> Lighting {
    let (Some(path), Some(folder)) = (sidecar_path(source), source.path().map(folder_of)) else {
        return asked.clone();
    };
    let saved = read(&path).ok().and_then(|text| toml::from_str(&text).ok());
    let light = saved.map(|saved: Sidecar| saved.light);
    let Some(light) = light.filter(|light| light.check().is_ok()) else {
        return asked.clone();
    };
    light.under(asked, folder).unwrap_or_else(|error| {
        let mut lighting = asked.clone();
        lighting.warnings.push(Warning {
            kind: WarningKind::Light,
            message: format!("the saved sky was not used: {error}"),
            count: 1,
            place: None,
        });
        lighting
    })
}

/// Bytes of the largest sidecar that is read; ours have about a thousand.
const MOST_BYTES: u64 = 1 << 20;

fn read(path: &Path) -> io::Result<String> {
    let refused = |reason: &str| Err(io::Error::other(reason));
    // Asked before it is opened: opening a pipe waits for somebody to write.
    if !fs::metadata(path)?.is_file() {
        return refused("it is not a file");
    }
    let mut text = String::new();
    let mut file = fs::File::open(path)?.take(MOST_BYTES + 1);
    file.read_to_string(&mut text)?;
    if text.len() as u64 > MOST_BYTES {
        return refused("it is larger than 1 MiB");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_survives_its_file() {
        let frame = Frame {
            centre: DVec3::new(1000.0, -5.0, 3.0),
            scale: 12.5,
        };
        let camera = Camera::looking(
            Vec3::new(10.0, 20.0, 30.0),
            Vec3::new(1.0, 0.0, -2.0),
            Vec3::new(0.0, -0.6, 0.8),
        );
        let session = Session {
            camera: Some(camera),
            bookmarks: vec![camera, Camera::default()],
            view: ViewSettings {
                exposure: 1.5,
                fixed_range: Some([0.5, 20.0]),
                ..ViewSettings::default()
            },
            settings: SolveSettings::draft(),
            light: SavedLight::of(
                &Lighting {
                    is_sky_off: true,
                    ..Lighting::default()
                },
                Path::new(""),
            ),
            materials: vec![SavedMaterial {
                name: "ceiling lamp".to_owned(),
                reflectance: [0.0, 0.25, 0.5],
                emission: [12.0, 10.0, 8.0],
            }],
        };
        let text = to_toml(&session, &frame).expect("plain values");
        let read = from_toml(&text, &frame).expect("our own text");
        assert_eq!(read.view, session.view);
        let [first, second] = &read.bookmarks[..] else {
            panic!("{text}");
        };
        assert!(first.eye().distance(camera.eye()) < 1e-3);
        assert!(second.eye().distance(Camera::default().eye()) < 1e-3);
        assert_eq!(read.settings, session.settings);
        assert_eq!(read.light, session.light);
        assert_eq!(read.materials, session.materials);
        let (was, is) = (session.camera.expect("set"), read.camera.expect("valid"));
        assert!((was.eye() - is.eye()).length() < 1e-3);
        assert!((was.up - is.up).length() < 1e-6);
        assert!((was.pivot - is.pivot).length() < 1e-3);
    }

    #[test]
    fn a_broken_sidecar_is_one_sentence() {
        let frame = Frame {
            centre: DVec3::ZERO,
            scale: 1.0,
        };
        let error = from_toml("settings = 3", &frame).expect_err("not a table");
        assert!(!error.contains('\n'), "{error}");
    }

    #[test]
    fn numbers_out_of_range_are_one_sentence() {
        let frame = Frame {
            centre: DVec3::ZERO,
            scale: 1.0,
        };
        for (text, sentence) in [
            (
                "settings.samples = 0",
                "samples is 0, but must be within 1 and 4096",
            ),
            (
                "settings.epsilon = nan",
                "epsilon is NaN, but must be a number of at least 0",
            ),
            (
                "settings.tolerance = -1.0",
                "tolerance is -1, but must be a number above 0",
            ),
            (
                "view.emission_scale = inf",
                "emission_scale is inf, but must be a number of at least 0",
            ),
            (
                "view.links.most = 4000000000",
                "links.most is 4000000000, but must be within 1 and 4096",
            ),
            (
                "[[materials]]\nname = \"a\"\nreflectance = [0.5, 2.0, 0.0]\nemission = [0.0, 0.0, 0.0]",
                "reflectance of 'a' is 2, which is out of range",
            ),
        ] {
            assert_eq!(from_toml(text, &frame).expect_err(text), sentence);
        }
    }

    #[test]
    fn the_newest_file_is_on_top_once() {
        let mut recent = Recent::default();
        for name in ["/a.obj", "/b.obj", "/a.obj"] {
            recent.push(Path::new(name));
        }
        assert_eq!(
            recent.files,
            [PathBuf::from("/a.obj"), PathBuf::from("/b.obj")]
        );
    }
}
