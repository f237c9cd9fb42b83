//! The state of a Dynamixel besides its registers. In: nothing. Out: the data.

use super::control::Motion;
use super::table::Addressee;
use crate::registers::RegisterFile;

/// All of it but the backup is lost in a reboot.
#[derive(Debug, Default)]
pub(crate) struct State {
    /// Write registered by Reg Write: address, data and how the servo was addressed.
    pub(super) registered: Option<(u16, Vec<u8>, Addressee)>,
    /// Registers stored by Control Table Backup.
    pub(super) backup: Option<RegisterFile>,
    /// When Realtime Tick was 0, ns.
    pub(super) started_ns: Option<u64>,
    /// The state of its motion.
    pub(super) motion: Motion,
}
