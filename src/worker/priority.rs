//! Priority of threads where there are more of them than cores.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool of so many threads, or with 0 of one for each core, that give way; `None` where the system refuses threads.
pub fn pool_that_gives_way(name: &'static str, count: usize) -> Option<ThreadPool> {
    ThreadPoolBuilder::new()
        .num_threads(count)
        .thread_name(move |index| format!("{name} {index}"))
        .start_handler(|_| give_way())
        .build()
        .ok()
}

/// Let the calling thread wait for others of the program, such as those that draw, where the system knows such a thing.
#[cfg(all(target_os = "linux", feature = "viewer"))]
pub(super) fn give_way() {
    /// At 5 a thread gets a third of what another gets that wants the same core. Less, and frames come half as often where
    /// a processor plays graphics adapter; more, and other programs starve the light.
    const NICENESS: i32 = 5;
    // Where it is refused, threads share.
    let _ = rustix::process::setpriority_process(None, NICENESS);
}

/// Let the calling thread wait for others of the program, where the system knows such a thing: this one is not asked.
#[cfg(not(all(target_os = "linux", feature = "viewer")))]
pub(super) fn give_way() {}
