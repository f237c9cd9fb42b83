//! One bus in an exchange: its client, and the progress of the exchange.

use std::time::Duration;

use super::settings_resend::SettingsResend;
use crate::bus::ServoGoal;
use crate::bus::client::BusClient;
use crate::bus::port::{PortError, Ports};
use crate::bus::{ExchangeTimes, Slot};
use crate::signals::Question;
use crate::units::Time;

/// Largest share of a period that an exchange may take.
const LONGEST_SHARE: f64 = 0.95;
/// Received bytes are moved in pieces of this size.
const PIECE_BYTES: usize = 512;

#[derive(Debug, Clone, Copy)]
enum State {
    /// Nothing is awaited.
    Idle,
    /// The request is sent. The line awaits replies until the deadline; where servos are asked one by one, the
    /// present servo's reply until its turn ends.
    Waiting { sent: Time, deadline: Time, turn_ends: Time },
    /// The port was gone when last used.
    Gone,
}

#[derive(Debug)]
pub(super) struct Line {
    /// Index of the bus in the robot.
    pub(super) bus: usize,
    pub(super) client: BusClient,
    /// The joint of each slot.
    pub(super) joints: Vec<usize>,
    pub(super) times: ExchangeTimes,
    pub(super) settings_resend: SettingsResend,
    goals: Vec<ServoGoal>,
    /// Longest wait for the replies of an exchange.
    longest: Duration,
    state: State,
}

impl Line {
    /// A line whose exchanges take a little less than `period` at most.
    pub(super) fn new(bus: usize, client: BusClient, joints: Vec<usize>, period: Duration) -> Line {
        // But the wait is never shorter than replies in time take.
        let longest = period.mul_f64(LONGEST_SHARE).max(client.cycle_time());
        let goals = vec![ServoGoal::Limp; joints.len()];
        let settings_resend = SettingsResend::new(joints.len());
        let times = ExchangeTimes::default();
        Line { bus, client, joints, times, settings_resend, goals, longest, state: State::Idle }
    }

    pub(super) fn is_gone(&self) -> bool {
        matches!(self.state, State::Gone)
    }

    /// Has the servo of `joint`, if it is on this line, restart in the next exchange. It gets its settings again
    /// once it is heard.
    pub(super) fn restart_servo(&mut self, joint: usize) {
        if let Some(index) = self.joints.iter().position(|own| *own == joint) {
            self.client.restart_servo(index);
            self.settings_resend.note_restart(index);
        }
    }

    /// Has the next exchange ask all servos of this line the question, if the servo of `joint` is on it.
    pub(super) fn ask(&mut self, joint: usize, question: Question) {
        if self.joints.contains(&joint) {
            self.client.ask(question);
        }
    }

    /// Sends this cycle's request. `goals` holds the goals of all joints.
    pub(super) fn begin_exchange(&mut self, ports: &mut impl Ports, goals: &[ServoGoal]) {
        if self.joints.is_empty() {
            return;
        }
        for (goal, joint) in self.goals.iter_mut().zip(&self.joints) {
            *goal = goals.get(*joint).copied().unwrap_or_default();
        }
        for index in 0..self.joints.len() {
            if self.settings_resend.take(index) {
                self.client.renew(index, self.settings_resend.watchdog_units());
            }
        }
        // A reply too late for the last exchange must not pass for one of this exchange.
        let sent = ports
            .discard_input(self.bus)
            .and_then(|()| ports.send(self.bus, self.client.begin_cycle(&self.goals)));
        self.await_feedback(ports, sent);
    }

    /// Sends a request that only reads.
    pub(super) fn begin_look(&mut self, ports: &mut impl Ports) {
        if self.joints.is_empty() {
            return;
        }
        let sent =
            ports.discard_input(self.bus).and_then(|()| ports.send(self.bus, self.client.begin_look()));
        self.await_feedback(ports, sent);
    }

    fn await_feedback(&mut self, ports: &mut impl Ports, sent: Result<(), PortError>) {
        self.await_replies(ports, sent);
        // The loop's rate outranks a late reply.
        if let State::Waiting { sent, deadline, .. } = &mut self.state {
            *deadline = (*deadline).min(*sent + self.longest);
        }
        if self.is_gone() {
            self.client.miss_cycle();
        }
    }

    /// After sending: waits for replies from now on, or notes that the port is gone.
    pub(super) fn await_replies(&mut self, ports: &mut impl Ports, sent: Result<(), PortError>) {
        self.state = match sent {
            Ok(()) => {
                let now = ports.now();
                State::Waiting {
                    sent: now,
                    deadline: now + self.client.reply_deadline(),
                    turn_ends: now + self.client.turn_deadline(),
                }
            }
            Err(_) => State::Gone,
        };
    }

    /// Takes the bytes that have arrived. Returns the time until which to wait for more, or `None` when nothing
    /// more is awaited.
    pub(super) fn poll(&mut self, ports: &mut impl Ports) -> Option<Time> {
        let State::Waiting { sent, deadline, mut turn_ends } = self.state else {
            // Unread bytes that no request awaits would end every wait for input at once.
            if !self.is_gone() && ports.discard_input(self.bus).is_err() {
                self.state = State::Gone;
            }
            return None;
        };
        // The time is read first, so that bytes that arrived by the deadline count.
        let now = ports.now();
        let is_late = now >= deadline;
        let mut piece = [0; PIECE_BYTES];
        loop {
            match ports.receive(self.bus, &mut piece) {
                Ok(0) => break,
                Ok(count) => self.client.feed(piece.get(..count).unwrap_or_default()),
                Err(_) => {
                    self.state = State::Gone;
                    return None;
                }
            }
        }
        if is_late || self.client.is_complete() {
            return None;
        }
        if self.client.is_turn_over() || now >= turn_ends {
            // Where all were asked at once there is no next servo; but then the turn ends with the deadline.
            let next = self.client.begin_turn()?;
            if ports.send(self.bus, next).is_err() {
                self.state = State::Gone;
                return None;
            }
            turn_ends = now + self.client.turn_deadline();
            self.state = State::Waiting { sent, deadline, turn_ends };
        }
        Some(deadline.min(turn_ends))
    }

    /// Ends the wait; returns the time since sending.
    pub(super) fn end_wait(&mut self, now: Time) -> Option<Duration> {
        let State::Waiting { sent, .. } = self.state else { return None };
        self.state = State::Idle;
        Some(now.since(sent))
    }

    /// Hands the result of each servo to its joint's place in `out`.
    pub(super) fn finish_exchange(&mut self, now: Time, out: &mut [Slot]) {
        for (index, (slot, joint)) in self.client.finish().iter().zip(&self.joints).enumerate() {
            if slot.is_good() {
                self.settings_resend.note_heard(index, now);
            }
            if let Some(place) = out.get_mut(*joint) {
                *place = *slot;
            }
        }
    }
}
