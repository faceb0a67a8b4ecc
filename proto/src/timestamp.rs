//! Times since the Unix epoch as messages, and back.

use std::time::Duration;

use prost_types::Timestamp;

/// Returns a time since the Unix epoch as a message.
pub fn to_message(since_epoch: Duration) -> Timestamp {
    // A machine's clock never shows a time beyond the range of a timestamp.
    let seconds = i64::try_from(since_epoch.as_secs()).unwrap_or(i64::MAX);
    Timestamp { seconds, nanos: since_epoch.subsec_nanos().cast_signed() }
}

/// Returns the time since the Unix epoch; `None` if it is before the epoch or the message is
/// malformed.
pub fn from_message(message: &Timestamp) -> Option<Duration> {
    let nanos = u32::try_from(message.nanos).ok().filter(|nanos| *nanos < 1_000_000_000)?;
    Some(Duration::new(u64::try_from(message.seconds).ok()?, nanos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_survive_the_message_and_bad_ones_are_none() {
        for time in [Duration::ZERO, Duration::new(1_790_000_000, 999_999_999)] {
            assert_eq!(from_message(&to_message(time)), Some(time));
        }
        for (seconds, nanos) in [(-1, 0), (0, -1), (0, 1_000_000_000)] {
            assert_eq!(from_message(&Timestamp { seconds, nanos }), None);
        }
    }
}
