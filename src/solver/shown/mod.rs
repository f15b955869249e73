//! What is made of the state: the display mesh, figures, answers about a node.

mod display;
mod figures;
mod inspect;
mod seams;
