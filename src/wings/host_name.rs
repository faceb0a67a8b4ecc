//! Names of hosts under which a server answers.

/// Maximum length of the name of a host (RFC 1035).
const HOST_NAME_BYTES_MAX: usize = 253;

/// Reads the name of a host.
pub(super) fn host_name(text: &str) -> Result<String, String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
    if text.is_empty() || text.len() > HOST_NAME_BYTES_MAX || !text.chars().all(allowed) {
        return Err(
            "it must be the name of a host without a port, such as bones.example.org".to_owned()
        );
    }
    Ok(text.to_owned())
}
