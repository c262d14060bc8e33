//! Nothing is traced while nobody looks.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use frameless::{Answer, Batch, Size, Tracer};
use frameless_session::{Stage, ViewChoice};
use frameless_web::Options;

use crate::support::{Client, PATIENCE, Received, options, start_with};

const SIZE: Size = Size { width: 64, height: 48 };

/// Everything is grey; it counts what it is asked for.
#[derive(Default)]
struct Counting {
    traced: Arc<AtomicU64>,
    answers: VecDeque<Answer>,
}

impl Tracer for Counting {
    fn submit(&mut self, batch: Batch) {
        self.traced.fetch_add(batch.requests.len() as u64, Ordering::Relaxed);
        let rgb = vec![[0.5; 3]; batch.requests.len()];
        self.answers.push_back(Answer::to(batch, rgb, Vec::new()));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop_front()
    }
}

impl Stage for Counting {
    type World = ();

    fn set_view(&mut self, _: ViewChoice) {}

    fn set_world(&mut self, (): ()) {}
}

#[test]
fn nothing_is_traced_while_nobody_looks_and_everything_is_there_again_at_once() {
    let (counting, soon) = (Counting::default(), Duration::from_millis(200));
    let traced = Arc::clone(&counting.traced);
    let running = start_with(Options { rests_after: soon, ..options() }, SIZE, counting, None);
    // Until the count stands still: nobody has looked yet.
    let rests = || {
        let begin = Instant::now();
        loop {
            let before = traced.load(Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(300));
            if traced.load(Ordering::Relaxed) == before {
                return before;
            }
            assert!(begin.elapsed() < PATIENCE, "the loop does not come to rest");
        }
    };
    let first = rests();
    let status = |client: &mut Client| {
        client.until("a status", |_, received| match received {
            Received::Status(status) => (status.unknown == 0.0).then_some(*status),
            _ => None,
        })
    };
    status(&mut Client::connect(&running));
    let second = rests();
    assert!(second > first, "it was traced while somebody looked");
    let begin = Instant::now();
    let mut client = Client::connect(&running);
    assert_eq!(status(&mut client).unknown, 0.0, "what was traced has been kept");
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
    drop(client);
    let third = rests();
    // A recording looks, too.
    let mut film = std::net::TcpStream::connect(running.address).unwrap();
    let request = format!("GET /recording.mp4 HTTP/1.1\r\n{}\r\n", running.pass());
    std::io::Write::write_all(&mut film, request.as_bytes()).unwrap();
    let begin = Instant::now();
    while traced.load(Ordering::Relaxed) == third {
        assert!(begin.elapsed() < PATIENCE, "nothing is traced for a recording");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(film);
    rests();
}
