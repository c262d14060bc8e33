//! The help teaches.

use crate::run::frameless;

const SUBCOMMANDS: [&str; 7] = ["view", "serve", "compare", "render", "trace", "info", "scenes"];

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

/// The program's default is written by hand into a help that is made before there is a window.
#[test]
fn the_views_help_names_its_defaults_and_every_choice() {
    let help = frameless(&["view", "--help"]).succeeded().out;
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let default = frameless::SamplerKind::default().name();
    assert!(help.contains(&format!("[default: {default}]")), "{help}");
    let default = frameless::ReconstructionKind::default().name();
    assert!(help.contains(&format!("[default: {default}]")), "{help}");
    let samplers = frameless::SamplerKind::ALL.map(|kind| kind.name());
    for choice in samplers.into_iter().chain(["hold", "filter", "reproject"]) {
        assert!(help.contains(&format!("{choice}: ")), "{choice}: {help}");
    }
}

#[test]
fn the_version_is_the_workspaces() {
    let version = frameless(&["--version"]).succeeded().out;
    assert_eq!(version, format!("frameless {}\n", env!("CARGO_PKG_VERSION")));
}
