//! Identification of a process: its host name, and unique random numbers.

use thiserror::Error;

/// The operating system provides no random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the operating system provides no random numbers")]
pub struct NoRandomness;

/// Returns random bytes from the operating system, fit for secrets.
///
/// # Errors
/// If the operating system provides none.
pub fn random_bytes<const N: usize>() -> Result<[u8; N], NoRandomness> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes).map_err(|_| NoRandomness)?;
    Ok(bytes)
}

/// Returns a random number other than 0.
///
/// # Errors
/// Same as [`random_bytes`].
pub fn random_number() -> Result<u64, NoRandomness> {
    Ok(u64::from_le_bytes(random_bytes()?).max(1))
}

/// Returns random bytes as hexadecimal digits, two for each byte.
///
/// # Errors
/// Same as [`random_bytes`].
pub fn random_digits<const N: usize>() -> Result<String, NoRandomness> {
    Ok(random_bytes::<N>()?.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Returns the name of this host, if it has one.
pub fn host_name() -> Option<String> {
    let names = rustix::system::uname();
    let name = names.nodename().to_string_lossy().trim().to_owned();
    (!name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use std::array;
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn random_numbers_do_not_repeat() {
        let numbers: [u64; 64] = array::from_fn(|_| random_number().unwrap());
        assert_eq!(BTreeSet::from(numbers).len(), numbers.len());
        let digits = random_digits::<16>().unwrap();
        assert_eq!(digits.len(), 32);
        assert_ne!(digits, random_digits::<16>().unwrap());
    }
}
