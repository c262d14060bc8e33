//! Which moment of the scene is shown: play, pause, scrub, speed.

use crate::Time;

/// Maps the clock's time to the scene's. Starts playing at scene time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    playing: bool,
    speed: f64,
    // At clock time `since` the scene stood at `scene_secs`.
    since: Time,
    scene_secs: f64,
}

impl Default for Timeline {
    fn default() -> Self {
        Timeline { playing: true, speed: 1.0, since: Time::ZERO, scene_secs: 0.0 }
    }
}

impl Timeline {
    /// The scene's time in seconds.
    pub fn scene_secs(&self, now: Time) -> f64 {
        let elapsed = if self.playing { now.secs_since(self.since) } else { 0.0 };
        self.scene_secs + self.speed * elapsed
    }

    /// Whether the scene's time moves.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Seconds of the scene per second of the clock.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Go on from where it stands.
    pub fn play(&mut self, now: Time) {
        *self = Timeline { playing: true, ..self.rebased(now) };
    }

    /// Stand still.
    pub fn pause(&mut self, now: Time) {
        *self = Timeline { playing: false, ..self.rebased(now) };
    }

    /// Jump to a scene time; plays on if it was playing.
    pub fn seek(&mut self, now: Time, scene_secs: f64) {
        *self = Timeline { since: now, scene_secs, ..*self };
    }

    /// 1: as fast as the clock; negative: backwards.
    pub fn set_speed(&mut self, now: Time, speed: f64) {
        *self = Timeline { speed, ..self.rebased(now) };
    }

    fn rebased(&self, now: Time) -> Timeline {
        Timeline { since: now, scene_secs: self.scene_secs(now), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pausing_and_scrubbing_never_jump_by_themselves() {
        let at = Time::from_secs;
        let mut timeline = Timeline::default();
        assert_eq!(timeline.scene_secs(at(2.0)), 2.0);
        timeline.pause(at(2.0));
        assert_eq!(timeline.scene_secs(at(5.0)), 2.0);
        timeline.set_speed(at(5.0), 0.5);
        timeline.play(at(6.0));
        assert_eq!(timeline.scene_secs(at(8.0)), 3.0);
        timeline.seek(at(8.0), 0.25);
        assert_eq!(timeline.scene_secs(at(9.0)), 0.75);
        assert!(timeline.is_playing());
    }
}
