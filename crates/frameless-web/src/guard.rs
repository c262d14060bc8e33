//! Who is let in: one check in front of every route and method, the WebSocket included.
//!
//! - `Host` must name this server. A page of another site whose name is made to lead here (DNS rebinding) says its own name there.
//! - `Origin`, where there is one, must be this server's, and there must be one where something is done: browsers send it along with
//!   every WebSocket and every `POST`. A page of another site has another.
//! - The secret must come along, in the cookie; or in the address of `/`, which is answered with the cookie.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::http::header::{COOKIE, HOST, HeaderValue, ORIGIN};
use axum::http::{HeaderMap, Method, Uri};

use crate::Secret;

/// What is checked against.
#[derive(Debug)]
pub(crate) struct Guard {
    pub(crate) secret: Secret,
    /// Host names and addresses without port, in lower case. Whatever the port: a tunnel may end at another.
    pub(crate) names: Vec<String>,
    /// Whether this server speaks TLS.
    pub(crate) tls: bool,
}

/// What a request may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It has the cookie.
    Enter,
    /// It has the secret in its address: it gets the cookie.
    Exchange,
}

/// Why a request is not let in. Told in the log and not to the client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    Host,
    Origin,
    Secret,
}

impl Guard {
    /// Whether a request is let in.
    pub(crate) fn check(
        &self,
        method: &Method,
        uri: &Uri,
        headers: &HeaderMap,
    ) -> Result<Admission, Refusal> {
        let host = self.host(uri, headers).ok_or(Refusal::Host)?;
        let origin = only(headers, ORIGIN)?;
        let scheme = if self.tls { "https" } else { "http" };
        let is_own = |origin: &str| origin.eq_ignore_ascii_case(&format!("{scheme}://{host}"));
        let acts = *method != Method::GET && *method != Method::HEAD || upgrades(headers);
        match origin {
            Some(origin) if !is_own(origin) => return Err(Refusal::Origin),
            None if acts => return Err(Refusal::Origin),
            _ => {}
        }
        if *method == Method::GET && uri.path() == "/" && self.has_key(uri) {
            return Ok(Admission::Exchange);
        }
        match self.has_cookie(headers) {
            true => Ok(Admission::Enter),
            false => Err(Refusal::Secret),
        }
    }

    /// The request's `Host`, if it is one of ours.
    fn host<'a>(&self, uri: &Uri, headers: &'a HeaderMap) -> Option<&'a str> {
        let host = only(headers, HOST).ok()??;
        // An address with a host of its own (as proxies are sent) must name the same.
        if uri.authority().is_some_and(|authority| !authority.as_str().eq_ignore_ascii_case(host)) {
            return None;
        }
        let name = without_port(host)?.to_ascii_lowercase();
        self.names.contains(&name).then_some(host)
    }

    fn has_key(&self, uri: &Uri) -> bool {
        let mut keys =
            uri.query().unwrap_or("").split('&').filter_map(|pair| pair.strip_prefix("key="));
        keys.next().is_some_and(|key| self.secret.is(key))
    }

    /// Cookies know no ports, and servers behind one name must not share one: its name has the port that the browser sees, which is a tunnel's
    /// if there is one.
    pub(crate) fn cookie(&self, headers: &HeaderMap) -> String {
        let host = only(headers, HOST).ok().flatten().unwrap_or_default();
        let port = host.rsplit_once(':').and_then(|(_, port)| port.parse::<u16>().ok());
        format!("frameless-{}", port.unwrap_or(if self.tls { 443 } else { 80 }))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let cookie = self.cookie(headers);
        let values = headers.get_all(COOKIE).into_iter().filter_map(|value| value.to_str().ok());
        let pairs = values.flat_map(|value| value.split(';'));
        let ours = pairs
            .filter_map(|pair| pair.trim().split_once('='))
            .filter(|(name, _)| *name == cookie);
        // Every one is compared, so that the time taken does not tell which was right.
        ours.fold(false, |found, (_, value)| found | self.secret.is(value))
    }
}

/// Who is turned away, for whoever looks after the server. One line in ten seconds: a log is not to be filled from outside.
#[derive(Debug, Default)]
pub(crate) struct Refusals {
    // When one was written last, and how many have not been since.
    written: Mutex<(Option<Instant>, u64)>,
}

const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// Of what a stranger wrote.
const LONGEST_HOST: usize = 60;

impl Refusals {
    /// Writes a warning, or counts it for the next one.
    pub(crate) fn log(&self, refusal: Refusal, method: &Method, host: Option<&HeaderValue>) {
        let Some(unsaid) = self.turn(Instant::now()) else { return };
        let why = match refusal {
            Refusal::Host => "its Host is none of this server's names",
            Refusal::Origin => "its Origin is not this server's, or missing",
            Refusal::Secret => "it has not got the secret",
        };
        let bytes = host.map(HeaderValue::as_bytes).unwrap_or_default();
        let host = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST_HOST)]);
        let more = if unsaid > 0 { format!("; {unsaid} more since then") } else { String::new() };
        log::warn!("a {method} request for host {host:?} was turned away: {why}{more}");
    }

    /// How many were not written since the last one that was, if it is time for another.
    fn turn(&self, now: Instant) -> Option<u64> {
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        let (last, unsaid) = &mut *written;
        if last.is_some_and(|last| now.duration_since(last) < BETWEEN_LINES) {
            *unsaid += 1;
            return None;
        }
        *last = Some(now);
        Some(std::mem::take(unsaid))
    }
}

/// The header's value if it comes once; an error if it comes twice or is not text.
fn only(headers: &HeaderMap, name: axum::http::HeaderName) -> Result<Option<&str>, Refusal> {
    let wrong = if name == HOST { Refusal::Host } else { Refusal::Origin };
    let mut values = headers.get_all(name).into_iter();
    match (values.next(), values.next()) {
        (None, _) => Ok(None),
        (Some(value), None) => value.to_str().map(Some).map_err(|_| wrong),
        (Some(_), Some(_)) => Err(wrong),
    }
}

fn upgrades(headers: &HeaderMap) -> bool {
    headers.contains_key(axum::http::header::UPGRADE)
}

/// `[::1]:80` → `[::1]`, `localhost` → `localhost`. None if what follows is no port.
fn without_port(host: &str) -> Option<&str> {
    let end = match host.starts_with('[') {
        true => host.find(']')? + 1,
        false => host.find(':').unwrap_or(host.len()),
    };
    let (name, port) = host.split_at(end);
    let is_port = match port.strip_prefix(':') {
        Some(digits) => digits.parse::<u16>().is_ok() && !digits.starts_with('+'),
        None => port.is_empty(),
    };
    is_port.then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard() -> Guard {
        Guard {
            secret: Secret::new().unwrap(),
            names: ["127.0.0.1", "localhost", "[::1]"].map(str::to_owned).to_vec(),
            tls: false,
        }
    }

    #[test]
    fn a_flood_of_refusals_is_a_line_in_ten_seconds() {
        let (refusals, now) = (Refusals::default(), Instant::now());
        assert_eq!(refusals.turn(now), Some(0));
        assert!((0..500).all(|_| refusals.turn(now).is_none()));
        assert_eq!(refusals.turn(now + BETWEEN_LINES), Some(500));
        assert_eq!(refusals.turn(now + 2 * BETWEEN_LINES), Some(0));
    }

    #[test]
    fn ports_are_told_from_names() {
        for (host, want) in [
            ("localhost", Some("localhost")),
            ("localhost:8420", Some("localhost")),
            ("[::1]:8420", Some("[::1]")),
            ("[::1]", Some("[::1]")),
            ("[::1", None),
            ("[::1]x", None),
            ("localhost:", None),
            ("localhost:8420:1", None),
            ("localhost:+80", None),
            ("localhost:99999", None),
            ("", Some("")),
        ] {
            assert_eq!(without_port(host), want, "{host}");
        }
    }

    #[test]
    fn cookies_are_named_after_the_port_that_the_browser_sees() {
        for (host, tls, want) in [
            ("localhost:8420", false, "frameless-8420"),
            ("localhost:19001", false, "frameless-19001"),
            ("[::1]:7", false, "frameless-7"),
            ("[::1]", false, "frameless-80"),
            ("localhost", true, "frameless-443"),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(HOST, host.parse().unwrap());
            assert_eq!(Guard { tls, ..guard() }.cookie(&headers), want, "{host}");
        }
    }

    #[test]
    fn one_of_several_cookies_will_do_and_none_other() {
        let guard = guard();
        let check = |cookie: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(HOST, "localhost:8420".parse().unwrap());
            headers.insert(COOKIE, cookie.parse().unwrap());
            guard.check(&Method::GET, &Uri::from_static("/"), &headers)
        };
        let secret = guard.secret.as_str();
        assert_eq!(check(&format!("a=b; frameless-8420={secret}; c=d")), Ok(Admission::Enter));
        assert_eq!(
            check(&format!("frameless-8420=x;frameless-8420={secret}")),
            Ok(Admission::Enter)
        );
        for wrong in [
            format!("frameless-8421={secret}"),
            format!("Frameless-8420={secret}"),
            format!("frameless-8420={}", &secret[..63]),
            format!("frameless-8420={secret}0"),
            format!("frameless-8420={}", secret.to_uppercase() + "x"),
            "frameless-8420=".to_owned(),
            secret.to_owned(),
        ] {
            assert_eq!(check(&wrong), Err(Refusal::Secret), "{wrong}");
        }
    }
}
