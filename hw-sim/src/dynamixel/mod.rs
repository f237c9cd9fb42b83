//! Dynamixel Protocol 2.0, as a servo sees it. Source: ROBOTIS e-manual, Protocol 2.0 and X-series pages.

pub(crate) mod answer;
pub(crate) mod control;
pub(crate) mod packet;
