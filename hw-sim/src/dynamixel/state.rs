//! What a Dynamixel holds besides its registers. In: nothing. Out: the data.

use super::control::Motion;
use super::table::Addressee;
use crate::registers::RegisterFile;

/// All of it but the backup is gone after a reboot.
#[derive(Debug, Default)]
pub(crate) struct State {
    /// What Reg Write has registered: address, data and by what name it came.
    pub(super) registered: Option<(u16, Vec<u8>, Addressee)>,
    /// What Control Table Backup has stored.
    pub(super) backup: Option<RegisterFile>,
    /// When Realtime Tick was 0, ns.
    pub(super) started_ns: Option<u64>,
    /// How it is moving.
    pub(super) motion: Motion,
}
