//! The state of a Dynamixel besides its registers. In: nothing. Out: the data.

use super::control::Motion;
use super::table::Addressee;
use crate::registers::RegisterFile;
use crate::servo;

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

/// The state of a servo of this protocol.
pub(super) fn own(state: &servo::State) -> &State {
    state.downcast_ref().expect("a servo has the state of its kind")
}

/// The same, to change it.
pub(super) fn own_mut(state: &mut servo::State) -> &mut State {
    state.downcast_mut().expect("a servo has the state of its kind")
}
