//! Linux: a thread's use of processor and memory, and its waiting times.
#![allow(unsafe_code, reason = "getrusage has no safe wrapper")]

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::time::Duration;

/// Resources that a thread has used since it began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Usage {
    /// Time on a processor.
    pub processor: Duration,
    /// Time in which the thread was ready but another had the processor; `None` if the system does not count it.
    pub waited: Option<Duration>,
    /// Page faults that the thread waited for.
    pub page_faults: u64,
    /// Page faults among these that came from a disk.
    pub disk_faults: u64,
}

impl Usage {
    /// The usage after `before`.
    #[must_use]
    pub fn since(&self, before: &Usage) -> Usage {
        let waited = self.waited.zip(before.waited).map(|(now, then)| now.saturating_sub(then));
        Usage {
            processor: self.processor.saturating_sub(before.processor),
            waited,
            page_faults: self.page_faults.saturating_sub(before.page_faults),
            disk_faults: self.disk_faults.saturating_sub(before.disk_faults),
        }
    }
}

/// Measures the usage of one thread: the one that first calls it.
#[derive(Debug, Default)]
pub struct Meter {
    /// Scheduler times of the thread (/proc/thread-self/schedstat); `None` if the system keeps none.
    times: Option<File>,
    is_open: bool,
}

impl Meter {
    /// The usage so far. Allocates nothing after the first call.
    pub fn usage(&mut self) -> Usage {
        if !self.is_open {
            self.is_open = true;
            self.times = File::open("/proc/thread-self/schedstat").ok();
        }
        // SAFETY: all-zero is a valid rusage.
        let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
        // SAFETY: `usage` outlives the call; the kernel fills it.
        if unsafe { libc::getrusage(libc::RUSAGE_THREAD, &mut usage) } != 0 {
            return Usage::default();
        }
        let count = |count: libc::c_long| u64::try_from(count).unwrap_or(0);
        let time = |time: libc::timeval| {
            let [s, us] = [time.tv_sec, time.tv_usec].map(|part| u64::try_from(part).unwrap_or(0));
            Duration::from_secs(s) + Duration::from_micros(us)
        };
        let times = self.times.as_ref().and_then(scheduler_times);
        Usage {
            processor: times.map_or(time(usage.ru_utime) + time(usage.ru_stime), |(processor, _)| processor),
            waited: times.map(|(_, waited)| waited),
            page_faults: count(usage.ru_minflt) + count(usage.ru_majflt),
            disk_faults: count(usage.ru_majflt),
        }
    }
}

/// Time on a processor and time waited for one, from a schedstat file.
fn scheduler_times(file: &File) -> Option<(Duration, Duration)> {
    let mut text = [0; 96];
    let count = file.read_at(&mut text, 0).ok()?;
    times_of(std::str::from_utf8(&text[..count]).ok()?)
}

/// The first two numbers of a schedstat file, ns.
pub(super) fn times_of(text: &str) -> Option<(Duration, Duration)> {
    let mut numbers = text.split_ascii_whitespace().map(|number| number.parse().map(Duration::from_nanos));
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_computes_has_used_processor_time_and_pages() {
        let mut meter = Meter::default();
        let before = meter.usage();
        // More than the allocator ever keeps for reuse, so that each page is new.
        let mut pages = vec![0_u8; 40 << 20];
        while meter.usage().since(&before).processor < Duration::from_millis(2) {
            pages.fill(std::hint::black_box(1));
        }
        let since = meter.usage().since(&before);
        assert!(since.page_faults > 0 && since.disk_faults == 0, "{since:?}");
        // Another thread's usage does not count.
        let elsewhere = std::thread::spawn(|| Meter::default().usage()).join().unwrap();
        assert!(elsewhere.processor < since.processor, "{elsewhere:?} {since:?}");
    }

    #[test]
    fn scheduler_times_are_nanoseconds_and_other_text_gives_none() {
        assert_eq!(times_of("1002 7 2\n"), Some((Duration::from_nanos(1002), Duration::from_nanos(7))));
        for text in ["", "1002", "x 7 2", "-1 7 2"] {
            assert_eq!(times_of(text), None, "{text}");
        }
    }
}
