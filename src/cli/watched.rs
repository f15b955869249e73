//! A job on threads of its own, which is cancelled when its time is over.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::mpsc,
    time::Duration,
};

use rayon::ThreadPool;

use crate::solver::Cancel;

/// How often it is asked whether the time is over.
const POLL: Duration = Duration::from_millis(50);

/// Run a job in a pool, and cancel it once `is_over`, which is asked again and again.
///
/// # Errors
/// A clause that says how it panicked.
pub(super) fn watched<T: Send>(
    pool: &ThreadPool,
    job: impl FnOnce(&Cancel) -> T + Send,
    mut is_over: impl FnMut() -> bool,
) -> Result<T, String> {
    let cancel = Cancel::default();
    let (done, outcome) = mpsc::sync_channel(1);
    let job = {
        let cancel = cancel.clone();
        move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| job(&cancel)));
            // The caller listens until there is an outcome.
            let _ = done.send(outcome);
        }
    };
    let outcome = pool.in_place_scope(|scope| {
        scope.spawn(|_| job());
        loop {
            if let Ok(outcome) = outcome.recv_timeout(POLL) {
                return outcome;
            }
            if is_over() {
                cancel.cancel();
            }
        }
    });
    outcome.map_err(|panic| {
        let message = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied());
        format!("panic: {}", message.unwrap_or("of unknown cause"))
    })
}
