//! Linux: monotonic clock, the two waits, low latency on serial lines, real-time scheduling.
//!
//! Only this file makes system calls that have no safe wrapper. No function allocates, except
//! [`request_real_time`].
#![allow(unsafe_code, reason = "ppoll on a kept list, serial flags and the scheduler have no safe wrapper")]

use std::io;
use std::num::NonZeroU64;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::time::Duration;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::{ClockId, CpuSet, Timespec, clock_nanosleep_absolute};
use rustix::time::clock_gettime;
use serialport::TTYPort;

/// Time on the monotonic clock since some point before the program started.
pub fn monotonic() -> Duration {
    Duration::try_from(clock_gettime(ClockId::Monotonic)).unwrap_or_default()
}

/// Processor time the calling thread has used.
pub fn thread_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap_or_default()
}

/// Processor time all threads of the process have used.
pub fn process_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ProcessCPUTime)).unwrap_or_default()
}

/// Sleeps until `deadline` on the clock of [`monotonic`], whatever signals arrive.
pub fn sleep_until(deadline: Duration) {
    let Ok(deadline) = Timespec::try_from(deadline) else { return };
    while clock_nanosleep_absolute(ClockId::Monotonic, &deadline) == Err(rustix::io::Errno::INTR) {}
}

/// The descriptor of an open port.
pub(crate) fn descriptor(port: &TTYPort) -> BorrowedFd<'_> {
    // SAFETY: the port owns this descriptor and stays open as long as it is borrowed.
    unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) }
}

/// What poll(2) reported about a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Readiness {
    /// Nothing to report.
    Quiet,
    /// There are bytes to read, or a read will report why not.
    Input,
    /// It was hung up and there is nothing left to read.
    HungUp,
}

/// A list of lines for poll(2), kept so that a wait allocates nothing.
#[derive(Debug)]
pub(crate) struct PollList {
    entries: Vec<libc::pollfd>,
}

impl PollList {
    /// A list for `count` lines, none of them there yet.
    pub(crate) fn new(count: usize) -> PollList {
        // The kernel skips negative descriptors.
        PollList { entries: vec![libc::pollfd { fd: -1, events: libc::POLLIN, revents: 0 }; count] }
    }

    /// Polls `port` in this place from now on, or nothing.
    pub(crate) fn set(&mut self, place: usize, port: Option<&TTYPort>) {
        if let Some(entry) = self.entries.get_mut(place) {
            entry.fd = port.map_or(-1, AsRawFd::as_raw_fd);
            entry.revents = 0;
        }
    }

    /// Waits until any line has data or an error, at most until `deadline` on the clock of [`monotonic`].
    pub(crate) fn wait_until(&mut self, deadline: Duration) {
        loop {
            let left = deadline.saturating_sub(monotonic());
            let timeout = libc::timespec {
                tv_sec: libc::time_t::try_from(left.as_secs()).unwrap_or(libc::time_t::MAX),
                tv_nsec: libc::c_long::from(left.subsec_nanos().cast_signed()),
            };
            let count = libc::nfds_t::try_from(self.entries.len()).unwrap_or(0);
            // SAFETY: `entries` holds `count` initialised pollfd and nothing else uses it during the call;
            // `timeout` outlives the call; a null signal mask leaves the thread's own in place.
            let found = unsafe { libc::ppoll(self.entries.as_mut_ptr(), count, &timeout, std::ptr::null()) };
            let is_interrupted = found < 0 && io::Error::last_os_error().kind() == io::ErrorKind::Interrupted;
            if !is_interrupted {
                return;
            }
        }
    }

    /// What the last wait reported about the line in this place.
    pub(crate) fn readiness(&self, place: usize) -> Readiness {
        match self.entries.get(place).map_or(0, |entry| entry.revents) {
            0 => Readiness::Quiet,
            found if found & libc::POLLIN != 0 => Readiness::Input,
            _ => Readiness::HungUp,
        }
    }
}

/// Asks the driver to hand over bytes as they come (`ASYNC_LOW_LATENCY`); FTDI's driver then uses a latency of 1
/// ms.
///
/// # Errors
/// If the driver has no such flag; pseudo-terminals and CDC-ACM adapters need none.
pub(crate) fn set_low_latency(port: &TTYPort) -> io::Result<()> {
    /// `struct serial_struct` of linux/serial.h is 60 to 72 bytes; `flags` is its fifth int.
    const INTS: usize = 32;
    const FLAGS: usize = 4;
    /// linux/tty_flags.h
    const ASYNC_LOW_LATENCY: libc::c_int = 1 << 13;
    let mut settings: [libc::c_int; INTS] = [0; INTS];
    // SAFETY: the kernel writes one serial_struct, which has room in `settings`.
    if unsafe { libc::ioctl(port.as_raw_fd(), libc::TIOCGSERIAL, settings.as_mut_ptr()) } != 0 {
        return Err(io::Error::last_os_error());
    }
    settings[FLAGS] |= ASYNC_LOW_LATENCY;
    // SAFETY: the kernel reads the serial_struct it wrote above.
    if unsafe { libc::ioctl(port.as_raw_fd(), libc::TIOCSSERIAL, settings.as_ptr()) } != 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}

/// Priority of the loop among real-time threads, 1 to 99: above the kernel's interrupt threads (50), which the
/// loop lets run whenever it waits.
const PRIORITY: libc::c_int = 79;
/// Priority of the guard, above the loop's: a loop that computes forever would keep it from the only processor of a
/// small machine. The system must permit this priority.
const GUARD_PRIORITY: libc::c_int = 80;
/// Stack the loop may use without a page fault, bytes.
const STACK_BYTES: usize = 256 * 1024;

/// Requests what keeps the calling thread punctual: fixed priority (`SCHED_FIFO`), memory locked in RAM,
/// timers without slack and, if given, one `processor` to stay on. Threads made later inherit the processor but not
/// the priority.
///
/// Call it on the loop's thread, when all its memory is allocated. Returns a line of text for each request:
/// what was permitted, and how to permit what was not. None of the requests is required.
pub fn request_real_time(processor: Option<usize>) -> Vec<String> {
    let mut said = Vec::new();
    said.push(match set_fixed_priority() {
        Ok(()) => format!("real-time priority {PRIORITY}"),
        Err(error) => format!(
            "no real-time priority ({error}): other programs can delay the loop; permit it with 'rtprio {GUARD_PRIORITY}' \
             for your user in /etc/security/limits.conf"
        ),
    });
    touch_stack();
    // Lock only present memory: with a limit, locking future memory too would make later allocations fail.
    said.push(match mlockall(MlockAllFlags::CURRENT) {
        Ok(()) => "memory locked in RAM".to_owned(),
        Err(error) => format!(
            "memory not locked in RAM ({error}): swapping can delay the loop; permit it with 'memlock unlimited' \
             for your user in /etc/security/limits.conf"
        ),
    });
    if let Err(error) = rustix::thread::set_current_timer_slack(NonZeroU64::new(1)) {
        said.push(format!("timers with slack ({error}): waits may end 50 us late"));
    }
    if let Some(processor) = processor {
        said.push(match keep_to(processor) {
            // Nothing here keeps other programs off that processor.
            Ok(()) => format!(
                "kept to processor {processor}, which other programs may use too; 'isolcpus={processor}' on the \
                 kernel's command line keeps them off it"
            ),
            Err(error) => format!(
                "not kept to processor {processor} ({error}): choose one of the machine's, counted from 0"
            ),
        });
    }
    said
}

/// Requests what keeps the guard punctual: a priority above the loop's, and memory locked in RAM. Neither is
/// required.
pub fn request_guard_priority() {
    let _ = set_priority(libc::SCHED_FIFO, GUARD_PRIORITY);
    touch_stack();
    let _ = mlockall(MlockAllFlags::CURRENT);
}

/// Makes the calling thread an ordinary one again: work after the loop has no claim on the processor. Does
/// nothing to a thread that never was real-time.
pub fn end_real_time() {
    let _ = set_priority(libc::SCHED_OTHER, 0);
}

fn set_fixed_priority() -> io::Result<()> {
    set_priority(libc::SCHED_FIFO, PRIORITY)
}

fn set_priority(policy: libc::c_int, priority: libc::c_int) -> io::Result<()> {
    // SAFETY: all-zero is a valid sched_param; on some C libraries it has more fields than the one set here.
    let mut parameters: libc::sched_param = unsafe { std::mem::zeroed() };
    parameters.sched_priority = priority;
    // Once the flag is set, the kernel refuses even the way back without it (sched(7)).
    let policy = policy | libc::SCHED_RESET_ON_FORK;
    // SAFETY: 0 is the calling thread; `parameters` outlives the call.
    match unsafe { libc::sched_setscheduler(0, policy, &parameters) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

fn keep_to(processor: usize) -> io::Result<()> {
    if processor >= CpuSet::MAX_CPU {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut processors = CpuSet::new();
    processors.set(processor);
    Ok(rustix::thread::sched_setaffinity(None, &processors)?)
}

/// Makes the kernel allocate the stack's pages now.
#[inline(never)]
fn touch_stack() {
    let mut pages = [0_u8; STACK_BYTES];
    std::hint::black_box(&mut pages);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_ends_after_its_deadline_and_a_past_one_at_once() {
        let deadline = monotonic() + Duration::from_millis(2);
        sleep_until(deadline);
        assert!(monotonic() >= deadline);
        sleep_until(Duration::ZERO);
    }

    #[test]
    fn a_wait_on_no_lines_lasts_until_its_deadline() {
        let mut list = PollList::new(3);
        let deadline = monotonic() + Duration::from_millis(2);
        list.wait_until(deadline);
        assert!(monotonic() >= deadline);
        assert_eq!(list.readiness(0), Readiness::Quiet);
        list.wait_until(Duration::ZERO);
    }

    #[test]
    fn a_wait_ends_on_input_and_on_hang_up() {
        let (mut near, far) = TTYPort::pair().unwrap();
        let mut list = PollList::new(1);
        list.set(0, Some(&far));
        let later = monotonic() + Duration::from_secs(60);
        io::Write::write_all(&mut near, b"x").unwrap();
        list.wait_until(later);
        assert_eq!(list.readiness(0), Readiness::Input);
        rustix::io::read(descriptor(&far), &mut [0; 8]).unwrap();
        drop(near);
        list.wait_until(later);
        assert_ne!(list.readiness(0), Readiness::Quiet);
    }

    #[test]
    fn a_pseudo_terminal_has_no_latency_to_lower() {
        let (_near, far) = TTYPort::pair().unwrap();
        assert!(set_low_latency(&far).is_err());
    }

    #[test]
    fn the_outcome_of_the_request_for_real_time_is_reported() {
        // A separate thread, so that its priority ends with it.
        let asked = std::thread::spawn(|| {
            let said = request_real_time(Some(usize::MAX));
            // SAFETY: 0 is the calling thread.
            let policies = [unsafe { libc::sched_getscheduler(0) }, {
                end_real_time();
                // SAFETY: as above.
                unsafe { libc::sched_getscheduler(0) }
            }];
            (said, policies)
        });
        let (said, policies) = asked.join().unwrap();
        let is_permitted = said[0].starts_with("real-time priority");
        let wanted = if is_permitted { libc::SCHED_FIFO } else { libc::SCHED_OTHER };
        assert_eq!(
            policies.map(|policy| policy & !libc::SCHED_RESET_ON_FORK),
            [wanted, libc::SCHED_OTHER],
            "{said:?}"
        );
        assert!(said.len() >= 3, "{said:?}");
        assert!(said[0].contains("real-time priority"), "{said:?}");
        assert!(said[1].contains("RAM"), "{said:?}");
        let last = said.last().unwrap();
        assert!(last.starts_with("not kept to processor"), "{last}");
    }
}
