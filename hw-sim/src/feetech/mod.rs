//! Feetech FT-SCS, as a servo sees it. Source: Feetech wiki, reference, protocol ft-scs and memory-sts.

pub(crate) mod answer;
pub(crate) mod control;
pub(crate) mod packet;
