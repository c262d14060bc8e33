//! What a client's canvas comes to show.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use frameless::Size;
use frameless_web::Options;

use crate::support::{Answer, Client, PATIENCE, Received, options, start, start_at};

#[test]
fn at_rest_the_canvas_is_the_servers_picture_and_then_nothing_is_sent() {
    // Not a multiple of the tile's side.
    let running = start_at(options(), Size::new(170, 101));
    let mut client = Client::connect(&running);
    client.say(r#"{"type": "play", "on": false}"#);
    // Antialiasing goes on for a while; each of its pictures is checked.
    for _ in 0..3 {
        client.exact();
    }
    // Without it the picture is the same for ever once every pixel has been traced.
    client.say(r#"{"type": "settings", "reconstruction": "hold"}"#);
    let paused = Instant::now();
    let last = loop {
        let status = client.exact();
        if f64::from(status.max_age_secs) + 0.5 < paused.elapsed().as_secs_f64() {
            break status;
        }
    };
    let answer = running.get("/picture.png");
    assert_eq!(answer.status, 200);
    let server = image::load_from_memory(&answer.body).expect("a picture").to_rgb8();
    assert_eq!((server.width(), server.height()), (170, 101));
    assert_eq!(answer.header("x-picture"), Some(&*last.picture.to_string()));
    assert_eq!(client.canvas, server);

    let (begin, before) = (Instant::now(), client.bytes);
    let mut beats = 0;
    while begin.elapsed() < Duration::from_secs(4) {
        match client.receive(Duration::from_millis(200)) {
            Received::Tiles(tiles) => panic!("something has changed: {tiles:?}"),
            Received::Status(status) => beats += u32::from(status.exact),
            _ => {}
        }
    }
    let per_sec = (client.bytes - before) as f64 / begin.elapsed().as_secs_f64();
    assert!(per_sec <= 200.0, "{per_sec} bytes/s at rest");
    assert!(beats >= 3, "{beats} heartbeats in 4 s");
}

#[test]
fn what_moves_is_sent_first_and_not_all_of_it() {
    let running = start_at(options(), Size::new(256, 192));
    let mut client = Client::connect(&running);
    let (mut all, mut few) = (0, 0);
    let end = Instant::now() + Duration::from_secs(4);
    while Instant::now() < end {
        if let Received::Tiles(header) = client.next() {
            all += usize::from(header.tiles.len() == 192);
            few += usize::from(header.tiles.len() < 192);
        }
    }
    assert!(few > 10, "{few} messages of some tiles, {all} of all");
    assert!(few > 3 * all, "{few} messages of some tiles, {all} of all");
}

#[test]
fn an_input_comes_back_with_the_first_picture_that_shows_it() {
    let running = start(options());
    let mut client = Client::connect(&running);
    client.say(r#"{"type": "play", "on": false}"#);
    client.exact();
    client.say(r#"{"type": "camera", "input": 41, "orbit": [0.2, 0.0]}"#);
    let before = client.canvas.clone();
    client.until("the input", |client, received| match received {
        Received::Tiles(header) if header.input == 41 => {
            assert_ne!(client.canvas, before, "the picture has moved");
            Some(())
        }
        Received::Tiles(header) => {
            assert_eq!(header.input, 0);
            None
        }
        _ => None,
    });
}

#[test]
fn another_size_is_another_generation() {
    let running = start(options());
    let mut client = Client::connect(&running);
    client.exact_size((160, 120));
    client.say(r#"{"type": "settings", "picture": "window"}"#);
    client.say(r#"{"type": "size", "place": [77, 45]}"#);
    client.exact_size((77, 45));
    client.say(r#"{"type": "settings", "picture": "64x300"}"#);
    client.exact_size((64, 300));
}

impl Client {
    fn exact_size(&mut self, size: (u32, u32)) {
        self.until("the size", |client, received| {
            let tiles = matches!(received, Received::Tiles(_));
            (tiles && client.canvas.dimensions() == size).then_some(())
        });
    }
}

#[test]
fn every_setting_can_be_set_and_is_told() {
    let running = start(options());
    let mut client = Client::connect(&running);
    for (say, key, want) in [
        (r#"{"type": "settings", "sampler": "change", "w_d": 0.5}"#, "w_d", "0.5"),
        (r#"{"type": "settings", "reconstruction": "hold"}"#, "reconstruction", "\"hold\""),
        (r#"{"type": "settings", "samples_per_sec": 5000}"#, "samples_per_sec", "5000.0"),
        (r#"{"type": "settings", "samples_per_sec": null}"#, "samples_per_sec", "null"),
        (r#"{"type": "settings", "exposure_stops": -1}"#, "exposure_stops", "-1.0"),
        (r#"{"type": "settings", "tone_map": "aces"}"#, "tone_map", "\"aces\""),
    ] {
        client.say(say);
        let want: serde_json::Value = serde_json::from_str(want).unwrap();
        client.state(say, |state| state["settings"][key] == want);
    }
    client.say(r#"{"type": "settings", "overlay": "source-age"}"#);
    let legend = client.until("a legend", |_, received| match received {
        Received::Json(json) if json["type"] == "legend" && !json["title"].is_null() => {
            Some(json.clone())
        }
        _ => None,
    });
    assert!(legend["ticks"].as_array().is_some_and(|ticks| ticks.len() > 2), "{legend}");
    client.say(r#"{"type": "settings", "sampler": "best"}"#);
    client.notice("best");
}

#[test]
fn scenes_are_opened_by_name_and_by_upload_and_nothing_else() {
    let running = start(options());
    let mut client = Client::connect(&running);
    client.json("scene");
    client.say(r#"{"type": "open", "name": "orbit"}"#);
    assert_eq!(client.json("scene")["name"], "orbit");
    client.say(r#"{"type": "open", "name": "/etc/passwd"}"#);
    client.notice("no built-in scene");

    let own = running.origin();
    let token = client.token.clone();
    let upload = |token: &str, origin: &str, body: &[u8]| {
        let (pass, length) = (running.pass(), body.len());
        let head = format!(
            "POST /upload?name=my%20scene.glb HTTP/1.1\r\n{pass}Origin: {origin}\r\nX-Client: {token}\r\n\
             Content-Length: {length}\r\n\r\n"
        );
        running.ask(&[head.as_bytes(), body].concat())
    };
    let bad = upload(&token, &own, b"not a scene");
    let text = String::from_utf8_lossy(&bad.body).into_owned();
    assert_eq!(bad.status, 422, "{text}");
    assert!(text.contains("my scene.glb"), "{text}");
    let outside = br#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "../../secret.bin"}]}"#;
    let relative = upload(&token, &own, outside);
    assert_eq!(relative.status, 422, "{}", String::from_utf8_lossy(&relative.body));
    let good = br#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{}]}"#;
    let good = upload(&token, &own, good);
    assert_eq!(good.status, 200, "{}", String::from_utf8_lossy(&good.body));
    assert_eq!(client.json("scene")["name"], "my scene.glb");
    assert_eq!(upload(&token, "http://localhost:1", b"{}").status, 403);
}

#[test]
fn an_upload_is_refused_before_it_is_read() {
    let running = start(options());
    let driver = Client::connect(&running);
    let watcher = Client::connect(&running);
    let (pass, origin) = (running.pass(), running.origin());
    // A body is announced, and never sent: whoever waited for it would not answer.
    let refused = |query: &str, lines: &str| {
        let begin = Instant::now();
        let answer = running.ask(
            format!(
                "POST /upload{query} HTTP/1.1\r\n{pass}Origin: {origin}\r\n{lines}Content-Length: 900\r\n\r\n"
            )
            .as_bytes(),
        );
        assert!(begin.elapsed() < Duration::from_secs(5), "{lines}: {:?}", begin.elapsed());
        (answer.status, String::from_utf8_lossy(&answer.body).into_owned())
    };
    let own = |client: &Client| format!("X-Client: {}\r\n", client.token);
    assert_eq!(refused("", "").0, 403, "no token");
    assert_eq!(refused("", &format!("X-Client: {}\r\n", driver.number)).0, 403, "a number");
    let short = format!("X-Client: {}\r\n", &driver.token[1..]);
    assert_eq!(refused("", &short).0, 403, "a part of a token");
    let (status, text) = refused("", &own(&watcher));
    assert!(status == 403 && text.contains("drives"), "{status} {text}");
    assert_eq!(refused("?client=1", &own(&driver)).0, 400, "who it is is not said in the address");
}

#[test]
fn who_has_lost_the_helm_keeps_nobody_from_uploading() {
    let running = start(options());
    let slow = Client::connect(&running);
    let mut next = Client::connect(&running);
    let (pass, origin) = (running.pass(), running.origin());
    let head = |client: &Client, bytes: usize| {
        let token = &client.token;
        format!(
            "POST /upload HTTP/1.1\r\n{pass}Origin: {origin}\r\nX-Client: {token}\r\nContent-Length: {bytes}\r\n\r\n"
        )
    };
    let mut stream = TcpStream::connect(running.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    stream.write_all(head(&slow, 100_000).as_bytes()).unwrap();
    stream.write_all(b"{").unwrap();
    std::thread::sleep(Duration::from_millis(700));
    next.say(r#"{"type": "drive", "on": true}"#);
    let number = next.number;
    next.state("the helm", |state| state["driver"] == number);
    assert_eq!(running.ask(format!("{}{{}}", head(&next, 2)).as_bytes()).status, 503, "waits");
    stream.write_all(b"}").unwrap();
    assert_eq!(Answer::read(&mut stream, false).status, 403);
    let answer = running.ask(format!("{}{{}}", head(&next, 2)).as_bytes());
    assert_eq!(answer.status, 422, "taken, read, and no scene");
}

#[test]
fn uploads_have_a_limit() {
    let running = start(Options { upload_bytes: 1000, ..options() });
    let client = Client::connect(&running);
    let (pass, origin, token) = (running.pass(), running.origin(), &client.token);
    let head = format!("POST /upload HTTP/1.1\r\n{pass}Origin: {origin}\r\nX-Client: {token}\r\n");
    let announced = running.ask(format!("{head}Content-Length: 1001\r\n\r\n").as_bytes());
    assert_eq!(announced.status, 413);
    // Without a length: in pieces.
    let pieces = format!(
        "{head}Transfer-Encoding: chunked\r\n\r\n{}0\r\n\r\n",
        format!("190\r\n{}\r\n", "x".repeat(400)).repeat(3)
    );
    assert_eq!(running.ask(pieces.as_bytes()).status, 413);
}

#[test]
fn a_recording_comes_while_it_is_made() {
    let running = start(options());
    let mut client = Client::connect(&running);
    client.until("tiles", |_, received| matches!(received, Received::Tiles(_)).then_some(()));
    let (address, pass) = (running.address, running.pass());
    let mut film = std::net::TcpStream::connect(address).unwrap();
    film.write_all(format!("GET /recording.mp4 HTTP/1.1\r\n{pass}\r\n").as_bytes()).unwrap();
    let mut bytes = Vec::new();
    let begin = Instant::now();
    // The head and two fragments at least.
    while bytes.windows(4).filter(|name| name == b"moof").count() < 2 {
        assert!(begin.elapsed() < PATIENCE, "{} bytes came", bytes.len());
        let mut piece = [0; 4096];
        let count = film.read(&mut piece).unwrap();
        bytes.extend_from_slice(&piece[..count]);
        client.receive(Duration::from_millis(1));
    }
    let head = String::from_utf8_lossy(&bytes[..300]).to_ascii_lowercase();
    assert!(head.starts_with("http/1.1 200") && head.contains("video/mp4"), "{head}");
    assert!(bytes.windows(4).any(|name| name == b"ftyp"));
}

#[test]
fn a_recording_goes_on_where_there_is_no_client() {
    let running = start(Options { rests_after: Duration::from_millis(50), ..options() });
    std::thread::sleep(Duration::from_millis(500));
    let mut film = std::net::TcpStream::connect(running.address).unwrap();
    film.set_read_timeout(Some(PATIENCE)).unwrap();
    let pass = running.pass();
    film.write_all(format!("GET /recording.mp4 HTTP/1.1\r\n{pass}\r\n").as_bytes()).unwrap();
    // Pictures are made while it is: without it there was none, and nobody else has asked for any.
    let begin = Instant::now();
    let number = || {
        let answer = running.get("/picture.png");
        answer.header("x-picture").and_then(|number| number.parse::<u32>().ok()).unwrap_or(0)
    };
    while number() < 10 {
        assert!(begin.elapsed() < PATIENCE, "{} pictures", number());
        std::thread::sleep(Duration::from_millis(20));
    }
}
