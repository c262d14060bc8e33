//! Several clients: who drives, how many there may be, and that the slow ones hold nobody up.

use std::time::{Duration, Instant};

use frameless::Size;
use frameless_web::Options;

use crate::support::{Client, Received, options, start, start_at};

#[test]
fn one_drives_the_others_watch_and_the_helm_changes_hands() {
    let running = start(options());
    let mut first = Client::connect(&running);
    let mut second = Client::connect(&running);
    let (one, two) = (first.number, second.number);
    let drives = |client: &mut Client, who: Option<u32>| {
        let want = who.map_or(serde_json::Value::Null, Into::into);
        client.state("another driver", |state| state["driver"] == want);
    };
    drives(&mut second, Some(one));
    second.say(r#"{"type": "settings", "exposure_stops": 3}"#);
    second.notice("drives");
    second.say(r#"{"type": "drive", "on": true}"#);
    drives(&mut first, Some(two));
    drives(&mut second, Some(two));
    second.say(r#"{"type": "settings", "exposure_stops": 2}"#);
    let state = first.state("two stops", |state| state["settings"]["exposure_stops"] == 2.0);
    assert_eq!(state["clients"], 2);
    drop(second);
    drives(&mut first, None);
    first.say(r#"{"type": "play", "on": false}"#);
    drives(&mut first, Some(one));
}

#[test]
fn the_65th_client_is_turned_away_until_one_leaves() {
    let running = start(options());
    let mut clients: Vec<Client> =
        (0..64).map(|_| Client::try_connect(&running).expect("there is room")).collect();
    assert_eq!(Client::try_connect(&running).err(), Some(503));
    clients.pop();
    let begin = Instant::now();
    while Client::try_connect(&running).is_err() {
        assert!(begin.elapsed() < Duration::from_secs(20), "the place stays taken");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_client_that_acknowledges_nothing_is_sent_a_window_and_no_more() {
    let running = start_at(options(), Size::new(640, 480));
    let mut silent = Client::connect(&running);
    let mut busy = Client::connect(&running);
    let end = Instant::now() + Duration::from_secs(4);
    let (mut in_flight, mut tiles) = (0, 0);
    while Instant::now() < end {
        let before = silent.bytes;
        if let Received::Tiles(_) = silent.receive(Duration::from_millis(1)) {
            in_flight += silent.bytes - before;
        }
        if let Received::Tiles(_) = busy.next() {
            tiles += 1;
        }
    }
    // One message may have turned out larger than was expected.
    assert!(in_flight <= 2 * (32 << 10), "{in_flight} bytes on their way");
    assert!(tiles > 20, "the other got {tiles} messages");
}

#[test]
fn a_slow_client_gets_the_newest_and_never_a_queue() {
    let running = start_at(options(), Size::new(320, 240));
    let mut slow = Client::connect(&running);
    let mut fast = Client::connect(&running);
    let end = Instant::now() + Duration::from_secs(5);
    let mut newest = 0;
    let mut behind = Vec::new();
    let (mut waiting, mut free_at) = (None, Instant::now());
    while Instant::now() < end {
        if let Received::Tiles(header) = fast.receive(Duration::from_millis(1)) {
            fast.acknowledge(header.sequence);
            newest = newest.max(header.picture);
        }
        if waiting.is_none() {
            let before = slow.bytes;
            if let Received::Tiles(header) = slow.receive(Duration::from_millis(1)) {
                // 50 kB/s.
                let takes = Duration::from_secs_f64((slow.bytes - before) as f64 / 50e3);
                free_at = free_at.max(Instant::now()) + takes;
                waiting = Some(header.sequence);
                behind.push(newest.saturating_sub(header.picture));
            }
        } else if Instant::now() >= free_at {
            slow.acknowledge(waiting.take().expect("one is being drawn"));
        }
    }
    // What comes is a few messages old and does not become older.
    let (early, late) = behind.split_at(behind.len() / 2);
    let worst = |part: &[u32]| part.iter().copied().max().unwrap_or(0);
    println!("behind by {behind:?}");
    assert!(late.len() >= 2, "{behind:?}");
    assert!(worst(late) <= worst(early).max(120), "{behind:?}");
}

#[test]
fn a_client_that_stalls_is_dropped_and_the_others_stay() {
    let stalled = Duration::from_secs(3);
    let running = start(Options { stalled, ..options() });
    let mut silent = Client::connect(&running);
    let mut other = Client::connect(&running);
    let begin = Instant::now();
    let ended = loop {
        if let Received::Closed(_) = silent.receive(Duration::from_millis(5)) {
            break begin.elapsed();
        }
        other.next();
        assert!(begin.elapsed() < Duration::from_secs(30), "still there");
    };
    assert!(ended >= stalled / 2, "{ended:?}");
    other.state("alone", |state| state["clients"] == 1);
}

#[test]
fn a_page_that_was_cut_off_has_its_helm_back() {
    let running = start(options());
    // It is there, and says nothing: as if its network had broken.
    let mut ghost = Client::connect(&running);
    let mut other = Client::connect(&running);
    let ghosts = ghost.number;
    other.state("the first drives", |state| state["driver"] == ghosts);
    let mut stranger = Client::resume(&running, &"0".repeat(64));
    stranger.state("a wrong token gives nothing", |state| {
        state["driver"] == ghosts && state["clients"] == 3
    });
    let mut back = Client::resume(&running, &ghost.token);
    let heir = back.number;
    assert!(heir != ghosts && back.token != ghost.token);
    back.state("it drives", |state| state["driver"] == heir && state["clients"] == 3);
    other.state("it drives", |state| state["driver"] == heir);
    ghost.draws = false;
    let begin = Instant::now();
    while !matches!(ghost.receive(Duration::from_millis(50)), Received::Closed(_)) {
        assert!(begin.elapsed() < Duration::from_secs(10), "the ghost stays");
    }
    // The token was good for once, and who watched still watches.
    let mut again = Client::resume(&running, &ghost.token);
    again.state("it watches", |state| state["driver"] == heir);
    let mut watcher = Client::resume(&running, &other.token);
    watcher.state("it watches", |state| state["driver"] == heir && state["clients"] == 4);
}
