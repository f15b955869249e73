//! The known name that a mistyped one may stand for.

/// Names that are less alike than this are not suggested: it is what clap takes for flags. Lower, and names are suggested
/// that have nothing in common; higher, and two swapped letters of a short name are not forgiven.
const ALIKE: f64 = 0.7;

/// The known name that is most like this one, whatever its case; nothing where none is alike.
pub fn closest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let likeness = |known: &str| strsim::jaro(&name, &known.to_lowercase());
    known
        .map(|known| (likeness(known), known))
        .max_by(|(one, _), (other, _)| one.total_cmp(other))
        .filter(|(likeness, _)| *likeness > ALIKE)
        .map(|(_, known)| known)
}
