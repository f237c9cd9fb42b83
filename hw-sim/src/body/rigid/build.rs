//! Builds bodies, joints and colliders from a description.

use rapier3d_f64::prelude::*;

use super::super::{BodyConfig, BodyError, BodyState, Chain, Foot, FootState, Ground, ShaftState, Trunk};
use super::ball::BallJointStop;
use super::{GRAVITY, Hinge, RigidBody};

/// Contacts as springs: natural frequency, Hz, and damping ratio. Stiff enough to sink in by less than half a
/// millimetre, soft enough for steps of a millisecond.
const CONTACT: SpringCoefficients<f64> = SpringCoefficients { natural_frequency: 60.0, damping_ratio: 1.0 };
/// Half the width of a step, m: so wide that no robot walks round it.
const STEP_HALF_WIDTH_M: f64 = 20.0;

const GROUND: InteractionGroups =
    InteractionGroups::new(Group::GROUP_1, Group::GROUP_2, InteractionTestMode::And);
const ROBOT: InteractionGroups =
    InteractionGroups::new(Group::GROUP_2, Group::GROUP_1, InteractionTestMode::And);

/// The part of the robot that a collider belongs to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    Trunk,
    /// A link of the chain at this index.
    Link(usize),
    /// A foot: index in [`BodyState::feet`].
    Foot(usize),
}

impl Part {
    fn mark(self) -> u128 {
        match self {
            Part::Trunk => 0,
            Part::Link(chain) => 1 + 2 * chain as u128,
            Part::Foot(place) => 2 + 2 * place as u128,
        }
    }

    pub(super) fn of(collider: &Collider) -> Part {
        match collider.user_data {
            0 => Part::Trunk,
            link if link % 2 == 1 => Part::Link(usize::try_from(link / 2).unwrap_or_default()),
            foot => Part::Foot(usize::try_from(foot / 2 - 1).unwrap_or_default()),
        }
    }
}

pub(super) fn build(config: &BodyConfig, shafts: &[ShaftState]) -> Result<RigidBody, BodyError> {
    let mut world = PhysicsWorld { gravity: -Vector::Z * GRAVITY, ..PhysicsWorld::default() };
    let parameters = &mut world.integration_parameters;
    parameters.num_solver_iterations = 1;
    parameters.static_contact_softness = CONTACT;
    parameters.contact_softness = CONTACT;
    // The engine's length tolerances are shares of this: a tenth of a metre, not a metre.
    parameters.length_unit = 0.1;
    let ground_turn = ground_turn(&config.ground);
    let grounds = insert_ground(&mut world, &config.ground, ground_turn);
    let trunk =
        Pose::from_parts(Vector::ZERO, if config.trunk.is_fixed { Rotation::IDENTITY } else { ground_turn });
    let mut body = RigidBody {
        trunk: insert_trunk(&mut world, &config.trunk, config.ground.friction, trunk),
        world,
        hinges: Vec::new(),
        balls: Vec::new(),
        joints: config.joints,
        grounds,
        soles: Vec::new(),
        pushes: Vec::new(),
        up: ground_turn * Vector::Z,
        mass_kg: config.mass_kg(),
        is_held: false,
        carried: None,
        motor_steps: config.motor_steps,
        chains: config.chains.len(),
        waited: 0,
        torques: vec![0.0; shafts.len()],
        state: BodyState::unseen(Vec::new()),
    };
    for (place, chain) in config.chains.iter().enumerate() {
        insert_chain(&mut body, config, (place, chain), shafts)?;
    }
    bend(&mut body, shafts);
    if !config.trunk.is_fixed {
        stand_up(&mut body, ground_turn * Vector::Z);
    }
    Ok(body)
}

/// Rotation from the frame of a level ground to that of this ground.
fn ground_turn(ground: &Ground) -> Rotation {
    // Uphill along x, the plane is turned about -y.
    let axis = Rotation::from_rotation_z(ground.uphill_rad) * -Vector::Y;
    Rotation::from_axis_angle(axis, ground.slope_rad)
}

fn insert_ground(world: &mut PhysicsWorld, ground: &Ground, turn: Rotation) -> Vec<ColliderHandle> {
    let finish = |collider: ColliderBuilder, middle: Vector| {
        let pose = Pose::from_parts(turn * middle, turn);
        collider.position(pose).friction(ground.friction).collision_groups(GROUND).build()
    };
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Z));
    let mut colliders = vec![finish(plane, Vector::ZERO)];
    for step in &ground.steps {
        // The lower half is in the ground.
        let cuboid = ColliderBuilder::cuboid(0.5 * step.length_m, STEP_HALF_WIDTH_M, step.height_m);
        colliders.push(finish(cuboid, Vector::new(step.at_m + 0.5 * step.length_m, 0.0, 0.0)));
    }
    colliders.into_iter().map(|collider| world.colliders.insert(collider)).collect()
}

fn insert_trunk(world: &mut PhysicsWorld, trunk: &Trunk, friction: f64, pose: Pose) -> RigidBodyHandle {
    if trunk.is_fixed {
        return world.insert_body(RigidBodyBuilder::fixed());
    }
    let [x, y, z] = trunk.box_size_m;
    let mass = trunk.mass().properties();
    let body = RigidBodyBuilder::dynamic().pose(pose).additional_mass_properties(mass).can_sleep(false);
    let collider = ColliderBuilder::cuboid(0.5 * x, 0.5 * y, 0.5 * z)
        .translation(Vector::from_array(trunk.box_middle_m))
        .user_data(Part::Trunk.mark());
    world.insert(body, of_robot(collider, friction)).0
}

fn of_robot(collider: ColliderBuilder, friction: f64) -> ColliderBuilder {
    collider.density(0.0).friction(friction).collision_groups(ROBOT)
}

fn insert_chain(
    body: &mut RigidBody,
    config: &BodyConfig,
    (place, chain): (usize, &Chain),
    shafts: &[ShaftState],
) -> Result<(), BodyError> {
    let root_turn = Rotation::from_array(chain.root_rotation).normalize();
    // One multibody for each chain if the chains share nothing that moves: cheaper.
    let is_fixed = config.trunk.is_fixed;
    let mut parent = if is_fixed { body.world.insert_body(RigidBodyBuilder::fixed()) } else { body.trunk };
    let mut anchor = Pose::from_parts(Vector::from_array(chain.root_m), root_turn);
    let first = body.hinges.len();
    for (number, link) in chain.links.iter().enumerate() {
        let Some(shaft) = shafts.get(link.servo.shaft) else {
            let what = format!("servo {} of link {number} of chain {place}", link.servo.shaft);
            return Err(BodyError { what, expected: "one of the buses' servos" });
        };
        let made = RigidBodyBuilder::dynamic()
            .additional_mass_properties(link.mass.properties())
            .gravity_scale(1.0 - chain.carried_share)
            .can_sleep(false);
        let child = body.world.insert_body(made);
        let axis = Vector::from_array(link.axis).normalize();
        let turn = Rotation::from_rotation_arc(Vector::X, axis);
        let mut joint = GenericJoint::new(JointAxesMask::LOCKED_REVOLUTE_AXES);
        joint.set_local_frame1(anchor * Pose::from_parts(Vector::ZERO, turn));
        joint.set_local_frame2(Pose::from_parts(Vector::ZERO, turn));
        let Some(joint) = body.world.insert_multibody_joint(parent, child, joint) else {
            let what = format!("link {number} of chain {place}");
            return Err(BodyError { what, expected: "a link that closes no loop" });
        };
        let zero_rad = link.servo.zero_rad;
        let sign = if link.servo.is_reversed { -1.0 } else { 1.0 };
        set_joint(body, joint, shaft);
        body.hinges.push(Hinge {
            joint,
            parent,
            child,
            axis,
            stops_rad: link.stops_rad,
            shaft: link.servo.shaft,
            zero_rad,
            sign,
            known_rad: zero_rad,
            friction_nm: shaft.friction_nm,
            torque_nm: 0.0,
        });
        let end = Vector::from_array(link.end_m);
        if !is_fixed && end.length() > 0.0 {
            // The round end of a link must not bear on the ground in place of the plate. So where the link is
            // short, it has a plate only.
            let is_on_plate =
                matches!(chain.foot, Some(Foot::Plate { .. })) && number + 1 == chain.links.len();
            let short = if is_on_plate { 2.0 * link.radius_m } else { 0.0 };
            if short < end.length() {
                let bare = end * (1.0 - short / end.length());
                let rod = ColliderBuilder::capsule_from_endpoints(Vector::ZERO, bare, link.radius_m);
                let rod = of_robot(rod.user_data(Part::Link(place).mark()), config.ground.friction);
                body.world.insert_collider(rod, Some(child));
            }
        }
        (parent, anchor) = (child, Pose::from_translation(end));
    }
    for stop in &chain.balls {
        let links = stop.last + 1 - stop.hinges..stop.last + 1;
        let axes = chain.links[links.clone()].iter().map(|link| Vector::from_array(link.axis)).collect();
        let hinges = links.map(|link| first + link).collect();
        let link = Vector::from_array(chain.links[stop.last].end_m);
        body.balls.push(BallJointStop::new(stop, hinges, axes, link));
    }
    if let Some(foot) = chain.foot.filter(|_| !is_fixed) {
        let number = body.soles.len();
        let (sole, middle) = sole(&foot, anchor.translation, root_turn.inverse());
        let sole = of_robot(sole.user_data(Part::Foot(number).mark()), config.ground.friction);
        body.world.insert_collider(sole, Some(parent));
        body.soles.push((parent, middle));
        body.state.feet.push(FootState { chain: place, ..FootState::default() });
    }
    Ok(())
}

/// A foot at `tip`, with its middle; `turn` rotates from the trunk's axes to the link's. It has no mass of
/// its own.
fn sole(foot: &Foot, tip: Vector, turn: Rotation) -> (ColliderBuilder, Vector) {
    match *foot {
        Foot::Round { radius_m, width_m } => {
            let across = turn * Vector::Y * (0.5 * width_m);
            (ColliderBuilder::capsule_from_endpoints(tip - across, tip + across, radius_m), tip)
        }
        Foot::Plate { size_m: [x, y, z], middle_m } => {
            let middle = tip + turn * Vector::from_array(middle_m);
            let plate = ColliderBuilder::cuboid(0.5 * x, 0.5 * y, 0.5 * z);
            (plate.position(Pose::from_parts(middle, turn)), middle)
        }
    }
}

/// Sets rotor inertia and friction, and no damping: the engine's default would brake the trunk too.
fn set_joint(body: &mut RigidBody, joint: MultibodyJointHandle, shaft: &ShaftState) {
    if let Some((multibody, link)) = body.world.multibody_joints.get_mut(joint) {
        let place = multibody.link(link).map_or(0, |link| link.assembly_id());
        multibody.armature_mut()[place] = shaft.inertia_kg_m2;
        multibody.frictions_mut()[place] = shaft.friction_nm;
    }
}

/// Turns every hinge to its shaft's angle, and removes all damping.
fn bend(body: &mut RigidBody, shafts: &[ShaftState]) {
    let RigidBody { world, hinges, .. } = body;
    for hinge in hinges.iter_mut() {
        let shaft = &shafts[hinge.shaft];
        let Some((multibody, link)) = world.multibody_joints.get_mut(hinge.joint) else { continue };
        let place = multibody.link(link).map_or(0, |link| link.assembly_id());
        let mut displacements = vec![0.0; multibody.ndofs()];
        displacements[place] = hinge.sign * (shaft.position_rad - hinge.zero_rad);
        multibody.damping_mut().fill(0.0);
        multibody.apply_displacements(&displacements);
        hinge.known_rad = shaft.position_rad;
    }
    place_links(body);
}

fn place_links(body: &mut RigidBody) {
    let RigidBody { world, hinges, .. } = body;
    for hinge in hinges.iter() {
        if let Some((multibody, _)) = world.multibody_joints.get_mut(hinge.joint) {
            multibody.forward_kinematics(&world.bodies, true);
            multibody.update_rigid_bodies(&mut world.bodies, true);
        }
    }
}

/// Raises or lowers a body that reaches into the ground or hangs in the air, until its lowest point just
/// touches the plane.
fn stand_up(body: &mut RigidBody, up: Vector) {
    let lowest = body.world.colliders.iter().filter_map(|(_, collider)| {
        let parent = body.world.bodies.get(collider.parent()?)?;
        let pose = *parent.position() * *collider.position_wrt_parent()?;
        let shape = collider.shape().as_support_map()?;
        Some(shape.support_point(&pose, -up).dot(up))
    });
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    if lowest.is_finite() {
        let trunk = &mut body.world.bodies[body.trunk];
        let pose = *trunk.position();
        trunk.set_position(Pose::from_parts(pose.translation - up * lowest, pose.rotation), true);
        place_links(body);
    }
}
