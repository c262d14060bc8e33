//! The web page, as far as the command line goes. What is served is tested beside the server.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

use crate::run::{frameless, program};

/// A program that goes on until it is dropped.
struct Serving {
    program: Child,
    /// What it printed first.
    line: String,
}

impl Serving {
    fn start(arguments: &[&str]) -> Serving {
        let mut command = program(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = command.spawn().expect("the program starts");
        let mut line = String::new();
        let out = program.stdout.take().expect("it is piped");
        BufReader::new(out).read_line(&mut line).expect("text");
        Serving { program, line }
    }

    /// Host with port, and key.
    fn address(&self) -> (&str, &str) {
        let address = self.line.trim_end().strip_prefix("http://").expect("an address");
        address.split_once("/?key=").expect("with a key")
    }

    /// Ends it, and returns its standard error.
    fn end(mut self) -> String {
        self.program.kill().expect("it runs");
        let mut text = String::new();
        let err = self.program.stderr.take();
        err.expect("it is piped").read_to_string(&mut text).expect("text");
        text
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        // It may have ended already.
        self.program.kill().ok();
        self.program.wait().ok();
    }
}

fn get(host: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(host).expect("it listens");
    let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).expect("it is connected");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("text");
    answer
}

#[test]
fn one_address_is_printed_and_it_opens_the_page() {
    let serving = Serving::start(&["serve", "--port", "0", "--size", "64x48"]);
    let (host, key) = serving.address();
    let key = key.to_owned();
    assert_eq!(key.len(), 64);
    assert!(get(host, &format!("/?key={key}")).contains("200 OK"));
    for _ in 0..3 {
        assert!(get(host, "/").contains("403 Forbidden"));
    }
    let said = serving.end();
    assert_eq!(said.lines().count(), 1, "a line in ten seconds: {said}");
    assert!(said.contains("turned away") && !said.contains(&key), "{said}");
}

#[test]
#[cfg(target_os = "linux")]
fn without_a_display_the_view_is_served_and_says_why() {
    for arguments in [&[][..], &["view", "sphere", "--size", "64x48"]] {
        let serving = Serving::start(arguments);
        let (host, key) = serving.address();
        assert!(get(host, &format!("/?key={key}")).contains("200 OK"));
        let said = serving.end();
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(said.contains("DISPLAY") && said.contains("web page"), "{said}");
    }
}

/// An environment that cannot show a window is nobody's bad input.
#[test]
#[cfg(target_os = "linux")]
fn a_screenshot_of_a_window_needs_a_display() {
    let folder = tempfile::tempdir().unwrap();
    let shot = folder.path().join("shot.png");
    frameless(&["view", "--screenshot", shot.to_str().unwrap()]).refused(1, "no display");
}

#[test]
fn what_is_not_safe_or_cannot_be_is_refused() {
    frameless(&["serve", "--bind", "0.0.0.0", "--port", "0"]).refused(2, "--insecure");
    let anywhere = ["serve", "--bind", "0.0.0.0", "--port", "0", "--insecure"];
    frameless(&anywhere).refused(2, "--host");
    frameless(&["serve", "--tls-cert", "a.pem"]).refused(2, "--tls-key");
    let no_files = ["serve", "--port", "0", "--tls-cert", "a.pem", "--tls-key", "b.pem"];
    frameless(&no_files).refused(2, "a.pem");
    frameless(&["serve", "--size", "16384x1000"]).refused(2, "3840x2160");
    frameless(&["serve", "no-such-file.glb"]).refused(2, "no-such-file.glb");
    let serving = Serving::start(&["serve", "--port", "0", "--size", "64x48"]);
    let (_, port) = serving.address().0.rsplit_once(':').unwrap();
    frameless(&["serve", "--port", port]).refused(2, "--port 0");
}
