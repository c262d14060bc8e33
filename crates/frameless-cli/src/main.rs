//! `frameless`
fn main() {}
