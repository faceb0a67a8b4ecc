//! What the tests of refused files share.

use std::fmt::Write as _;

/// Pins what a user reads of each input, but for the numbers of lines, which change with every line of the
/// file around it; no input may be `ACCEPTED`.
pub(crate) fn pin<'a>(name: &str, refusals: impl IntoIterator<Item = (&'a str, String)>) {
    let mut page = String::new();
    for (input, message) in refusals {
        let message: Vec<String> = message.lines().map(without_line_number).collect();
        writeln!(page, "{input}\n=> {}\n", message.join("\n")).unwrap();
    }
    insta::with_settings!({
        snapshot_path => "../snapshots",
        prepend_module_to_snapshot => false,
        omit_expression => true,
    }, {
        insta::assert_snapshot!(name, page);
    });
    assert!(!page.contains("ACCEPTED"), "{page}");
}

/// Returns a line of a message without the number of the line in the file, which it may begin with.
fn without_line_number(line: &str) -> String {
    let named = line.trim_start().strip_prefix("line ").and_then(|rest| rest.split_once(": "));
    match named {
        Some((number, message)) if number.bytes().all(|byte| byte.is_ascii_digit()) => {
            format!("  {message}")
        }
        _ => line.to_owned(),
    }
}
