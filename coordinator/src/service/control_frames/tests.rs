use tokio::time::advance;

use super::*;

const SETTINGS: u8 = 4;
const PING: u8 = 6;

/// Returns a frame with so many bytes of content.
fn frame(kind: u8, flags: u8, length: u32) -> Vec<u8> {
    let [_, high, middle, low] = length.to_be_bytes();
    let mut bytes = vec![high, middle, low, kind, flags, 0, 0, 0, 1];
    bytes.resize(HEADER_BYTES + length as usize, 0xff);
    bytes
}

/// Returns a connection whose preface has arrived.
fn begun_connection() -> ControlFrames {
    let mut frames = ControlFrames::new();
    frames.follow_arrived(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n").unwrap();
    frames
}

/// Returns how many equal frames may arrive, at most `most`. A connection that was ended would go on here.
fn count_accepted(frames: &mut ControlFrames, frame: &[u8], most: u32) -> u32 {
    let count = (0..most).take_while(|_| frames.follow_arrived(frame).is_ok()).count();
    frames.skip = 0;
    count as u32
}

#[tokio::test(start_paused = true)]
async fn what_brings_nothing_forward_is_bounded() {
    let many = 10 * PERMITS_MAX;
    for (kind, flags, length, free) in [
        (SETTINGS, 0, 0, false),
        (SETTINGS, 0, 36, false),
        (SETTINGS, 1, 0, false),
        (PING, 0, 8, false),
        (PING, 1, 8, false),
        (2, 0, 5, false),
        (3, 0, 4, false),
        (7, 0, 8, false),
        (WINDOW_UPDATE, 0, 4, false),
        (200, 0, 0, false),
        (DATA, 0, 0, false),
        (DATA, 0, 1, false),
        (DATA, END_STREAM, 0, true),
        (DATA, 0, DATA_BYTES_MIN, true),
        (HEADERS, 4, 30, true),
        (CONTINUATION, 0, 0, false),
        (CONTINUATION, 0, 1, true),
    ] {
        let expected = if free { many } else { PERMITS_MAX };
        let found = count_accepted(&mut begun_connection(), &frame(kind, flags, length), many);
        assert_eq!(found, expected, "type {kind}, flags {flags}, {length} bytes");
    }
}

/// A frame is found wherever the reads end.
#[tokio::test(start_paused = true)]
async fn frames_are_found_in_pieces_of_any_length() {
    let mut bytes = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec();
    for _ in 0..PERMITS_MAX {
        bytes.extend(frame(PING, 0, 8));
        bytes.extend(frame(DATA, 0, 100));
    }
    for piece in [1, 2, 7, 9, 16, 1000, bytes.len()] {
        let mut frames = ControlFrames::new();
        for piece in bytes.chunks(piece) {
            frames.follow_arrived(piece).unwrap();
        }
        assert_eq!(frames.permits, 0, "pieces of {piece} bytes");
        assert_eq!(frames.follow_arrived(&frame(PING, 0, 8)), Err(TooManyControlFrames));
    }
}

#[tokio::test(start_paused = true)]
async fn permits_come_back_with_time() {
    let mut frames = begun_connection();
    let ping = frame(PING, 0, 8);
    assert_eq!(count_accepted(&mut frames, &ping, u32::MAX), PERMITS_MAX);
    advance(Duration::from_secs(1)).await;
    assert_eq!(count_accepted(&mut frames, &ping, u32::MAX), PERMITS_PER_SECOND);
    // A little at a time is not lost, and a long rest gives no more than a new connection has.
    for _ in 0..10 {
        advance(Duration::from_millis(4)).await;
        count_accepted(&mut frames, &ping, u32::MAX);
    }
    advance(Duration::from_secs(3600)).await;
    assert_eq!(count_accepted(&mut frames, &ping, u32::MAX), PERMITS_MAX);
    // A probe each second for a day, as often as the most anxious client.
    for _ in 0..86_400 {
        advance(Duration::from_secs(1)).await;
        frames.follow_arrived(&ping).unwrap();
    }
}

#[tokio::test(start_paused = true)]
async fn what_was_sent_pays_for_window_updates() {
    let mut frames = begun_connection();
    let update = frame(WINDOW_UPDATE, 0, 4);
    // A million messages of the length of a small batch, in no time, each with two updates.
    for _ in 0..1_000_000 {
        frames.note_sent(44);
        frames.follow_arrived(&update).unwrap();
        frames.follow_arrived(&update).unwrap();
    }
    assert_eq!(frames.permits, PERMITS_MAX);
    let paid = frames.updates;
    assert!(paid <= UPDATES_MAX, "{paid}");
    assert_eq!(count_accepted(&mut frames, &update, u32::MAX), paid + PERMITS_MAX);
    // It pays for nothing else: answers to probes do not pay for probes.
    let mut frames = begun_connection();
    frames.note_sent(usize::MAX);
    assert_eq!(count_accepted(&mut frames, &frame(PING, 0, 8), u32::MAX), PERMITS_MAX);
}
