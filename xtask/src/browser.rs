//! The report in a real browser: no error on its console, every scene to be seen, and a video that plays.
//!
//! Chromium is asked through the DevTools protocol, over its standard input and output: messages are JSON, each ended by a zero
//! byte (`--remote-debugging-pipe`, <https://chromedevtools.github.io/devtools-protocol/>).

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use crate::command::Stopped;

/// A cold start on a busy machine takes ten seconds; longer than this is a hang.
const LIMIT: Duration = Duration::from_secs(120);

/// Runs in the page, and answers with what the page shows.
const LOOK: &str = include_str!("look_at_report.js");

/// Open `report` with the browser `program` and look at it. Returns what was seen.
pub(crate) fn opens(program: &str, report: &Path, scenes: &[&str]) -> Result<String> {
    let profile = report.with_file_name("browser-profile");
    let mut page = Page::open(program, report, &profile)?;
    let seen = page.evaluate(LOOK)?;
    // Whatever the console says late has been said when this is answered.
    page.evaluate("0")?;
    ensure!(page.complaints.is_empty(), "the page complains: {}", page.complaints.join("; "));
    ensure!(
        seen["scenes"] == json!(scenes),
        "wanted the scenes {scenes:?}, got {}",
        seen["scenes"]
    );
    for what in ["hidden", "broken"] {
        ensure!(seen[what] == json!([]), "{what} parts of the page: {}", seen[what]);
    }
    let (width, secs) = (seen["video_width"].as_f64(), seen["video_secs"].as_f64());
    ensure!(width > Some(0.0) && secs > Some(0.0), "the video does not play: {seen}");
    Ok(format!(
        "{} scenes, {} pictures, a video {} pixels wide",
        scenes.len(),
        seen["pictures"],
        seen["video_width"]
    ))
}

/// A page in a browser of its own, which ends with it.
struct Page {
    _browser: Stopped,
    to: ChildStdin,
    from: Receiver<Value>,
    session: Option<String>,
    calls: u64,
    /// Errors on the page's console, and exceptions that nobody caught.
    complaints: Vec<String>,
}

impl Page {
    fn open(program: &str, file: &Path, profile: &Path) -> Result<Page> {
        let file = file.canonicalize().with_context(|| format!("no {}", file.display()))?;
        // The browser reads from file descriptor 3 and writes to 4.
        let mut browser = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null", "sh", program])
            .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot start {program}"))?;
        let to = browser.stdin.take().context("no standard input")?;
        let stdout = browser.stdout.take().context("no standard output")?;
        let (send, from) = channel();
        thread::spawn(move || {
            for message in BufReader::new(stdout).split(0).map_while(Result::ok) {
                let Ok(message) = serde_json::from_slice(&message) else { return };
                if send.send(message).is_err() {
                    return;
                }
            }
        });
        let _browser = Stopped(browser);
        let mut page = Page { _browser, to, from, session: None, calls: 0, complaints: Vec::new() };
        let target = page.call("Target.createTarget", json!({ "url": "about:blank" }))?;
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        let attached = page.call("Target.attachToTarget", target)?;
        page.session = attached["sessionId"].as_str().map(String::from);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            page.call(domain, json!({}))?;
        }
        page.call("Page.navigate", json!({ "url": format!("file://{}", file.display()) }))?;
        page.wait_for("Page.loadEventFired")?;
        Ok(page)
    }

    /// The value of an expression in the page, or of the promise that it is.
    fn evaluate(&mut self, expression: &str) -> Result<Value> {
        let wanted =
            json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut answer = self.call("Runtime.evaluate", wanted)?;
        if let Some(exception) = answer.get("exceptionDetails") {
            bail!("looking at the page failed: {exception}");
        }
        Ok(answer["result"]["value"].take())
    }

    fn call(&mut self, method: &str, params: Value) -> Result<Value> {
        self.calls += 1;
        let mut message = json!({ "id": self.calls, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.to.write_all(message.to_string().as_bytes())?;
        self.to.write_all(&[0])?;
        let id = json!(self.calls);
        let mut answer = self.receive(method, |message| message["id"] == id)?;
        if let Some(error) = answer.get("error") {
            bail!("{method}: {error}");
        }
        Ok(answer["result"].take())
    }

    fn wait_for(&mut self, event: &str) -> Result<()> {
        self.receive(event, |message| message["method"] == event).map(drop)
    }

    /// The first message that is wanted; complaints on the way are remembered.
    fn receive(&mut self, what: &str, is_wanted: impl Fn(&Value) -> bool) -> Result<Value> {
        let start = Instant::now();
        loop {
            let left = LIMIT.saturating_sub(start.elapsed());
            let message = self.from.recv_timeout(left);
            let message = message.with_context(|| format!("the browser does not answer {what}"))?;
            self.complaints.extend(complaint(&message));
            if is_wanted(&message) {
                return Ok(message);
            }
        }
    }
}

/// What an event says if it is an error of the page.
fn complaint(message: &Value) -> Option<String> {
    let params = &message["params"];
    let is_error = match message["method"].as_str()? {
        "Runtime.exceptionThrown" => true,
        "Runtime.consoleAPICalled" => params["type"] == "error",
        "Log.entryAdded" => params["entry"]["level"] == "error",
        _ => false,
    };
    is_error.then(|| params.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_that_complain_or_hide_something_are_refused() {
        let Some(program) = crate::missing::browser() else {
            assert!(std::env::var_os("CI").is_none(), "no browser to test the test of the report");
            eprintln!("SKIPPED: there is no browser to open pages with");
            return;
        };
        let folder = std::env::temp_dir().join(format!("frameless-pages-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("writable");
        for (page, words) in [
            ("<script>console.error('alas')</script>", "alas"),
            ("<script>nobody.knows()</script>", "ReferenceError"),
            ("<img src='https://example.invalid/a.png'>", "example.invalid"),
            ("<div data-scene=many></div>", "wanted the scenes"),
            (
                "<div data-scene=sphere>without a chart</div><video></video>",
                "looking at the page failed",
            ),
        ] {
            let file = folder.join("page.html");
            std::fs::write(&file, format!("<!doctype html><h1>page</h1>{page}")).expect("writable");
            let complaint = opens(program, &file, &["sphere"]).expect_err(page).to_string();
            assert!(complaint.contains(words), "{page}: {complaint}");
        }
        // The browser's children write to its profile until they have noticed that it has ended.
        let removed = (0..50).any(|_| {
            thread::sleep(Duration::from_millis(100));
            std::fs::remove_dir_all(&folder).is_ok()
        });
        assert!(removed, "{} cannot be removed", folder.display());
    }
}
