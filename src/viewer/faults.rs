//! Errors of the graphics device and signals of the system, which arrive on any thread.

use std::sync::{
    Arc, Mutex, OnceLock, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use eframe::egui;

use crate::worker::Wake;

/// Events from outside the window, on any thread: errors of the graphics device, signals of the system.
#[derive(Default)]
pub struct Faults {
    sentences: Mutex<Vec<String>>,
    lost: OnceLock<String>,
    must_close: AtomicBool,
}

impl Faults {
    /// Listen to a device, so that its errors become sentences and not the end of the program.
    pub fn watch(self: &Arc<Self>, device: &wgpu::Device, wake: Wake) {
        let (faults, waker) = (self.clone(), wake.clone());
        device.set_device_lost_callback(move |reason, text| {
            // Closing the window drops the device, too.
            if reason != wgpu::DeviceLostReason::Destroyed {
                let _ = faults.lost.set(text.replace('\n', " "));
                faults.must_close.store(true, Ordering::Relaxed);
                waker();
            }
        });
        let faults = self.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            faults.push(match error {
                wgpu::Error::OutOfMemory { .. } => {
                    "the graphics adapter is out of memory; close other programs, or raise the smallest element area and restart".to_owned()
                }
                other => format!("the graphics adapter refused: {}", first_line(&other.to_string())),
            });
            wake();
        }));
    }

    /// Close the window on Ctrl+C and when the system ends the program, so that what is being written is written; a
    /// second signal ends the program at once.
    pub(super) fn listen_to_signals(self: &Arc<Self>, ctx: egui::Context) {
        let faults = self.clone();
        let listening = ctrlc::set_handler(move || {
            if faults.must_close.swap(true, Ordering::Relaxed) {
                std::process::exit(1);
            }
            ctx.request_repaint();
        });
        // Without, a signal ends the program as it would any other.
        drop(listening);
    }

    /// Why the graphics device was lost, once it was.
    pub(super) fn lost(&self) -> Option<&str> {
        self.lost.get().map(String::as_str)
    }

    /// Whether the window is to close: the device is gone, or a signal came.
    pub fn must_close(&self) -> bool {
        self.must_close.load(Ordering::Relaxed)
    }

    /// Sentences since the last call.
    pub fn take(&self) -> Vec<String> {
        let mut sentences = self
            .sentences
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *sentences)
    }

    fn push(&self, sentence: String) {
        self.sentences
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(sentence);
    }
}

fn first_line(text: &str) -> String {
    text.lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .take(3)
        .collect::<Vec<_>>()
        .join(": ")
}
