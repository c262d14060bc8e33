//! How many connections are answered at once, and who makes room: those that have not shown the secret, the oldest first.
//!
//! Whoever is on the same machine can connect, and say nothing for as long as a request's headers may take. If such connections held their
//! places, whoever has the secret would find none.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

/// The places, and those who have one without having shown the secret.
pub(crate) struct Door {
    places: Arc<Semaphore>,
    strangers: Mutex<Strangers>,
}

/// By number, the oldest first; each is woken when it has to go.
#[derive(Default)]
struct Strangers {
    waiting: BTreeMap<u64, Arc<Notify>>,
    last: u64,
}

/// A connection that has a place.
pub(crate) struct Visitor {
    door: Arc<Door>,
    number: u64,
    has_to_go: Arc<Notify>,
}

impl Door {
    /// With so many places.
    pub(crate) fn new(places: usize) -> Arc<Door> {
        let places = Arc::new(Semaphore::new(places));
        Arc::new(Door { places, strangers: Mutex::default() })
    }

    /// A place for one connection more. None where everybody has shown the secret: then somebody who has it holds all of them.
    pub(crate) async fn enter(self: &Arc<Door>) -> Option<(Arc<Visitor>, OwnedSemaphorePermit)> {
        let place = match Arc::clone(&self.places).try_acquire_owned() {
            Ok(place) => place,
            Err(_) => {
                let (_, oldest) = self.strangers().waiting.pop_first()?;
                oldest.notify_one();
                // It goes at once: it waits for nothing but that.
                Arc::clone(&self.places).acquire_owned().await.ok()?
            }
        };
        let has_to_go = Arc::new(Notify::new());
        let mut strangers = self.strangers();
        strangers.last += 1;
        let number = strangers.last;
        strangers.waiting.insert(number, Arc::clone(&has_to_go));
        drop(strangers);
        Some((Arc::new(Visitor { door: Arc::clone(self), number, has_to_go }), place))
    }

    fn strangers(&self) -> MutexGuard<'_, Strangers> {
        self.strangers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Visitor {
    /// It has shown the secret: it makes room for nobody any more.
    pub(crate) fn is_known(&self) {
        self.door.strangers().waiting.remove(&self.number);
    }

    /// Returns when somebody else needs the place.
    pub(crate) async fn has_to_go(&self) {
        self.has_to_go.notified().await;
    }
}

impl Drop for Visitor {
    fn drop(&mut self) {
        self.door.strangers().waiting.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_oldest_stranger_makes_room_and_who_is_known_does_not() {
        let door = Door::new(3);
        let (first, first_place) = door.enter().await.unwrap();
        let (second, second_place) = door.enter().await.unwrap();
        let (_third, _third_place) = door.enter().await.unwrap();
        first.is_known();
        let leaves = tokio::spawn(async move {
            second.has_to_go().await;
            drop(second_place);
        });
        let fourth = door.enter().await;
        assert!(fourth.is_some());
        leaves.await.unwrap();
        // What is known stays: nobody has told it to go.
        let told = tokio::time::timeout(std::time::Duration::from_millis(20), first.has_to_go());
        assert!(told.await.is_err());
        drop(first_place);
    }

    #[tokio::test]
    async fn where_all_are_known_there_is_no_room() {
        let door = Door::new(1);
        let (visitor, _place) = door.enter().await.unwrap();
        visitor.is_known();
        assert!(door.enter().await.is_none());
    }
}
