//! Questions to the solver about what is selected, and its answers.

use std::sync::Arc;

use super::view::{LinkEnd, LinkOverlay};
use crate::solver::{Inspection, Subject};

/// Subjects of the present run, and their inspections.
#[derive(Default)]
pub struct Inspections {
    /// Whether the nodes that are shown are those of the present run.
    is_open: bool,
    asked: Vec<Subject>,
    element: Option<Arc<Inspection>>,
    cluster: Option<Arc<Inspection>>,
}

impl Inspections {
    /// A new run begins: what was asked is forgotten, and nothing is asked until its nodes are known.
    pub fn close(&mut self) {
        *self = Self::default();
    }

    /// The nodes of the present run are known.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// The subjects to ask about now: once, until others are wanted.
    pub fn question(&mut self, wanted: &[Subject]) -> Option<Vec<Subject>> {
        let is_same = self.asked.len() == wanted.len()
            && self.asked.iter().zip(wanted).all(|(a, b)| is_same(a, b));
        if !self.is_open || is_same {
            return None;
        }
        self.asked = wanted.to_vec();
        for known in [&mut self.element, &mut self.cluster] {
            known.take_if(|known| !wanted.iter().any(|subject| is_same_as(known, subject)));
        }
        Some(self.asked.clone())
    }

    /// Take note of an answer, unless something else was asked since.
    pub fn note(&mut self, inspection: Arc<Inspection>) {
        let is_wanted = |subject: &Subject| is_same_as(&inspection, subject);
        if self.asked.iter().any(is_wanted) {
            match inspection.subject {
                Subject::Element { .. } => self.element = Some(inspection),
                Subject::Cluster(_) => self.cluster = Some(inspection),
            }
        }
    }

    /// The inspection of the picked element.
    pub fn element(&self) -> Option<&Arc<Inspection>> {
        self.element.as_ref()
    }

    /// The inspection of an end of links.
    pub fn of(&self, end: LinkEnd) -> Option<&Arc<Inspection>> {
        match end {
            LinkEnd::Element => self.element.as_ref(),
            LinkEnd::Cluster => self.cluster.as_ref(),
        }
    }

    /// The inspection whose links an overlay draws.
    pub fn drawn(&self, overlay: &LinkOverlay) -> Option<&Arc<Inspection>> {
        self.of(overlay.of).filter(|_| overlay.shown)
    }

    /// Whether an answer about an end of links is still to come.
    pub fn is_waiting(&self, end: LinkEnd) -> bool {
        let is_end = |subject: &Subject| end_of(subject) == end;
        self.of(end).is_none() && self.asked.iter().any(is_end)
    }
}

fn end_of(subject: &Subject) -> LinkEnd {
    match subject {
        Subject::Element { .. } => LinkEnd::Element,
        Subject::Cluster(_) => LinkEnd::Cluster,
    }
}

fn is_same_as(inspection: &Inspection, subject: &Subject) -> bool {
    is_same(&inspection.subject, subject)
}

/// A picked point stays the same subject when its element is divided.
fn is_same(a: &Subject, b: &Subject) -> bool {
    match (a, b) {
        (Subject::Element { point, .. }, Subject::Element { point: other, .. }) => point == other,
        (Subject::Cluster(node), Subject::Cluster(other)) => node == other,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::hierarchy::NodeId;

    fn element(node: u32, x: f32) -> Subject {
        Subject::Element {
            node: NodeId(node),
            point: Vec3::X * x,
        }
    }

    fn answer(subject: Subject, step: u32) -> Arc<Inspection> {
        Arc::new(Inspection {
            subject,
            step,
            links: Vec::new(),
            linked: Vec3::ZERO,
            direct: Vec3::ZERO,
            row_sum: 0.0,
            error_bound: 0.0,
            path: Vec::new(),
        })
    }

    #[test]
    fn each_question_is_asked_once() {
        let mut known = Inspections::default();
        assert!(
            known.question(&[element(7, 1.0)]).is_none(),
            "no run is known"
        );
        known.open();
        assert!(known.question(&[element(7, 1.0)]).is_some());
        assert!(known.question(&[element(7, 1.0)]).is_none());
        assert!(
            known.question(&[element(9, 1.0)]).is_none(),
            "the same point, divided"
        );
        assert!(known.is_waiting(LinkEnd::Element));
        known.note(answer(element(7, 1.0), 1));
        assert!(!known.is_waiting(LinkEnd::Element));
        known.note(answer(element(7, 1.0), 2));
        assert_eq!(known.element().map(|known| known.step), Some(2));
    }

    #[test]
    fn answers_to_older_questions_do_not_show() {
        let mut known = Inspections::default();
        known.open();
        known.question(&[element(7, 1.0), Subject::Cluster(NodeId(3))]);
        known.note(answer(element(7, 1.0), 1));
        known.note(answer(Subject::Cluster(NodeId(3)), 1));
        known.question(&[element(8, 2.0), Subject::Cluster(NodeId(3))]);
        assert!(known.element().is_none());
        assert!(known.of(LinkEnd::Cluster).is_some(), "still wanted");
        known.note(answer(element(7, 1.0), 2));
        assert!(known.element().is_none());
        known.close();
        assert!(known.of(LinkEnd::Cluster).is_none());
    }
}
