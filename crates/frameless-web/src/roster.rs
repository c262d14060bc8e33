//! Who is connected, and who of them drives.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::mailbox::{Kind, Mailbox};
use crate::wire::{Level, Told};

/// The clients by number.
#[derive(Default)]
pub(crate) struct Roster {
    clients: BTreeMap<u32, Arc<Mailbox>>,
    driver: Option<u32>,
}

impl Roster {
    /// A client more; it drives if nobody does.
    pub(crate) fn join(&mut self, client: u32, mailbox: Arc<Mailbox>) {
        self.clients.insert(client, mailbox);
        self.driver.get_or_insert(client);
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
        self.clients.values().for_each(|mailbox| mailbox.put(kind, Arc::clone(&message)));
    }

    /// To everybody.
    pub(crate) fn notice(&self, level: Level, text: String) {
        let message: Arc<str> = Told::Notice { level, text }.to_json().into();
        self.clients.values().for_each(|mailbox| mailbox.notice(Arc::clone(&message)));
    }

    /// To one.
    pub(crate) fn notice_to(&self, client: u32, level: Level, text: String) {
        if let Some(mailbox) = self.clients.get(&client) {
            mailbox.notice(Told::Notice { level, text }.to_json().into());
        }
    }

    /// There will be no more.
    pub(crate) fn close(&self) {
        self.clients.values().for_each(|mailbox| mailbox.close());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roster(clients: u32) -> Roster {
        let mut roster = Roster::default();
        (1..=clients).for_each(|client| roster.join(client, Arc::default()));
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
