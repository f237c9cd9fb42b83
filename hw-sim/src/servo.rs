//! One servo: its registers, its motor, and the steps that servos of all protocols share. Knows no protocol: each
//! fills a [`ProtocolSpec`].
//!
//! In: writes from the bus, the shaft's motion, supply and heat. Out: motor torque and register contents.

use std::any::Any;

use crate::body::ShaftState;
use crate::config::ServoConfig;
use crate::convert::{low_byte, round_to_i64};
use crate::decoder::{LineDecoder, Received};
use crate::model::{Model, Protocol};
use crate::motor::{Drive, Motor};
use crate::registers::RegisterFile;
use crate::reply::Slot;

/// The state that a protocol keeps of a servo besides its registers.
pub(crate) type State = Box<dyn Any + Send>;

/// Has the servos that hear a packet carry it out, at this virtual time, ns; returns their replies. The flags say which
/// servos hear it.
pub(crate) type AnswerPacket = fn(&Received, &mut [Servo], &[bool], u64) -> Vec<Slot>;

/// The behaviour of the servos of one protocol.
#[derive(Debug)]
pub(crate) struct ProtocolSpec {
    pub(crate) protocol: Protocol,
    /// Name in messages.
    pub(crate) name: &'static str,
    /// The models that come with the crate.
    pub(crate) models: fn() -> Vec<Model>,
    /// Number of the first byte in a reply that follows header, id and length.
    pub(crate) first_data_byte: usize,
    /// Line rates a servo can be set to, as (register code, bit/s).
    pub(crate) bauds: &'static [(i64, u32)],
    /// Highest id a servo may have.
    pub(crate) id_max: u8,
    /// Time from power-on or a restart until a servo hears and answers, ns.
    pub(crate) start_ns: u64,
    /// Addresses of registers that all servos of the protocol have.
    pub(crate) id: u16,
    pub(crate) baud: u16,
    pub(crate) goal_position: u16,
    /// Address of the register of a model that delays its replies, in units of 2 µs; `None` if none does.
    pub(crate) return_delay: fn(&Model) -> Option<u16>,
    /// Address of a model's torque limit.
    pub(crate) torque_limit: fn(&Model) -> u16,
    /// The state of a servo as shipped.
    pub(crate) state: fn(&RegisterFile) -> State,
    /// Sets up a servo at its first power-on: id, code of the rate, units of the delay.
    pub(crate) power_on: fn(&mut Servo, u8, i64, i64),
    /// Loses the content of RAM.
    pub(crate) forget: fn(&mut Servo),
    /// False if its settings keep it from understanding any packet.
    pub(crate) understands_packets: fn(&Servo) -> bool,
    /// The drive that its controller asks of the bridge, at this speed of the shaft (rad/s) and supply (V).
    pub(crate) drive: fn(&mut Servo, f64, f64) -> Drive,
    /// Writes what it measures into its registers, at this speed of the shaft, rad/s.
    pub(crate) observe: fn(&mut Servo, f64, &Conditions),
    /// True if the bridge is closed.
    pub(crate) is_torque_on: fn(&Servo) -> bool,
    /// Share of requests to two servos of one id in which the host can read an answer.
    pub(crate) drowned_twin_share: f64,
    /// Makes the decoder of a line.
    pub(crate) decoder: fn() -> Box<dyn LineDecoder>,
    /// Has the servos answer a packet.
    pub(crate) answer: AnswerPacket,
}

/// Whether a servo runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Power {
    /// No supply, or not enough.
    Off,
    /// Starting: deaf and limp until the time given.
    Starting {
        until_ns: u64,
    },
    On,
}

#[derive(Debug)]
pub(crate) struct Servo {
    spec: &'static ProtocolSpec,
    pub(crate) model: Model,
    pub(crate) registers: RegisterFile,
    /// State that only servos of its protocol have.
    pub(crate) state: State,
    /// True if it is connected.
    pub(crate) is_plugged_in: bool,
    pub(crate) motor: Motor,
    /// Shaft position as the encoder sees it, counts, from the last motor step.
    pub(crate) encoder_counts: i64,
    /// Whole turns that the position register leaves out, counts.
    pub(crate) turns_left_out: i64,
    /// True if an error has switched the torque off until a reboot (Dynamixel).
    pub(crate) is_shut_down: bool,
    /// When it last heard an instruction packet, ns (Dynamixel).
    pub(crate) heard_ns: u64,
    /// The id that a fault makes it take for its own.
    pub(crate) wrong_id: Option<u8>,
    /// The last goal position that a host wrote and the servo accepted, and how many it has accepted since it was
    /// built.
    pub(crate) goal_taken: Option<i64>,
    pub(crate) goals_taken: u64,
    /// True if the last goal it accepted was meant for another servo, or was corrupted on the line.
    pub(crate) is_misled: bool,
    /// True if it has accepted a goal from the present request.
    pub(crate) takes_now: bool,
    power: Power,
    /// Values that registers of RAM get at every start instead of their table's.
    pub(crate) starts_with: Vec<(u16, i64)>,
}

/// The conditions of a servo in one motor step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    /// Virtual time, ns.
    pub(crate) now_ns: u64,
    /// Step, s.
    pub(crate) dt_s: f64,
    /// Supply, V.
    pub(crate) supply_v: f64,
    /// Temperature forced by a fault, °C.
    pub(crate) celsius: Option<f64>,
    /// True if a fault makes it detect an overload.
    pub(crate) is_overloaded: bool,
}

impl Servo {
    /// A servo that has just been powered, with a shaft standing still.
    pub(crate) fn new(spec: &'static ProtocolSpec, config: &ServoConfig, baud_code: i64) -> Servo {
        let registers = RegisterFile::new(config.model.registers.clone());
        let mut servo = Servo {
            spec,
            model: config.model.clone(),
            state: (spec.state)(&registers),
            registers,
            is_plugged_in: true,
            motor: Motor::at_rest(),
            encoder_counts: round_to_i64(config.position_counts),
            turns_left_out: 0,
            is_shut_down: false,
            heard_ns: 0,
            wrong_id: None,
            goal_taken: None,
            goals_taken: 0,
            is_misled: false,
            takes_now: false,
            power: Power::On,
            starts_with: Vec::new(),
        };
        let delay_units = i64::from(config.return_delay_us / 2);
        (spec.power_on)(&mut servo, config.id, baud_code, delay_units);
        servo
    }

    /// Resets every register to its value as shipped.
    pub(crate) fn make_new(&mut self) {
        self.registers = RegisterFile::new(self.model.registers.clone());
        self.state = (self.spec.state)(&self.registers);
        self.forget();
    }

    /// Sets registers of its EEPROM, as before power-on.
    pub(crate) fn configure(&mut self, settings: &[(u16, i64)]) {
        let has = |address: u16| self.model.registers.iter().any(|register| register.address == address);
        for (address, value) in settings.iter().filter(|(address, _)| has(*address)) {
            self.registers.set(*address, *value);
        }
        self.state = (self.spec.state)(&self.registers);
        self.forget();
    }

    /// Connects it: it starts with the content of its EEPROM.
    pub(crate) fn plug_in(&mut self) {
        (self.is_plugged_in, self.power) = (true, Power::On);
        self.forget();
    }

    /// Disconnects it.
    pub(crate) fn pull_out(&mut self) {
        (self.is_plugged_in, self.power) = (false, Power::Off);
        self.forget();
    }

    /// True if it hears, answers and can turn.
    pub(crate) fn is_awake(&self) -> bool {
        self.power == Power::On
    }

    /// Switches its supply on or off. When the supply returns, the servo restarts; a servo that is not plugged in
    /// has none.
    pub(crate) fn set_power(&mut self, is_on: bool, now_ns: u64) {
        let is_on = is_on && self.is_plugged_in;
        match self.power {
            Power::Off if is_on => self.restart(now_ns),
            Power::Off => {}
            _ if !is_on => {
                self.power = Power::Off;
                self.forget();
            }
            Power::Starting { until_ns } if now_ns >= until_ns => {
                self.power = Power::On;
                self.forget();
            }
            Power::Starting { .. } | Power::On => {}
        }
    }

    /// Restarts: silent for the start time of its kind, then with its RAM lost.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.power = Power::Starting { until_ns: now_ns + self.spec.start_ns };
        self.forget();
    }

    /// Loses the content of RAM.
    fn forget(&mut self) {
        self.is_shut_down = false;
        self.turns_left_out = 0;
        self.motor.duty = 0.0;
        (self.spec.forget)(self);
        for &(address, value) in &self.starts_with {
            self.registers.set(address, value);
        }
    }

    /// The initial state of this servo's shaft.
    pub(crate) fn shaft(&self, config: &ServoConfig) -> ShaftState {
        ShaftState {
            position_rad: config.position_counts / self.model.counts_per_rad(),
            backlash_rad: self.model.backlash_rad,
            holding_share: self.model.holding_share,
            ..ShaftState::at_rest(self.model.reflected_inertia_kg_m2, self.model.friction_nm)
        }
    }

    /// Reads the register that starts at `address`.
    pub(crate) fn get(&self, address: u16) -> i64 {
        self.registers.get(address)
    }

    /// Reads a one-byte register.
    pub(crate) fn byte(&self, address: u16) -> u8 {
        low_byte(u32::try_from(self.get(address)).unwrap_or(0))
    }

    /// The id it answers to now.
    pub(crate) fn id(&self) -> u8 {
        if let Some(wrong_id) = self.wrong_id {
            return wrong_id;
        }
        self.byte(self.spec.id)
    }

    /// Register code of the line rate it listens at now; -1 if it understands nothing at any rate.
    pub(crate) fn baud_code(&self) -> i64 {
        if (self.spec.understands_packets)(self) { self.get(self.spec.baud) } else { -1 }
    }

    /// From the request's last bit to the reply's first, ns.
    pub(crate) fn return_delay_ns(&self) -> u64 {
        (self.spec.return_delay)(&self.model).map_or(0, |address| 2_000 * u64::from(self.byte(address)))
    }

    /// Its goal register, counts.
    pub(crate) fn goal(&self) -> i64 {
        self.get(self.spec.goal_position)
    }

    /// Its torque limit register, in the maker's unit.
    pub(crate) fn torque_limit(&self) -> i64 {
        self.get((self.spec.torque_limit)(&self.model))
    }

    /// A register as a float, for the control laws.
    #[expect(clippy::cast_precision_loss, reason = "registers have 32 bits at most")]
    pub(crate) fn value(&self, address: u16) -> f64 {
        self.registers.get(address) as f64
    }

    /// Drives the motor from the registers; returns its torque, N m.
    pub(crate) fn torque(&mut self, shaft: &ShaftState, supply_v: f64) -> f64 {
        let drive = match self.is_awake() {
            true => (self.spec.drive)(self, shaft.motor_speed_rad_s, supply_v),
            false => Drive::Off,
        };
        self.motor.torque(&self.model, drive, supply_v, shaft.motor_speed_rad_s)
    }

    /// Writes what the servo measures into its registers, after the shaft has moved.
    pub(crate) fn observe(&mut self, shaft: &ShaftState, around: &Conditions) {
        self.encoder_counts = round_to_i64(shaft.position_rad * self.model.counts_per_rad());
        self.motor.warm(&self.model, around.dt_s);
        if let Some(celsius) = around.celsius {
            self.motor.temperature_c = celsius;
        }
        if !self.is_awake() {
            return;
        }
        (self.spec.observe)(self, shaft.speed_rad_s, around);
    }

    /// Notes that a host has written this goal position, and that the servo accepted it.
    pub(crate) fn note_goal(&mut self, counts: i64) {
        self.goal_taken = Some(counts);
        self.goals_taken += 1;
        self.takes_now = true;
    }

    /// True if the bridge is closed.
    pub(crate) fn is_torque_on(&self) -> bool {
        self.is_awake() && (self.spec.is_torque_on)(self)
    }
}

/// Index of the servo that answers to `id`, among those that hear the line.
pub(crate) fn listener(id: u8, servos: &[Servo], hears: &[bool]) -> Option<usize> {
    (0..servos.len()).find(|&index| hears[index] && servos[index].id() == id)
}
