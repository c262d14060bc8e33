//! The program as its user meets it: what it prints, how it ends, what it leaves behind.

mod bad_input;
mod bad_scenes;
mod bench;
mod compare;
mod good_input;
mod help;
mod hostile;
mod run;
mod serve;
