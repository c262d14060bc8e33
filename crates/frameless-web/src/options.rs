//! Where the server listens, and what it allows.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};

/// The port unless another is asked for.
pub const DEFAULT_PORT: u16 = 8420;
/// The largest upload unless told otherwise, in bytes.
pub const DEFAULT_UPLOAD_BYTES: u64 = 256 << 20;

/// Where the server listens, and what it allows.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where to listen; port 0: any free one.
    pub address: SocketAddr,
    /// Further names or addresses under which browsers reach this machine, without port.
    pub hosts: Vec<String>,
    /// Certificate chain and private key, as PEM files.
    pub tls: Option<TlsFiles>,
    /// Another address than loopback without TLS.
    pub insecure: bool,
    /// Where the secret is kept over restarts; none: a new one each time.
    pub key_file: Option<PathBuf>,
    /// An origin (`http://localhost:8888`) whose pages may show ours in a frame.
    pub allow_frame: Option<String>,
    /// The largest upload.
    pub upload_bytes: u64,
    /// The most clients at once.
    pub clients: usize,
    /// A client that takes nothing, or is not heard of, for so long is dropped.
    pub stalled: Duration,
    /// Where nobody has looked for so long nothing is traced until somebody does.
    pub rests_after: Duration,
}

/// PEM files.
#[derive(Clone, Debug)]
pub struct TlsFiles {
    /// The certificate, then those that lead to its root.
    pub certificates: PathBuf,
    /// Its private key.
    pub key: PathBuf,
}

impl Default for Options {
    /// This machine only.
    fn default() -> Options {
        Options {
            address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), DEFAULT_PORT),
            hosts: Vec::new(),
            tls: None,
            insecure: false,
            key_file: None,
            allow_frame: None,
            upload_bytes: DEFAULT_UPLOAD_BYTES,
            clients: 64,
            stalled: Duration::from_secs(30),
            rests_after: Duration::from_secs(10),
        }
    }
}

impl Options {
    /// Refuses what is not safe, or would lead to an address that nobody can open.
    ///
    /// # Errors
    /// With what to say instead.
    pub fn check(&self) -> anyhow::Result<()> {
        let ip = self.address.ip();
        if !ip.is_loopback() && self.tls.is_none() && !self.insecure {
            bail!(
                "{ip}: everybody on the way could read along and steer; give --tls-cert and --tls-key, or leave --bind \
                 out and go through {tunnel}, or say --insecure",
                tunnel = self.tunnel()
            );
        }
        if ip.is_unspecified() && self.hosts.is_empty() {
            bail!(
                "{ip} is no address that a browser can open: say with --host under which name or address this machine is reached"
            );
        }
        if let Some(host) = self.hosts.iter().find(|host| !is_host(host)) {
            bail!(
                "--host {host}: wanted a name or an address without a port, such as render.example.org or [2001:db8::1]"
            );
        }
        if let Some(origin) = self.allow_frame.as_ref().filter(|origin| !is_origin(origin)) {
            bail!("--allow-frame {origin}: wanted one origin such as http://localhost:8888");
        }
        Ok(())
    }

    /// The command that leads here from another machine. Which port is free is known only when it has been taken.
    fn tunnel(&self) -> String {
        match self.address.port() {
            0 => "`ssh -L PORT:localhost:PORT` with the port that is printed then".to_owned(),
            port => format!("`ssh -L {port}:localhost:{port}`"),
        }
    }

    /// The names under which it is reached, in lower case, the one for its URL first.
    pub(crate) fn names(&self) -> Vec<String> {
        let ip = self.address.ip();
        let mut names: Vec<String> =
            self.hosts.iter().map(|host| host.to_ascii_lowercase()).collect();
        if !ip.is_unspecified() {
            names.push(in_url(ip));
        }
        if ip.is_loopback() || ip.is_unspecified() {
            names.extend(["127.0.0.1", "localhost", "[::1]"].map(str::to_owned));
        }
        names
    }
}

/// A name, or an address as it stands in a URL; no port.
fn is_host(host: &str) -> bool {
    if let Some(rest) = host.strip_prefix('[') {
        return rest.strip_suffix(']').is_some_and(|ip| ip.parse::<Ipv6Addr>().is_ok());
    }
    let is_letter = |byte: u8| byte.is_ascii_alphanumeric() || b"-._".contains(&byte);
    !host.is_empty() && host.bytes().all(is_letter)
}

/// Scheme and host, with or without a port, which may be a star for any. No star stands for hosts: that would allow every site.
fn is_origin(origin: &str) -> bool {
    let rest = origin.strip_prefix("http://").or(origin.strip_prefix("https://"));
    let Some(rest) = rest else { return false };
    // An address of version 6 has colons of its own, in brackets.
    match rest.rsplit_once(':').filter(|(_, port)| !port.ends_with(']')) {
        Some((host, "*")) => is_host(host),
        Some((host, port)) => is_host(host) && port.parse::<u16>().is_ok_and(|port| port > 0),
        None => is_host(rest),
    }
}

fn in_url(ip: IpAddr) -> String {
    match ip {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    }
}

impl TlsFiles {
    /// Certificates and key, ready to be used.
    ///
    /// # Errors
    /// If a file cannot be read, or they do not belong together.
    pub(crate) fn config(&self) -> anyhow::Result<tokio_rustls::rustls::ServerConfig> {
        use tokio_rustls::rustls::pki_types::pem::PemObject;
        use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
        let shown = self.certificates.display();
        let certificates = CertificateDer::pem_file_iter(&self.certificates)
            .and_then(Iterator::collect::<Result<Vec<_>, _>>)
            .with_context(|| format!("cannot read certificates from {shown}"))?;
        if certificates.is_empty() {
            bail!("{shown}: wanted certificates as PEM, came none");
        }
        let key = PrivateKeyDer::from_pem_file(&self.key)
            .with_context(|| format!("cannot read a private key from {}", self.key.display()))?;
        let provider = tokio_rustls::rustls::crypto::ring::default_provider();
        tokio_rustls::rustls::ServerConfig::builder_with_provider(provider.into())
            .with_safe_default_protocol_versions()?
            .with_no_client_auth()
            .with_single_cert(certificates, key)
            .with_context(|| format!("{shown} and {} cannot be used", self.key.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(address: &str) -> Options {
        Options { address: address.parse().unwrap(), ..Options::default() }
    }

    #[test]
    fn only_loopback_needs_no_tls() {
        for fine in ["127.0.0.1:1", "127.5.5.5:1", "[::1]:1"] {
            at(fine).check().unwrap();
        }
        for other in
            ["192.168.1.2:1", "0.0.0.0:1", "[::]:1", "[2001:db8::1]:1", "[::ffff:7f00:1]:1"]
        {
            let error = at(other).check().unwrap_err().to_string();
            assert!(error.contains("--tls-cert") && error.contains("--insecure"), "{error}");
        }
        Options { insecure: true, ..at("192.168.1.2:1") }.check().unwrap();
    }

    #[test]
    fn the_way_through_ssh_names_no_port_that_is_none() {
        let error = |address| at(address).check().unwrap_err().to_string();
        assert!(error("0.0.0.0:8420").contains("ssh -L 8420:localhost:8420"));
        assert!(!error("0.0.0.0:0").contains("0:localhost"), "{}", error("0.0.0.0:0"));
    }

    #[test]
    fn every_address_needs_a_name() {
        let anywhere = Options { insecure: true, ..at("0.0.0.0:1") };
        assert!(anywhere.check().unwrap_err().to_string().contains("--host"));
        let named = Options { hosts: vec!["Render.example".to_owned()], ..anywhere };
        named.check().unwrap();
        assert_eq!(named.names()[0], "render.example");
        for bad in
            ["", "a b", "http://a", "a:80", "a/b", "[::1", "[::1]:80", "::1", "[]", "[a]", "a]"]
        {
            assert!(
                Options { hosts: vec![bad.to_owned()], ..at("127.0.0.1:1") }.check().is_err(),
                "{bad}"
            );
        }
    }

    #[test]
    fn a_frames_origin_cannot_smuggle_a_policy_in() {
        let allowing =
            |origin: &str| Options { allow_frame: Some(origin.to_owned()), ..Options::default() };
        for good in [
            "http://localhost:8888",
            "http://localhost:*",
            "https://a.example",
            "http://[::1]:1",
            "http://[::1]",
        ] {
            allowing(good).check().unwrap();
        }
        for bad in [
            "*",
            "localhost",
            "http://",
            "http://*",
            "http://*:*",
            "https://*.example",
            "http://a:",
            "http://a:0",
            "http://a:1:2",
            "http://[::1",
            "http://a; script-src *",
            "http://a\r\nX: y",
            "http://a b",
        ] {
            assert!(allowing(bad).check().is_err(), "{bad}");
        }
    }
}
