//! Scripted events: what they do to a scene, what is measured about them, and which are refused.

use std::path::Path;

use frameless_eval::{Algorithm, Cell, Experiment, Ideals, RunResult, Subject, rmse, run};

/// 64×48, 1.5 s of one scene; `events` is TOML that follows its table.
fn experiment(scene: &str, events: &str) -> Result<Experiment, String> {
    let text = format!(
        "title = \"events\"\nsamples_per_sec = [1]\nwidth = 64\nheight = 48\nduration_secs = 1.5\n\
         [metrics]\nssim_every = 0\nflip_every = 0\n[output]\nvideo = false\n\
         [[scenes]]\nscene = \"{scene}\"\n{events}"
    );
    Experiment::parse(&text, Path::new(""))
}

fn event(at_secs: f64, name: &str, action: &str) -> String {
    format!("[[scenes.events]]\nat_secs = {at_secs}\nname = \"{name}\"\n{action}\n")
}

fn subject(scene: &str, events: &str) -> Subject {
    let experiment = experiment(scene, events).expect("valid");
    Subject::load(&experiment.scenes[0]).expect("built in")
}

fn picture(subject: &Subject, secs: f64) -> Vec<[f32; 3]> {
    subject.ideal(secs, frameless::Size::new(64, 48))
}

fn results(scene: &str, events: &str, algorithms: &[&str], samples_per_sec: f64) -> Vec<RunResult> {
    let experiment = experiment(scene, events).expect("valid");
    let subject = Subject::load(&experiment.scenes[0]).expect("built in");
    let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
    let run_one = |name: &&str| {
        let algorithm = Algorithm::from_name(name).expect(name);
        let cell = Cell { scene: scene.into(), algorithm, samples_per_sec, seed: 1 };
        run(&cell, &experiment, &subject, &ideals, &mut |_, _| true).expect("finite colours")
    };
    algorithms.iter().map(run_one).collect()
}

/// So many samples trace the 64×48 picture once per millisecond, in well less than a refresh.
const FAST: f64 = 64.0 * 48.0 * 1000.0;
const SLOW: f64 = 20_000.0;
const REFRESH_SECS: f64 = 1.0 / 60.0;

#[test]
fn nothing_differs_before_the_event_and_something_does_from_then_on() {
    let plain = subject("settle", "");
    for action in [
        "light = { index = 0, factor = 0.0 }",
        "move = { node = \"sphere\", by = [0, 0.5, 0] }",
        "move = { node = \"sphere\", to = [0, 2, 3] }",
        "move = { light = 0, by = [3, 0, 0] }",
        "cut = { eye = [2, 2, 8], target = [0, 1, 0] }",
    ] {
        let scripted = subject("settle", &event(1.0, "it", action));
        assert_eq!(picture(&plain, 0.999), picture(&scripted, 0.999), "{action}");
        assert!(rmse(&picture(&plain, 1.0), &picture(&scripted, 1.0)) > 0.01, "{action}");
        assert!(scripted.is_still(0.9, 0.999), "{action}");
        assert!(!scripted.is_still(0.999, 1.0), "{action}");
        assert!(scripted.is_still(1.0, 1.4), "{action}");
    }
}

#[test]
fn an_event_at_a_refresh_is_seen_at_it() {
    // 1/60 s and 1.1 s are no whole numbers of nanoseconds, or no exact sums of them.
    for k in [0usize, 5, 65] {
        let secs = (k + 1) as f64 / 60.0;
        let scripted =
            subject("settle", &event(secs, "off", "light = { index = 0, factor = 0.0 }"));
        let at = |k: usize| frameless_eval::refresh_time(k, 60).secs();
        let lit = picture(&subject("settle", ""), at(k));
        assert!(rmse(&lit, &picture(&scripted, at(k))) > 0.01, "refresh {k}");
    }
}

#[test]
fn what_takes_a_while_is_half_way_in_the_middle() {
    let slowly = "move = { node = \"sphere\", by = [1, 0, 0], over_secs = 0.4 }";
    let moving = subject("settle", &event(1.0, "it", slowly));
    let there = |x: f64, secs: f64| {
        let at_once = format!("move = {{ node = \"sphere\", by = [{x}, 0, 0] }}");
        picture(&subject("settle", &event(0.9, "it", &at_once)), secs)
    };
    assert!(rmse(&picture(&moving, 1.2), &there(0.5, 1.2)) < 1e-3);
    assert_eq!(picture(&moving, 1.4), there(1.0, 1.4));
    assert!(!moving.is_still(1.1, 1.3) && moving.is_still(1.4, 1.49));
}

#[test]
fn a_cut_shows_what_a_camera_there_shows() {
    let camera = |eye: &str| {
        format!("camera = {{ keyframes = [{{ time = 0, eye = {eye}, target = [0, 1, 0] }}] }}\n")
    };
    let cut = event(0.5, "cut", "cut = { eye = [2, 2, 8], target = [0, 1, 0] }");
    let cut = subject("sphere", &(camera("[0, 3, 9]") + &cut));
    assert_eq!(picture(&cut, 0.49), picture(&subject("sphere", &camera("[0, 3, 9]")), 0.49));
    assert_eq!(picture(&cut, 0.7), picture(&subject("sphere", &camera("[2, 2, 8]")), 0.7));
}

#[test]
fn after_a_stop_nothing_moves_but_the_script_goes_on() {
    let events = event(0.5, "stop", "stop = true")
        + &event(1.0, "off", "light = { index = 0, factor = 0.0 }");
    let subject = subject("mix", &events);
    assert!(!subject.is_still(0.4, 0.5) && subject.is_still(0.5, 0.99));
    assert_eq!(picture(&subject, 0.5), picture(&subject, 0.99));
    assert!(!subject.is_still(0.99, 1.0) && subject.is_still(1.0, 1.4));
}

#[test]
fn fast_frames_follow_at_the_next_refresh_and_slow_ones_later() {
    let events = event(1.0, "light jumps", "");
    let fast = &results("sudden", &events, &["framed"], FAST)[0].events[0];
    // The refresh at the very time of the event shows what was traced before.
    assert!((fast.latency_secs.expect("followed") - REFRESH_SECS).abs() < 1e-6, "{fast:?}");
    assert!(fast.changed_pixels > 300, "{fast:?}");
    let slow = results("sudden", &events, &["framed", "random"], SLOW);
    for run in &slow {
        let latency = run.events[0].latency_secs.expect("followed");
        // A picture takes 0.154 s.
        assert!(latency > 0.1 && latency < 0.5, "{}: {latency}", run.algorithm);
    }
}

#[test]
fn what_changes_nothing_is_followed_by_nobody() {
    let events = event(1.0, "it", "light = { index = 0, factor = 1.0 }");
    let result = &results("settle", &events, &["framed"], FAST)[0].events[0];
    assert_eq!((result.changed_pixels, result.latency_secs), (0, None));
}

#[test]
fn a_stop_is_followed_when_the_last_change_is_there() {
    let result = &results("settle", &event(0.8, "stops", ""), &["framed"], FAST)[0].events[0];
    assert!(result.changed_pixels > 10, "{result:?}");
    let latency = result.latency_secs.expect("followed");
    assert!(latency <= REFRESH_SECS + 1e-6, "{latency}");
}

#[test]
fn at_rest_progressive_pictures_come_nearer_to_the_antialiased_one() {
    let runs = results("settle", "", &["progressive", "framed"], 0.1 * FAST);
    let [progressive, framed] = [0, 1].map(|i: usize| runs[i].at_rest.as_ref().expect("it rests"));
    assert!((progressive.since_secs - 0.8).abs() < 0.02, "{}", progressive.since_secs);
    assert_eq!(progressive.rmse.len(), 90 - 47);
    let last = |rest: &frameless_eval::AtRest| *rest.rmse.last().expect("several");
    // After 0.7 s every pixel has 70 samples; a single sample keeps the error of its aliasing.
    assert!(last(progressive) < 0.2 * last(framed), "{} {}", last(progressive), last(framed));
    assert!(last(progressive) < 0.5 * progressive.rmse[1]);
}

#[test]
fn where_something_moves_to_the_end_there_is_no_rest() {
    assert!(results("sphere", "", &["framed"], SLOW)[0].at_rest.is_none());
}

#[test]
fn ages_are_those_of_what_is_shown() {
    let runs = results("sphere", "", &["framed", "framed-single", "permutation"], SLOW);
    let picture_secs = 64.0 * 48.0 / SLOW;
    for (run, mean) in runs.iter().zip([1.5, 1.5, 0.5]) {
        // Double-buffered: begun one to two pictures ago. Single-buffered: rows are of this frame or the last one, and were
        // begun up to two pictures ago. Permutation: every pixel once per picture, at its own time, in another order every
        // time, so somewhat older than half a picture.
        let got = run.age_secs.mean.expect("measured") / picture_secs;
        assert!((mean - 0.6..=mean + 0.2).contains(&got), "{}: {got}", run.algorithm);
        assert!(run.oldest_secs < 2.1 * picture_secs, "{}: {}", run.algorithm, run.oldest_secs);
    }
}

#[test]
fn bad_events_are_refused() {
    for (text, part) in [
        (event(0.0, "it", ""), "after 0"),
        (event(1.5, "it", ""), "before the end"),
        (event(1.0, "it", "stop = true\nlight = { index = 0, factor = 0.0 }"), "at most one"),
        (event(1.0, "it", "move = { node = \"a\" }"), "either by or to"),
        (event(1.0, "it", "move = { by = [0, 0, 0] }"), "either node or light"),
        (
            event(1.0, "it", "move = { node = 0, by = [0, 0, 0], over_secs = 0.6 }"),
            "ends after the run",
        ),
        (event(1.0, "it", "move = { node = 0, by = [0, 0, nan] }"), "finite"),
        (event(1.0, "it", "light = { index = 0, factor = -1.0 }"), "at least 0"),
        (event(1.0, "it", "cut = { eye = [0, 0, 0], target = [0, 0, 0] }"), "away from the eye"),
        (event(1.0, "it", "jump = true"), "jump"),
        (event(1.0, "it", "") + &event(1.2, "it", ""), "two are called"),
        (event(1.0, "a", "stop = true") + &event(1.2, "b", "stop = true"), "only one can stop"),
    ] {
        let message = experiment("settle", &text).expect_err(&text);
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn what_the_scene_does_not_have_is_named() {
    for (action, part) in [
        ("move = { node = \"no such\", by = [0, 0, 0] }", "no node \"no such\", but: "),
        ("move = { node = 999, by = [0, 0, 0] }", "no node 999"),
        ("move = { node = \"bumper\", by = [0, 0, 0] }", "2 nodes are called \"bumper\""),
        ("move = { light = 9, by = [0, 0, 0] }", "no light 9, only 1"),
        ("light = { index = 9, factor = 0.0 }", "no light 9"),
    ] {
        let experiment = experiment("settle", &event(1.0, "it", action)).expect("valid TOML");
        let error = Subject::load(&experiment.scenes[0]).err().expect(action);
        assert!(error.is_bad_input(), "{action}");
        assert!(error.to_string().contains(part), "{action}: {error}");
    }
}
