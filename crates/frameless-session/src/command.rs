//! What the window asks of the render loop, and what it is told.

use frameless::Size;
use frameless_scene::View;

use crate::overlay::Drawn;
use crate::settings::Settings;
use crate::shown::Ages;

/// From the window to the render loop. `W` is a scene made ready for the renderer.
#[derive(Debug)]
pub enum Command<W> {
    /// Everything that the panel can set; what differs is applied. The picture stays.
    Settings(Settings),
    /// The picture's size in pixels. The picture stays, resampled.
    Size(Size),
    /// From where to look. The picture stays.
    View(ViewChoice),
    /// Another scene, from its beginning, through its first camera. The picture stays until it is traced anew.
    Scene(W),
    /// Go on or stand still.
    Play(bool),
    /// Jump to a scene time in seconds.
    Seek(f64),
    /// Seconds of the scene per second.
    Speed(f64),
    /// Nobody looks (or somebody does again): the loop stands still, and what it holds stays. The scene's time goes on.
    Rest(bool),
    /// A number that pictures give back: those which show the commands before it. Somebody waits for them: the next one is hurried.
    Mark(u64),
    /// A picture is wanted at the next refresh. Gives an old picture's memory back, and says what painting costs.
    WantPicture {
        /// Any bytes.
        memory: Vec<[u8; 4]>,
        /// What the window's last paint cost, without waiting for the display.
        paint_secs: f64,
    },
}

/// From where the scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewChoice {
    /// One of the scene's cameras, by index; moves if it is animated.
    Camera(u32),
    /// Where the user has put it.
    Free(View),
}

/// From the render loop to the window.
#[derive(Debug)]
pub enum Report {
    /// A picture to be shown, with what the loop knows of itself.
    Picture(Picture),
    /// The renderer gave an answer that cannot be used; the loop goes on.
    Error(String),
}

/// The picture at one moment.
#[derive(Debug)]
pub struct Picture {
    /// Width and height.
    pub size: Size,
    /// sRGB-encoded RGBA, row-major from the top.
    pub rgba: Vec<[u8; 4]>,
    /// The last [`Command::Mark`] before it; 0 before the first.
    pub mark: u64,
    /// What the loop knows of itself.
    pub status: Status,
}

/// What the loop knows of itself, at the moment of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Scene time in seconds.
    pub scene_secs: f64,
    /// Samples kept per second, over the last quarter of a second.
    pub samples_per_sec: f64,
    /// Pictures made per second, over the same time.
    pub pictures_per_sec: f64,
    /// How old the picture is.
    pub ages: Ages,
    /// The overlay, where one was asked for.
    pub overlay: Option<Drawn>,
}
