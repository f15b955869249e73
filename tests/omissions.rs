//! The plan suite on its quick scenes: every omission that applies is run, counted and compared.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::sync::Arc;

use common::assert_close;
use vecrad::{
    experiments::omissions::{Comparison, Exhibit, Trial, exhibits},
    solver::{Cancel, SolveSettings},
};

fn trial(exhibit: &Exhibit) -> Trial {
    let scene = Arc::new(exhibit.scene().unwrap());
    Trial::new(scene, &SolveSettings::draft(), &Cancel::default()).unwrap()
}

fn compared(exhibit: &Exhibit) -> Comparison {
    let mut trial = trial(exhibit);
    assert!(trial.comparison().is_none(), "nothing was run");
    for index in 0..trial.kept().len() {
        trial.run(index, &Cancel::default()).unwrap();
    }
    let due: Vec<bool> = (0..trial.kept().len())
        .map(|index| trial.is_due(index))
        .collect();
    assert!(due.iter().rev().skip(1).all(|&is_due| is_due) && !due[due.len() - 1]);
    trial.comparison().unwrap()
}

#[test]
fn quick_scenes_cost_less_as_planned_and_look_alike() {
    let quick = exhibits().iter().filter(|exhibit| exhibit.is_quick);
    for comparison in quick.map(compared) {
        let kept: Vec<&str> = comparison.runs.iter().map(|run| run.kept).collect();
        assert_eq!((kept[0], kept[kept.len() - 1]), ("nothing", "all"));
        assert_eq!(&kept[1..kept.len() - 1], comparison.left_out);
        let (planned, all) = (&comparison.runs[0], &comparison.runs[kept.len() - 1]);
        assert!(planned.rays == 0 && all.rays > 0, "{comparison:?}");
        assert!(
            planned.elements < all.elements && planned.memory_bytes < all.memory_bytes,
            "{comparison:?}"
        );
        assert_eq!((all.difference, all.power), (0.0, 1.0));
        for run in &comparison.runs {
            // Two drafts that differ in their mesh: the edge where plates meet is bright on one side only.
            assert!(run.difference < 0.1, "{comparison:?}");
            assert_close(run.power, 1.0, 0.02, format_args!("{comparison:?}"));
        }
    }
}

#[test]
fn a_scene_that_needs_everything_has_two_runs() {
    let closed = exhibits()
        .iter()
        .find(|exhibit| exhibit.name == "cornell, one-sided");
    let kept: Vec<&str> = trial(closed.unwrap()).kept().collect();
    assert_eq!(kept, ["nothing", "all"]);
}

#[test]
fn a_cancelled_trial_has_no_result() {
    let cancel = Cancel::default();
    cancel.cancel();
    let mut trial = trial(&exhibits()[0]);
    assert!(trial.run(0, &cancel).is_none());
    assert!(trial.comparison().is_none());
}
