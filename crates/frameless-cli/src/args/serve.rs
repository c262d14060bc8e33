//! What `frameless serve` takes.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::LookArgs;
use frameless_web::DEFAULT_PORT;

/// Look at a scene on a web page while it is being traced
///
/// Prints one address, to be opened in Chromium or Firefox; it holds a secret, and who has it may look and steer. Only this
/// machine can reach it: from elsewhere go through `ssh -L 8420:localhost:8420 MACHINE`, and open the same address there.
#[derive(ClapArgs)]
#[command(after_help = "Examples:
  frameless serve
  frameless serve model.glb --port 0 --size 1280x720
      on any free port
  frameless serve --bind 192.168.1.5 --tls-cert cert.pem --tls-key key.pem
      for the local network
  ssh -L 8420:localhost:8420 MACHINE frameless serve
      on another machine: open what it prints on this one")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(crate) look: LookArgs,

    /// Listen on this port; 0: any free one
    #[arg(long, value_name = "PORT", default_value_t = DEFAULT_PORT)]
    pub(crate) port: u16,

    /// Listen on this address; another than this machine's own (loopback) needs --tls-cert and --tls-key
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1")]
    pub(crate) bind: IpAddr,

    /// A name or address under which browsers reach this machine, besides that of --bind; may come more than once
    #[arg(long, value_name = "NAME")]
    pub(crate) host: Vec<String>,

    /// The certificate, and those that lead to its root, as a PEM file
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub(crate) tls_cert: Option<PathBuf>,

    /// The certificate's private key, as a PEM file
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub(crate) tls_key: Option<PathBuf>,

    /// Listen on another address than loopback without TLS: whoever is on the way can read along and steer
    #[arg(long)]
    pub(crate) insecure: bool,

    /// Keep the secret in this file, so that open pages find their way back after a restart; made if it is not there
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,

    /// Pages of this origin may show this one in a frame, such as http://localhost:8888
    #[arg(long, value_name = "ORIGIN")]
    pub(crate) allow_frame: Option<String>,

    /// The largest scene that a page may upload, in MiB; 0: none
    #[arg(long, value_name = "MIB", default_value_t = 256)]
    pub(crate) upload_limit: u32,
}
