//! One client's connection: hears what its user does, and sends it as much of the newest picture as its link takes.
//!
//! One message is encoded at a time, for the newest picture there is when the link has room: nothing ever queues but what is on its way.

mod outgoing;

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use tokio::task::JoinHandle;
use tokio::time::{MissedTickBehavior, interval, sleep_until, timeout};

use crate::Secret;
use crate::hub::{Event, HubHandle, Joining};
use crate::mailbox::Mailbox;
use crate::tiles::{Flow, Published};
use crate::wire::{Ack, LONGEST_MESSAGE, Said, StatusMessage, WireError};

use outgoing::{Outgoing, Ready, Room};

/// How often a client is asked whether it is still there, while it may stall.
const PINGS: u32 = 3;
/// That often, in the time after which a stalled client is dropped, it is looked whether one is.
const CHECKS: u32 = 30;
/// Status while something changes.
const STATUS: Duration = Duration::from_millis(250);
/// Of those, one in so many at rest.
const AT_REST: u32 = 4;

/// Why a connection ends.
enum End {
    /// The other side has gone, or the server ends.
    Gone,
    /// It sent what must not be.
    Invalid(WireError),
    /// It sent more than may be.
    TooLong,
    /// It has not moved for too long.
    Stalled,
}

/// A client that has been let in.
pub(crate) struct Newcomer {
    /// By which others know it.
    pub(crate) number: u32,
    /// By which it is recognised, see [`Joining`].
    pub(crate) token: Secret,
    /// The token of the connection that it had before.
    pub(crate) resumes: Option<String>,
}

/// Runs until the client goes, does what it must not, or stalls.
pub(crate) async fn serve(
    newcomer: Newcomer,
    socket: WebSocket,
    hub: HubHandle,
    stalled: Duration,
) {
    let Newcomer { number: client, token, resumes } = newcomer;
    let mailbox = Arc::new(Mailbox::default());
    let joining = Joining { client, token, resumes, mailbox: Arc::clone(&mailbox) };
    let events = hub.events.clone();
    if events.send(Event::Join(joining)).await.is_err() {
        return;
    }
    let mut connection = Connection::new(client, socket, mailbox, hub, stalled);
    let end = connection.run().await;
    // Fails if the hub has ended.
    events.send(Event::Leave(client)).await.ok();
    connection.close(end).await;
}

struct Connection {
    client: u32,
    socket: WebSocket,
    mailbox: Arc<Mailbox>,
    hub: HubHandle,
    stalled: Duration,
    flow: Flow,
    // None while a message is being made.
    outgoing: Option<Outgoing>,
    making: Option<JoinHandle<Ready>>,
    look: Look,
    // The canvas is this picture, once all that was sent is drawn.
    exact: Option<Arc<Published>>,
    heard_at: Instant,
    // Bytes of what moves in the newest picture of which something was sent.
    moved: (u32, usize),
    sent_bytes: u64,
    status: StatusMeter,
}

/// When there may be something to send.
#[derive(Clone, Copy)]
enum Look {
    /// As soon as there is room.
    Now,
    At(Instant),
    /// When something has happened.
    Later,
}

/// When to send a status, and what was sent meanwhile.
struct StatusMeter {
    ticks: u32,
    // Bytes sent in each of the last second's quarters.
    quarters: [u64; 4],
    counted: u64,
    last_exact: Option<u32>,
    was_sent: bool,
}

impl Connection {
    fn new(
        client: u32,
        socket: WebSocket,
        mailbox: Arc<Mailbox>,
        hub: HubHandle,
        stalled: Duration,
    ) -> Connection {
        let now = Instant::now();
        let status = StatusMeter {
            ticks: 0,
            quarters: [0; 4],
            counted: 0,
            last_exact: None,
            was_sent: false,
        };
        Connection {
            client,
            socket,
            mailbox,
            hub,
            stalled,
            flow: Flow::new(now),
            outgoing: Some(Outgoing::new(now)),
            making: None,
            look: Look::Now,
            exact: None,
            heard_at: now,
            moved: (0, 0),
            sent_bytes: 0,
            status,
        }
    }

    async fn run(&mut self) -> End {
        let mut status = interval(STATUS);
        status.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut ping = interval(self.stalled / PINGS);
        let mut check = interval(self.stalled / CHECKS);
        let mut pictures = self.hub.pictures.clone();
        let mailbox = Arc::clone(&self.mailbox);
        loop {
            self.make();
            let outcome = tokio::select! {
                message = self.socket.recv() => match message {
                    Some(Ok(message)) => self.hear(message).await,
                    Some(Err(_)) | None => Err(End::Gone),
                },
                ready = joined(&mut self.making), if self.making.is_some() => match ready {
                    Some(ready) => self.send_tiles(ready).await,
                    None => Err(End::Gone),
                },
                changed = pictures.changed() => {
                    self.look = Look::Now;
                    changed.map_err(|_| End::Gone)
                }
                text = mailbox.next() => match text {
                    Some(text) => self.send(Message::text(&*text)).await,
                    None => Err(End::Gone),
                },
                _ = status.tick() => self.send_status().await,
                _ = ping.tick() => self.send(Message::Ping(Default::default())).await,
                _ = check.tick() => self.check_stalled(),
                () = self.look.its_moment() => {
                    self.look = Look::Now;
                    Ok(())
                }
            };
            if let Err(end) = outcome {
                return end;
            }
        }
    }

    /// Begins to make a message, if there may be something to send and there is room for it.
    fn make(&mut self) {
        let room = self.flow.room();
        if !matches!(self.look, Look::Now) || room == 0 {
            return;
        }
        if self.hub.pictures.borrow().is_none() {
            return;
        }
        let Some(outgoing) = self.outgoing.take() else { return };
        self.look = Look::Later;
        let room = Room {
            bytes: room,
            window: self.flow.window(),
            client: self.client,
            sequence: self.flow.next_sequence(),
        };
        let hub = self.hub.clone();
        self.making = Some(tokio::task::spawn_blocking(move || {
            // The newest one only now: it may have waited for others to be encoded.
            let picture = hub.pictures.borrow().clone().expect("there has been one");
            let begin = Instant::now();
            let ready = outgoing.make(picture, &room);
            hub.painted(begin.elapsed());
            ready
        }));
    }

    async fn send_tiles(&mut self, ready: Ready) -> Result<(), End> {
        let Ready { outgoing, picture, message, moves, all_exact, wait } = ready;
        self.outgoing = Some(outgoing);
        let now = Instant::now();
        // Unless something has happened meanwhile.
        if let (Look::Later, Some(wait)) = (self.look, wait) {
            self.look = Look::At(now + wait);
        }
        let number = picture.number;
        self.exact = all_exact.then_some(picture);
        if let Some(message) = message {
            // What else is there to send is seen when it has been sent.
            self.look = Look::Now;
            self.flow.send(message.len(), now);
            if moves {
                let before = if self.moved.0 == number { self.moved.1 } else { 0 };
                self.moved = (number, before + message.len());
                self.hub.moved(self.moved.1);
            }
            self.send(Message::binary(message)).await?;
        }
        self.tell_drawn();
        let exact = self.exact.as_ref().map(|picture| picture.number);
        if exact.is_some() && exact != self.status.last_exact {
            self.tell_status().await?;
        }
        Ok(())
    }

    async fn hear(&mut self, message: Message) -> Result<(), End> {
        let now = Instant::now();
        self.heard_at = now;
        if message_bytes(&message) > LONGEST_MESSAGE as u64 {
            return Err(End::TooLong);
        }
        match message {
            Message::Text(text) => {
                let said = Said::parse(&text).map_err(End::Invalid)?;
                let event = Event::Said(self.client, said);
                self.hub.events.send(event).await.map_err(|_| End::Gone)
            }
            Message::Binary(bytes) => {
                let Ack { sequence } = Ack::parse(&bytes).map_err(End::Invalid)?;
                self.flow.acknowledge(sequence, now).map_err(|_| {
                    let (what, wanted) = ("sequence number", "one that is on its way");
                    End::Invalid(WireError::Value { what, wanted, came: sequence.to_string() })
                })?;
                self.tell_drawn();
                Ok(())
            }
            Message::Ping(_) | Message::Pong(_) => Ok(()),
            Message::Close(_) => Err(End::Gone),
        }
    }

    /// Tells the hub once all of a picture has been sent, and acknowledged.
    fn tell_drawn(&self) {
        if let Some(exact) = &self.exact
            && self.flow.waiting_since().is_none()
        {
            self.hub.drawn(exact.number);
        }
    }

    fn check_stalled(&self) -> Result<(), End> {
        let now = Instant::now();
        let unanswered = self.flow.waiting_since().map_or(Duration::ZERO, |since| now - since);
        match unanswered >= self.stalled || now - self.heard_at >= self.stalled {
            true => Err(End::Stalled),
            false => Ok(()),
        }
    }

    /// Told four times a second.
    async fn send_status(&mut self) -> Result<(), End> {
        let meter = &mut self.status;
        let quarter = self.sent_bytes - meter.counted;
        meter.counted = self.sent_bytes;
        meter.quarters.rotate_left(1);
        meter.quarters[3] = quarter;
        meter.ticks += 1;
        let at_rest = self.exact.is_some() && meter.was_sent && quarter <= MOST_AT_REST;
        if at_rest && !meter.ticks.is_multiple_of(AT_REST) {
            return Ok(());
        }
        self.tell_status().await
    }

    async fn tell_status(&mut self) -> Result<(), End> {
        let newest = self.hub.pictures.borrow().clone();
        let Some(newest) = newest else { return Ok(()) };
        let exact = self.exact.as_ref().filter(|exact| exact.number == newest.number);
        // Of no use to whoever has not all of it. Worked out before the status is held: the hub would wait for it.
        let crc = exact.map_or(0, |exact| exact.crc());
        let message = {
            let newest_status = self.hub.statuses.borrow();
            let Some(status) = &newest_status.status else { return Ok(()) };
            StatusMessage {
                playing: newest_status.playing,
                exact: exact.is_some(),
                bytes_per_sec: self.status.quarters.iter().sum::<u64>() as u32,
                generation: newest.generation,
                picture: newest.number,
                crc,
                ..outgoing::status(status, newest.size.pixels())
            }
        };
        self.status.last_exact = exact.map(|exact| exact.number);
        self.status.was_sent = true;
        self.send(Message::binary(message.to_bytes())).await
    }

    async fn send(&mut self, message: Message) -> Result<(), End> {
        self.sent_bytes += message_bytes(&message);
        match timeout(self.stalled, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(End::Gone),
            Err(_) => Err(End::Stalled),
        }
    }

    /// Says why, if the other side may still hear it.
    async fn close(mut self, end: End) {
        let (code, reason) = match end {
            End::Gone => (close_code::AWAY, String::new()),
            End::Invalid(error) => (close_code::POLICY, error.to_string()),
            End::TooLong => (close_code::SIZE, "a message of more than 1 MiB".to_owned()),
            End::Stalled => (close_code::AWAY, "not heard of for too long".to_owned()),
        };
        let frame = CloseFrame { code, reason: shortened(&reason).into() };
        let farewell = self.socket.send(Message::Close(Some(frame)));
        // A client that is gone does not matter any more.
        drop(timeout(Duration::from_secs(1), farewell).await);
    }
}

/// Less than this in a quarter of a second is no picture.
const MOST_AT_REST: u64 = 200;

/// With a WebSocket's header.
fn message_bytes(message: &Message) -> u64 {
    let payload = match message {
        Message::Text(text) => text.len(),
        Message::Binary(bytes) | Message::Ping(bytes) | Message::Pong(bytes) => bytes.len(),
        Message::Close(_) => 0,
    };
    let header = match payload {
        0..=125 => 2,
        126..=0xffff => 4,
        _ => 10,
    };
    (header + payload) as u64
}

/// A WebSocket's reason has at most 123 bytes.
fn shortened(reason: &str) -> String {
    let mut end = reason.len().min(120);
    while !reason.is_char_boundary(end) {
        end -= 1;
    }
    reason[..end].to_owned()
}

/// What a task has made, which is then forgotten; None if it failed.
async fn joined(making: &mut Option<JoinHandle<Ready>>) -> Option<Ready> {
    let ready = match making {
        Some(task) => task.await.ok(),
        None => std::future::pending().await,
    };
    *making = None;
    ready
}

impl Look {
    /// Ends at the moment that is waited for, and else never.
    async fn its_moment(self) {
        match self {
            Look::At(moment) => sleep_until(moment.into()).await,
            Look::Now | Look::Later => std::future::pending().await,
        }
    }
}
