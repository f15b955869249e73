//! Same scene, settings and seed: the same bits on any number of threads.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{path::Path, sync::Arc, time::Duration};

use vecrad::{
    cli,
    scene::{Lighting, SceneOptions},
    solver::{Snapshot, SolveSettings},
    worker::{Event, RunOptions, WorkerHandle},
};

fn light(threads: usize) -> Arc<Snapshot> {
    let none: Option<&Path> = None;
    let scene = cli::load(
        none,
        Some("room-1022"),
        &SceneOptions::default(),
        &Lighting::default(),
    )
    .unwrap();
    let mut worker = WorkerHandle::spawn(Arc::new(|| {})).unwrap();
    let options = RunOptions {
        threads,
        ..RunOptions::default()
    };
    worker.start(Arc::new(scene), SolveSettings::draft(), options);
    loop {
        match worker.next_event(Duration::from_secs(60)) {
            Some(Event::Finished(_)) => return worker.latest().unwrap(),
            Some(Event::Failed(message)) => panic!("{message}"),
            Some(_) => {}
            None => panic!("the solve does not end"),
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let (one, two, eight) = (light(1), light(2), light(8));
    let bits = |snapshot: &Snapshot| -> Vec<[u32; 3]> {
        let irradiance = snapshot.light.irradiance.iter();
        irradiance
            .map(|light| light.to_array().map(f32::to_bits))
            .collect()
    };
    for other in [two, eight] {
        assert_eq!(one.mesh, other.mesh);
        assert_eq!(bits(&one), bits(&other));
    }
    assert!(
        one.light
            .irradiance
            .iter()
            .any(|light| light.max_element() > 0.0),
        "there is light to compare"
    );
}
