//! What the tests of refused files share.

use std::fmt::Write as _;

/// Pins what a user reads of each input; no input may be `ACCEPTED`.
pub(crate) fn pin<'a>(name: &str, refusals: impl IntoIterator<Item = (&'a str, String)>) {
    let mut page = String::new();
    for (input, message) in refusals {
        writeln!(page, "{input}\n=> {message}\n").unwrap();
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
