//! Who is connected, and who of them drives.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::Secret;
use crate::mailbox::{Kind, Mailbox};
use crate::wire::{Level, Told};

/// The clients by number.
#[derive(Default)]
pub(crate) struct Roster {
    clients: BTreeMap<u32, Client>,
    driver: Option<u32>,
}

struct Client {
    token: Secret,
    mailbox: Arc<Mailbox>,
}

impl Roster {
    /// A client more; it drives if it is the only one.
    pub(crate) fn join(&mut self, client: u32, token: Secret, mailbox: Arc<Mailbox>) {
        if self.clients.is_empty() {
            self.driver = Some(client);
        }
        self.clients.insert(client, Client { token, mailbox });
    }

    /// Who has that token.
    pub(crate) fn with_token(&self, token: &str) -> Option<u32> {
        // All are compared, so that the time taken does not tell which was right.
        self.clients.iter().fold(
            None,
            |found, (&number, client)| {
                if client.token.is(token) { Some(number) } else { found }
            },
        )
    }

    /// `heir` takes the place of a client whose connection is lost, and the helm if that had it.
    pub(crate) fn succeed(&mut self, lost: u32, heir: u32) {
        if let Some(client) = self.clients.remove(&lost) {
            client.mailbox.close();
        }
        if self.driver == Some(lost) {
            self.driver = Some(heir);
        }
    }

    /// A client less; if it drove, nobody does.
    pub(crate) fn leave(&mut self, client: u32) {
        self.clients.remove(&client);
        self.release(client);
    }

    /// The client drives from now on, whoever did before. Returns who did.
    pub(crate) fn take(&mut self, client: u32) -> Option<u32> {
        let connected = self.clients.contains_key(&client).then_some(client)?;
        self.driver.replace(connected).filter(|before| *before != client)
    }

    /// Nobody drives, if the client did.
    pub(crate) fn release(&mut self, client: u32) {
        self.driver.take_if(|driver| *driver == client);
    }

    /// Whether the client may do something: it drives, or nobody did and it does now.
    pub(crate) fn may_act(&mut self, client: u32) -> bool {
        if self.driver.is_none() {
            self.take(client);
        }
        self.driver == Some(client)
    }

    pub(crate) fn driver(&self) -> Option<u32> {
        self.driver
    }

    pub(crate) fn len(&self) -> usize {
        self.clients.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.clients.is_empty()
    }

    /// To everybody.
    pub(crate) fn put(&self, kind: Kind, told: &Told) {
        let message: Arc<str> = told.to_json().into();
        self.clients.values().for_each(|client| client.mailbox.put(kind, Arc::clone(&message)));
    }

    /// To everybody.
    pub(crate) fn notice(&self, level: Level, text: String) {
        let message: Arc<str> = Told::Notice { level, text }.to_json().into();
        self.clients.values().for_each(|client| client.mailbox.notice(Arc::clone(&message)));
    }

    /// To one.
    pub(crate) fn notice_to(&self, client: u32, level: Level, text: String) {
        if let Some(client) = self.clients.get(&client) {
            client.mailbox.notice(Told::Notice { level, text }.to_json().into());
        }
    }

    /// There will be no more.
    pub(crate) fn close(&self) {
        self.clients.values().for_each(|client| client.mailbox.close());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roster(clients: u32) -> Roster {
        let mut roster = Roster::default();
        (1..=clients).for_each(|client| {
            roster.join(client, Secret::new().unwrap(), Arc::default());
        });
        roster
    }

    #[test]
    fn the_first_drives_and_the_others_watch() {
        let mut roster = roster(2);
        assert!(roster.may_act(1) && !roster.may_act(2));
    }

    #[test]
    fn who_asks_drives() {
        let mut roster = roster(2);
        assert_eq!(roster.take(2), Some(1));
        assert!(roster.may_act(2) && !roster.may_act(1));
        assert_eq!(roster.take(2), None, "already");
        assert_eq!(roster.take(9), None);
        assert_eq!(roster.driver(), Some(2), "9 is not connected");
    }

    #[test]
    fn who_comes_back_with_its_token_has_what_it_had() {
        let mut roster = roster(2);
        let token = roster.clients[&1].token.as_str().to_owned();
        assert_eq!(roster.with_token(&token), Some(1));
        assert_eq!(roster.with_token(&token[1..]), None);
        roster.join(3, Secret::new().unwrap(), Arc::default());
        roster.succeed(1, 3);
        assert_eq!((roster.driver(), roster.len()), (Some(3), 2));
        assert_eq!(roster.with_token(&token), None, "a token is good for once");
        // That its old connection ends later changes nothing.
        roster.leave(1);
        assert_eq!(roster.driver(), Some(3));
        roster.join(4, Secret::new().unwrap(), Arc::default());
        roster.succeed(2, 4);
        assert_eq!(roster.driver(), Some(3), "2 did not drive");
    }

    #[test]
    fn a_driver_that_leaves_is_followed_by_who_does_something() {
        let mut roster = roster(3);
        roster.leave(1);
        assert_eq!(roster.driver(), None);
        assert!(roster.may_act(3) && !roster.may_act(2));
        roster.release(2);
        assert_eq!(roster.driver(), Some(3), "2 had nothing to release");
        roster.release(3);
        assert!(roster.may_act(2));
    }
}
