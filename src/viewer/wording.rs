//! Sentences of other rooms as the window says them: they name controls where the command line names flags.

/// Flags by the name of their control in the window.
const CONTROLS: [(&str, &str); 14] = [
    ("--sides", "Sides"),
    ("--up", "Camera"),
    ("--epsilon", "Link threshold ε"),
    ("--min-area", "Smallest element"),
    ("--max-steps", "Maximum steps"),
    ("--time-limit", "Time limit"),
    ("--memory-limit", "Memory limit"),
    ("--threads", "Threads"),
    ("--direct", "Direct light"),
    ("--oracle", "Link error"),
    ("--samples", "Samples p"),
    ("--method", "Clusters"),
    ("--reference", "Trace reference"),
    ("--sky", "Sky"),
];

/// Values of flags by their label in the window.
const VALUES: [(&str, &str); 9] = [
    ("auto", "Automatic"),
    ("+Y", "Y is up"),
    ("one", "One-sided"),
    ("two", "Two-sided"),
    ("sampled", "Shadow rays"),
    ("linked", "Links"),
    ("interval", "Interval bounds"),
    ("samples", "p samples"),
    ("none", "None"),
];

/// A sentence without flags: `--sides two` becomes “Sides: Two-sided”. A flag without a control keeps its words.
pub fn without_flags(sentence: &str) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut rest = sentence.split(' ').peekable();
    while let Some(word) = rest.next() {
        let (flag, end) = split_punctuation(word);
        let Some(bare) = flag.strip_prefix("--").filter(|bare| is_flag(bare)) else {
            words.push(word.to_owned());
            continue;
        };
        let control = CONTROLS.iter().find(|(name, _)| *name == flag);
        let name = control.map_or_else(|| bare.replace('-', " "), |(_, name)| (*name).to_owned());
        let value = rest.peek().and_then(|next| value_of(next));
        match (end, value) {
            ("", Some((label, end))) => {
                rest.next();
                words.push(format!("“{name}: {label}”{end}"));
            }
            _ => words.push(format!("“{name}”{end}")),
        }
    }
    words.join(" ")
}

/// Whether text behind two dashes is the name of a flag.
fn is_flag(bare: &str) -> bool {
    bare.starts_with(|c: char| c.is_ascii_lowercase())
        && bare.chars().all(|c| c.is_ascii_lowercase() || c == '-')
}

/// The label of a flag's value, and the punctuation behind it.
fn value_of(word: &str) -> Option<(&'static str, &str)> {
    let (value, end) = split_punctuation(word);
    let (_, label) = VALUES.iter().find(|(name, _)| *name == value)?;
    Some((label, end))
}

fn split_punctuation(word: &str) -> (&str, &str) {
    let core = word.trim_end_matches([',', ';', ':', '.', ')']);
    word.split_at(core.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_become_the_names_of_controls() {
        for (sentence, expected) in [
            (
                "flip them or use --sides two",
                "flip them or use “Sides: Two-sided”",
            ),
            (
                "or --sides one was asked for",
                "or “Sides: One-sided” was asked for",
            ),
            (
                "raise --min-area, or stop",
                "raise “Smallest element”, or stop",
            ),
            ("choose --up +Y", "choose “Camera: Y is up”"),
            ("see --some-flag now", "see “some flag” now"),
            ("a -- b, --, x--sides", "a -- b, --, x--sides"),
        ] {
            assert_eq!(without_flags(sentence), expected);
        }
    }
}
