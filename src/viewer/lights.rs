//! The lights of a scene together: what was changed, one of them alone, and how it was before.

use std::time::{Duration, Instant};

use super::materials::Materials;
use crate::{scene::Lighting, solver::Lamp};

/// All that can be changed about the light of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Lights {
    /// Its lamps and materials.
    pub materials: Materials,
    /// Sky and sun.
    pub lighting: Lighting,
    /// Where one of them is alone.
    pub solo: Option<Solo>,
}

/// A light that is shown alone, and what was on before.
#[derive(Clone, Debug, PartialEq)]
pub struct Solo {
    /// The light.
    pub lamp: Lamp,
    /// By material, whether it was a lamp.
    were_lamps: Vec<bool>,
    was_sky_off: bool,
    was_sun_off: bool,
}

impl Lights {
    /// Show one light alone; where it is alone already, all that were on before. `has_sky` and `has_sun` tell which of them
    /// there are.
    pub fn toggle_solo(&mut self, lamp: Lamp, [has_sky, has_sun]: [bool; 2]) {
        let before = self.solo.clone();
        self.end_solo();
        if before.is_some_and(|solo| solo.lamp == lamp) {
            return;
        }
        let Lighting {
            is_sky_off,
            is_sun_off,
            ..
        } = &mut self.lighting;
        self.solo = Some(Solo {
            lamp,
            were_lamps: self.materials.are_lamps(),
            was_sky_off: *is_sky_off,
            was_sun_off: *is_sun_off,
        });
        if has_sky {
            *is_sky_off = lamp != Lamp::Sky;
        }
        if has_sun {
            *is_sun_off = lamp != Lamp::Sun;
        }
        for index in 0..self.materials.now.len() {
            self.materials.switch(index, lamp == Lamp::Material(index));
        }
    }

    /// Switch on again what was on before one light was shown alone.
    pub fn end_solo(&mut self) {
        let Some(solo) = self.solo.take() else {
            return;
        };
        for (index, was_lamp) in solo.were_lamps.into_iter().enumerate() {
            self.materials.switch(index, was_lamp);
        }
        self.lighting.is_sky_off = solo.was_sky_off;
        self.lighting.is_sun_off = solo.was_sun_off;
    }
}

/// Lights and materials before and after changes, to go back and forth between.
#[derive(Clone, Debug, Default)]
pub struct History {
    past: Vec<Lights>,
    future: Vec<Lights>,
    changed: Option<Instant>,
}

impl History {
    /// Changes that are remembered.
    const KEPT: usize = 100;
    /// Changes that follow each other sooner belong together, as those of one drag do.
    const TOGETHER: Duration = Duration::from_millis(700);

    /// Remember lights and materials before a change that is made at this time.
    pub fn note(&mut self, before: Lights, now: Instant) {
        let last = self.changed.replace(now);
        self.future.clear();
        if last.is_some_and(|last| now.duration_since(last) < Self::TOGETHER) {
            return;
        }
        if self.past.len() >= Self::KEPT {
            self.past.remove(0);
        }
        self.past.push(before);
    }

    /// Whether there is a change to undo.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Lights and materials before the last change, given those of now.
    pub fn undo(&mut self, now: Lights) -> Option<Lights> {
        let before = self.past.pop()?;
        self.future.push(now);
        self.changed = None;
        Some(before)
    }

    /// Lights and materials after the change that was undone last, given those of now.
    pub fn redo(&mut self, now: Lights) -> Option<Lights> {
        let after = self.future.pop()?;
        self.past.push(now);
        self.changed = None;
        Some(after)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{SceneOptions, builtin::builtin};

    fn cornell() -> Lights {
        let scene = builtin("cornell", &SceneOptions::default());
        let scene = scene.expect("it is built in").expect("it is whole");
        Lights {
            materials: Materials::of(&scene),
            lighting: Lighting::default(),
            solo: None,
        }
    }

    #[test]
    fn one_light_is_alone_until_it_is_left() {
        let mut lights = cornell();
        let first = lights.materials.lights().next().expect("a lamp");
        let second = (first + 1) % lights.materials.now.len();
        lights.materials.make_lamp(second);
        let before = lights.clone();
        let on = |lights: &Lights| {
            let lamps = lights.materials.are_lamps();
            let lamps: Vec<usize> = (0..lamps.len()).filter(|&index| lamps[index]).collect();
            (
                lamps,
                lights.lighting.is_sky_off,
                lights.lighting.is_sun_off,
            )
        };
        lights.toggle_solo(Lamp::Material(second), [true, false]);
        assert_eq!(on(&lights), (vec![second], true, false));
        lights.toggle_solo(Lamp::Sky, [true, true]);
        assert_eq!(on(&lights), (vec![], false, true));
        lights.toggle_solo(Lamp::Material(first), [true, true]);
        assert_eq!(on(&lights), (vec![first], true, true));
        // What is changed meanwhile stays so.
        lights.materials.now[second].reflectance = Vec3::splat(0.25);
        lights.toggle_solo(Lamp::Material(first), [true, true]);
        assert_eq!(on(&lights), on(&before));
        assert_eq!(lights.solo, None);
        assert_eq!(lights.materials.now[second].reflectance, Vec3::splat(0.25));
    }

    #[test]
    fn changes_are_undone_and_made_again() {
        let first = Lights {
            materials: cornell().materials,
            lighting: Lighting::default(),
            solo: None,
        };
        let mut second = first.clone();
        second.materials.make_lamp(0);
        let (mut history, start) = (History::default(), Instant::now());
        history.note(first.clone(), start);
        // Still the same drag.
        history.note(second.clone(), start + Duration::from_millis(100));
        assert_eq!(history.undo(second.clone()), Some(first.clone()));
        assert_eq!(history.undo(first.clone()), None);
        assert_eq!(history.redo(first), Some(second.clone()));
        assert_eq!(history.redo(second), None);
    }
}
