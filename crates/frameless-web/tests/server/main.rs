//! A live server, and clients that are no browsers: what is streamed, who is let in, and what becomes of those that misbehave.

mod clients;
mod door;
mod hostile;
mod rest;
mod stream;
mod support;
