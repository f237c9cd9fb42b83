//! `hippocamp check`: prints what the robot is and what it can do.

use std::path::Path;

use anyhow::Result;

use super::load::load;
use super::{BadInput, write_whole};
use crate::capability::bus_costs;
use crate::capability::loads::LASTING_SHARE;
use crate::capability::{Capability, FigureCapability, HorseCapability, Load, TentacleCapability};
use crate::model::{ArmGeometry, Carrier, FigureMotion, Gait, HorseMotion, LEG_NAMES, Robot, TentacleMotion};
use crate::motion::tentacle::KEYED;
use crate::output::{Outputs, Writing};
use crate::urdf;

/// Checks the robot file at `path`, prints what the robot can do, and writes its URDF if asked to.
pub(super) fn check(path: &Path, urdf_file: Option<&Path>) -> Result<()> {
    let place = |file| Outputs::of_reading([path]).claim("--urdf", file, Writing::Whole);
    let place = urdf_file.map(place).transpose()?;
    let loaded = load(path, None)?;
    let robot = &loaded.file.robot;
    let urdf = place.map(|place| urdf::of_robot(robot).map(|text| (place, text)));
    let urdf = urdf.transpose().map_err(|error| BadInput(format!("--urdf: {error}")))?;
    let mass_kg = robot.mass_kg();
    say!(
        "{}: {} chains, {} joints, {mass_kg:.2} kg, loop at {} Hz",
        robot.name,
        robot.chains.len(),
        robot.joints.len(),
        robot.rate_hz
    );
    print_joints(robot);
    match &loaded.capability {
        Capability::Horse(horse, capability) => {
            print_legs(capability);
            print_gaits(robot, horse, capability);
        }
        Capability::Tentacle(tentacle, capability) => {
            print_arms(robot, tentacle);
            print_tempos(tentacle, capability);
            print_loads(robot, tentacle, &capability.loads);
        }
        Capability::Figure(figure, capability) => {
            print_poses(figure, capability);
            say!();
            say!("Weight held in the heaviest of these poses, shared by both feet:");
            print_load_table(robot, &capability.loads);
        }
    }
    print_buses(robot);
    if let Some((place, text)) = urdf {
        write_whole(&place, &text)?;
        say!();
        say!("URDF written to {}", place.path().display());
    }
    Ok(())
}

fn print_joints(robot: &Robot) {
    say!();
    say!("{:<24} {:>16}  {:>9}  servo", "joint", "range deg", "rate deg/s");
    for joint in &robot.joints {
        let (low, high) = joint.range_rad;
        let range = format!("{:.1} .. {:.1}", low.to_degrees(), high.to_degrees());
        let (rate, servo) = match &joint.servo {
            None => ("-".to_owned(), "none".to_owned()),
            Some(servo) => (
                format!("{:.0}", (robot.safety.rate_share * servo.model.no_load_speed_rad_s).to_degrees()),
                format!(
                    "{} id {} on bus {}{}",
                    servo.model.name,
                    servo.id,
                    robot.buses[servo.bus].name,
                    if servo.reversed { ", reversed" } else { "" }
                ),
            ),
        };
        say!("{:<24} {range:>16}  {rate:>9}  {servo}", joint.name);
    }
}

fn print_legs(capability: &HorseCapability) {
    say!();
    say!("{:<24} {:>16}  neutral foot point, mm from the body's origin", "leg", "E mm");
    for (name, reach) in LEG_NAMES.iter().zip(&capability.reaches) {
        let place = reach.neutral_in_body * 1e3;
        say!(
            "{name:<24} {:>16.1}  forward {:.1}, left {:.1}, up {:.1}",
            reach.half_excursion_m * 1e3,
            place.x,
            place.y,
            place.z
        );
    }
    say!("{:<24} {:>16.1}", "all legs", capability.half_excursion_m() * 1e3);
}

fn print_gaits(robot: &Robot, horse: &HorseMotion, capability: &HorseCapability) {
    say!();
    say!("{:<24} {:>16}  {:>15}  limited by", "gait", "by reach m/s", "by servos m/s");
    for (gait, top) in horse.gaits.iter().zip(&capability.top_speeds) {
        let limit = top.joint.map_or("the legs' reach".to_owned(), |joint| {
            format!("the speed or acceleration of {}", robot.joints[joint].name)
        });
        let by_servos =
            if robot.buses.is_empty() { "-".to_owned() } else { format!("{:.3}", top.by_servos_m_s) };
        say!("{:<24} {:>16.3}  {by_servos:>15}  {limit}", gait.name, top.by_reach_m_s);
    }
    print_own_gaits(&horse.gaits);
}

/// Prints the gaits that come from the robot file, if there are any.
fn print_own_gaits(gaits: &[Gait]) {
    let built_in = Gait::built_in();
    let own = gaits.iter().filter(|gait| !built_in.contains(gait)).map(|gait| {
        let is_replaced = built_in.iter().any(|known| known.name == gait.name);
        format!("{}{}", gait.name, if is_replaced { " (in the place of the built-in one)" } else { "" })
    });
    let own: Vec<String> = own.collect();
    if !own.is_empty() {
        say!("from the robot file: {}", own.join(", "));
    }
}

fn print_arms(robot: &Robot, tentacle: &TentacleMotion) {
    say!();
    say!("{:<24} {:>16}  {:>9}  root, mm from the body's origin", "arm", "length mm", "joints");
    for arm in &tentacle.arms {
        let chain = &robot.chains[arm.chain];
        let (length_m, root) = (chain.length_m(robot.joints_of(chain)), chain.root_m * 1e3);
        say!(
            "{:<24} {:>16.1}  {:>9}  forward {:.1}, left {:.1}, up {:.1}",
            chain.name,
            length_m * 1e3,
            ArmGeometry::of(chain, robot.joints_of(chain)).map_or(0, |geometry| geometry.joints.len()),
            root.x,
            root.y,
            root.z
        );
    }
}

fn print_tempos(tentacle: &TentacleMotion, capability: &TentacleCapability) {
    say!();
    say!("{:<24} {:>16}  {:>9}", "stroke", "at tempo 1, s", "tempo max");
    for (stroke, tempo) in KEYED.iter().zip(capability.tempo_max) {
        say!("{:<24} {:>16.2}  {tempo:>9.2}", stroke.name(), tentacle.stroke_time_s);
    }
}

/// Prints the load that each joint holds up in its worst pose.
fn print_loads(robot: &Robot, tentacle: &TentacleMotion, loads: &[Load]) {
    let carried = match tentacle.carrier {
        Carrier::Servos => "its servos alone".to_owned(),
        Carrier::Water => format!("water, {:.0} %,", tentacle.carried_share * 100.0),
        Carrier::Counterweight => format!("a counterweight, {:.0} %,", tentacle.carried_share * 100.0),
    };
    say!();
    say!("Weight carried by {carried} stretched out level:");
    print_load_table(robot, loads);
    let heavy = loads.iter().filter(|load| is_heavy(load)).count();
    if heavy > 0 {
        say!(
            "WARNING: {heavy} joints would hold more than {:.0} % of stall torque: they get hot if the arm stays so; carry \
             more of its weight (motion.carried_by, carried_share)",
            LASTING_SHARE * 100.0
        );
    }
}

fn is_heavy(load: &Load) -> bool {
    load.share_of_stall.is_some_and(|share| share > LASTING_SHARE)
}

/// Prints the poses of a figure, and where its centre of mass is over its feet.
fn print_poses(figure: &FigureMotion, capability: &FigureCapability) {
    say!();
    say!(
        "{:<24} {:>16}  {:>9}  centre of mass, mm from the middle between the soles",
        "pose",
        "height mm",
        "time s"
    );
    for (pose, center) in figure.poses.iter().zip(&capability.centers_m) {
        let center = *center * 1e3;
        say!(
            "{:<24} {:>16.1}  {:>9.2}  forward {:.1}, left {:.1}, up {:.1}",
            pose.name,
            pose.height_m * 1e3,
            pose.time_s,
            center.x,
            center.y,
            center.z
        );
    }
}

/// Prints the load that each joint holds.
fn print_load_table(robot: &Robot, loads: &[Load]) {
    say!("{:<24} {:>16}  {:>9}", "joint", "load N m", "of stall");
    for load in loads {
        let share = load.share_of_stall.map_or("-".to_owned(), |share| format!("{:.1} %", share * 100.0));
        let warning = if is_heavy(load) { "  MORE THAN IT CAN HOLD FOR LONG" } else { "" };
        say!("{:<24} {:>16.4}  {share:>9}{warning}", robot.joints[load.joint].name, load.torque_nm);
    }
}

fn print_buses(robot: &Robot) {
    if robot.buses.is_empty() {
        say!();
        say!("No buses: this robot exists on paper only and cannot be run.");
        return;
    }
    say!();
    say!("{:<24} {:>16}  {:>9} {:>10} {:>12}", "bus", "exchange ms", "wire ms", "adapter ms", "at most Hz");
    for bus in bus_costs::of_robot(robot) {
        say!(
            "{:<24} {:>16.3}  {:>9.3} {:>10.3} {:>12.0}",
            bus.name,
            bus.total().as_secs_f64() * 1e3,
            bus.wire.as_secs_f64() * 1e3,
            bus.adapter.as_secs_f64() * 1e3,
            bus.highest_rate_hz()
        );
    }
}
