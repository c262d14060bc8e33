//! `frameless serve`: the web page.

use std::net::SocketAddr;
use std::sync::Arc;

use anyhow::anyhow;
use frameless::Clock;
use frameless_scene::Scene;
use frameless_session::{Helm, PictureSize, Session};
use frameless_trace::{CpuTracer, ViewSource, World};
use frameless_web::{MOST_PIXELS, Options, Scenes, Server, Show, TlsFiles};

use crate::args::{LookArgs, ServeArgs};
use crate::failure::Failure;
use crate::{output, view};

/// Before a page has said how much room it has.
const FIRST_PLACE: [u32; 2] = [640, 480];

/// Serve until Ctrl-C.
pub(crate) fn run(args: &ServeArgs) -> Result<(), Failure> {
    let show = show(&args.look)?;
    let tls = args.tls_cert.clone().zip(args.tls_key.clone());
    let options = Options {
        address: SocketAddr::new(args.bind, args.port),
        hosts: args.host.clone(),
        tls: tls.map(|(certificates, key)| TlsFiles { certificates, key }),
        insecure: args.insecure,
        key_file: args.key_file.clone(),
        allow_frame: args.allow_frame.clone(),
        upload_bytes: u64::from(args.upload_limit) << 20,
        ..Options::default()
    };
    serve(Server::bind(options).map_err(Failure::bad_input)?, show)
}

/// Serve because there is no display: on the usual port, or on any if that is taken, since nobody asked for it.
pub(crate) fn instead(look: &LookArgs, reason: &anyhow::Error) -> Result<(), Failure> {
    let show = show(look)?;
    eprintln!("{reason}; serving a web page instead");
    let any_port = || {
        let mut options = Options::default();
        options.address.set_port(0);
        Server::bind(options)
    };
    serve(Server::bind(Options::default()).or_else(|_| any_port())?, show)
}

fn serve(server: Server, show: Show<CpuTracer>) -> Result<(), Failure> {
    let stopper = server.stopper();
    ctrlc::set_handler(move || stopper.stop()).map_err(Failure::other)?;
    output::print(&format!("{}\n", server.url()))?;
    Ok(server.run(show)?)
}

fn show(look: &LookArgs) -> Result<Show<CpuTracer>, Failure> {
    let settings = view::settings(look)?;
    if let PictureSize::Fixed(size) = settings.picture
        && size.pixels() > MOST_PIXELS
    {
        let (width, height) = (size.width, size.height);
        return Err(Failure::bad_input(anyhow!(
            "--size {width}x{height}: a web page shows at most {MOST_PIXELS} pixels, such as 3840x2160"
        )));
    }
    let (scene, opener) = view::scene(look)?;
    let scene = Arc::new(scene);
    let limits = opener.limits.clone();
    let world = World::open(&look.scene, Arc::clone(&scene), &limits);
    let world = Arc::new(world.map_err(Failure::bad_input)?);
    let prepare = move |scene: &Arc<Scene>| {
        Ok(Arc::new(World::open(&scene.name, Arc::clone(scene), &limits)?))
    };
    let camera = ViewSource::Camera(0);
    let tracer = CpuTracer::new(world, camera, look.light.settings()?, look.threads).in_real_time();
    let size = settings.picture.size_in(FIRST_PLACE);
    Ok(Show {
        session: Session::new(size, Clock::real(), settings, look.seed, tracer)
            .with_refresh_threads(look.threads),
        helm: Helm::new(scene),
        scenes: Some(Scenes { opener, prepare: Arc::new(prepare) }),
    })
}
