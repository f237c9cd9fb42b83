//! The rigid body of a robot file: its links, masses and feet, each joint with the servo that turns it.

use hw_sim::body::{self, BallStop, BodyConfig, JointMechanics, Mass, ShaftLink, Trunk};

use super::mass;
use crate::model::{Chain, Foot, Ground, Joint, Physics, Robot, hinges_in_place};

/// The body of `robot`, as `physics` describes it.
pub fn body(robot: &Robot, physics: &Physics) -> BodyConfig {
    let shafts = shafts(robot);
    BodyConfig {
        trunk: Trunk {
            // A trunk that is bolted down has no weight and touches nothing.
            is_fixed: physics.trunk_box_m.is_none(),
            mass_kg: robot.trunk_mass_kg,
            center_m: robot.trunk_center_m.to_array(),
            box_middle_m: robot.trunk_center_m.to_array(),
            box_size_m: mass::trunk_box_m(robot).to_array(),
        },
        chains: (0..robot.chains.len()).map(|chain| limb(robot, physics, chain, &shafts)).collect(),
        ground: ground(&physics.ground),
        joints: JointMechanics { viscosity_nm_s: physics.viscosity_nm_s, stop: physics.stop },
        motor_steps: physics.step_ms,
    }
}

/// Index of each joint's servo among all servos, bus by bus, in the order of the simulated buses.
fn shafts(robot: &Robot) -> Vec<Option<usize>> {
    let on = |bus: usize| robot.joints.iter().filter_map(|joint| joint.servo).filter(move |of| of.bus == bus);
    let mut next: Vec<usize> =
        (0..robot.buses.len()).map(|bus| (0..bus).map(|bus| on(bus).count()).sum()).collect();
    let place = |joint: &Joint| {
        let next = next.get_mut(joint.servo?.bus)?;
        *next += 1;
        Some(*next - 1)
    };
    robot.joints.iter().map(place).collect()
}

fn limb(robot: &Robot, physics: &Physics, place: usize, shafts: &[Option<usize>]) -> body::Chain {
    let chain = &robot.chains[place];
    let masses = mass::links(robot, place);
    let links = robot.joints_of(chain).iter().zip(masses).zip(&shafts[chain.joints.clone()]);
    let moved = |((joint, mass), shaft): ((&Joint, Mass), &Option<usize>)| {
        Some(link(joint, mass, (*shaft)?, mass::link_radius_m(robot, place, joint), physics))
    };
    body::Chain {
        root_m: chain.root_m.to_array(),
        root_rotation: chain.root_rotation.to_array(),
        carried_share: robot.motion.carried_share(),
        links: links.filter_map(moved).collect(),
        balls: balls(robot.joints_of(chain)),
        foot: foot(chain),
    }
}

fn link(joint: &Joint, mass: Mass, shaft: usize, radius_m: f64, physics: &Physics) -> body::Link {
    // The encoders of models differ: an SCS0009 has 1024 counts in 300 degrees.
    let zero = |servo: crate::model::Servo| (servo.zero_count * servo.count_rad(), servo.reversed);
    let (zero_rad, is_reversed) = joint.servo.map_or((0.0, false), zero);
    body::Link {
        axis: joint.axis.to_array(),
        end_m: joint.link_m.to_array(),
        mass,
        radius_m,
        stops_rad: joint.stops_rad(),
        servo: ShaftLink { shaft, zero_rad, is_reversed, rotor_inertia_kg_m2: physics.rotor_inertia_kg_m2 },
    }
}

/// The ball joints of a chain with these `joints`, all of them with servos.
fn balls(joints: &[Joint]) -> Vec<BallStop> {
    let ball = |(last, joint): (usize, &Joint)| {
        let corners = joint.ball.as_ref()?.corners();
        Some(BallStop {
            last,
            hinges: hinges_in_place(joints, last).len(),
            corners: corners.iter().map(|corner| (corner.swing.to_array(), corner.twist_rad)).collect(),
        })
    };
    joints.iter().enumerate().filter_map(ball).collect()
}

fn foot(chain: &Chain) -> Option<body::Foot> {
    Some(match chain.foot? {
        Foot::Round { radius_m, width_m } => body::Foot::Round { radius_m, width_m },
        Foot::Plate { size_m, middle_m } => {
            body::Foot::Plate { size_m: size_m.to_array(), middle_m: middle_m.to_array() }
        }
    })
}

fn ground(ground: &Ground) -> body::Ground {
    let steps = ground.steps.iter();
    body::Ground {
        friction: ground.friction,
        slope_rad: ground.slope_rad,
        uphill_rad: ground.uphill_rad,
        steps: steps
            .map(|step| body::Step { at_m: step.at_m, length_m: step.length_m, height_m: step.height_m })
            .collect(),
    }
}
