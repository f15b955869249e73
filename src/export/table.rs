//! Tables as CSV: a header of field names, then a line for each row.

use std::io::{self, Write};

use serde::Serialize;

/// Write rows under the names of their fields; without rows the table is empty.
///
/// # Errors
/// Those of `out`.
pub fn write_csv(
    rows: impl IntoIterator<Item = impl Serialize>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    for row in rows {
        table.serialize(row)?;
    }
    table.flush()
}
