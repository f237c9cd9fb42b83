use std::collections::VecDeque;

use glam::{DQuat, DVec3};

use super::*;
use crate::bus::feetech::FEETECH_STS;
use crate::bus::port::PortError;
use crate::bus::testing::feetech_status;
use crate::bus::{Feedback, Request};
use crate::model::{
    Bus, Gait, HorseMotion, Joint, Motion, Protocol, SafetySettings, Servo, ServoModel, StopAction,
};
use crate::units::Time;

/// Replies to a request: the time after sending, and the bytes.
type Replies = Vec<(Duration, Vec<u8>)>;
type Responder = Box<dyn FnMut(&[u8]) -> Replies>;

/// One line of [`ScriptedPorts`]: its answers, and the bytes on their way.
struct ScriptedLine {
    respond: Responder,
    arriving: VecDeque<(Time, Vec<u8>)>,
    sent: Vec<Vec<u8>>,
    is_gone: bool,
    /// The line is gone after this time.
    goes_at: Time,
}

/// Ports whose clock moves only by waiting, and whose lines answer according to the test.
struct ScriptedPorts {
    now: Time,
    lines: Vec<ScriptedLine>,
    waits: u32,
}

impl ScriptedPorts {
    fn new(responders: Vec<Responder>) -> ScriptedPorts {
        let lines = responders.into_iter().map(|respond| ScriptedLine {
            respond,
            arriving: VecDeque::new(),
            sent: Vec::new(),
            is_gone: false,
            goes_at: Time(u64::MAX),
        });
        ScriptedPorts { now: Time(0), lines: lines.collect(), waits: 0 }
    }

    fn line(&mut self, bus: usize) -> Result<&mut ScriptedLine, PortError> {
        let now = self.now;
        let line = &mut self.lines[bus];
        if line.is_gone || now >= line.goes_at { Err(PortError::Gone { bus }) } else { Ok(line) }
    }
}

impl Ports for ScriptedPorts {
    fn now(&mut self) -> Time {
        self.now
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        let now = self.now;
        self.line(bus)?.arriving.retain(|(arrival, _)| *arrival > now);
        Ok(())
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        let now = self.now;
        let line = self.line(bus)?;
        line.sent.push(bytes.to_vec());
        for (delay, reply) in (line.respond)(bytes) {
            line.arriving.push_back((now + delay, reply));
        }
        line.arriving.make_contiguous().sort_by_key(|(arrival, _)| *arrival);
        Ok(())
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        let now = self.now;
        let line = self.line(bus)?;
        match line.arriving.front_mut() {
            Some((arrival, bytes)) if *arrival <= now => {
                let count = bytes.len().min(into.len());
                into[..count].copy_from_slice(&bytes[..count]);
                bytes.drain(..count);
                if bytes.is_empty() {
                    line.arriving.pop_front();
                }
                Ok(count)
            }
            _ => Ok(0),
        }
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.waits += 1;
        assert!(self.waits < 10_000, "the wait never ends");
        let next =
            self.lines.iter().filter_map(|line| line.arriving.front()).map(|(arrival, _)| *arrival).min();
        self.now = self.now.max(next.map_or(deadline, |arrival| arrival.min(deadline)));
    }

    fn wait_until(&mut self, deadline: Time) {
        self.now = self.now.max(deadline);
    }
}

const MS: Duration = Duration::from_millis(1);

/// Four joints with Feetech servos on two buses: 0 and 2 on bus 0, 1 and 3 on bus 1; no id equals its
/// joint's number; and a fifth joint without a servo.
fn robot() -> Robot {
    let bus = |name: &str| Bus {
        name: name.into(),
        protocol: Protocol::Feetech,
        baud: 1_000_000,
        adapter_latency_us: 1000,
        return_delay_us: 0,
        voltage_min_v: 9.5,
        supply_ohm: 0.0,
    };
    let joint = |index: u8| Joint {
        name: format!("leg.{index}"),
        axis: DVec3::Z,
        link_m: DVec3::X,
        range_rad: (-1.0, 1.0),
        stiffness: 1.0,
        mass_kg: 0.1,
        center_m: DVec3::ZERO,
        ball: None,
        servo: (index < 4).then(|| Servo {
            model: ServoModel::named("STS3215-12V").unwrap(),
            bus: usize::from(index % 2),
            id: ServoId(10 + index),
            reversed: false,
            zero_count: 2048.0,
            firmware: None,
        }),
    };
    Robot {
        name: "test".into(),
        rate_hz: 100.0,
        trunk_mass_kg: 1.0,
        trunk_center_m: DVec3::ZERO,
        chains: vec![crate::model::Chain {
            name: "leg".into(),
            root_m: DVec3::ZERO,
            root_rotation: DQuat::IDENTITY,
            joints: 0..5,
            tendons: None,
            foot: None,
        }],
        joints: (0..5).map(joint).collect(),
        buses: vec![bus("left"), bus("right")],
        motion: Motion::Horse(HorseMotion {
            legs: [0; 4],
            stand_height_m: 0.2,
            sit_height_m: 0.1,
            swing_time_s: 0.4,
            swing_lift_m: 0.01,
            swing_ramp_share: 0.1,
            acceleration_m_s2: 1.0,
            yaw_rate_max_rad_s: 1.0,
            gaits: Vec::<Gait>::new(),
        }),
        safety: SafetySettings {
            rate_share: 0.8,
            acceleration_rad_s2: 100.0,
            slow_rate_rad_s: 0.5,
            torque_share: 0.8,
            torque_ramp_s: 1.0,
            coast_s: 0.1,
            hold_s: 1.0,
            tracking_error_rad: 0.2,
            fault_delay_s: 0.2,
            temperature_c: 65.0,
            tripped_servo: crate::model::TrippedServoPolicy::Stop,
        },
        physics: None,
        bears_weight: true,
        balance: None,
        stop_action: StopAction::Hold,
        imu: None,
        reflex: None,
        yielding: None,
    }
}

/// A reply in which position and id are the same number.
fn report(id: u8) -> Vec<u8> {
    feetech_status(id, 0, &[id, 0, 0, 0, 0, 0, 120, 30])
}

fn fresh(id: u8) -> Slot {
    let position = i32::from(id);
    Slot::Fresh(Feedback { position, voltage_decivolt: 120, temperature_c: 30, ..Feedback::default() })
}

/// Answers every request with the reports of these servos after 2 ms.
fn servos(ids: &'static [u8]) -> Responder {
    Box::new(move |_| ids.iter().map(|id| (2 * MS, report(*id))).collect())
}

fn silence() -> Responder {
    Box::new(|_| Vec::new())
}

fn buses(left: Responder, right: Responder) -> Buses<ScriptedPorts> {
    Buses::new(&robot(), ScriptedPorts::new(vec![left, right]))
}

const GOALS: [ServoGoal; 5] = [ServoGoal::Move { position: 2048, torque_limit: 500 }; 5];
const ALL: [Slot; 5] = [Slot::Missing; 5];

fn exchange(buses: &mut Buses<ScriptedPorts>) -> [Slot; 5] {
    let mut out = ALL;
    buses.exchange_counts(&GOALS, &mut out);
    out
}

/// Time from sending to the deadline, with 2 servos on each bus.
/// Out (8 + 2 x 3) x 2 + (8 + 2 x 2) + (8 + 2) = 50 bytes, in 2 x 14; 10 us a byte; 1000 us adapter; a
/// quarter more and 200 us.
const DEADLINE: Duration = Duration::from_micros((780 + 1000) * 5 / 4 + 200);

#[test]
fn every_joint_gets_its_own_servos_reply() {
    let mut buses = buses(servos(&[12, 10]), servos(&[11, 13]));
    assert_eq!(exchange(&mut buses), [fresh(10), fresh(11), fresh(12), fresh(13), Slot::Missing]);
}

#[test]
fn goals_reach_the_bus_and_id_of_their_joint() {
    let mut buses = buses(servos(&[10, 12]), servos(&[11, 13]));
    let mut out = ALL;
    let goal = |position| ServoGoal::Move { position, torque_limit: 1 };
    buses.exchange_counts(&[goal(100), goal(101), goal(102), ServoGoal::Limp], &mut out);
    let ports = buses.into_ports();
    let holds = |bus: usize, bytes: &[u8]| ports.lines[bus].sent[0].windows(bytes.len()).any(|w| w == bytes);
    assert!(holds(0, &[0x83, 42, 2, 10, 100, 0, 12, 102, 0]));
    assert!(holds(1, &[0x83, 42, 2, 11, 101, 0]));
    assert!(holds(1, &[0x83, 40, 1, 11, 1, 13, 0]));
}

#[test]
fn all_buses_run_at_the_same_time() {
    let mut buses = buses(servos(&[10, 12]), servos(&[11, 13]));
    exchange(&mut buses);
    assert_eq!(buses.ports_mut().now(), Time(0) + 2 * MS);
    exchange(&mut buses);
    for bus in buses.statistics() {
        assert_eq!((bus.times.last, bus.times.max, bus.times.total), (2 * MS, 2 * MS, 4 * MS));
        assert_eq!((bus.times.count, bus.counters.exchanges), (2, 2));
    }
}

#[test]
fn a_silent_servo_costs_its_own_bus_the_deadline_and_no_other_bus() {
    let mut buses = buses(servos(&[12]), servos(&[11, 13]));
    assert_eq!(exchange(&mut buses), [Slot::Missing, fresh(11), fresh(12), fresh(13), Slot::Missing]);
    assert_eq!(buses.ports_mut().now(), Time(0) + DEADLINE);
    let times: Vec<Duration> = buses.statistics().map(|bus| bus.times.last).collect();
    assert_eq!(times, [DEADLINE, 2 * MS]);
    let missing: Vec<u64> = buses.statistics().map(|bus| bus.counters.missing).collect();
    assert_eq!(missing, [1, 0]);
}

#[test]
fn each_bus_has_its_own_deadline() {
    let mut robot = robot();
    robot.buses[0].baud = 115_200;
    robot.rate_hz = 10.0;
    let mut buses = Buses::new(&robot, ScriptedPorts::new(vec![silence(), silence()]));
    exchange(&mut buses);
    let times: Vec<Duration> = buses.statistics().map(|bus| bus.times.last).collect();
    assert_eq!(times[1], DEADLINE);
    assert!(times[0] > 4 * DEADLINE, "78 bytes take 6.8 ms at 115200 baud: {times:?}");
}

#[test]
fn the_exchange_waits_for_no_bus_longer_than_a_period() {
    let mut robot = robot();
    robot.rate_hz = 1.0 / DEADLINE.as_secs_f64();
    let mut buses = Buses::new(&robot, ScriptedPorts::new(vec![silence(), silence()]));
    exchange(&mut buses);
    let took = buses.ports_mut().now().since(Time(0)).as_secs_f64();
    assert!((took / DEADLINE.as_secs_f64() - 0.95).abs() < 1e-6, "{took} s");
}

#[test]
fn a_lost_bus_stops_no_other_bus_and_may_come_back() {
    let mut buses = buses(servos(&[10, 12]), servos(&[11, 13]));
    buses.ports_mut().lines[0].is_gone = true;
    assert_eq!(exchange(&mut buses), [Slot::Missing, fresh(11), Slot::Missing, fresh(13), Slot::Missing]);
    assert_eq!(buses.ports_mut().now(), Time(0) + 2 * MS, "nothing is waited for on a bus that is gone");
    let gone: Vec<bool> = buses.statistics().map(|bus| bus.is_gone).collect();
    assert_eq!(gone, [true, false]);
    let left = buses.statistics().next().unwrap();
    assert_eq!((left.counters.missing, left.counters.bytes_out, left.times.count), (2, 0, 0));

    buses.ports_mut().lines[0].is_gone = false;
    assert_eq!(exchange(&mut buses), [fresh(10), fresh(11), fresh(12), fresh(13), Slot::Missing]);
}

#[test]
fn a_bus_lost_during_the_exchange_keeps_the_replies_received() {
    let left: Responder = Box::new(|_| vec![(MS, report(10)), (2 * MS, report(12))]);
    let mut buses = buses(left, servos(&[11, 13]));
    buses.ports_mut().lines[0].goes_at = Time(0) + Duration::from_micros(1500);
    assert_eq!(exchange(&mut buses), [fresh(10), fresh(11), Slot::Missing, fresh(13), Slot::Missing]);
}

#[test]
fn replies_of_an_earlier_exchange_do_not_count_for_this_one() {
    let mut is_first = true;
    let left: Responder = Box::new(move |_| {
        // Both reports of the first exchange come too late; the second exchange gets none.
        let late = if is_first { vec![(3 * MS, report(10)), (3 * MS, report(12))] } else { Vec::new() };
        is_first = false;
        late
    });
    let mut buses = buses(left, servos(&[11, 13]));
    assert_eq!(exchange(&mut buses)[0], Slot::Missing);
    buses.ports_mut().wait_until(Time(0) + 10 * MS);
    assert_eq!(exchange(&mut buses)[0], Slot::Missing);
}

#[test]
fn a_reply_at_the_very_deadline_counts() {
    let left: Responder = Box::new(|_| vec![(DEADLINE, report(10)), (DEADLINE, report(12))]);
    let mut buses = buses(left, servos(&[11, 13]));
    assert_eq!(exchange(&mut buses)[0], fresh(10));
}

#[test]
fn an_adapter_may_echo_and_deliver_bytes_in_pieces() {
    let left: Responder = Box::new(|request| {
        let bytes = [request, &report(10), &report(12)].concat();
        bytes.chunks(3).map(|piece| (MS, piece.to_vec())).collect()
    });
    let mut buses = buses(left, servos(&[11, 13]));
    assert_eq!(exchange(&mut buses)[..4], [fresh(10), fresh(11), fresh(12), fresh(13)]);
}

#[test]
fn noise_on_a_finished_bus_does_not_end_the_wait_for_the_others() {
    let left: Responder =
        Box::new(|_| vec![(MS, [report(10), report(12), vec![0; 600]].concat()), (2 * MS, vec![0; 9])]);
    let mut buses = buses(left, silence());
    assert_eq!(exchange(&mut buses), [fresh(10), Slot::Missing, fresh(12), Slot::Missing, Slot::Missing]);
    assert_eq!(buses.ports_mut().now(), Time(0) + DEADLINE);
}

/// Answers requests one after the other with the `replies`, then with nothing.
fn script(replies: Vec<Vec<u8>>) -> Responder {
    let mut replies = replies.into_iter();
    Box::new(move |_| replies.next().map(|reply| vec![(MS, reply)]).unwrap_or_default())
}

fn registers() -> &'static crate::model::Registers {
    &FEETECH_STS
}

#[test]
fn a_read_is_tried_again_after_silence_and_noise() {
    let mut broken = feetech_status(10, 0, &[0x18, 0x05, 0]);
    broken[5] ^= 1;
    let replies = vec![Vec::new(), broken, feetech_status(10, 0, &[0x18, 0x05, 0])];
    let mut buses = buses(script(replies), silence());
    assert_eq!(buses.read(0, registers().present_position), Ok(1304));
    assert_eq!(buses.into_ports().lines[0].sent.len(), 3);
}

#[test]
fn a_silent_servo_is_named() {
    let mut buses = buses(silence(), silence());
    let error = buses.read(3, registers().model_number).unwrap_err();
    assert_eq!(
        error.to_string(),
        "servo 13 of joint leg.3 on bus right did not answer a read of register 3 (2 bytes) in 3 tries: check \
         its power and cable, that its id is 13, and that it is set to 1000000 baud"
    );
    let Err(TransactionError::NoAnswer { request: Request::Ping, .. }) = buses.ping(3) else {
        panic!("a ping without an answer must say so");
    };
}

#[test]
fn a_damaged_answer_is_named() {
    let mut broken = feetech_status(10, 0, &[1]);
    broken[5] ^= 1;
    let mut buses = buses(script(vec![broken]), silence());
    let error = buses.read(0, registers().torque_enable).unwrap_err();
    assert!(matches!(error, TransactionError::Corrupt { tries: 3, .. }), "{error}");
}

#[test]
fn a_ping_answer_that_could_be_an_echo_is_confirmed_by_a_read() {
    let mut plain = buses(script(vec![feetech_status(10, 0, &[])]), silence());
    assert_eq!(plain.ping(0), Ok(()));
    // A servo in voltage alarm, on an adapter without echo: its answer equals the request.
    let in_alarm: Responder = Box::new(|request| {
        let data: &[u8] = if request[4] == 0x01 { &[] } else { &[9, 3, 10] };
        vec![(MS, feetech_status(10, 0x01, data))]
    });
    let mut in_alarm = buses(in_alarm, silence());
    assert_eq!(in_alarm.ping(0), Ok(()));
    // Only an adapter's echo, and no servo.
    let echo: Responder = Box::new(|request| vec![(MS, request.to_vec())]);
    assert!(buses(echo, silence()).ping(0).is_err());
}

#[test]
fn a_write_is_confirmed_by_its_answer_or_by_the_register() {
    let mut answered = buses(script(vec![feetech_status(10, 0, &[])]), silence());
    assert_eq!(answered.write(0, registers().torque_limit, 300), Ok(()));
    // Response level 0: the servo takes writes and answers only reads.
    let quiet = |held: u16| -> Responder {
        let [low, high] = held.to_le_bytes();
        Box::new(move |request| match request[4] {
            0x02 => vec![(MS, feetech_status(10, 0, &[low, high, 0]))],
            _ => Vec::new(),
        })
    };
    assert_eq!(buses(quiet(300), silence()).write(0, registers().torque_limit, 300), Ok(()));
    let error = buses(quiet(1000), silence()).write(0, registers().torque_limit, 300).unwrap_err();
    assert!(matches!(error, TransactionError::NoAnswer { request: Request::Write(_, 300), .. }), "{error}");
}

#[test]
fn a_request_that_cannot_be_sent_says_why() {
    let mut buses = buses(silence(), silence());
    assert_eq!(buses.ping(4), Err(TransactionError::NoServo { joint: 4 }));
    assert_eq!(buses.ping(99), Err(TransactionError::NoServo { joint: 99 }));
    buses.ports_mut().lines[0].is_gone = true;
    let error = buses.ping(0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "servo 10 of joint leg.0 on bus left: a ping could not be sent: the port of bus 0 is gone: plug its \
         adapter in again"
    );
}

#[test]
fn other_buses_do_not_delay_a_transaction() {
    let mut buses = buses(silence(), silence());
    buses.ports_mut().lines[1].arriving.push_back((Time(0), vec![1, 2, 3]));
    assert!(buses.ping(0).is_err());
    buses.ports_mut().lines[1].is_gone = true;
    assert!(buses.ping(0).is_err());
}
