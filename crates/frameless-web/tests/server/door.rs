//! Who is let in: the request matrix, the headers, and where the server listens.

use std::io::Write;
use std::net::TcpStream;
use std::time::Duration;

use frameless::Size;
use frameless_web::{Options, Server};

use crate::support::{Answer, Client, Received, options, start, start_at};

const METHODS: [&str; 9] =
    ["GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "BREW"];
const PATHS: [&str; 9] = [
    "/",
    "/stream",
    "/clients",
    "/picture.png",
    "/upload",
    "/main.js",
    "/recording.mp4",
    "/nothing",
    "/..%2f",
];

/// What makes a request unwelcome, as header lines; `{port}`, `{key}` and so on are filled in.
const FOREIGN: [(&str, &str); 30] = [
    ("no secret", "Host: localhost:{port}\r\nOrigin: {origin}\r\n"),
    ("an empty secret", "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: {cookie}=\r\n"),
    (
        "a wrong secret",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: {cookie}={wrong}\r\n",
    ),
    (
        "a truncated secret",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: {cookie}={short}\r\n",
    ),
    (
        "a lengthened secret",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: {cookie}={key}0\r\n",
    ),
    (
        "another cookie's name",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: key={key}\r\n",
    ),
    (
        "another server's cookie",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nCookie: frameless-1={key}\r\n",
    ),
    (
        "the secret in another header",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nAuthorization: Bearer {key}\r\n",
    ),
    ("no host", "Cookie: {cookie}={key}\r\nOrigin: {origin}\r\n"),
    ("an empty host", "Host: \r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n"),
    (
        "a name that was made to lead here",
        "Host: evil.example:{port}\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "the same with its origin",
        "Host: evil.example:{port}\r\nOrigin: http://evil.example:{port}\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "a name that begins like ours",
        "Host: localhost.evil.example:{port}\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    (
        "a name that ends like ours",
        "Host: evil-localhost:{port}\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    (
        "an address that leads here",
        "Host: 127.0.0.2:{port}\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    (
        "an address in other digits",
        "Host: 2130706433:{port}\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    ("any address", "Host: 0.0.0.0:{port}\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n"),
    (
        "a user in the host",
        "Host: localhost@evil.example\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    (
        "two hosts",
        "Host: localhost:{port}\r\nHost: evil.example\r\nCookie: {cookie}={key}\r\nOrigin: {origin}\r\n",
    ),
    (
        "a foreign origin",
        "Host: localhost:{port}\r\nOrigin: http://evil.example\r\nCookie: {cookie}={key}\r\n",
    ),
    ("the null origin", "Host: localhost:{port}\r\nOrigin: null\r\nCookie: {cookie}={key}\r\n"),
    ("an empty origin", "Host: localhost:{port}\r\nOrigin: \r\nCookie: {cookie}={key}\r\n"),
    (
        "an origin that begins like ours",
        "Host: localhost:{port}\r\nOrigin: {origin}.evil.example\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "an origin that ends like ours",
        "Host: localhost:{port}\r\nOrigin: http://evil.localhost:{port}\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "another port's origin",
        "Host: localhost:{port}\r\nOrigin: http://localhost:1\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "an origin without port",
        "Host: localhost:{port}\r\nOrigin: http://localhost\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "the same origin by another name",
        "Host: localhost:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "another scheme's origin",
        "Host: localhost:{port}\r\nOrigin: https://localhost:{port}\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "a path behind the origin",
        "Host: localhost:{port}\r\nOrigin: {origin}/\r\nCookie: {cookie}={key}\r\n",
    ),
    (
        "two origins",
        "Host: localhost:{port}\r\nOrigin: {origin}\r\nOrigin: http://evil.example\r\nCookie: {cookie}={key}\r\n",
    ),
];

#[test]
fn nobody_foreign_is_let_in_by_any_method_to_any_path() {
    let running = start(options());
    let port = running.address.port().to_string();
    let wrong: String = running.key.chars().map(|c| if c == '0' { '1' } else { '0' }).collect();
    let fill = |text: &str| {
        text.replace("{port}", &port)
            .replace("{origin}", &running.origin())
            .replace("{cookie}", &format!("frameless-{port}"))
            .replace("{key}", &running.key)
            .replace("{wrong}", &wrong)
            .replace("{short}", &running.key[..63])
    };
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let mut cases = 0;
    for (what, lines) in FOREIGN {
        for (method, path) in METHODS.iter().flat_map(|m| PATHS.iter().map(move |path| (m, path))) {
            for more in ["Connection: close\r\n", upgrade] {
                let request = format!("{method} {path} HTTP/1.1\r\n{}{more}\r\n", fill(lines));
                let answer = running.ask(request.as_bytes());
                // 400: not even HTTP.
                assert!(
                    matches!(answer.status, 403 | 400),
                    "{what}, {method} {path}: {} {}",
                    answer.status,
                    answer.head
                );
                assert!(!answer.head.contains("set-cookie"), "{what}, {method} {path}");
                cases += 1;
            }
        }
    }
    assert!(cases >= 24, "{cases}");
    println!("{cases} requests, none let in");
}

#[test]
fn what_acts_needs_an_origin() {
    let running = start(options());
    let pass = running.pass();
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let ask = |request: String| running.ask(request.as_bytes()).status;
    assert_eq!(ask(format!("GET /stream HTTP/1.1\r\n{pass}{upgrade}\r\n")), 403);
    assert_eq!(ask(format!("POST /upload HTTP/1.1\r\n{pass}Content-Length: 0\r\n\r\n")), 403);
    let origin = running.origin();
    assert_eq!(
        ask(format!("GET /stream HTTP/1.1\r\n{pass}Origin: {origin}\r\n{upgrade}\r\n")),
        101
    );
}

#[test]
fn a_request_to_somewhere_else_is_refused() {
    let running = start(options());
    let pass = running.pass();
    let foreign = format!("GET http://evil.example/ HTTP/1.1\r\n{pass}Connection: close\r\n\r\n");
    assert_eq!(running.ask(foreign.as_bytes()).status, 403);
    let long = format!("GET /{} HTTP/1.1\r\n{pass}\r\n", "x".repeat(100_000));
    assert!(matches!(running.ask(long.as_bytes()).status, 0 | 400 | 414 | 431));
}

#[test]
fn the_key_becomes_a_cookie_once_and_only_at_the_front_door() {
    let running = start(options());
    let (port, key) = (running.address.port(), &running.key);
    let host = format!("Host: 127.0.0.1:{port}\r\nConnection: close\r\n");
    let ask = |path: &str| running.ask(format!("GET {path} HTTP/1.1\r\n{host}\r\n").as_bytes());
    let entered = ask(&format!("/?key={key}"));
    assert_eq!(entered.status, 200);
    let cookie = entered.header("set-cookie").unwrap_or_default().to_owned();
    for part in [&*format!("frameless-{port}={key}"), "httponly", "samesite=strict", "path=/"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    assert!(!String::from_utf8_lossy(&entered.body).contains(key.as_str()));
    for wrong in [
        format!("/?key={}", &key[1..]),
        format!("/?key={key}0"),
        format!("/?Key={key}"),
        format!("/?key=&key={key}"),
        format!("/picture.png?key={key}"),
        format!("/stream?key={key}"),
        "/?key".to_owned(),
    ] {
        assert_eq!(ask(&wrong).status, 403, "{wrong}");
    }
    let evil =
        format!("GET /?key={key} HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n");
    assert_eq!(running.ask(evil.as_bytes()).status, 403);
}

#[test]
fn every_answer_forbids_what_browsers_are_too_ready_to_do() {
    let running = start(options());
    let turned_away =
        running.ask(b"GET / HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n");
    for answer in [running.get("/"), running.get("/main.js"), running.get("/nothing"), turned_away]
    {
        let policy = answer.header("content-security-policy").unwrap_or_default();
        for rule in ["default-src 'self'", "frame-ancestors 'none'", "object-src 'none'"] {
            assert!(policy.contains(rule), "{policy}");
        }
        assert!(!policy.contains("unsafe") && !policy.contains("evil"), "{policy}");
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
        assert_eq!(answer.header("referrer-policy"), Some("no-referrer"));
        assert_eq!(answer.header("cache-control"), Some("no-store"));
        assert_eq!(answer.header("x-frame-options"), Some("deny"));
    }
    let framed =
        start(Options { allow_frame: Some("http://localhost:8888".to_owned()), ..options() });
    let page = framed.get("/");
    assert!(page.head.contains("frame-ancestors http://localhost:8888"), "{}", page.head);
    assert_eq!(page.header("x-frame-options"), None);
}

#[test]
fn a_taken_port_is_said_with_the_way_out() {
    let running = start(options());
    let again = Options { address: running.address, ..options() };
    let error = Server::bind(again).err().expect("it is taken").to_string();
    assert!(
        error.contains("--port 0") && error.contains(&running.address.port().to_string()),
        "{error}"
    );
}

#[test]
fn it_comes_back_with_the_same_key_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let kept = Options { key_file: Some(folder.path().join("key")), ..options() };
    let first = start(kept.clone());
    let (key, address) = (first.key.clone(), first.address);
    first.end().unwrap();
    let second = start(Options { address, ..kept });
    assert_eq!(second.key, key);
    Client::connect(&second);
}

/// Read from the system's table of sockets, not from what the server says of itself.
#[test]
#[cfg(target_os = "linux")]
fn it_listens_on_this_machines_own_address_only() {
    let running = start(options());
    let port = running.address.port();
    let mut listening = Vec::new();
    for table in ["/proc/net/tcp", "/proc/net/tcp6"] {
        let text = std::fs::read_to_string(table).unwrap_or_default();
        for line in text.lines().skip(1) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            // Local address, state; 0A is LISTEN.
            let (address, at) = fields[1].split_once(':').unwrap();
            if fields[3] == "0A" && u16::from_str_radix(at, 16) == Ok(port) {
                listening.push(address.to_owned());
            }
        }
    }
    // 127.0.0.1 as the kernel writes it, lowest byte first.
    assert_eq!(listening, ["0100007F"]);
    assert!(TcpStream::connect(running.address).is_ok());
}

#[test]
fn who_has_not_got_the_secret_keeps_nobody_out() {
    let running = start(options());
    let mut client = Client::connect(&running);
    // Connected, and known by a request.
    let pass = running.pass();
    let request = format!("GET /main.js HTTP/1.1\r\n{pass}\r\n");
    let mut known = TcpStream::connect(running.address).unwrap();
    let answers = |stream: &mut TcpStream| {
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream.write_all(request.as_bytes()).ok();
        Answer::read(stream, false).status
    };
    assert_eq!(answers(&mut known), 200);
    // Far more than there are places, and they say nothing, or half a request.
    let strangers: Vec<TcpStream> = (0..400)
        .map(|i| {
            let mut stranger = TcpStream::connect(running.address).unwrap();
            stranger.write_all(if i % 2 == 0 { b"GET / HT" } else { b"" }).ok();
            stranger
        })
        .collect();
    assert_eq!(running.get("/").status, 200, "a new one is let in");
    assert_eq!(answers(&mut known), 200, "who was known stays");
    Client::connect(&running);
    client.until("a status", |_, received| matches!(received, Received::Status(_)).then_some(()));
    drop(strangers);
}

#[test]
fn pictures_are_sent_two_at_a_time_and_the_others_are_told_when_to_ask_again() {
    // Large enough to be a while in the making.
    let running = start_at(options(), Size::new(1920, 1080));
    let mut client = Client::connect(&running);
    client.until("tiles", |_, received| matches!(received, Received::Tiles(_)).then_some(()));
    let answers: Vec<Answer> = std::thread::scope(|scope| {
        let asking: Vec<_> = (0..12).map(|_| scope.spawn(|| running.get("/picture.png"))).collect();
        asking.into_iter().map(|answer| answer.join().unwrap()).collect()
    });
    let (sent, refused): (Vec<&Answer>, Vec<_>) =
        answers.iter().partition(|answer| answer.status == 200);
    assert!(!sent.is_empty() && !refused.is_empty(), "{} sent", sent.len());
    for answer in sent {
        assert_eq!(answer.header("content-length"), Some(&*answer.body.len().to_string()));
        assert!(image::load_from_memory(&answer.body).is_ok());
    }
    for answer in refused {
        assert_eq!((answer.status, answer.header("retry-after")), (503, Some("1")));
    }
    assert_eq!(running.get("/picture.png").status, 200, "their turns have ended");
}
