//! The simulated hardware of a robot file: the same buses and servos, limp, in a random pose; and, if the file has
//! `[physics]`, the body that they move, put down on the ground.

mod body;
pub(crate) mod mass;

pub use body::body;
use hw_sim::{BuildError, BusConfig, FaultError, FaultScript, ImuConfig, Model, ServoConfig, World};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::model::{Bus, ImuSettings, Robot, Servo, ServoModel, SharedRange};

/// How far outside its range a limp joint may lie, as a share of the range's width.
const OUTSIDE_SHARE: f64 = 0.1;

/// Height of the feet above the ground when hands hold a figure, m.
const CLEARANCE_M: f64 = 0.02;

/// Longest time that a limp robot needs to lie still after it is put down, s.
const SETTLE_S: f64 = 3.0;

/// A simulated world of `robot`'s buses, each joint at a random angle in or a little outside its range; with
/// physics, the robot is then put down on the ground.
///
/// # Errors
/// If `faults` names a bus or servo that the robot does not have.
pub fn world(robot: &Robot, seed: u64, faults: &FaultScript) -> Result<World, BuildError> {
    let mut chance = Pcg64Mcg::seed_from_u64(seed);
    let mut pose: Vec<f64> = robot
        .joints
        .iter()
        .map(|joint| {
            let (low, high) = joint.range_rad;
            #[allow(clippy::cast_precision_loss, reason = "53 bits fit")]
            let share = (chance.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
            low + (high - low) * (share * (1.0 + 2.0 * OUTSIDE_SHARE) - OUTSIDE_SHARE)
        })
        .collect();
    // Joints whose hinges share a stop lie inside it.
    for (hinges, range) in SharedRange::of_robot(robot) {
        range.bring_in(&mut pose[hinges]);
    }
    world_from_pose(robot, &pose, seed, faults)
}

/// A simulated world of `robot`'s buses with the limp joints at `pose` (rad); with physics, the robot is
/// then put down on the ground.
///
/// # Errors
/// If `faults` names a bus or servo that the robot does not have.
pub fn world_from_pose(
    robot: &Robot,
    pose: &[f64],
    seed: u64,
    faults: &FaultScript,
) -> Result<World, BuildError> {
    let buses = buses(robot, pose)?;
    let mut world = match &robot.physics {
        None => World::new(&buses, faults.clone(), seed)?,
        Some(physics) => {
            let mut world = World::with_body(&buses, faults.clone(), seed, &body(robot, physics))?;
            match robot.motion.held_height_m() {
                Some(height_m) => world.carry(height_m + CLEARANCE_M),
                None => world.put_down(SETTLE_S),
            }
            if world.body().is_some_and(|state| !state.is_finite) {
                return Err(BuildError::Unstable);
            }
            world
        }
    };
    set_up(robot, &mut world);
    if let Some(settings) = &robot.imu {
        world.fit_imu(&imu(settings), seed)?;
    }
    Ok(world)
}

/// Gives the servos the settings that `hippocamp setup` leaves them with.
fn set_up(robot: &Robot, world: &mut World) {
    let mut places = vec![0; robot.buses.len()];
    for servo in robot.joints.iter().filter_map(|joint| joint.servo) {
        let place = places[servo.bus];
        places[servo.bus] += 1;
        let series = robot.buses[servo.bus].protocol.spec().series;
        let Some(series) = series.iter().find(|of| std::ptr::eq(of.registers, servo.model.registers)) else {
            continue;
        };
        let held = |address| world.register(servo.bus, servo.id.0, address).unwrap_or_default();
        let settings = series.after_setup(servo.model.model_number, held);
        world.configure(servo.bus, place, &settings);
    }
}

/// The unit of a robot file, configured and mounted as the file says.
fn imu(settings: &ImuSettings) -> ImuConfig {
    let noise = &settings.noise;
    ImuConfig {
        rate_hz: settings.rate_hz,
        baud: settings.baud,
        rotation: settings.rotation.to_array(),
        delay_s: settings.delay_s,
        acceleration_noise_m_s2: noise.acceleration_m_s2,
        acceleration_bias_m_s2: noise.acceleration_bias_m_s2,
        rate_noise_rad_s: noise.rate_rad_s,
        rate_bias_rad_s: noise.rate_bias_rad_s,
        angle_noise_rad: noise.angle_rad,
        angle_drift_rad: noise.angle_drift_rad,
    }
}

/// Reads a fault script from a file called `file_name`, for the buses of `robot`.
///
/// # Errors
/// Every mistake in the script; buses and servos that the robot does not have count as mistakes.
pub fn fault_script(robot: &Robot, text: &str, file_name: &str) -> Result<FaultScript, FaultError> {
    let pose = vec![0.0; robot.joints.len()];
    // A robot that cannot be simulated says so when its world is built.
    let buses = buses(robot, &pose).ok();
    let script = FaultScript::for_buses(text, file_name, buses.as_deref())?;
    if robot.physics.is_some() { Ok(script) } else { script.without_body() }
}

/// The buses of `robot` with their servos where the joints are at `pose` (rad).
fn buses(robot: &Robot, pose: &[f64]) -> Result<Vec<BusConfig>, BuildError> {
    let mut buses = robot.buses.iter().map(bus_of).collect::<Result<Vec<BusConfig>, BuildError>>()?;
    for (joint, angle) in robot.joints.iter().zip(pose) {
        if let Some(servo) = &joint.servo {
            let bus = &mut buses[servo.bus];
            bus.supply_v = servo.model.nominal_voltage_v;
            bus.servos.push(servo_of(&robot.buses[servo.bus], servo, *angle)?);
        }
    }
    Ok(buses)
}

/// A simulated bus without servos. The simulator has protocols and models of its own, by the same names.
fn bus_of(bus: &Bus) -> Result<BusConfig, BuildError> {
    let name = bus.protocol.name();
    let protocol = hw_sim::Protocol::named(name)
        .ok_or_else(|| BuildError::UnknownProtocol { bus: bus.name.clone(), protocol: name.to_owned() })?;
    Ok(BusConfig {
        name: bus.name.clone(),
        protocol,
        baud: bus.baud,
        adapter_latency_us: bus.adapter_latency_us,
        supply_v: 0.0,
        supply_ohm: bus.supply_ohm,
        servos: Vec::new(),
    })
}

/// A simulated servo with its joint at this angle, rad.
fn servo_of(bus: &Bus, servo: &Servo, angle_rad: f64) -> Result<ServoConfig, BuildError> {
    let (id, name) = (servo.id.0, servo.model.name);
    let model = Model::named(name).ok_or_else(|| BuildError::unknown_model(&bus.name, id, name))?;
    Ok(ServoConfig {
        model: model.clone(),
        id,
        return_delay_us: bus.return_delay_us,
        position_counts: servo.count_of(angle_rad),
    })
}

/// Coulomb friction of the gearbox of a servo of this model, N m; 0 for a model that the simulator does not have.
pub(crate) fn friction_nm(model: &ServoModel) -> f64 {
    Model::named(model.name).map_or(0.0, |model| model.friction_nm)
}
