//! Which display server the window is for, where the environment names two.
//!
//! Under a variable that names a Wayland display only that one is tried, although it may be left over from a session that
//! has ended, or from another machine, while X11 works.

use std::{
    ffi::OsString,
    os::unix::{ffi::OsStrExt as _, net::UnixStream},
    path::{Path, PathBuf},
};

/// Whether X11 is to be asked for: it is named, and no Wayland display answers where one is named, too.
pub(super) fn needs_x11(variable: impl Fn(&str) -> Option<OsString>) -> bool {
    let given = |name: &str| variable(name).filter(|value| !value.is_empty());
    let (socket, display) = (given("WAYLAND_SOCKET"), given("WAYLAND_DISPLAY"));
    if given("DISPLAY").is_none() || (socket.is_none() && display.is_none()) {
        return false;
    }
    // A connection that is handed over goes before a display that is named.
    let answers = match socket {
        Some(socket) => is_open_socket(&socket),
        None => display
            .and_then(|display| socket_path(&display, given("XDG_RUNTIME_DIR")))
            .is_some_and(|path| UnixStream::connect(path).is_ok()),
    };
    !answers
}

/// Where the display of this name listens.
fn socket_path(display: &OsString, runtime_folder: Option<OsString>) -> Option<PathBuf> {
    let display = Path::new(display);
    if display.is_absolute() {
        return Some(display.to_owned());
    }
    let folder = PathBuf::from(runtime_folder?);
    folder.is_absolute().then(|| folder.join(display))
}

/// Whether this is the number of a socket that this process was started with.
fn is_open_socket(number: &OsString) -> bool {
    let is_number = number.as_bytes().iter().all(u8::is_ascii_digit);
    let opened = Path::new("/proc/self/fd").join(number);
    is_number
        && opened
            .read_link()
            .is_ok_and(|target| target.as_os_str().as_bytes().starts_with(b"socket:"))
}

#[cfg(test)]
mod tests {
    use std::os::{fd::AsRawFd as _, unix::net::UnixListener};

    use super::*;

    fn needs_x11_under(variables: &[(&str, &str)]) -> bool {
        needs_x11(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.into())
        })
    }

    #[test]
    fn x11_is_asked_for_where_no_wayland_display_answers() {
        let folder = tempfile::tempdir().unwrap();
        let runtime = folder.path().to_str().unwrap();
        let x11 = ("DISPLAY", ":0");
        let in_runtime = |display| {
            [
                x11,
                ("WAYLAND_DISPLAY", display),
                ("XDG_RUNTIME_DIR", runtime),
            ]
        };
        // Left over: no socket of that name, or one behind which nobody listens any more.
        assert!(needs_x11_under(&in_runtime("wayland-9")));
        let dead = folder.path().join("wayland-1");
        drop(UnixListener::bind(&dead).unwrap());
        assert!(needs_x11_under(&in_runtime("wayland-1")));
        assert!(needs_x11_under(&[x11, ("WAYLAND_DISPLAY", "wayland-0")]));
        assert!(needs_x11_under(&[x11, ("WAYLAND_SOCKET", "987654")]));
        assert!(needs_x11_under(&[x11, ("WAYLAND_SOCKET", "../fd/0")]));
        // One that answers is used.
        let alive = folder.path().join("wayland-0");
        let _listener = UnixListener::bind(&alive).unwrap();
        assert!(!needs_x11_under(&in_runtime("wayland-0")));
        let absolute = [x11, ("WAYLAND_DISPLAY", alive.to_str().unwrap())];
        assert!(!needs_x11_under(&absolute));
        let (socket, _other) = UnixStream::pair().unwrap();
        let number = socket.as_raw_fd().to_string();
        assert!(!needs_x11_under(&[x11, ("WAYLAND_SOCKET", &number)]));
    }

    #[test]
    fn x11_is_not_asked_for_where_it_is_not_there_or_the_only_one() {
        let stale = ("WAYLAND_DISPLAY", "/nowhere/wayland-0");
        assert!(!needs_x11_under(&[stale]));
        assert!(!needs_x11_under(&[stale, ("DISPLAY", "")]));
        assert!(!needs_x11_under(&[("DISPLAY", ":0")]));
        assert!(!needs_x11_under(&[
            ("DISPLAY", ":0"),
            ("WAYLAND_DISPLAY", "")
        ]));
    }
}
