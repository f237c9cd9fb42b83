//! When to use fast sync read.
//!
//! A fast reply is one packet that the servos write in turn, so one silent servo also silences those
//! behind it, in every exchange. Plain sync read loses only the silent one. So: plain while any servo is
//! missing, fast while all answer.

use crate::bus::timing::GroupRead;

/// Plain exchanges in a row that must bring every reply before the fast read is tried.
///
/// A try that fails costs the servos behind the break one cycle's news. With 50 that is at most one cycle
/// in 51, and yet the fast read is back within half a second at 100 Hz.
const WHOLE_CYCLES_BEFORE_FAST: u32 = 50;

/// Tries in a row that may fail on a bus whose fast read never worked. All servos had answered the plain
/// read until then, so it is the fast read that some of them do not know: their firmware is too old
/// (XL330 learned it in version 46).
const TRIES: u32 = 3;

#[derive(Debug)]
pub(super) enum ReadMode {
    /// Plain, after this many whole exchanges in a row.
    Plain { whole_cycles: u32, tries: u32 },
    /// Fast; it worked before when `tries` is 0.
    Fast { tries: u32 },
    /// Plain for good.
    PlainOnly,
}

impl ReadMode {
    /// A Dynamixel bus: plain until all servos are heard.
    pub(super) fn new() -> ReadMode {
        ReadMode::Plain { whole_cycles: 0, tries: 1 }
    }

    pub(super) fn group_read(&self) -> GroupRead {
        match self {
            ReadMode::Fast { .. } => GroupRead::Fast,
            ReadMode::Plain { .. } | ReadMode::PlainOnly => GroupRead::Plain,
        }
    }

    /// An exchange ended; whether it brought every reply.
    pub(super) fn end_cycle(&mut self, is_whole: bool) {
        *self = match *self {
            ReadMode::Plain { tries, .. } if !is_whole => ReadMode::Plain { whole_cycles: 0, tries },
            ReadMode::Plain { whole_cycles, tries } if whole_cycles + 1 == WHOLE_CYCLES_BEFORE_FAST => {
                ReadMode::Fast { tries }
            }
            ReadMode::Plain { whole_cycles, tries } => {
                ReadMode::Plain { whole_cycles: whole_cycles + 1, tries }
            }
            ReadMode::Fast { .. } if is_whole => ReadMode::Fast { tries: 0 },
            ReadMode::Fast { tries: TRIES } => ReadMode::PlainOnly,
            ReadMode::Fast { tries: 0 } => ReadMode::Plain { whole_cycles: 0, tries: 0 },
            ReadMode::Fast { tries } => ReadMode::Plain { whole_cycles: 0, tries: tries + 1 },
            ReadMode::PlainOnly => ReadMode::PlainOnly,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run_plain(mode: &mut ReadMode) {
        for _ in 0..WHOLE_CYCLES_BEFORE_FAST {
            assert_eq!(mode.group_read(), GroupRead::Plain);
            mode.end_cycle(true);
        }
    }

    #[test]
    fn fast_while_it_works_and_again_after_a_break() {
        let mut mode = ReadMode::new();
        for _ in 0..10 {
            run_plain(&mut mode);
            for _ in 0..100 {
                assert_eq!(mode.group_read(), GroupRead::Fast);
                mode.end_cycle(true);
            }
            mode.end_cycle(false);
        }
    }

    #[test]
    fn a_silent_servo_keeps_it_plain() {
        let mut mode = ReadMode::new();
        for cycle in 0..1000 {
            assert_eq!(mode.group_read(), GroupRead::Plain);
            mode.end_cycle(cycle % 49 != 0);
        }
    }

    #[test]
    fn servos_that_never_answer_it_are_no_longer_asked() {
        let mut mode = ReadMode::new();
        let mut fast = 0;
        for _ in 0..10_000 {
            let is_plain = mode.group_read() == GroupRead::Plain;
            fast += u32::from(!is_plain);
            mode.end_cycle(is_plain);
        }
        assert_eq!(fast, TRIES);
    }
}
