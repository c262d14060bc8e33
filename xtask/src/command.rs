//! Running other programs: shown before they run, watched while they run, stopped when they take too long.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

/// How often a running program is looked at.
const POLL: Duration = Duration::from_millis(20);

/// Cargo itself, in the project's root, with `args` as one would type them.
pub(crate) fn cargo(args: &[&str]) -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(args).current_dir(crate::project_dir());
    cargo
}

/// Run to the end with its output on our own; an error if it fails.
pub(crate) fn run(mut command: Command) -> Result<()> {
    let shown = show(&command);
    eprintln!("$ {shown}");
    let status = command.status().with_context(|| format!("cannot start `{shown}`"))?;
    ensure!(status.success(), "`{shown}` ended with {status}");
    Ok(())
}

/// Run to the end, passing on line by line what is `worth_showing` and returning all of its output (standard output first).
/// The second value says whether it succeeded.
pub(crate) fn watch<W>(
    mut command: Command,
    worth_showing: impl Fn() -> W,
) -> Result<(String, bool)>
where
    W: FnMut(&str) -> bool + Send + 'static,
{
    let shown = show(&command);
    eprintln!("$ {shown}");
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{shown}`"))?;
    let (to_out, to_err) = (worth_showing(), worth_showing());
    let out = child.stdout.take();
    let out = out.map(|pipe| thread::spawn(|| pass_on(pipe, std::io::stdout(), to_out)));
    let err = child.stderr.take();
    let err = err.map(|pipe| thread::spawn(|| pass_on(pipe, std::io::stderr(), to_err)));
    let status = child.wait()?;
    let text = [out, err].into_iter().flatten().filter_map(|reader| reader.join().ok()).collect();
    Ok((text, status.success()))
}

fn pass_on(
    pipe: impl Read,
    mut to: impl Write,
    mut is_worth_showing: impl FnMut(&str) -> bool,
) -> String {
    let mut text = String::new();
    for line in BufReader::new(pipe).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line).into_owned() + "\n";
        if is_worth_showing(&line) {
            // Nobody reading any more must not stop the program whose output this is.
            let _ = to.write_all(line.as_bytes());
        }
        text += &line;
    }
    text
}

/// Run to the end and return what it printed; an error if that takes longer than `limit`.
pub(crate) fn output_within(command: &mut Command, limit: Duration) -> Result<Output> {
    let shown = show(command);
    eprintln!("$ {shown}");
    let child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{shown}`"))?;
    let mut child = Stopped(child);
    let out = child.0.stdout.take().map(|pipe| thread::spawn(|| read_all(pipe)));
    let err = child.0.stderr.take().map(|pipe| thread::spawn(|| read_all(pipe)));
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.0.try_wait()? {
            break status;
        }
        if start.elapsed() > limit {
            bail!("`{shown}` was still running after {} s", limit.as_secs());
        }
        thread::sleep(POLL);
    };
    let text = |reader: Option<thread::JoinHandle<Vec<u8>>>| {
        reader.and_then(|reader| reader.join().ok()).unwrap_or_default()
    };
    Ok(Output { status, stdout: text(out), stderr: text(err) })
}

fn read_all(mut pipe: impl Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    // What came before a broken pipe is still worth showing.
    let _ = pipe.read_to_end(&mut bytes);
    bytes
}

/// A program that does not outlive this value.
pub(crate) struct Stopped(pub(crate) Child);

impl Drop for Stopped {
    fn drop(&mut self) {
        // Both fail only if it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The command as one would type it.
fn show(command: &Command) -> String {
    let program = std::path::Path::new(command.get_program());
    let name = program.file_name().unwrap_or_default().to_string_lossy().into_owned();
    command.get_args().fold(name, |line, arg| line + " " + &arg.to_string_lossy())
}
