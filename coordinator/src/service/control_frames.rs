//! A bound on the control frames of a connection. They cost their sender a few bytes and nothing counts them, so
//! that some millions of them in a second would delay the calls of everybody.
//!
//! The bytes of HTTP/2 that a peer sends are followed from one frame's header to the next as they pass, above TLS where
//! there is TLS. A frame that brings nothing forward takes a permit, and permits come back with time. A window
//! update answers data, so what was sent to the peer pays for it. Calls are limited elsewhere: here they
//! are free, as is their data.

use std::time::Duration;

use thiserror::Error;
use tokio::time::Instant;

/// Number of permits of a new connection, and the most that come back at once. Clients send a few control frames
/// when they connect, one for each of their [at most 256](super::shell) calls that they give up, and a probe
/// every few seconds.
const PERMITS_MAX: u32 = 1000;
/// Permits that come back in a second.
const PERMITS_PER_SECOND: u32 = 200;
/// Bytes sent to a peer that pay for one window update. A thrifty client sends one for some ten thousand
/// bytes. Another sends two with each message, one for the stream and one for the connection, and a
/// message is rarely shorter than twice this.
const BYTES_PER_UPDATE: u32 = 16;
/// Most window updates that are paid for and have not arrived.
const UPDATES_MAX: u32 = 65_536;
/// Length from which on a frame of data costs no permit. Every answer of a worker is longer; only
/// heartbeats are shorter.
const DATA_BYTES_MIN: u32 = 16;

/// First bytes of a connection, before its first frame.
const PREFACE_BYTES: u32 = 24;
const HEADER_BYTES: usize = 9;
const DATA: u8 = 0;
const HEADERS: u8 = 1;
const WINDOW_UPDATE: u8 = 8;
const CONTINUATION: u8 = 9;
const END_STREAM: u8 = 1;

/// The peer has sent more control frames than it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "more than {PERMITS_MAX} control frames of HTTP/2, and then more than {PERMITS_PER_SECOND} a second"
)]
pub(crate) struct TooManyControlFrames;

/// What a connection may still send.
#[derive(Debug)]
pub(crate) struct ControlFrames {
    /// Bytes until the next header of a frame.
    skip: u32,
    /// The header of a frame, as far as it has arrived.
    header: [u8; HEADER_BYTES],
    /// Number of its bytes that have arrived.
    filled: usize,
    permits: u32,
    /// Time up to which permits have come back.
    refilled: Instant,
    /// Window updates that are paid for.
    updates: u32,
    /// Bytes sent that do not pay for a whole update yet.
    unpaid: u32,
}

impl ControlFrames {
    /// Begins with the first byte of a connection.
    pub(crate) fn new() -> Self {
        Self {
            skip: PREFACE_BYTES,
            header: [0; HEADER_BYTES],
            filled: 0,
            permits: PERMITS_MAX,
            refilled: Instant::now(),
            updates: 0,
            unpaid: 0,
        }
    }

    /// Notes bytes that were sent to the peer.
    pub(crate) fn note_sent(&mut self, bytes: usize) {
        let most = UPDATES_MAX * BYTES_PER_UPDATE;
        let unpaid = self.unpaid + u32::try_from(bytes).unwrap_or(most).min(most);
        self.unpaid = unpaid % BYTES_PER_UPDATE;
        self.updates = (self.updates + unpaid / BYTES_PER_UPDATE).min(UPDATES_MAX);
    }

    /// Follows bytes that have arrived from the peer.
    ///
    /// # Errors
    /// When a control frame in them is one too many.
    pub(crate) fn follow_arrived(&mut self, mut bytes: &[u8]) -> Result<(), TooManyControlFrames> {
        while !bytes.is_empty() {
            if self.skip > 0 {
                let skipped = bytes.len().min(self.skip as usize);
                // At most `self.skip`.
                self.skip -= skipped as u32;
                bytes = &bytes[skipped..];
                continue;
            }
            let taken = bytes.len().min(HEADER_BYTES - self.filled);
            self.header[self.filled..self.filled + taken].copy_from_slice(&bytes[..taken]);
            self.filled += taken;
            bytes = &bytes[taken..];
            if self.filled == HEADER_BYTES {
                self.filled = 0;
                self.frame()?;
            }
        }
        Ok(())
    }

    /// Takes what the frame of a complete header costs.
    fn frame(&mut self) -> Result<(), TooManyControlFrames> {
        let [high, middle, low, kind, flags, ..] = self.header;
        let length = u32::from_be_bytes([0, high, middle, low]);
        self.skip = length;
        let is_free = match kind {
            DATA => length >= DATA_BYTES_MIN || flags & END_STREAM != 0,
            HEADERS => true,
            CONTINUATION => length > 0,
            WINDOW_UPDATE if self.updates > 0 => {
                self.updates -= 1;
                true
            }
            _ => false,
        };
        if is_free { Ok(()) } else { self.take_permit() }
    }

    fn take_permit(&mut self) -> Result<(), TooManyControlFrames> {
        if self.permits == 0 {
            self.refill();
        }
        self.permits = self.permits.checked_sub(1).ok_or(TooManyControlFrames)?;
        Ok(())
    }

    /// Returns the permits that have come back since the last time. Called when there are none, so that the clock is
    /// read once for many frames.
    fn refill(&mut self) {
        let each = Duration::from_secs(1) / PERMITS_PER_SECOND;
        let now = Instant::now();
        let back = now.saturating_duration_since(self.refilled).as_nanos() / each.as_nanos();
        let back = u32::try_from(back).unwrap_or(PERMITS_MAX).min(PERMITS_MAX);
        if back == PERMITS_MAX {
            self.refilled = now;
        } else {
            self.refilled += each * back;
        }
        self.permits = back;
    }
}

#[cfg(test)]
mod tests;
