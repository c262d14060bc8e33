//! What lets a client in: 256 random bits.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use subtle::ConstantTimeEq;

const BYTES: usize = 32;

/// A secret as it stands in the URL and in the cookie: 64 hexadecimal digits.
#[derive(Clone)]
pub struct Secret(String);

impl Secret {
    /// A new one, of the system's random numbers.
    ///
    /// # Errors
    /// If the system has none.
    pub fn new() -> anyhow::Result<Secret> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| anyhow!("the system gives no random numbers: {error}"))?;
        Ok(Secret(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// The one in a file, which is made if it is not there; only its owner may read it.
    ///
    /// # Errors
    /// If the file cannot be read or written, holds anything else, or others may read it.
    pub fn of_file(path: &Path) -> anyhow::Result<Secret> {
        let shown = path.display();
        match std::fs::read_to_string(path) {
            Ok(text) => {
                refuse_readable_by_others(path)?;
                let text = text.trim();
                let is_secret = text.len() == 2 * BYTES
                    && text
                        .bytes()
                        .all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte));
                if !is_secret {
                    bail!(
                        "{shown}: wanted {} hexadecimal digits; remove the file for new ones",
                        2 * BYTES
                    );
                }
                Ok(Secret(text.to_owned()))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let secret = Secret::new()?;
                let mut options = OpenOptions::new();
                options.write(true).create_new(true);
                #[cfg(unix)]
                std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
                let mut file =
                    options.open(path).with_context(|| format!("cannot write {shown}"))?;
                writeln!(file, "{}", secret.0).with_context(|| format!("cannot write {shown}"))?;
                Ok(secret)
            }
            Err(error) => Err(error).with_context(|| format!("cannot read {shown}")),
        }
    }

    /// As in the URL.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether that is it; takes as long whatever it is.
    pub(crate) fn is(&self, came: &str) -> bool {
        self.0.as_bytes().ct_eq(came.as_bytes()).into()
    }
}

#[cfg(unix)]
fn refuse_readable_by_others(path: &Path) -> anyhow::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let shown = path.display();
    let metadata = path.metadata().with_context(|| format!("cannot read {shown}"))?;
    if metadata.permissions().mode() & 0o077 != 0 {
        bail!("{shown}: others may read it; say chmod 600 {shown}");
    }
    Ok(())
}

#[cfg(not(unix))]
fn refuse_readable_by_others(_: &Path) -> anyhow::Result<()> {
    Ok(())
}

impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_another_and_only_itself() {
        let (one, other) = (Secret::new().unwrap(), Secret::new().unwrap());
        assert_eq!(one.as_str().len() * 4, 256);
        assert!(one.is(one.as_str()));
        assert!(!one.is(other.as_str()) && !one.is("") && !one.is(&one.as_str()[1..]));
        assert!(!format!("{one:?}").contains(one.as_str()));
    }

    #[test]
    fn a_file_keeps_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let made = Secret::of_file(&path).unwrap();
        assert!(Secret::of_file(&path).unwrap().is(made.as_str()));
        std::fs::write(&path, "secret").unwrap();
        assert!(Secret::of_file(&path).is_err());
    }

    #[test]
    #[cfg(unix)]
    fn a_file_that_others_may_read_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        Secret::of_file(&path).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        assert!(Secret::of_file(&path).unwrap_err().to_string().contains("chmod"));
    }
}
