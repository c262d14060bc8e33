//! The help teaches.

use crate::run::frameless;

const SUBCOMMANDS: [&str; 6] = ["view", "compare", "render", "trace", "info", "scenes"];

#[test]
fn the_main_help_names_every_subcommand_and_the_exit_codes() {
    let help = frameless(&["--help"]).succeeded().out;
    for word in SUBCOMMANDS {
        assert!(help.contains(word), "{word}");
    }
    assert!(help.contains("Exit code"), "{help}");
    assert!(help.contains("no frames"), "{help}");
}

#[test]
fn every_subcommand_has_an_example_that_begins_as_one_would_type_it() {
    for subcommand in SUBCOMMANDS {
        let help = frameless(&[subcommand, "--help"]).succeeded().out;
        assert!(help.contains(&format!("\n  frameless {subcommand}")), "{help}");
        assert!(help.contains("Usage: frameless "), "{help}");
    }
}

#[test]
fn the_version_is_the_workspaces() {
    let version = frameless(&["--version"]).succeeded().out;
    assert_eq!(version, format!("frameless {}\n", env!("CARGO_PKG_VERSION")));
}
