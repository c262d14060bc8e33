//! The contenders, one file each: frameless ones and the strongest of what is used instead.

mod blind;
mod framed;
mod framed_single;
mod frameless;
mod lowres;
mod oracle_hold;
mod progressive;
mod temporal;

pub(crate) use blind::Blind;
pub(crate) use framed::Framed;
pub(crate) use framed_single::FramedSingle;
pub(crate) use frameless::Frameless;
pub(crate) use lowres::LowRes;
pub(crate) use oracle_hold::OracleHold;
pub(crate) use progressive::Progressive;
pub(crate) use temporal::Temporal;
