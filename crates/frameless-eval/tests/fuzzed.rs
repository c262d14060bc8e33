//! Inputs by which the fuzzer has reached something new (`fuzz/README.md`): none may panic or take long.

#[path = "../../../fuzz/src/lib.rs"]
#[expect(unreachable_pub, reason = "it is a library, too")]
mod targets;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const LONGEST: Duration = Duration::from_secs(5);

#[test]
fn what_fuzzing_has_found_is_still_refused_or_drawn() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    for (name, target) in targets::TARGETS {
        let folder = corpus.join(name);
        let entries =
            folder.read_dir().unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        assert!(paths.len() >= 20, "{}: only {} inputs", folder.display(), paths.len());
        for path in paths {
            let data = std::fs::read(&path).unwrap();
            let begin = Instant::now();
            let outcome = std::panic::catch_unwind(|| target(&data));
            assert!(outcome.is_ok(), "{} panics", path.display());
            assert!(begin.elapsed() < LONGEST, "{} takes {:?}", path.display(), begin.elapsed());
        }
    }
}
