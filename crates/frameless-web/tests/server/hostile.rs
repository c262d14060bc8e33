//! Messages that must not be.

use frameless_web::wire::{Ack, Said, StatusMessage, TilesHeader};
use tokio_tungstenite::tungstenite::Message;

use crate::support::{Client, PATIENCE, Received, Running, options, start};

/// Numbers from a seed (SplitMix64: Steele, Lea, Flood 2014).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn bytes(&mut self, most: usize) -> Vec<u8> {
        let length = self.below(most + 1);
        (0..length).map(|_| self.next() as u8).collect()
    }
}

const GOOD: [&str; 10] = [
    r#"{"type": "camera", "input": 7, "orbit": [0.1, -0.2], "pan": [0, 0], "zoom": 0.9, "fly": [0, 0, 1]}"#,
    r#"{"type": "settings", "sampler": "adaptive", "temporal": 0.5, "samples_per_sec": null, "picture": "160x120"}"#,
    r#"{"type": "settings", "overlay": "holes", "reconstruction": "hold", "exposure_stops": 1.5}"#,
    r#"{"type": "look_through", "input": 8, "camera": 0}"#,
    r#"{"type": "seek", "input": 11, "secs": 1.5}"#,
    r#"{"type": "speed", "input": 12, "speed": -0.5}"#,
    r#"{"type": "play", "on": true}"#,
    r#"{"type": "size", "place": [160, 120]}"#,
    r#"{"type": "open", "name": "sphere"}"#,
    r#"{"type": "drive", "on": true}"#,
];

/// A message of any kind, good, changed or random. Pictures stay small: what a driver may ask for is no mistake.
fn message(numbers: &mut Numbers) -> Message {
    match numbers.below(5) {
        0 => Message::binary(numbers.bytes(64)),
        1 => Message::text(String::from_utf8_lossy(&numbers.bytes(200)).into_owned()),
        2 => {
            let sequence = numbers.next() as u32;
            Message::binary(mutated(numbers, Ack { sequence }.to_bytes().to_vec()))
        }
        _ => {
            let good = GOOD[numbers.below(GOOD.len())].as_bytes().to_vec();
            let changed = mutated(numbers, good);
            Message::text(String::from_utf8_lossy(&changed).into_owned())
        }
    }
}

/// Up to four times: a bit turned, a byte removed, inserted or replaced, the end cut off, a part repeated.
fn mutated(numbers: &mut Numbers, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..numbers.below(5) {
        if bytes.is_empty() {
            break;
        }
        let at = numbers.below(bytes.len());
        match numbers.below(6) {
            0 => bytes[at] ^= 1 << numbers.below(8),
            1 => drop(bytes.remove(at)),
            2 => bytes.insert(at, b"\"{}[],:0-e9\\ntf"[numbers.below(15)]),
            3 => bytes[at] = numbers.next() as u8,
            4 => bytes.truncate(at),
            _ => bytes.extend_from_within(at..),
        }
    }
    bytes
}

#[test]
fn ten_thousand_messages_do_not_break_the_parsers() {
    let mut numbers = Numbers(1);
    let mut taken = 0;
    for _ in 0..10_000 {
        match message(&mut numbers) {
            Message::Text(text) => taken += usize::from(Said::parse(&text).is_ok()),
            Message::Binary(bytes) => taken += usize::from(Ack::parse(&bytes).is_ok()),
            other => panic!("{other:?}"),
        }
        let bytes = numbers.bytes(100);
        let header = [&[1, 1, 1, 0][..], &bytes].concat();
        TilesHeader::parse(&header).ok();
        StatusMessage::parse(&header).ok();
    }
    assert!((1000..9000).contains(&taken), "{taken} are good: both kinds are tried");
}

/// Sends messages until they are `most`, on a new connection wherever one has been closed. Returns how many it took.
fn send_bad_and_good(running: &Running, seed: u64, most: usize) -> usize {
    let mut numbers = Numbers(seed);
    let (mut sent, mut connections) = (0, 0);
    while sent < most {
        let mut client = Client::try_connect(running).expect("let in");
        client.draws = false;
        connections += 1;
        while sent < most {
            let message = message(&mut numbers);
            let is_good = match &message {
                Message::Text(text) => Said::parse(text).is_ok(),
                // No acknowledgement of what was never sent is good.
                _ => false,
            };
            sent += 1;
            // Fails where the last message was bad and has been found so by now.
            client.socket.send(message).ok();
            if !is_good {
                let code = closing_code(&mut client);
                assert!(code.is_none_or(|code| code == 1008), "{code:?}");
                break;
            }
        }
    }
    connections
}

fn closing_code(client: &mut Client) -> Option<u16> {
    loop {
        match client.receive(PATIENCE) {
            Received::Closed(code) => return code,
            Received::Nothing => panic!("still open after a bad message"),
            _ => {}
        }
    }
}

#[test]
fn ten_thousand_messages_close_their_own_connections_only() {
    const CLIENTS: u64 = 16;
    let running = start(options());
    let mut watcher = Client::connect(&running);
    let connections: usize = std::thread::scope(|scope| {
        let running = &running;
        let client =
            |seed| scope.spawn(move || send_bad_and_good(running, seed, 10_000 / CLIENTS as usize));
        let clients: Vec<_> = (1..=CLIENTS).map(client).collect();
        // Somebody else is served all the while.
        while clients.iter().any(|client| !client.is_finished()) {
            watcher.next();
        }
        clients.into_iter().map(|client| client.join().expect("no surprise")).sum()
    });
    println!("10,000 messages on {connections} connections");
    let alive =
        |_: &mut Client, received: &Received| matches!(received, Received::Status(_)).then_some(());
    watcher.until("a status", alive);
}

#[test]
fn a_message_that_is_too_long_ends_its_connection() {
    let running = start(options());
    let mut other = Client::connect(&running);
    let mut client = Client::connect(&running);
    client.socket.send(Message::text(" ".repeat((1 << 20) + 1))).ok();
    assert_eq!(closing_code(&mut client), Some(1009));
    other.until("a status", |_, received| matches!(received, Received::Status(_)).then_some(()));
}
