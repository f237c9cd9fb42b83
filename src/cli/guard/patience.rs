//! How long the guard waits for a loop that gives no sign of life.
//!
//! A loop that hangs waits for something that does not come, computes without end, or was stopped: one second of
//! that is too much. A loop that could run, but is kept from it by other programs or by memory that comes from a
//! disk, will continue: to kill it would turn a delay into a fall. So while the loop could run, only the processor
//! time it has used counts. Meanwhile its servos hold their last goal, so this wait has a limit too.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::time::Duration;

/// How long the loop may be silent by its own fault. Servos hold their last goal meanwhile, which is harmless for a
/// moment; a fall because the machine was busy for a moment is not.
pub(super) const HANGS: Duration = Duration::from_secs(1);
/// How long it may be silent altogether.
pub(super) const STARVES: Duration = Duration::from_secs(5);
/// Time between the guard's looks. If the guard was held up itself, perhaps with the whole machine, that counts as
/// one look.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Unit of times in /proc: a hundredth of a second, whatever the machine (USER_HZ).
const TICK: Duration = Duration::from_millis(10);

/// State of the loop's thread, from the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Thread {
    /// True if it runs, or would with a processor and the memory it waits for.
    is_ready: bool,
    /// Processor time it has had so far.
    ran: Duration,
}

/// Where the system reports that state.
pub(super) struct ThreadStat(Option<File>);

/// Why the guard stops waiting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cause {
    /// It hangs, or was stopped.
    Hangs,
    /// Other programs kept it from running.
    Starves,
}

/// The silence of a loop so far, updated at each look.
#[derive(Debug, Default)]
pub(super) struct SilenceTimer {
    /// True while the loop runs: it has begun and not ended.
    is_beating: bool,
    /// How long it has been silent, and how much of that by its own fault.
    silent: Duration,
    hung: Duration,
    /// Its processor time at the last look.
    ran: Option<Duration>,
}

impl ThreadStat {
    /// For the first thread of `process`, where its loop runs. If the system reports nothing, neither does this.
    pub(super) fn of(process: i32) -> ThreadStat {
        ThreadStat(File::open(format!("/proc/{process}/task/{process}/stat")).ok())
    }

    pub(super) fn look(&self) -> Option<Thread> {
        let mut text = [0; 1024];
        let count = self.0.as_ref()?.read_at(&mut text, 0).ok()?;
        Thread::of_stat(std::str::from_utf8(&text[..count]).ok()?)
    }
}

impl Thread {
    /// Parses the text of a `stat` file (proc(5)).
    fn of_stat(text: &str) -> Option<Thread> {
        // The program's name, in brackets, may contain brackets and blanks.
        let (_, fields) = text.rsplit_once(") ")?;
        let fields: Vec<&str> = fields.split(' ').take(13).collect();
        let [state, .., user, system] = fields[..] else { return None };
        let ticks: u32 = user.parse::<u32>().ok()?.checked_add(system.parse().ok()?)?;
        Some(Thread { is_ready: fields.len() == 13 && matches!(state, "R" | "D"), ran: TICK * ticks })
    }
}

impl SilenceTimer {
    /// Notes a sign of life; `beats` is true if the loop continues.
    pub(super) fn hear(&mut self, beats: bool) {
        *self = SilenceTimer { is_beating: beats, ..SilenceTimer::default() };
    }

    /// Notes that nothing was heard since the last look; `thread` is the state of the loop's thread, `None` if the
    /// system does not report it. Returns the cause once the guard should stop waiting.
    pub(super) fn hear_nothing(&mut self, thread: Option<Thread>) -> Option<Cause> {
        if !self.is_beating {
            return None;
        }
        self.silent += LOOK_EVERY;
        self.hung += match thread {
            Some(thread) if thread.is_ready => {
                let before = self.ran.unwrap_or(thread.ran);
                thread.ran.saturating_sub(before).min(LOOK_EVERY)
            }
            _ => LOOK_EVERY,
        };
        self.ran = thread.map(|thread| thread.ran);
        if self.hung >= HANGS {
            Some(Cause::Hangs)
        } else if self.silent >= STARVES {
            Some(Cause::Starves)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thread(is_ready: bool, ran_ms: u64) -> Option<Thread> {
        Some(Thread { is_ready, ran: Duration::from_millis(ran_ms) })
    }

    /// Number of looks after which the guard gives up on a loop that is silent after its first beat, and why;
    /// `seen` gives the thread's state at each look.
    fn given_up(seen: impl Fn(u64) -> Option<Thread>) -> (u64, Cause) {
        let mut patience = SilenceTimer::default();
        patience.hear(true);
        (1..).find_map(|look| Some((look, patience.hear_nothing(seen(look))?))).unwrap()
    }

    #[test]
    fn the_guard_waits_a_second_for_a_hung_loop_and_five_for_one_that_may_not_run() {
        // Stopped, or waiting for something that does not come; or its state is unknown.
        assert_eq!(given_up(|_| thread(false, 700)), (10, Cause::Hangs));
        assert_eq!(given_up(|_| None), (10, Cause::Hangs));
        // It has the processor and does nothing useful. Its time before the first look is unknown.
        assert_eq!(given_up(|look| thread(true, 700 + 100 * look)), (11, Cause::Hangs));
        // It used a second before the guard could look again.
        assert_eq!(given_up(|look| thread(true, 5000 * look)), (11, Cause::Hangs));
        // It gets no processor time, or a hundredth.
        assert_eq!(given_up(|_| thread(true, 700)), (50, Cause::Starves));
        assert_eq!(given_up(|look| thread(true, 700 + look)), (50, Cause::Starves));
        // It hangs half of the time.
        assert_eq!(given_up(|look| thread(look % 2 == 0, 700)), (19, Cause::Hangs));
    }

    #[test]
    fn a_loop_that_is_heard_again_gets_the_full_wait_again() {
        let mut patience = SilenceTimer::default();
        for _ in 0..3 {
            patience.hear(true);
            for _ in 0..49 {
                assert_eq!(patience.hear_nothing(thread(true, 0)), None);
            }
            patience.hear(true);
            for _ in 0..9 {
                assert_eq!(patience.hear_nothing(thread(false, 0)), None);
            }
        }
    }

    #[test]
    fn silence_before_the_loop_begins_and_after_it_ends_means_nothing() {
        let mut patience = SilenceTimer::default();
        let waits = |patience: &mut SilenceTimer| {
            (0..1000).all(|_| patience.hear_nothing(thread(false, 0)).is_none())
        };
        assert!(waits(&mut patience));
        patience.hear(true);
        patience.hear(false);
        assert!(waits(&mut patience));
    }

    #[test]
    fn the_state_and_the_time_of_a_thread_are_read_whatever_its_name() {
        let stat = |name: &str, state: &str| {
            format!("71 ({name}) {state} 1 71 71 0 -1 4194560 103 0 0 0 12 30 0 0 20 0 1 0 4403 2 3\n")
        };
        let ran = Duration::from_millis(420);
        for name in ["hippocamp", "a) R (b", ") "] {
            for (state, is_ready) in
                [("R", true), ("D", true), ("S", false), ("T", false), ("t", false), ("Z", false)]
            {
                assert_eq!(
                    Thread::of_stat(&stat(name, state)),
                    Some(Thread { is_ready, ran }),
                    "{name} {state}"
                );
            }
        }
        for text in ["", "71 (hippocamp) R", "71 (hippocamp) R 1 71 71 0 -1 4194560 103 0 0 0 x 30 0"] {
            assert_eq!(Thread::of_stat(text), None, "{text}");
        }
    }

    #[test]
    fn the_processor_time_of_a_thread_is_read_and_a_dead_process_has_none() {
        let own = i32::try_from(std::process::id()).unwrap();
        let first = ThreadStat::of(own).look().unwrap();
        assert!(first.ran < Duration::from_secs(3600), "{first:?}");
        let mut child = std::process::Command::new("sh").args(["-c", "while :; do :; done"]).spawn().unwrap();
        let source = ThreadStat::of(i32::try_from(child.id()).unwrap());
        while source.look().is_none_or(|thread| !thread.is_ready || thread.ran.is_zero()) {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(source.look(), None);
    }
}
