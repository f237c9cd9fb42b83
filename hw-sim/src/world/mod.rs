//! All buses of a robot on one virtual clock.
//!
//! Three kinds of event happen by themselves, in the order of their time: a byte leaves a line, an adapter is
//! unplugged, the motors step. Motors step at whole milliseconds since the start, so that the result does not
//! depend on how the host cuts time into calls. A person's hands on single servos are in `hands`.

mod hands;
mod imu_line;
mod truth;

use std::collections::BTreeSet;

use crate::body::{Body, BodyConfig, BodyState, FreeJoints, Push, RigidBody, ShaftState};
use crate::bus::{Bus, HeardRequest};
use crate::config::{BusConfig, ServoConfig};
use crate::convert::nanoseconds;
use crate::error::{BuildError, Unplugged};
use crate::faults::{Assigned, FaultKind, FaultScript, HostStalls, ImuFaults, Pushes};
use crate::imu::Imu;
use crate::servo::{Conditions, Servo};
use crate::wire::WireStatistics;
pub use truth::ServoTruth;

/// Motor step, ns.
const STEP_NS: u64 = 1_000_000;
/// The same, s.
const STEP_S: f64 = 1e-3;
/// A body slower than this for this long lies still, rad/s and ns.
const STILL_RAD_S: f64 = 0.01;
const SETTLED_NS: u64 = 100_000_000;

/// The true state of a shaft, whatever the registers say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// Angle, encoder counts with their fraction, never wrapped.
    pub position_counts: f64,
    /// Speed, rad/s, positive where counts grow.
    pub speed_rad_s: f64,
    /// Motor torque before gearbox friction, N m.
    pub torque_nm: f64,
    /// True if the bridge is closed.
    pub torque_on: bool,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Supply at the servo, V.
    pub supply_v: f64,
}

/// Every bus of a robot, their servos, the clock and the faults. Deterministic: equal inputs at equal times
/// give equal bytes.
pub struct World {
    now_ns: u64,
    next_step_ns: u64,
    buses: Vec<Bus>,
    /// Every shaft, bus by bus in the order of configuration.
    shafts: Vec<ShaftState>,
    torques: Vec<f64>,
    body: Box<dyn Body + Send>,
    stalls: HostStalls,
    imu: Option<Box<Imu>>,
    /// Faults of a unit that may be fitted later.
    imu_faults: ImuFaults,
    /// Pushes: start, end (exclusive), ns, and the push.
    pushes: Vec<(u64, u64, Push)>,
    scripted_pushes: Pushes,
    /// Shafts that a hand is turning: index into `shafts` and target, rad.
    turning: Vec<(usize, f64)>,
}

impl World {
    /// Powers everything up at time 0, with shafts independent of each other.
    ///
    /// # Errors
    /// [`BuildError`] names the first impossible thing: unknown model, id, rate, number, or a fault on a bus or
    /// servo that does not exist.
    pub fn new(buses: &[BusConfig], faults: FaultScript, seed: u64) -> Result<World, BuildError> {
        let scripted_pushes = Pushes::of(&faults, seed);
        let Assigned { buses: bus_faults, stalls, imu: imu_faults } = faults.assign(buses)?;
        let mut built = Vec::new();
        let mut shafts = Vec::new();
        let mut names = BTreeSet::new();
        for ((index, config), faults) in (0u64..).zip(buses).zip(bus_faults) {
            if !names.insert(&config.name) {
                return Err(BuildError::DuplicateBus { bus: config.name.clone() });
            }
            let baud_code = check_bus(config)?;
            let mut servos = Vec::new();
            for servo_config in &config.servos {
                check_servo(config, servo_config, baud_code)?;
                let servo = Servo::new(config.protocol.spec(), servo_config, baud_code);
                shafts.push(servo.shaft(servo_config));
                servos.push(servo);
            }
            // Distinct streams for each bus; the multiplier only spreads small seeds.
            let bus_seed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(index);
            built.push(Bus::new(config, servos, faults, bus_seed));
        }
        let torques = vec![0.0; shafts.len()];
        let mut world = World {
            now_ns: 0,
            next_step_ns: STEP_NS,
            buses: built,
            shafts,
            torques,
            body: Box::new(FreeJoints),
            stalls,
            imu: None,
            imu_faults,
            pushes: Vec::new(),
            scripted_pushes,
            turning: Vec::new(),
        };
        world.observe(0, 0.0);
        Ok(world)
    }

    /// The same with the shafts in a body: links with masses, on the ground.
    ///
    /// # Errors
    /// As [`World::new`], or the first number that no body can have.
    pub fn with_body(
        buses: &[BusConfig],
        faults: FaultScript,
        seed: u64,
        body: &BodyConfig,
    ) -> Result<World, BuildError> {
        let mut body = body.clone();
        faults.ground.apply(&mut body.ground);
        let mut world = World::new(buses, faults, seed)?;
        for link in body.chains.iter().flat_map(|chain| &chain.links) {
            if let (Some(shaft), Some(inertia)) =
                (world.shafts.get_mut(link.servo.shaft), link.servo.rotor_inertia_kg_m2)
            {
                shaft.inertia_kg_m2 = inertia;
            }
        }
        // A rotor so light that a motor brakes it to rest within a step is computed with the inertia that this takes.
        let step_s = STEP_S * f64::from(body.motor_steps);
        let servos = world.buses.iter().flat_map(|bus| &bus.servos);
        for (shaft, servo) in world.shafts.iter_mut().zip(servos) {
            let braking_nm_s = servo.model.back_emf_nm_s() + body.joints.viscosity_nm_s;
            shaft.inertia_kg_m2 = shaft.inertia_kg_m2.max(braking_nm_s * step_s);
        }
        world.body = Box::new(RigidBody::new(&body, &world.shafts)?);
        Ok(world)
    }

    /// Puts the limp robot down before time begins: hands keep the trunk level while its limbs give way, and then
    /// let go. Each phase lasts until the robot lies still, or `longest_s` seconds that do not count. Does nothing
    /// if joints carry nothing.
    pub fn put_down(&mut self, longest_s: f64) {
        if self.body.state().is_none() {
            return;
        }
        self.torques.fill(0.0);
        for is_held in [true, false] {
            self.body.hold_trunk(is_held);
            let (mut ns, mut still_ns) = (0, 0);
            while ns < nanoseconds(longest_s) && still_ns < SETTLED_NS {
                self.body.step(STEP_S, &mut self.shafts, &self.torques);
                ns += STEP_NS;
                still_ns = if self.is_still() { still_ns + STEP_NS } else { 0 };
            }
        }
        self.observe(0, 0.0);
    }

    /// From now on hands carry the trunk, level and no lower than `height_m` above the ground (its frame's origin,
    /// m). Once motors have kept all joints still for a while, the hands set it down and let go when it stands.
    /// Does nothing if joints carry nothing.
    pub fn carry(&mut self, height_m: f64) {
        self.body.carry_trunk(height_m);
    }

    fn is_still(&self) -> bool {
        let trunk = self.body.state().into_iter().flat_map(|state| state.rate_rad_s);
        let joints = self.shafts.iter().map(|shaft| shaft.speed_rad_s);
        trunk.chain(joints).all(|speed| speed.abs() < STILL_RAD_S)
    }

    /// The true state of the robot after the last motor step; `None` if its joints carry nothing.
    pub fn body(&self) -> Option<&BodyState> {
        self.body.state()
    }

    /// Pushes the trunk for `for_s` seconds from now on. Does nothing if joints carry nothing.
    pub fn push(&mut self, push: Push, for_s: f64) {
        self.pushes.push((self.now_ns, self.now_ns.saturating_add(nanoseconds(for_s)), push));
    }

    /// Virtual time since power-up, ns.
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Hands bytes to the adapter of a bus; they leave at 10 bits a byte, after any bytes it is still sending.
    ///
    /// # Errors
    /// [`Unplugged`] while a script has the adapter out, or when there is no such bus.
    pub fn host_send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), Unplugged> {
        self.buses.get_mut(bus).ok_or(Unplugged)?.send(self.now_ns, bytes)
    }

    /// Takes bytes that have reached the host by now; returns how many, 0 when there are none.
    ///
    /// # Errors
    /// As [`World::host_send`].
    pub fn host_receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, Unplugged> {
        self.buses.get_mut(bus).ok_or(Unplugged)?.receive(self.now_ns, into)
    }

    /// Number of bytes that have arrived on a bus and were not taken yet.
    pub fn host_pending(&self, bus: usize) -> usize {
        self.buses.get(bus).map_or(0, |bus| bus.pending(self.now_ns))
    }

    /// When to come back, for a host that is served in pieces, as a USB adapter does: when a burst will have
    /// crossed a line completely, or a piece of it will have passed an adapter. `None` while every line is idle.
    pub fn next_handover_ns(&self) -> Option<u64> {
        let imu = self.imu.as_ref().and_then(|imu| imu.next_handover_ns());
        self.buses.iter().filter_map(Bus::next_handover_ns).chain(imu).min()
    }

    /// True if a script has the adapter of a bus out now, or there is no such bus.
    pub fn is_unplugged(&self, bus: usize) -> bool {
        self.buses.get(bus).is_none_or(|bus| bus.is_unplugged(self.now_ns))
    }

    /// Pulls the adapter of a bus out for `for_ns` from now on, or for good with [`u64::MAX`]; does nothing if
    /// there is no such bus. The same as the scripted fault `unplugged`, but at a moment that the caller chooses
    /// during the run.
    pub fn unplug(&mut self, bus: usize, for_ns: u64) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.faults.unplug(self.now_ns, for_ns);
        }
        self.advance_to(self.now_ns);
    }

    /// Puts the adapter of a bus back, however it was pulled out.
    pub fn plug_in(&mut self, bus: usize) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.faults.plug_in(self.now_ns);
        }
    }

    /// From now on keeps every complete request that crosses a line, for [`World::requests`]; drops those kept
    /// before.
    pub fn keep_requests(&mut self) {
        self.buses.iter_mut().for_each(|bus| bus.requests = Some(Vec::new()));
    }

    /// Drops all kept requests, and keeps no more.
    pub fn forget_requests(&mut self) {
        self.buses.iter_mut().for_each(|bus| bus.requests = None);
    }

    /// The kept requests of a bus, in the order in which they crossed its line.
    pub fn requests(&self, bus: usize) -> &[HeardRequest] {
        self.buses.get(bus).and_then(|bus| bus.requests.as_deref()).unwrap_or_default()
    }

    /// Name and the host's line rate (bit/s) of every bus, in the order of configuration.
    pub fn lines(&self) -> impl Iterator<Item = (&str, u32)> {
        self.buses.iter().map(|bus| (bus.name.as_str(), bus.wire.baud()))
    }

    /// Sets the rate at which the host of a bus talks and listens from now on, bit/s: servos set to another rate do
    /// not understand it. Does nothing if there is no such bus.
    pub fn set_host_baud(&mut self, bus: usize, baud: u32) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.set_host_baud(baud);
        }
    }

    /// Runs wires and motors up to and including `ns`; does nothing if that time is past.
    pub fn advance_to(&mut self, ns: u64) {
        while self.step_once_until(ns) {}
        self.now_ns = self.now_ns.max(ns);
    }

    /// Runs until a byte for the host is there on any bus (at once if one already is), at most to `deadline_ns`.
    /// Returns true if there is one.
    pub fn advance_to_input(&mut self, deadline_ns: u64) -> bool {
        loop {
            let arrival = self.buses.iter().filter_map(Bus::first_arrival_ns).min();
            let stop = arrival.unwrap_or(u64::MAX).min(deadline_ns);
            if self.step_once_until(stop) {
                continue;
            }
            self.now_ns = self.now_ns.max(stop);
            return arrival.is_some_and(|at| at <= self.now_ns);
        }
    }

    /// Carries out the next event if it is due by `ns`.
    fn step_once_until(&mut self, ns: u64) -> bool {
        let mut at = self.next_step_ns;
        let mut who = None;
        for (index, bus) in self.buses.iter().enumerate() {
            if let Some(bus_ns) = bus.next_ns()
                && bus_ns < at
            {
                (at, who) = (bus_ns, Some(index));
            }
        }
        if let Some(imu) = &mut self.imu
            && imu.next_ns() < at
            && imu.next_ns() <= ns
        {
            imu.step();
            return true;
        }
        if at > ns {
            return false;
        }
        match who {
            Some(index) => self.buses[index].step(),
            None => {
                self.step_motors(at);
                self.next_step_ns += STEP_NS;
            }
        }
        true
    }

    fn step_motors(&mut self, now_ns: u64) {
        let mut index = 0;
        for bus in &mut self.buses {
            let supply_v = bus.volts(now_ns);
            for place in 0..bus.servos.len() {
                let id = bus.home_id(place);
                let is_stuck = bus.faults.has(now_ns, id, FaultKind::Stuck);
                let has_power = supply_v >= bus.servos[place].model.brown_out_v();
                let has_power = has_power && !bus.faults.takes_power(now_ns, id);
                bus.set_power(place, has_power, now_ns);
                let shaft = &mut self.shafts[index];
                shaft.is_stuck = is_stuck;
                self.torques[index] = bus.servos[place].torque(shaft, supply_v);
                index += 1;
            }
            let current_a = bus.servos.iter().map(|servo| servo.motor.supply_current_a(&servo.model)).sum();
            bus.supply.draw(current_a);
        }
        self.grip();
        while let Some(push) = self.scripted_pushes.take(now_ns - STEP_NS) {
            self.pushes.push(push);
        }
        self.pushes.retain(|(_, until_ns, _)| now_ns - STEP_NS < *until_ns);
        // A step ends at its time: so it feels the pushes that act when it begins.
        let begun = self.pushes.iter().filter(|(from_ns, ..)| *from_ns <= now_ns - STEP_NS);
        begun.for_each(|(_, _, push)| self.body.push(push));
        self.body.step(STEP_S, &mut self.shafts, &self.torques);
        self.turn_by_hand();
        self.observe(now_ns, STEP_S);
        if let Some(imu) = &mut self.imu {
            imu.observe(now_ns, self.body.state());
        }
    }

    fn observe(&mut self, now_ns: u64, dt_s: f64) {
        let mut shafts = self.shafts.iter();
        for bus in &mut self.buses {
            let supply_v = bus.volts(now_ns);
            for place in 0..bus.servos.len() {
                let Some(shaft) = shafts.next() else { return };
                let id = bus.home_id(place);
                let celsius = bus.faults.celsius(now_ns, id);
                let is_overloaded = bus.faults.has(now_ns, id, FaultKind::Overload);
                let around = Conditions { now_ns, dt_s, supply_v, celsius, is_overloaded };
                bus.servos[place].observe(shaft, &around);
            }
        }
    }

    /// Puts a torque (N m, positive where counts grow) on the shaft of a servo, given by its bus and its index
    /// there, until the next call: a weight on a lever, say. Does nothing if there is no such servo.
    pub fn load(&mut self, bus: usize, place: usize, torque_nm: f64) {
        if let Some(index) = self.index_of(bus, place).filter(|_| torque_nm.is_finite()) {
            self.shafts[index].load_nm = torque_nm;
        }
    }

    /// Extra time the host sleeps if it goes to sleep now, ns. Each scripted stall that is due is returned once;
    /// several add up.
    pub fn host_stall_ns(&mut self) -> u64 {
        self.stalls.take(self.now_ns)
    }

    /// The true state of the shaft of the servo that has this id now.
    pub fn shaft(&self, bus: usize, id: u8) -> Option<Shaft> {
        self.shaft_at(bus, self.buses.get(bus)?.servo_with_id(id)?)
    }

    /// The true state of the shaft of a servo, by its index among the bus's servos in the order of configuration.
    pub fn shaft_at(&self, bus: usize, place: usize) -> Option<Shaft> {
        let line = self.buses.get(bus)?;
        let (state, servo) = (self.shafts.get(self.index_of(bus, place)?)?, line.servos.get(place)?);
        Some(Shaft {
            position_counts: state.position_rad * servo.model.counts_per_rad(),
            speed_rad_s: state.speed_rad_s,
            torque_nm: servo.motor.torque_nm,
            torque_on: servo.is_torque_on(),
            temperature_c: servo.motor.temperature_c,
            supply_v: line.volts(self.now_ns),
        })
    }

    /// One byte of the control table of the servo that has this id now.
    pub fn register(&self, bus: usize, id: u8, address: u16) -> Option<u8> {
        let line = self.buses.get(bus)?;
        line.servos[line.servo_with_id(id)?].registers.byte(address)
    }

    /// What has crossed a bus since power-up.
    pub fn wire_statistics(&self, bus: usize) -> Option<WireStatistics> {
        self.buses.get(bus).map(|bus| bus.wire.statistics())
    }
}

/// Checks the settings of a bus; returns the register code of its rate.
fn check_bus(config: &BusConfig) -> Result<i64, BuildError> {
    let bus = || config.name.clone();
    let Some(code) = config.protocol.baud_code(config.baud) else {
        return Err(bad_baud(config, i64::MAX));
    };
    if !(config.supply_v.is_finite() && config.supply_v > 0.0) {
        let (key, value) = ("supply_v".into(), config.supply_v.to_string());
        return Err(BuildError::BadNumber { bus: bus(), key, value, expected: "volts above 0" });
    }
    if !(0.0..=10.0).contains(&config.supply_ohm) {
        let (key, value) = ("supply_ohm".into(), config.supply_ohm.to_string());
        return Err(BuildError::BadNumber { bus: bus(), key, value, expected: "0 to 10 ohms" });
    }
    let mut ids = BTreeSet::new();
    for servo in &config.servos {
        if servo.id > config.protocol.spec().id_max {
            let (protocol, max) = (config.protocol, config.protocol.spec().id_max);
            return Err(BuildError::BadId { bus: bus(), id: servo.id, protocol, max });
        }
        if !ids.insert(servo.id) {
            return Err(BuildError::DuplicateId { bus: bus(), id: servo.id });
        }
    }
    Ok(code)
}

/// The error for a rate that is not among those up to `highest_code`.
fn bad_baud(config: &BusConfig, highest_code: i64) -> BuildError {
    let bauds = config.protocol.spec().bauds.iter().filter(|(code, _)| *code <= highest_code);
    let known = bauds.map(|(_, baud)| baud.to_string()).collect::<Vec<_>>().join(", ");
    BuildError::BadBaud { bus: config.name.clone(), baud: config.baud, known }
}

fn check_servo(config: &BusConfig, servo: &ServoConfig, baud_code: i64) -> Result<(), BuildError> {
    let (bus, id, model) = (config.name.clone(), servo.id, &servo.model);
    if model.protocol != config.protocol {
        let (speaks, expected) = (model.protocol, config.protocol);
        return Err(BuildError::WrongProtocol { bus, id, model: model.name.clone(), speaks, expected });
    }
    let highest_code = model.largest(config.protocol.spec().baud);
    if baud_code > highest_code {
        return Err(bad_baud(config, highest_code));
    }
    let bad = |key: &str, value: String, expected| {
        Err(BuildError::BadNumber {
            bus: config.name.clone(),
            key: format!("{key} of servo {id}"),
            value,
            expected,
        })
    };
    if servo.return_delay_us > 508 || !servo.return_delay_us.is_multiple_of(2) {
        return bad("return_delay_us", servo.return_delay_us.to_string(), "an even number of 0 to 508");
    }
    // A Dynamixel's position register has 32 bits; a shaft further out than this would not fit.
    if servo.position_counts.is_nan() || servo.position_counts.abs() > 1e9 {
        return bad("position_counts", servo.position_counts.to_string(), "a number within 1e9 of 0");
    }
    Ok(())
}
