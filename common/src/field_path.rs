//! Paths of fields, and quotations of a user's text, for messages.

/// Maximum number of characters of a user's text that a message quotes.
const SHOWN_CHARACTERS_MAX: usize = 60;

/// Returns the path of the entry `key` of the table at `table`; the root's path is empty.
pub fn entry_path(table: &str, key: &str) -> String {
    let key = shown_key(key);
    if table.is_empty() { key } else { format!("{table}.{key}") }
}

/// Returns the path of element `index` (from 0) of the list at `list`.
pub fn element_path(list: &str, index: usize) -> String {
    format!("{list}[{index}]")
}

/// Returns a key as it must be written in TOML, shortened if it is long.
pub fn shown_key(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.len() <= SHOWN_CHARACTERS_MAX && key.chars().all(bare) {
        key.to_owned()
    } else {
        quoted(key)
    }
}

/// Returns `text` in quotes, with control characters escaped, shortened if it is long.
pub fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_CHARACTERS_MAX).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    format!("{shown:?}")
}
