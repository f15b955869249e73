//! Messages to the user: sentences, which of them were seen, and which are dropped with the scene they are about.

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Something was done.
    Note,
    /// Something may not be as expected.
    Warning,
    /// Something was not done.
    Error,
}

/// One sentence for the messages panel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// How much it matters.
    pub severity: Severity,
    /// The sentence.
    pub text: String,
    /// Number of the scene that it is about; `None` where it stays true whatever scene is shown.
    scene: Option<u32>,
}

/// All messages, and how many were seen.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    /// The oldest first.
    pub all: Vec<Message>,
    /// How many of them, from the oldest on, were shown in the messages panel.
    pub seen: usize,
    /// Number of the scene that was opened last, whether or not it could be read.
    scene: u32,
}

impl Messages {
    /// Messages kept; older ones are dropped.
    const KEPT: usize = 500;

    /// Add a sentence about the scene that was opened last. It is dropped once another one is shown.
    pub fn push(&mut self, severity: Severity, text: impl Into<String>) {
        self.add(severity, text.into(), Some(self.scene));
    }

    /// Add a sentence that stays true whatever scene is shown: a file was saved, the graphics adapter failed.
    pub fn push_lasting(&mut self, severity: Severity, text: impl Into<String>) {
        self.add(severity, text.into(), None);
    }

    /// A scene is being opened: sentences from now on are about it.
    pub fn open_scene(&mut self) {
        self.scene += 1;
    }

    /// The scene that was opened last is shown: drop the messages about earlier scenes.
    pub fn show_scene(&mut self) {
        let scene = self.scene;
        let stays = |message: &Message| message.scene.is_none_or(|number| number == scene);
        let seen = &self.all[..self.seen.min(self.all.len())];
        self.seen = seen.iter().filter(|message| stays(message)).count();
        self.all.retain(stays);
    }

    fn add(&mut self, severity: Severity, text: String, scene: Option<u32>) {
        let message = Message {
            severity,
            text: sentence(text),
            scene,
        };
        // A message that is repeated every frame is added once.
        if self.all.last() == Some(&message) {
            return;
        }
        if self.all.len() >= Self::KEPT {
            self.all.remove(0);
            self.seen = self.seen.saturating_sub(1);
        }
        self.all.push(message);
    }

    /// Messages that were not seen in the messages panel, the oldest first.
    pub fn unseen(&self) -> &[Message] {
        &self.all[self.seen.min(self.all.len())..]
    }
}

/// A first capital, as sentences have on screen. Names of files keep their case: only a word of nothing but letters gets
/// one.
fn sentence(text: String) -> String {
    let first_word = text.split(' ').next().unwrap_or_default();
    if !first_word.chars().all(char::is_alphabetic) {
        return text;
    }
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => first.to_uppercase().chain(chars).collect(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_message_is_said_once() {
        let mut messages = Messages::default();
        messages.push(Severity::Error, "no room");
        messages.push(Severity::Error, "no room");
        assert_eq!(messages.unseen().len(), 1);
        assert_eq!(messages.all[0].text, "No room");
    }

    #[test]
    fn file_names_keep_their_case() {
        for text in [
            "hall.obj:12: skipped a face",
            "rooms/hall.obj: skipped a face",
            "hall_2 was not found",
            "house-1:7: bad line",
            "",
        ] {
            assert_eq!(sentence(text.to_owned()), text);
        }
        assert_eq!(sentence("saved hall.obj".to_owned()), "Saved hall.obj");
        assert_eq!(sentence("été".to_owned()), "Été");
    }

    #[test]
    fn messages_go_with_their_scene_but_saved_files_stay() {
        let mut messages = Messages::default();
        messages.push(Severity::Warning, "two faces were skipped");
        messages.push_lasting(Severity::Note, "saved a.png");
        messages.seen = 2;
        messages.open_scene();
        messages.push(Severity::Error, "cannot read b.obj");
        messages.push_lasting(Severity::Error, "cannot save b.png");
        messages.open_scene();
        messages.push(Severity::Note, "three files were dropped");
        messages.show_scene();
        let texts: Vec<&str> = messages.all.iter().map(|said| said.text.as_str()).collect();
        let expected = [
            "Saved a.png",
            "Cannot save b.png",
            "Three files were dropped",
        ];
        assert_eq!(texts, expected);
        assert_eq!(messages.unseen().len(), 2);
    }
}
