//! The memory limit against what the system says that the process holds. Alone in its file, and so in its process.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{fs, sync::Arc};

use vecrad::{
    scene::{SceneOptions, Sides, builtin},
    solver::{Cancel, SolveSettings, Solver},
};

/// Most bytes that the process used so far.
fn peak_bytes() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmHWM"))
        .unwrap();
    let kibibytes = line.split_whitespace().nth(1).unwrap();
    kibibytes.parse::<u64>().unwrap() << 10
}

#[test]
fn the_process_holds_no_more_than_the_limit() {
    let scene = Arc::new(
        builtin::builtin("cornell", &SceneOptions::with_sides(Sides::One))
            .unwrap()
            .unwrap(),
    );
    // Elements without end at first, then links without end.
    for (mesh_tolerance, epsilon, limit) in [(1e-9, 10.0, 320 << 20), (1e-3, 0.0, 96 << 20)] {
        let settings = SolveSettings {
            mesh_tolerance,
            epsilon,
            min_area: 0.0,
            shadow_samples: 1,
            max_steps: 3,
            ..SolveSettings::draft()
        };
        let before = peak_bytes();
        let never = Cancel::default();
        let mut solver = Solver::new(scene.clone(), settings, Some(limit), &never).unwrap();
        let mut is_final = false;
        while !is_final {
            let report = solver.step(&never).unwrap();
            assert!(report.memory_bytes <= limit, "{report:?}");
            is_final = report.is_final;
        }
        // Memory of the thread pool and the allocator comes on top.
        let growth = peak_bytes() - before;
        assert!(
            growth <= limit + (limit >> 2),
            "{growth} bytes at a limit of {limit}"
        );
    }
}
