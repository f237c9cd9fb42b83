//! An inertial measurement unit that speaks WitMotion's standard protocol over a serial line of its own.
//!
//! In: the true state of the trunk after every motor step, and the host's commands. Out: frames of acceleration,
//! angular rate and angles, each byte when it would have crossed the line. The angles are not a fusion of its
//! measurements but the truth with noise and a slow drift. Settings changed by command are lost without power,
//! unless they are saved.

mod config;
mod packet;
mod sense;

use std::collections::VecDeque;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::body::BodyState;
use crate::error::{BuildError, Unplugged};
use crate::faults::{FaultKind, ImuFaults};
pub use config::ImuConfig;
use config::{BAUDS, RATES};
use packet::Commands;
use sense::{Measurement, Sense};

/// Bits a byte takes: 8N1.
const BITS_PER_BYTE: u64 = 10;
/// Full scale of the accelerations, m/s^2: 16 g (WT901 datasheet v20-0702, 5.1.2).
const ACCELERATION_FULL_M_S2: f64 = 16.0 * 9.806_65;
/// Full scale of the angular rates, degrees/s (5.1.3).
const RATE_FULL_DEG_S: f64 = 2000.0;
/// Temperature that it reports, hundredths of a degree Celsius.
const TEMPERATURE: i16 = 2500;
/// How long it accepts commands after it was unlocked, ns (WIT Standard Communication Protocol: 10 s).
const UNLOCKED_NS: u64 = 10_000_000_000;
/// Bytes that its line can have under way: beyond that it skips outputs. Our choice; the maker only says that it
/// outputs less often (WT901 manual v0513, 2.4.2).
const BACKLOG_BYTES: usize = 64;

/// Registers, all from 5.2.1.
const SAVE: u8 = 0x00;
const CONTENT: u8 = 0x02;
const RATE: u8 = 0x03;
const BAUD: u8 = 0x04;
const READ: u8 = 0x27;
const KEY: u8 = 0x69;
const KEY_OPEN: u16 = 0xB588;
/// Values of the register that saves: keep the settings, restart, reset to factory settings.
const SAVE_KEEP: u16 = 0;
const SAVE_RESTART: u16 = 0xFF;
const SAVE_FORGET: u16 = 1;
/// Which frames it sends: bits of the content register, in their order.
const CONTENTS: [(u16, u8); 3] =
    [(1 << 1, packet::ACCELERATION), (1 << 2, packet::RATE), (1 << 3, packet::ANGLE)];
/// Factory settings: acceleration, angular rate, angle, magnetic field; 10 Hz; 9600 bit/s.
const FACTORY: Settings = Settings { content: 0x1E, rate: 0x06, baud: 2 };

#[derive(Debug, Clone, Copy)]
struct Settings {
    content: u16,
    rate: u16,
    baud: u16,
}

impl Settings {
    /// Time between outputs; `None` if there are none.
    fn period_ns(self) -> Option<u64> {
        let (_, hz) = RATES.iter().find(|(code, _)| *code == self.rate)?;
        Some(crate::convert::nanoseconds(1.0 / hz))
    }

    fn bits_s(self) -> u32 {
        BAUDS.iter().find(|(code, _)| *code == self.baud).map_or(9_600, |(_, baud)| *baud)
    }
}

/// The unit, its line and the host's end of the line.
#[derive(Debug)]
pub(crate) struct Imu {
    settings: Settings,
    saved: Settings,
    sense: Sense,
    faults: ImuFaults,
    /// The output that it would repeat if it froze now.
    last: Option<Measurement>,
    commands: Commands,
    unlocked_until_ns: u64,
    next_output_ns: u64,
    host_baud: u32,
    /// End of the transmission under way, ns.
    talking_until_ns: u64,
    /// Bytes for the host, and for the unit, with the arrival time of each, in order.
    inbox: VecDeque<(u64, u8)>,
    outbox: VecDeque<(u64, u8)>,
    rng: Pcg64Mcg,
}

impl Imu {
    pub(crate) fn new(
        config: &ImuConfig,
        faults: ImuFaults,
        now_ns: u64,
        seed: u64,
    ) -> Result<Imu, BuildError> {
        let (rate, baud) = config.check()?;
        // The unneeded frames are off, as in a unit that is set up.
        let settings = Settings { content: 0x0E, rate, baud };
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        Ok(Imu {
            settings,
            saved: settings,
            sense: Sense::new(config, Pcg64Mcg::seed_from_u64(rng.random())),
            faults,
            last: None,
            commands: Commands::default(),
            unlocked_until_ns: 0,
            next_output_ns: now_ns + settings.period_ns().unwrap_or(u64::MAX >> 1),
            host_baud: config.baud,
            talking_until_ns: 0,
            inbox: VecDeque::new(),
            outbox: VecDeque::new(),
            rng,
        })
    }

    pub(crate) fn observe(&mut self, at_ns: u64, body: Option<&BodyState>) {
        self.sense.observe(at_ns, body);
    }

    /// Hands turn the trunk to this roll, pitch and yaw, rad, if there is no body.
    pub(crate) fn tilt(&mut self, to_rad: [f64; 3]) {
        self.sense.tilt(to_rad);
    }

    pub(crate) fn is_tilting(&self) -> bool {
        self.sense.is_tilting()
    }

    /// When the next event in the unit happens by itself.
    pub(crate) fn next_ns(&self) -> u64 {
        self.outbox.front().map_or(self.next_output_ns, |&(at, _)| at.min(self.next_output_ns))
    }

    /// Carries out that event.
    pub(crate) fn step(&mut self) {
        let now_ns = self.next_ns();
        if let Some((_, byte)) = self.outbox.front().copied().filter(|(at, _)| *at <= now_ns) {
            self.outbox.pop_front();
            if let Some((register, value)) = self.commands.push(byte) {
                self.obey(now_ns, register, value);
            }
            return;
        }
        self.output(now_ns);
        let period_ns = self.settings.period_ns();
        self.next_output_ns = period_ns.map_or(u64::MAX, |period_ns| now_ns.saturating_add(period_ns));
    }

    fn output(&mut self, now_ns: u64) {
        let period_s =
            self.settings.period_ns().map_or(0.0, |ns| std::time::Duration::from_nanos(ns).as_secs_f64());
        let measured = self.sense.measure(period_s);
        if !self.faults.is_on(now_ns, FaultKind::ImuFrozen) || self.last.is_none() {
            self.last = measured;
        }
        let Some(Measurement { force_m_s2, rate_rad_s, angles_rad }) = self.last else { return };
        let backlog_ns = self.talking_until_ns.saturating_sub(now_ns);
        if self.faults.is_on(now_ns, FaultKind::ImuSilent) || backlog_ns > self.duration_ns(BACKLOG_BYTES) {
            return;
        }
        let mut bytes = Vec::with_capacity(33);
        for (bit, kind) in CONTENTS {
            if self.settings.content & bit == 0 {
                continue;
            }
            let [x, y, z] = match kind {
                packet::ACCELERATION => force_m_s2.map(|force| packet::number(force, ACCELERATION_FULL_M_S2)),
                packet::RATE => rate_rad_s.map(|rate| packet::number(rate.to_degrees(), RATE_FULL_DEG_S)),
                _ => angles_rad.map(packet::angle),
            };
            bytes.extend(packet::frame(kind, [x, y, z, TEMPERATURE]));
        }
        self.talk(now_ns, bytes);
    }

    /// Carries out a command from the host. While locked the unit accepts only the unlock key.
    fn obey(&mut self, now_ns: u64, register: u8, value: u16) {
        if register == KEY {
            self.unlocked_until_ns = if value == KEY_OPEN { now_ns + UNLOCKED_NS } else { 0 };
            return;
        }
        if register == READ {
            let first = value.to_le_bytes()[0];
            let registers = [0, 1, 2, 3].map(|place| self.register(first.wrapping_add(place)));
            self.talk(now_ns, packet::frame(packet::REGISTERS, registers).to_vec());
            return;
        }
        if now_ns > self.unlocked_until_ns {
            return;
        }
        match register {
            SAVE if value == SAVE_KEEP => self.saved = self.settings,
            SAVE if value == SAVE_RESTART => self.restart(now_ns),
            SAVE if value == SAVE_FORGET => (self.settings, self.saved) = (FACTORY, FACTORY),
            CONTENT => self.settings.content = value,
            RATE => {
                self.settings.rate = value;
                self.next_output_ns =
                    self.settings.period_ns().map_or(u64::MAX, |period_ns| now_ns + period_ns);
            }
            BAUD if BAUDS.iter().any(|(code, _)| *code == value) => self.settings.baud = value,
            _ => {}
        }
    }

    fn register(&self, register: u8) -> i16 {
        let value = match register {
            CONTENT => self.settings.content,
            RATE => self.settings.rate,
            BAUD => self.settings.baud,
            _ => 0,
        };
        i16::from_le_bytes(value.to_le_bytes())
    }

    /// Power goes off and on: the unit loses settings that were not saved.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.settings = self.saved;
        self.unlocked_until_ns = 0;
        self.next_output_ns = now_ns + self.settings.period_ns().unwrap_or(u64::MAX >> 1);
    }

    /// Resets it to factory settings: 10 Hz at 9600 bit/s.
    pub(crate) fn reset_to_factory(&mut self, now_ns: u64) {
        self.saved = FACTORY;
        self.restart(now_ns);
    }

    fn talk(&mut self, now_ns: u64, bytes: Vec<u8>) {
        let start_ns = now_ns.max(self.talking_until_ns);
        let is_garbled =
            self.faults.is_on(now_ns, FaultKind::ImuGarbled) || self.host_baud != self.settings.bits_s();
        for (place, mut byte) in bytes.into_iter().enumerate() {
            if is_garbled {
                byte ^= self.rng.random_range(1..=255u8);
            }
            let at_ns = start_ns + self.duration_ns(place + 1);
            self.talking_until_ns = at_ns;
            // For a host that never listens, the inbox keeps no more than a page.
            if self.inbox.len() < 4096 {
                self.inbox.push_back((at_ns, byte));
            }
        }
    }

    fn duration_ns(&self, bytes: usize) -> u64 {
        duration_ns(bytes, self.settings.bits_s())
    }

    pub(crate) fn is_unplugged(&self, now_ns: u64) -> bool {
        self.faults.is_on(now_ns, FaultKind::ImuUnplugged)
    }

    pub(crate) fn send(&mut self, now_ns: u64, bytes: &[u8]) -> Result<(), Unplugged> {
        if self.is_unplugged(now_ns) {
            return Err(Unplugged);
        }
        let is_understood = self.host_baud == self.settings.bits_s();
        let start_ns = self.outbox.back().map_or(now_ns, |&(at, _)| at.max(now_ns));
        for (place, byte) in bytes.iter().enumerate() {
            let garble = if is_understood { 0 } else { self.rng.random_range(1..=255u8) };
            self.outbox.push_back((start_ns + duration_ns(place + 1, self.host_baud), byte ^ garble));
        }
        Ok(())
    }

    pub(crate) fn receive(&mut self, now_ns: u64, into: &mut [u8]) -> Result<usize, Unplugged> {
        if self.is_unplugged(now_ns) {
            self.inbox.clear();
            return Err(Unplugged);
        }
        let count = self.inbox.partition_point(|&(at, _)| at <= now_ns).min(into.len());
        for (place, (_, byte)) in into.iter_mut().zip(self.inbox.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    /// When to come back, for a host that is served in pieces.
    pub(crate) fn next_handover_ns(&self) -> Option<u64> {
        self.inbox.back().map(|&(at, _)| at)
    }

    pub(crate) fn set_host_baud(&mut self, baud: u32) {
        self.host_baud = baud.max(1);
    }
}

/// Time that `count` bytes take at `baud`, ns, rounded up.
fn duration_ns(count: usize, baud: u32) -> u64 {
    (count as u64).saturating_mul(BITS_PER_BYTE * 1_000_000_000).div_ceil(u64::from(baud))
}
