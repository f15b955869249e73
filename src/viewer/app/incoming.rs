//! Results that arrive between frames: chosen files, notices, a scene that was read, events and light of the worker.

use std::{sync::Arc, time::Duration};

use super::{
    super::{
        light_range,
        loader::{Loader, SceneSource},
        messages::Severity,
        stage::Wanted,
        view::ViewMode,
    },
    App,
};
use crate::worker::Event;

/// A dialog that is gone sooner than this was never seen. Longer, and a quick cancel is taken for a failure.
const SOONEST_CANCEL: Duration = Duration::from_millis(1500);

impl App {
    /// Take note of everything that arrived since the last frame.
    pub(super) fn drain(&mut self) {
        while let Ok(chosen) = self.chosen.1.try_recv() {
            let opened = self.dialog_since.take();
            match chosen {
                Some(path) => self.load(SceneSource::File(path)),
                None => self.no_file(opened.is_some_and(|since| since.elapsed() < SOONEST_CANCEL)),
            }
        }
        while let Ok((severity, text)) = self.notices.1.try_recv() {
            self.state.messages.push_lasting(severity, text);
        }
        for fault in self.faults.take() {
            self.state.messages.push_lasting(Severity::Error, fault);
        }
        if let Some(outcome) = self.state.loading.as_ref().and_then(Loader::poll) {
            self.state.loading = None;
            match outcome {
                Ok(loaded) => self.show(loaded),
                Err(error) => {
                    self.state.messages.push(Severity::Error, error);
                    let said = self.state.messages.all.last();
                    self.state
                        .panels
                        .refuse_path(said.map(|said| said.text.clone()));
                }
            }
        }
        self.drain_worker();
        self.take_staged();
        self.glossing.renew(&self.state, &self.wake);
        self.want();
    }

    /// The dialog ended without a file. One that fails cannot be told from one that was cancelled, but by how soon it ends.
    fn no_file(&mut self, is_immediate: bool) {
        let (severity, text) = if is_immediate {
            self.state.panels.ask_for_path();
            let text = "this desktop has no file dialog; type the path instead";
            (Severity::Warning, text)
        } else {
            (Severity::Note, "no file was chosen")
        };
        self.state.messages.push(severity, text);
    }

    fn drain_worker(&mut self) {
        let run = self.worker.generation().number();
        let mut needs_restart = false;
        for event in self.worker.events() {
            let state = &mut self.state;
            match &event {
                Event::Started => state.inspections.close(),
                Event::Prepared { .. } => state.inspections.open(),
                Event::Inspected(inspection) => {
                    state.inspections.note(inspection.clone());
                    state.correct_cluster();
                }
                // Later light of the same run may need less again.
                Event::Relit {
                    needs_restart: is_now,
                    seconds: Some(_),
                    ..
                } => needs_restart = *is_now,
                _ => {}
            }
            state.truth.note(&event, run, &state.settings);
            state.run.note(event);
        }
        if needs_restart {
            self.begin_again();
        }
        let shown = &self.state.run.snapshot;
        let is_known = |latest: &Arc<_>| {
            shown
                .as_ref()
                .is_some_and(|shown| Arc::ptr_eq(shown, latest))
        };
        let newer = self.worker.latest().filter(|latest| !is_known(latest));
        let has_light = newer.is_some();
        if has_light {
            let replaced = std::mem::replace(&mut self.state.run.snapshot, newer);
            self.stage.drop_later(replaced);
        }
        let has_errors = self
            .state
            .truth
            .exchange(&self.state.run, self.state.view.mode);
        if has_light || has_errors {
            self.follow_light();
        }
    }

    /// Ask the solver about what is selected, if it was not asked yet.
    pub(super) fn ask(&mut self) {
        let wanted = self.state.subjects();
        if let Some(subjects) = self.state.inspections.question(&wanted) {
            self.worker.inspect(subjects);
        }
    }

    /// Let the range of false colours follow the newest light.
    pub(super) fn follow_light(&mut self) {
        let Some(snapshot) = &self.state.run.snapshot else {
            return;
        };
        self.state.false_color_range = light_range::false_color_range(
            snapshot,
            &self.state.view,
            self.state
                .truth
                .vertex_errors(snapshot)
                .map(|errors| errors.as_slice()),
        );
    }

    /// Ask for what the state shows to be made ready, if it is not.
    pub(super) fn want(&mut self) {
        let state = &self.state;
        let (Some(loaded), Some(snapshot)) = (&state.loaded, &state.run.snapshot) else {
            return;
        };
        let picked = state.selection.as_ref().map(|selection| {
            let object = selection.object.map(|index| &loaded.scene.objects[index]);
            let triangles = object.map(|object| [object.start, object.end]);
            (selection.pick, triangles)
        });
        let mode = state.view.mode;
        self.stage.want(Wanted {
            scene: loaded.scene.clone(),
            snapshot: snapshot.clone(),
            errors: (mode == ViewMode::Error)
                .then(|| state.truth.vertex_errors(snapshot).cloned())
                .flatten(),
            gloss: (state.view.shows_gloss())
                .then(|| self.glossing.of(snapshot))
                .flatten(),
            mode,
            range: state.false_color_range,
            edges: state.view.edges,
            clusters: state.view.clusters,
            picked,
        });
    }

    /// Show what has been made ready.
    fn take_staged(&mut self) {
        let Some(staged) = self.stage.poll() else {
            return;
        };
        if let Some(error) = &staged.error {
            self.state.messages.push(Severity::Error, error.to_string());
        }
        if let (Some(selection), Some((pick, _))) =
            (&mut self.state.selection, &staged.wanted.picked)
            && selection.pick == *pick
        {
            selection.probe = staged.probe;
            selection.object_light = staged.object_light;
        }
        self.state.shown_clusters = staged.clusters.clone();
        let replaced = self.state.staged.replace(Arc::new(staged));
        self.stage.drop_later(replaced);
    }
}
