//! Serves a [`World`] to other programs: every bus, and the inertial measurement unit, on a pseudo-terminal, in real
//! time.
//!
//! In: bytes a program writes to a bus's terminal. Out: the servos' bytes, when they would have arrived. Each bus
//! has one path, a symbolic link, as an adapter has under `/dev/serial/by-id`. While a fault script has the adapter
//! out, the terminal behind the link is hung up; afterwards there is a new one. The line rate is the one the
//! program has set, and only servos set to the same rate understand it. One thread serves all buses. Linux only.

use std::fs;
use std::io;
use std::num::NonZeroU64;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use rustix::time::{ClockId, clock_gettime};

use crate::error::Unplugged;
use crate::world::World;

/// Longest time between checks for a stop and for adapters that come or go, ns.
const LOOK_EVERY_NS: u64 = 5_000_000;
/// Name of the link to the inertial measurement unit.
const IMU_LINK: &str = "imu";
/// Bytes moved at once; a terminal holds no more.
const PIECE_BYTES: usize = 4096;

/// Serves every bus of a world on a pseudo-terminal from a thread of its own, until dropped.
#[derive(Debug)]
pub struct PtyServer {
    shared: Arc<Shared>,
    links: Vec<PathBuf>,
    imu_link: Option<PathBuf>,
    server: Option<JoinHandle<()>>,
}

struct Shared {
    world: Mutex<World>,
    /// When the world's clock was 0.
    start: Duration,
    is_to_stop: AtomicBool,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").field("start", &self.start).finish_non_exhaustive()
    }
}

impl PtyServer {
    /// Serves `world` from now on. When this returns, each bus is at `folder` / its name. The world's clock
    /// continues from its present time.
    ///
    /// # Errors
    /// If the system has no free terminal, or a link cannot be made in `folder`.
    pub fn start(world: World, folder: &Path) -> io::Result<PtyServer> {
        PtyServer::start_prepared(world, folder, || {})
    }

    /// The same from a thread that calls `prepare` first. It may ask the system for a priority, for example, since
    /// on a real line no other program delays the servos.
    ///
    /// # Errors
    /// As [`PtyServer::start`].
    pub fn start_prepared(
        world: World,
        folder: &Path,
        prepare: impl FnOnce() + Send + 'static,
    ) -> io::Result<PtyServer> {
        let mut lines = Vec::new();
        let buses = world.lines().enumerate().map(|(bus, (name, _))| (End::Bus(bus), name));
        let imu = world.has_imu().then_some((End::Imu, IMU_LINK));
        for (end, name) in buses.chain(imu) {
            let mut line = Line { end, link: folder.join(name), terminal: None };
            line.plug_in()?;
            lines.push(line);
        }
        let link_of = |line: &Line| line.link.clone();
        let links = lines.iter().filter(|line| line.end != End::Imu).map(link_of).collect();
        let imu_link = lines.iter().find(|line| line.end == End::Imu).map(link_of);
        let shared = Arc::new(Shared {
            start: monotonic().saturating_sub(Duration::from_nanos(world.now_ns())),
            world: Mutex::new(world),
            is_to_stop: AtomicBool::new(false),
        });
        let theirs = Arc::clone(&shared);
        let server = std::thread::Builder::new().name("simulated servos".to_owned()).spawn(move || {
            prepare();
            serve(&theirs, &mut lines);
        })?;
        Ok(PtyServer { shared, links, imu_link, server: Some(server) })
    }

    /// Where programs find each bus, in the order of the world's buses.
    pub fn paths(&self) -> &[PathBuf] {
        &self.links
    }

    /// The path of the inertial measurement unit; `None` if the world has none.
    pub fn imu_path(&self) -> Option<&Path> {
        self.imu_link.as_deref()
    }

    /// Calls `look` with the world, advanced to the present, while it is being served. `look` should be quick: the
    /// world waits meanwhile.
    pub fn with_world<R>(&self, look: impl FnOnce(&mut World) -> R) -> R {
        look(&mut self.shared.present_world())
    }
}

impl Drop for PtyServer {
    /// Hangs up every terminal and removes the links.
    fn drop(&mut self) {
        self.shared.is_to_stop.store(true, Ordering::Relaxed);
        if let Some(server) = self.server.take() {
            let _ = server.join();
        }
        for link in self.links.iter().chain(&self.imu_link) {
            let _ = clear(link);
        }
    }
}

impl Shared {
    fn present_world(&self) -> MutexGuard<'_, World> {
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        let now = monotonic().saturating_sub(self.start);
        world.advance_to(u64::try_from(now.as_nanos()).unwrap_or(u64::MAX));
        world
    }
}

/// The device on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// A bus, by its index in the world.
    Bus(usize),
    /// The inertial measurement unit.
    Imu,
}

impl End {
    fn is_unplugged(self, world: &World) -> bool {
        match self {
            End::Bus(bus) => world.is_unplugged(bus),
            End::Imu => world.is_imu_unplugged(),
        }
    }

    fn set_host_baud(self, world: &mut World, baud: u32) {
        match self {
            End::Bus(bus) => world.set_host_baud(bus, baud),
            End::Imu => world.set_imu_host_baud(baud),
        }
    }

    fn send(self, world: &mut World, bytes: &[u8]) -> Result<(), Unplugged> {
        match self {
            End::Bus(bus) => world.host_send(bus, bytes),
            End::Imu => world.imu_send(bytes),
        }
    }

    fn receive(self, world: &mut World, into: &mut [u8]) -> Result<usize, Unplugged> {
        match self {
            End::Bus(bus) => world.host_receive(bus, into),
            End::Imu => world.imu_receive(into),
        }
    }
}

/// A line and the terminal it is served on.
struct Line {
    end: End,
    link: PathBuf,
    /// `None` while the adapter is out.
    terminal: Option<Terminal>,
}

/// Removes a link to a terminal. Anything else of that name belongs to the user, and stays.
fn clear(link: &Path) -> io::Result<()> {
    match fs::symlink_metadata(link) {
        Err(_) => Ok(()),
        Ok(_) if fs::read_link(link).is_ok_and(|target| target.starts_with("/dev/pts")) => {
            fs::remove_file(link)
        }
        Ok(_) => Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            format!("{} exists and is not a link to a terminal: move it away", link.display()),
        )),
    }
}

struct Terminal {
    master: OwnedFd,
    /// Held open so that the terminal stays when a program closes it.
    slave: OwnedFd,
}

impl Line {
    /// Makes a terminal and points the link at it.
    fn plug_in(&mut self) -> io::Result<()> {
        let (terminal, path) = Terminal::open()?;
        let mut beside = self.link.clone().into_os_string();
        beside.push(".new");
        clear(Path::new(&beside))?;
        clear(&self.link)?;
        std::os::unix::fs::symlink(&path, &beside)?;
        fs::rename(&beside, &self.link)?;
        self.terminal = Some(terminal);
        Ok(())
    }

    /// Hangs up on every program that has the terminal open.
    fn pull_out(&mut self) {
        self.terminal = None;
        let _ = clear(&self.link);
    }

    /// Moves the waiting bytes in both directions.
    fn exchange(&mut self, world: &mut World, piece: &mut [u8]) {
        match (self.end.is_unplugged(world), &self.terminal) {
            (true, Some(_)) => self.pull_out(),
            // If the system has no free terminal now, it may have one the next time.
            (false, None) => drop(self.plug_in()),
            _ => {}
        }
        let Some(terminal) = &self.terminal else { return };
        // A real terminal forgets an exclusive open with its last close; this one is never closed here.
        let _ = rustix::termios::ioctl_tiocnxcl(&terminal.slave);
        if let Ok(settings) = tcgetattr(&terminal.slave) {
            self.end.set_host_baud(world, settings.output_speed());
        }
        while let Ok(count @ 1..) = rustix::io::read(&terminal.master, &mut *piece) {
            let _ = self.end.send(world, piece.get(..count).unwrap_or_default());
        }
        while let Ok(count @ 1..) = self.end.receive(world, piece) {
            // Bytes that a program leaves no room for are lost, as on any line without flow control.
            let _ = rustix::io::write(&terminal.master, piece.get(..count).unwrap_or_default());
        }
    }
}

impl Terminal {
    /// Opens a pair, already raw so that nothing is echoed; returns it and the path of the end for programs.
    fn open() -> io::Result<(Terminal, PathBuf)> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let slave =
            ioctl_tiocgptpeer(&master, OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(std::ffi::OsString::from_vec(name.into_bytes()));
        Ok((Terminal { master, slave }, path))
    }
}

fn serve(shared: &Shared, lines: &mut [Line]) {
    // The kernel may add 50 us to every wait of an ordinary thread; a simulated line has no such slack.
    let _ = rustix::thread::set_current_timer_slack(NonZeroU64::new(1));
    let mut piece = [0; PIECE_BYTES];
    while !shared.is_to_stop.load(Ordering::Relaxed) {
        let next = {
            let mut world = shared.present_world();
            for line in &mut *lines {
                line.exchange(&mut world, &mut piece);
            }
            let look_ns = world.now_ns() + LOOK_EVERY_NS;
            Duration::from_nanos(world.next_handover_ns().unwrap_or(look_ns).min(look_ns))
        };
        wait_for_programs(lines, (shared.start + next).saturating_sub(monotonic()));
    }
}

/// Waits until a program has written to a terminal, for at most `time`.
fn wait_for_programs(lines: &[Line], time: Duration) {
    let terminals = lines.iter().filter_map(|line| line.terminal.as_ref());
    let mut masters: Vec<PollFd<'_>> =
        terminals.map(|terminal| PollFd::new(&terminal.master, PollFlags::IN)).collect();
    let Ok(timeout) = Timespec::try_from(time) else { return };
    // If a signal or a fault wakes it early, the server only looks sooner.
    let _ = poll(&mut masters, Some(&timeout));
}

/// The system's monotonic clock.
fn monotonic() -> Duration {
    Duration::try_from(clock_gettime(ClockId::Monotonic)).unwrap_or_default()
}
