//! Names from a file in messages.

/// Names in one message. Fewer would hide which are meant, more would hide the message.
pub(super) const MOST_LISTED: usize = 8;

/// Names in quotes, at most so many of them, and how many more there are.
pub(super) fn listed<'a>(names: impl ExactSizeIterator<Item = &'a str>, most: usize) -> String {
    let more = names.len().saturating_sub(most);
    let quoted = names
        .take(most)
        .map(|name| format!("'{}'", shortened(name)));
    let listed = quoted.collect::<Vec<_>>().join(", ");
    match (more, listed.is_empty()) {
        (0, _) => listed,
        (_, true) => format!("{more} more"),
        (_, false) => format!("{listed} and {more} more"),
    }
}

/// A name short enough for a message.
pub(super) fn shortened(name: &str) -> String {
    const LONGEST: usize = 120;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST).chain(['…']).collect()
}
