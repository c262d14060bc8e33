//! `--only scene=sphere,algorithm=change,rate=900000,seed=1`: a part of an experiment.

use crate::algorithm::Algorithm;
use crate::experiment::{Experiment, IDEAL};

/// Which scenes, algorithms, rates and seeds of an experiment are wanted; of what is not named, all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    scenes: Vec<String>,
    algorithms: Vec<Algorithm>,
    rates: Vec<f64>,
    seeds: Vec<u64>,
}

impl Selection {
    /// Parses `key=value,…` with the keys `scene`, `algorithm`, `rate` and `seed`; a key that is there twice names two of
    /// its kind. Commas within parentheses belong to the algorithm's name.
    ///
    /// # Errors
    /// What was wanted, and what came instead.
    pub fn parse(text: &str) -> Result<Selection, String> {
        let mut selection = Selection::default();
        for part in split_outside_parentheses(text) {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| format!("{part:?}: wanted scene=, algorithm=, rate= or seed="))?;
            let value = value.trim();
            let wrong = |wanted| format!("{key}={value}: wanted {wanted}");
            match key.trim() {
                "scene" => selection.scenes.push(value.into()),
                "algorithm" => selection.algorithms.push(Algorithm::from_name(value)?),
                "rate" => {
                    let rate = value.replace('_', "").parse();
                    selection.rates.push(rate.map_err(|_| wrong("samples per second"))?);
                }
                "seed" => selection.seeds.push(value.parse().map_err(|_| wrong("a number"))?),
                key => return Err(format!("{key:?}: wanted scene, algorithm, rate or seed")),
            }
        }
        Ok(selection)
    }

    /// The selected part of `experiment`. Pictures and equal-quality factors shrink with it: a factor is worked out where both
    /// the algorithm and its opponent are selected.
    ///
    /// # Errors
    /// If the experiment lacks something that is named; the message lists what it has.
    pub fn of(&self, mut experiment: Experiment) -> Result<Experiment, String> {
        let name = |algorithm: &Algorithm| algorithm.name();
        keep(
            &mut experiment.scenes,
            &self.scenes,
            "scene",
            |scene| scene.name.clone(),
            |s| s.clone(),
        )?;
        keep(&mut experiment.algorithms, &self.algorithms, "algorithm", name, name)?;
        let (rate, seed) = (f64::to_string, u64::to_string);
        keep(&mut experiment.samples_per_sec, &self.rates, "rate", rate, rate)?;
        keep(&mut experiment.seeds, &self.seeds, "seed", seed, seed)?;

        let left: Vec<String> = experiment.algorithms.iter().map(name).collect();
        experiment.show.retain(|shown| shown == IDEAL || left.contains(shown));
        if !experiment.show.iter().any(|shown| left.contains(shown)) {
            experiment.show = left;
            experiment.show.push(IDEAL.into());
        }
        experiment.equal_quality = experiment.equal_quality.and_then(|mut spec| {
            spec.algorithms.retain(|algorithm| experiment.algorithms.contains(algorithm));
            spec.opponents.retain(|opponent| experiment.algorithms.contains(opponent));
            (!spec.algorithms.is_empty() && !spec.opponents.is_empty()).then_some(spec)
        });
        Ok(experiment)
    }
}

/// Keeps of `all` what is `wanted`, compared by name; all if nothing is.
fn keep<T, W>(
    all: &mut Vec<T>,
    wanted: &[W],
    kind: &str,
    name: impl Fn(&T) -> String,
    wanted_name: impl Fn(&W) -> String,
) -> Result<(), String> {
    let known: Vec<String> = all.iter().map(&name).collect();
    let wanted: Vec<String> = wanted.iter().map(wanted_name).collect();
    if let Some(stranger) = wanted.iter().find(|wanted| !known.contains(wanted)) {
        return Err(format!(
            "{kind}={stranger}: not in the experiment; there are {}",
            known.join(", ")
        ));
    }
    all.retain(|one| wanted.is_empty() || wanted.contains(&name(one)));
    Ok(())
}

fn split_outside_parentheses(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth) = (Vec::new(), 0, 0i32);
    for (i, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const EXPERIMENT: &str = r#"
        title = "some"
        algorithms = ["random", "change", "change(w_d=0.5,tile=8)", "framed"]
        samples_per_sec = [225_000, 900_000]
        seeds = [1, 2, 3]
        [[scenes]]
        scene = "sphere"
        [[scenes]]
        scene = "many"
    "#;

    fn selected(text: &str) -> Result<Experiment, String> {
        let experiment = Experiment::parse(EXPERIMENT, Path::new("")).expect("valid");
        Selection::parse(text)?.of(experiment)
    }

    #[test]
    fn what_is_named_is_kept_and_of_the_rest_all() {
        let part = selected("scene=many,algorithm=change+hold,rate=900_000").expect("there");
        assert_eq!(part.scenes.len(), 1);
        assert_eq!(part.scenes[0].name, "many");
        assert_eq!(part.algorithms, [Algorithm::from_name("change").expect("known")]);
        assert_eq!(part.samples_per_sec, [900_000.0]);
        assert_eq!(part.seeds, [1, 2, 3]);
        assert_eq!(part.show, ["change", "ideal"]);
    }

    #[test]
    fn a_key_may_come_twice_and_names_may_have_commas() {
        let part = selected("algorithm=change(w_d=0.5,tile=8),algorithm=framed,seed=2,seed=3");
        let part = part.expect("there");
        let names: Vec<String> = part.algorithms.iter().map(Algorithm::name).collect();
        assert_eq!(names, ["change(w_d=0.5,tile=8)", "framed"]);
        assert_eq!(part.seeds, [2, 3]);
    }

    #[test]
    fn what_is_not_there_is_refused_and_what_is_there_listed() {
        for (text, part) in [
            ("scene=cube", "there are sphere, many"),
            ("algorithm=permutation", "there are random, change, change(w_d=0.5,tile=8), framed"),
            ("rate=1", "there are 225000, 900000"),
            ("seed=9", "there are 1, 2, 3"),
            ("algorithm=chance", "unknown algorithm"),
            ("rate=fast", "wanted samples per second"),
            ("sphere", "wanted scene="),
            ("", "wanted scene="),
            ("speed=1", "wanted scene, algorithm"),
        ] {
            let message = selected(text).expect_err(text);
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
