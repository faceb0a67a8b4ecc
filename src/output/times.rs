//! Times of the coordinator's clock, in the same form for people and programs.

use std::time::Duration;

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Returns a time since the Unix epoch in UTC by RFC 3339, to the second: `2026-01-31T09:30:00Z`.
pub(crate) fn utc(since_epoch: Duration) -> Option<String> {
    let seconds = i64::try_from(since_epoch.as_secs()).ok()?;
    OffsetDateTime::from_unix_timestamp(seconds).ok()?.format(&Rfc3339).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_in_utc_and_those_beyond_the_calendar_are_none() {
        assert_eq!(utc(Duration::ZERO).as_deref(), Some("1970-01-01T00:00:00Z"));
        let day = Duration::new(1_790_000_000, 999_999_999);
        assert_eq!(utc(day).as_deref(), Some("2026-09-21T14:13:20Z"));
        assert_eq!(utc(Duration::MAX), None);
        assert_eq!(utc(Duration::from_secs(1 << 50)), None);
    }
}
