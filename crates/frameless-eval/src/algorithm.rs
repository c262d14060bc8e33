//! Who competes, by name.

use frameless::SamplerKind;

/// A way of making pictures from samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Algorithm {
    /// A frameless sampler, shown by `hold`.
    Frameless(SamplerKind),
}

impl Algorithm {
    /// `random`, `permutation`, `change`; with parameters: `change(w_d=0.7,tile=8)`. A trailing `+hold` may be
    /// written out.
    ///
    /// # Errors
    /// What was wanted, if the name is not one of these.
    pub fn from_name(name: &str) -> Result<Algorithm, String> {
        let plain = name.strip_suffix("+hold").unwrap_or(name);
        let (head, parameters) = match plain.split_once('(') {
            Some((head, rest)) => (head, Some(rest)),
            None => (plain, None),
        };
        let kind = SamplerKind::from_name(head).ok_or_else(|| {
            let known = SamplerKind::ALL.map(|kind| kind.name()).join(", ");
            format!("unknown algorithm {name:?}; there are: {known}")
        })?;
        match (kind, parameters) {
            (kind, None) => Ok(Algorithm::Frameless(kind)),
            (SamplerKind::Change { .. }, Some(text)) => parse_change(name, text),
            (_, Some(_)) => Err(format!("algorithm {name:?}: {head} has no parameters")),
        }
    }

    /// The name that [`Algorithm::from_name`] understands.
    pub fn name(&self) -> String {
        match self {
            Algorithm::Frameless(kind) if *kind == SamplerKind::CHANGE => kind.name().into(),
            Algorithm::Frameless(SamplerKind::Change { w_d, tile }) => {
                format!("change(w_d={w_d},tile={tile})")
            }
            Algorithm::Frameless(kind) => kind.name().into(),
        }
    }
}

fn parse_change(name: &str, text: &str) -> Result<Algorithm, String> {
    let wrong = || format!("algorithm {name:?}: wanted change(w_d=0.9,tile=16)");
    let SamplerKind::Change { mut w_d, mut tile } = SamplerKind::CHANGE else {
        return Err(wrong());
    };
    for parameter in text.strip_suffix(')').ok_or_else(wrong)?.split(',') {
        match parameter.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            Some(("w_d", value)) => w_d = value.parse().map_err(|_| wrong())?,
            Some(("tile", value)) => tile = value.parse().map_err(|_| wrong())?,
            _ => return Err(wrong()),
        }
    }
    if !(0.0..=1.0).contains(&w_d) || tile == 0 {
        return Err(format!("algorithm {name:?}: w_d must be in [0, 1] and tile at least 1"));
    }
    Ok(Algorithm::Frameless(SamplerKind::Change { w_d, tile }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        for name in ["random", "permutation", "change", "change(w_d=0.5,tile=8)"] {
            assert_eq!(Algorithm::from_name(name).expect(name).name(), name);
        }
        assert_eq!(
            Algorithm::from_name("change+hold").expect("hold is what it is").name(),
            "change"
        );
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        for name in [
            "",
            "chance",
            "random(w_d=1)",
            "change(w_d=2)",
            "change(tile=0)",
            "change(x=1)",
            "change(w_d",
        ] {
            let message = Algorithm::from_name(name).expect_err(name);
            assert!(message.contains(&format!("{name:?}")), "{message}");
        }
    }
}
