//! Decides when to use fast sync read.
//!
//! A fast reply is one packet that the servos write in turn, so one silent servo also silences those after it, in
//! every exchange. Plain sync read loses only the silent one. So the client reads plain while any servo is missing,
//! and fast while all answer.

use crate::bus::timing::GroupRead;

/// Number of complete plain exchanges in a row before the client tries the fast read.
///
/// A failed try costs the servos after the break one cycle's feedback. With 50 that is at most one cycle
/// in 51, yet the fast read is back within half a second at 100 Hz.
const WHOLE_CYCLES_BEFORE_FAST: u32 = 50;

/// Failed tries in a row after which a bus whose fast read never worked stays plain. All servos had answered the
/// plain read until then, so some of them do not know the fast read: their firmware is too old (XL330 learned it in
/// version 46).
const TRIES: u32 = 3;

#[derive(Debug)]
pub(super) enum ReadMode {
    /// Plain, after this many complete exchanges in a row.
    Plain { whole_cycles: u32, tries: u32 },
    /// Fast; it worked before when `tries` is 0.
    Fast { tries: u32 },
    /// Plain permanently.
    PlainOnly,
}

impl ReadMode {
    /// The mode of a Dynamixel bus at the start: plain until all servos are heard.
    pub(super) fn new() -> ReadMode {
        ReadMode::Plain { whole_cycles: 0, tries: 1 }
    }

    pub(super) fn group_read(&self) -> GroupRead {
        match self {
            ReadMode::Fast { .. } => GroupRead::Fast,
            ReadMode::Plain { .. } | ReadMode::PlainOnly => GroupRead::Plain,
        }
    }

    /// Notes that an exchange ended, and whether it brought every reply.
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
    fn fast_reads_resume_after_a_damaged_reply() {
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
    fn a_silent_servo_keeps_reads_plain() {
        let mut mode = ReadMode::new();
        for cycle in 0..1000 {
            assert_eq!(mode.group_read(), GroupRead::Plain);
            mode.end_cycle(cycle % 49 != 0);
        }
    }

    #[test]
    fn servos_that_never_answer_fast_reads_get_plain_ones() {
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
