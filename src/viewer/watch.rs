//! Watching the files of a scene, so that it is read again when another program writes them.
//!
//! Folders are watched instead of the files themselves: most programs write a new file and rename it. A file may be written
//! for a while, so that the scene is read only once nothing has changed for a moment.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use notify::{
    Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher as _,
    event::{AccessKind, AccessMode},
};

use crate::{scene::folder_of, worker::Wake};

/// How long nothing must change before the files are read. Shorter, and files are read half written; longer is felt.
const QUIET: Duration = Duration::from_millis(400);

/// Watches the files of one scene as long as it exists.
pub(super) struct SceneWatch {
    changed: Arc<Mutex<Option<Instant>>>,
    /// Stops when dropped.
    _watcher: RecommendedWatcher,
}

impl SceneWatch {
    /// Watch some files; `wake` is called when one of them changes.
    ///
    /// # Errors
    /// One sentence where the system does not allow it.
    pub(super) fn start(files: &[PathBuf], wake: Wake) -> Result<Self, String> {
        let places: BTreeSet<PathBuf> = files.iter().flat_map(|file| places_of(file)).collect();
        let folders: BTreeSet<PathBuf> = places
            .iter()
            .map(|place| folder_of(place).to_owned())
            .collect();
        let changed = Arc::new(Mutex::new(None));
        let (noted, watched) = (changed.clone(), places);
        let note = move |event: notify::Result<Event>| {
            let concerns = |event: &Event| {
                writes(event.kind) && event.paths.iter().any(|path| watched.contains(path))
            };
            // Where events were lost, any file may have changed.
            if event.is_ok_and(|event| event.need_rescan() || concerns(&event)) {
                *noted.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
                wake();
            }
        };
        let fails = |error: notify::Error| format!("the files cannot be watched: {error}");
        let mut watcher = notify::recommended_watcher(note).map_err(fails)?;
        for folder in &folders {
            let watched = watcher.watch(folder, RecursiveMode::NonRecursive);
            watched.map_err(fails)?;
        }
        Ok(Self {
            changed,
            _watcher: watcher,
        })
    }

    /// How long to wait before [`Self::take`] may say yes; nothing where no file has changed.
    pub(super) fn wait(&self) -> Option<Duration> {
        let changed = *self.changed.lock().unwrap_or_else(PoisonError::into_inner);
        Some(QUIET.saturating_sub(changed?.elapsed()))
    }

    /// Whether files have changed and are whole by now; once for each change.
    pub(super) fn take(&self) -> bool {
        let mut changed = self.changed.lock().unwrap_or_else(PoisonError::into_inner);
        changed.take_if(|at| at.elapsed() >= QUIET).is_some()
    }
}

/// Whether an event may leave a file with other content; reading it does not.
fn writes(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        _ => true,
    }
}

/// Where a file is told of: in its folder, and where a symbolic link leads.
fn places_of(file: &Path) -> Vec<PathBuf> {
    let beside = folder_of(file).canonicalize().ok();
    let name = file.file_name();
    let named = beside.zip(name).map(|(folder, name)| folder.join(name));
    named.into_iter().chain(file.canonicalize().ok()).collect()
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::mpsc, thread};

    use super::*;

    /// A watch of one file, and the ends of its calls.
    fn watch(file: &Path) -> (SceneWatch, mpsc::Receiver<()>) {
        let (sender, receiver) = mpsc::channel();
        let wake = Arc::new(move || {
            let _ = sender.send(());
        });
        let watch = SceneWatch::start(&[file.to_owned()], wake).expect("a folder");
        (watch, receiver)
    }

    /// Whether files count as changed before long.
    fn notices(watch: &SceneWatch, calls: &mpsc::Receiver<()>) -> bool {
        if calls.recv_timeout(Duration::from_secs(5)).is_err() {
            return false;
        }
        while let Some(wait) = watch.wait() {
            thread::sleep(wait);
            if watch.take() {
                return true;
            }
        }
        false
    }

    #[test]
    fn written_and_renamed_files_are_noticed_and_others_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.obj");
        fs::write(&file, "v 0 0 0").expect("written");
        let (watch, calls) = watch(&file);
        fs::write(folder.path().join("b.obj"), "v 1 1 1").expect("written");
        fs::read(&file).expect("read");
        assert!(calls.recv_timeout(Duration::from_millis(500)).is_err());
        assert!(!watch.take() && watch.wait().is_none());
        fs::write(&file, "v 1 0 0").expect("written");
        assert!(notices(&watch, &calls), "written");
        assert!(!watch.take(), "once");
        while calls.try_recv().is_ok() {}
        let aside = folder.path().join("aside");
        fs::write(&aside, "v 2 0 0").expect("written");
        fs::rename(&aside, &file).expect("renamed");
        assert!(notices(&watch, &calls), "renamed");
    }

    #[test]
    fn a_file_that_is_still_written_is_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.obj");
        fs::write(&file, "").expect("written");
        let (watch, calls) = watch(&file);
        let text = "v 0 0 0\n".repeat(100);
        let mut written = String::new();
        for line in text.split_inclusive('\n').take(8) {
            written += line;
            fs::write(&file, &written).expect("written");
            thread::sleep(QUIET / 8);
            assert!(!watch.take(), "{} bytes", written.len());
        }
        assert!(notices(&watch, &calls));
    }
}
