//! The criterion by which velocities were picked, as comments above them in a CSV file.

use std::fmt::Write as _;

use osteon_common::settings::Picking;

use crate::document::Format;
use crate::document_text::DocumentText;
use crate::reader::{self, Reader};

/// How each of these lines begins; what follows `# ` is a line of TOML.
const BEGIN: &str = "# picking.";

/// Returns the lines that state a criterion.
pub fn of_picking(picking: &Picking) -> String {
    let Picking { extremum, threshold } = picking;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{BEGIN}extremum = \"{}\"", extremum.name());
    let _ = writeln!(text, "{BEGIN}threshold = {threshold:?}");
    text
}

/// Returns the criterion that the first lines of a file state; `None` if they state none.
pub(crate) fn read(text: &str) -> Option<Picking> {
    let lines = text.lines().take_while(|line| line.starts_with(BEGIN));
    let stated: String =
        lines.filter_map(|line| Some(line.strip_prefix("# ")?.to_owned() + "\n")).collect();
    let root = DocumentText::new(&stated, Format::Toml).tree().ok()?;
    let mut reader = Reader::default();
    let table = reader.root(&root, &["picking"]);
    let mut picking = Picking::default();
    reader::section(&mut reader, &table, "picking", &mut picking);
    (table.has("picking") && reader.violations.is_empty()).then_some(picking)
}

#[cfg(test)]
mod tests {
    use osteon_common::settings::Extremum;

    use super::*;

    #[test]
    fn what_is_stated_is_read() {
        let picking = Picking { extremum: Extremum::Second, threshold: 0.125 };
        let text = of_picking(&picking) + "velocity\n3900\n";
        assert_eq!(read(&text), Some(picking));
        for other in
            ["", "velocity\n3900\n", "# picking.extremum = \"third\"\nvelocity\n", "# picking.\n"]
        {
            assert_eq!(read(other), None, "{other}");
        }
    }
}
