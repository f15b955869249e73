//! Standard error without the messages of the system's graphics libraries.
//!
//! Loaders, drivers and their layers write to standard error what concerns them alone, such as "error: XDG_RUNTIME_DIR is
//! invalid" from a layer that asks for a Wayland display which a picture does not need. Beside the sentences of this program
//! they read like its own. A failure is returned as an error value, with a text of its own.

#[cfg(unix)]
pub use redirected::StderrCapture;

/// On this system, the graphics libraries do not write to standard error.
#[cfg(not(unix))]
pub struct StderrCapture;

#[cfg(not(unix))]
impl StderrCapture {
    /// Does nothing.
    pub fn begin() -> Option<Self> {
        None
    }
}

#[cfg(unix)]
mod redirected {
    use std::{
        fs::File,
        io::{self, Read as _, Seek as _, Write as _},
        os::fd::{AsFd as _, OwnedFd},
        thread,
    };

    /// While it lives, all that any part of the process writes to standard error is set aside, and in the end dropped;
    /// after a panic it is shown, since the message of the panic is in it. One at a time.
    pub struct StderrCapture {
        stderr: OwnedFd,
        aside: File,
    }

    impl StderrCapture {
        /// Begin; `None` where the system does not allow it, and everything is shown.
        pub fn begin() -> Option<Self> {
            let stderr = io::stderr().as_fd().try_clone_to_owned().ok()?;
            let aside = tempfile::tempfile().ok()?;
            nix::unistd::dup2_stderr(&aside).ok()?;
            Some(Self { stderr, aside })
        }

        /// Show what was set aside.
        fn show(&mut self) -> io::Result<()> {
            let mut text = Vec::new();
            self.aside.rewind()?;
            self.aside.read_to_end(&mut text)?;
            io::stderr().write_all(&text)
        }
    }

    impl Drop for StderrCapture {
        fn drop(&mut self) {
            if nix::unistd::dup2_stderr(&self.stderr).is_ok() && thread::panicking() {
                // There is nowhere else to say that it failed.
                let _ = self.show();
            }
        }
    }
}
