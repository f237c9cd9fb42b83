//! The whole robot as links and joints under gravity, on the ground.
//!
//! Uses joint coordinates after Featherstone (Rapier's multibody joints), so that no joint ever comes apart.
//! Motor torque is applied in full: the motor model already lets torque fall with speed, so the engine's own
//! damping is off, else it would count twice. The rotor's inertia is the joint's armature.

mod ball;
mod build;

use rapier3d_f64::prelude::*;

use super::{Body, BodyConfig, BodyError, BodyState, FootState, JointMechanics, Push, PushFrame, ShaftState};
use ball::BallJointStop;
use build::Part;

/// Gravity, m/s^2.
const GRAVITY: f64 = 9.81;
/// Friction that holds a stuck shaft, whatever the load, N m.
const STUCK_NM: f64 = 1e3;

/// Stiffness and damping with which hands keep a trunk level, N m/rad and N m s/rad for each kg of the robot,
/// and how they brake its motion over the ground, N s/m for each kg.
const HANDS: (f64, f64, f64) = (10.0, 0.3, 20.0);
/// Stiffness and damping with which they carry it from below, N/m and N s/m for each kg: it sinks in by 4 mm.
const CARRY: (f64, f64) = (2500.0, 70.0);
/// They let go once they carry less than this share of its weight.
const LET_GO_SHARE: f64 = 0.1;

/// Once the motors have kept all joints slower than this, rad/s, for this long, s, the robot is ready. The
/// time is longer than torque takes to come on, and than a controller waits for a joint that does not follow.
const STILL: (f64, f64) = (0.05, 2.5);
/// Speed at which a robot is then set down, m/s.
const SET_DOWN_M_S: f64 = 0.05;

/// A robot that hands carry.
#[derive(Debug, Clone, Copy)]
struct Carried {
    /// Lowest height, m.
    height_m: f64,
    /// How long all joints have been still, s.
    still_s: f64,
}

/// No robot gets that far or that fast, m, m/s and rad/s: a body that does is a fault of the simulation.
const FURTHEST_M: f64 = 1e8;
const FASTEST_M_S: f64 = 1e6;
const FASTEST_RAD_S: f64 = 1e6;

/// One hinge between two bodies.
#[derive(Debug)]
struct Hinge {
    joint: MultibodyJointHandle,
    parent: RigidBodyHandle,
    child: RigidBodyHandle,
    /// Rotation axis in the frame of the child; a turn about it leaves it unchanged.
    axis: Vector,
    stops_rad: (f64, f64),
    shaft: usize,
    /// Angle of the shaft at the hinge's angle 0, rad.
    zero_rad: f64,
    /// 1, or -1 if the shaft turns the other way.
    sign: f64,
    /// Shaft's angle and friction as the engine has them, rad and N m.
    known_rad: f64,
    friction_nm: f64,
    /// Motor torque in this step, N m, in the hinge's direction.
    torque_nm: f64,
}

/// The body of a robot.
pub struct RigidBody {
    world: PhysicsWorld,
    trunk: RigidBodyHandle,
    hinges: Vec<Hinge>,
    balls: Vec<BallJointStop>,
    joints: JointMechanics,
    /// Plane and steps.
    grounds: Vec<ColliderHandle>,
    /// Body of each foot and the position of its middle there, as in [`BodyState::feet`].
    soles: Vec<(RigidBodyHandle, Vector)>,
    /// Pushes in the motor steps since the last step of the body.
    pushes: Vec<Push>,
    /// Sum of the torques in these motor steps, one for each shaft, N m.
    torques: Vec<f64>,
    /// Number of these motor steps, and number of motor steps in one step of the body.
    waited: u32,
    motor_steps: u32,
    /// How many chains there are.
    chains: usize,
    /// The ground's normal.
    up: Vector,
    /// Total mass, kg.
    mass_kg: f64,
    is_held: bool,
    carried: Option<Carried>,
    state: BodyState,
}

impl std::fmt::Debug for RigidBody {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RigidBody").field("state", &self.state).finish_non_exhaustive()
    }
}

impl RigidBody {
    /// A body at rest with its `shafts` where they are: the trunk level with the ground, and as low as it can
    /// be.
    ///
    /// # Errors
    /// [`BodyError`] names the first number that is impossible.
    pub fn new(config: &BodyConfig, shafts: &[ShaftState]) -> Result<RigidBody, BodyError> {
        config.check()?;
        let mut body = build::build(config, shafts)?;
        body.observe(None);
        Ok(body)
    }

    /// Kinetic energy of bodies and rotors, and potential energy above height 0, J.
    pub fn energy_j(&self) -> f64 {
        let bodies = self.world.bodies.iter().map(|(_, body)| {
            let height = body.center_of_mass().z;
            body.kinetic_energy() + body.mass() * body.gravity_scale() * GRAVITY * height
        });
        let rotors = self.hinges.iter().filter_map(|hinge| {
            let (multibody, link) = self.world.multibody_joints.get(hinge.joint)?;
            let link = multibody.link(link)?;
            let speed = multibody.joint_velocity(link)[0];
            Some(0.5 * multibody.armature()[link.assembly_id()] * speed * speed)
        });
        bodies.sum::<f64>() + rotors.sum::<f64>()
    }

    /// Gives the trunk, and all that hangs on it, a velocity (world frame, m/s).
    pub fn set_trunk_velocity(&mut self, velocity_m_s: [f64; 3]) {
        let multibody = self.hinges.first().map(|hinge| hinge.joint);
        match multibody.and_then(|joint| self.world.multibody_joints.get_mut(joint)) {
            Some((multibody, _)) => {
                let mut velocities = multibody.generalized_velocity_mut();
                (0..3).for_each(|axis| velocities[axis] = velocity_m_s[axis]);
            }
            None => self.world.bodies[self.trunk].set_linvel(Vector::from_array(velocity_m_s), true),
        }
    }

    /// Moves joints to where hands have turned their shafts, and updates their friction.
    fn follow_shafts(&mut self, shafts: &[ShaftState]) {
        for hinge in &mut self.hinges {
            let shaft = &shafts[hinge.shaft];
            let friction = if shaft.is_stuck { STUCK_NM } else { shaft.friction_nm };
            let turned = hinge.sign * (shaft.position_rad - hinge.known_rad);
            let is_same = (friction - hinge.friction_nm).abs() <= 0.0;
            if is_same && turned.abs() <= 0.0 {
                continue;
            }
            let Some((multibody, link)) = self.world.multibody_joints.get_mut(hinge.joint) else { continue };
            let place = multibody.link(link).map_or(0, |link| link.assembly_id());
            multibody.frictions_mut()[place] = friction;
            hinge.friction_nm = friction;
            if turned.abs() > 0.0 {
                let mut displacements = vec![0.0; multibody.ndofs()];
                displacements[place] = turned;
                multibody.apply_displacements(&displacements);
                multibody.forward_kinematics(&self.world.bodies, false);
                multibody.update_rigid_bodies(&mut self.world.bodies, true);
            }
        }
    }

    /// Applies all forces to the bodies for the next `dt_s`: of torques and pushes, the mean of the last motor steps.
    fn drive(&mut self, dt_s: f64, shafts: &[ShaftState]) {
        let share = 1.0 / f64::from(self.motor_steps);
        let bodies = &mut self.world.bodies;
        bodies.iter_mut().for_each(|(_, body)| {
            body.reset_forces(true);
            body.reset_torques(true);
        });
        for hinge in &mut self.hinges {
            let shaft = &shafts[hinge.shaft];
            let angle = hinge.sign * (shaft.position_rad - hinge.zero_rad);
            let speed = hinge.sign * shaft.speed_rad_s;
            let (low, high) = hinge.stops_rad;
            let beyond = (angle - high).max(0.0) + (angle - low).min(0.0);
            let mut torque = hinge.sign * (share * self.torques[hinge.shaft] + shaft.load_nm);
            hinge.torque_nm = torque;
            torque -= self.joints.viscosity_nm_s * speed;
            if beyond.abs() > 0.0 {
                // The stop pushes back but never pulls.
                let (stiffness, damping) = stable(self.joints.stop, shaft.inertia_kg_m2, dt_s);
                let stop = -stiffness * beyond - damping * speed;
                torque += if beyond > 0.0 { stop.min(0.0) } else { stop.max(0.0) };
            }
            turn(bodies, hinge, torque);
        }
        for ball in &self.balls {
            let (mut angles, mut speeds) = ([0.0; 3], [0.0; 3]);
            let inertias = ball.hinges.iter().map(|hinge| shafts[self.hinges[*hinge].shaft].inertia_kg_m2);
            let stop = stable(self.joints.stop, inertias.fold(f64::INFINITY, f64::min), dt_s);
            for (place, hinge) in ball.hinges.iter().map(|hinge| &self.hinges[*hinge]).enumerate() {
                let shaft = &shafts[hinge.shaft];
                angles[place] = hinge.sign * (shaft.position_rad - hinge.zero_rad);
                speeds[place] = hinge.sign * shaft.speed_rad_s;
            }
            let torques = ball.torques(angles, speeds, stop);
            for (hinge, torque) in ball.hinges.iter().zip(torques) {
                turn(bodies, &self.hinges[*hinge], torque);
            }
        }
        let trunk = &mut bodies[self.trunk];
        for push in self.pushes.drain(..) {
            let force = share * Vector::from_array(push.force_n);
            let force = if push.frame == PushFrame::Trunk { trunk.rotation() * force } else { force };
            let place = trunk.position() * Vector::from_array(push.place_m);
            trunk.add_force_at_point(force, place, true);
        }
        let is_still = self.torques.iter().any(|torque| torque.abs() > 0.0)
            && shafts.iter().all(|shaft| shaft.speed_rad_s.abs() < STILL.0);
        self.torques.fill(0.0);
        self.carry(dt_s, is_still);
        if self.is_held {
            let trunk = &mut self.world.bodies[self.trunk];
            let (_, _, brake) = HANDS;
            let ratio = trunk.mass() / self.mass_kg;
            let brake = stable((0.0, brake), ratio, dt_s).1;
            let least = trunk.mass_properties().local_mprops.principal_inertia().min_element();
            let (stiffness, damping) = stable((HANDS.0, HANDS.1), least / self.mass_kg, dt_s);
            let tilt = (trunk.rotation() * Vector::Z).cross(self.up);
            let way = trunk.linvel() - self.up * trunk.linvel().dot(self.up);
            trunk.add_torque(self.mass_kg * (stiffness * tilt - damping * trunk.angvel()), true);
            trunk.add_force(-brake * self.mass_kg * way, true);
        }
    }

    /// Carries the trunk, sets it down, and lets go of it once the robot stands by itself.
    fn carry(&mut self, dt_s: f64, is_still: bool) {
        let Some(carried) = &mut self.carried else { return };
        let is_ready = carried.still_s >= STILL.1;
        if is_ready {
            carried.height_m -= SET_DOWN_M_S * dt_s;
        } else {
            carried.still_s = if is_still { carried.still_s + dt_s } else { 0.0 };
        }
        let trunk = &mut self.world.bodies[self.trunk];
        let (height_m, speed) = (trunk.translation().dot(self.up), trunk.linvel().dot(self.up));
        let (stiffness, damping) = stable(CARRY, trunk.mass() / self.mass_kg, dt_s);
        let lift = stiffness * (carried.height_m - height_m) - damping * speed;
        trunk.add_force(self.up * (self.mass_kg * lift.max(0.0)), true);
        if is_ready && lift < LET_GO_SHARE * GRAVITY {
            (self.carried, self.is_held) = (None, false);
        }
    }

    /// Reads the result of a step of `dt_s`; `None` before the first step.
    fn observe(&mut self, dt_s: Option<f64>) {
        let trunk = &self.world.bodies[self.trunk];
        let (position, rotation) = (trunk.translation(), *trunk.rotation());
        let velocity = trunk.velocity_at_point(position);
        self.state.is_finite = position.is_finite()
            && rotation.is_finite()
            && position.length() < FURTHEST_M
            && velocity.length() < FASTEST_M_S;
        if !self.state.is_finite {
            return;
        }
        let acceleration =
            dt_s.map_or(Vector::ZERO, |dt_s| (velocity - Vector::from_array(self.state.velocity_m_s)) / dt_s);
        let specific = rotation.inverse() * (acceleration + Vector::Z * GRAVITY);
        self.state.position_m = position.to_array();
        self.state.height_m = position.dot(self.up);
        self.state.rotation = rotation.to_array();
        self.state.velocity_m_s = velocity.to_array();
        self.state.rate_rad_s = (rotation.inverse() * trunk.angvel()).to_array();
        self.state.specific_force_m_s2 = specific.to_array();
        self.observe_contacts(dt_s);
    }

    fn observe_contacts(&mut self, dt_s: Option<f64>) {
        let state = &mut self.state;
        for (foot, (body, middle)) in state.feet.iter_mut().zip(&self.soles) {
            foot.position_m = (self.world.bodies[*body].position() * *middle).to_array();
            foot.force_n = 0.0;
        }
        (state.trunk_contact_n, state.links_contact_n) = (0.0, 0.0);
        state.is_held = self.is_held;
        state.chain_impulses_ns.resize(self.chains, 0.0);
        state.joint_impulses_nms.resize(self.hinges.len(), 0.0);
        let Some(dt_s) = dt_s else { return };
        for ground in &self.grounds {
            for pair in self.world.contact_pairs_with(*ground) {
                let other = if pair.collider1 == *ground { pair.collider2 } else { pair.collider1 };
                let Some(collider) = self.world.colliders.get(other) else { continue };
                let force_n = pair.total_impulse_magnitude() / dt_s;
                match Part::of(collider) {
                    Part::Trunk => {
                        state.trunk_contact_n += force_n;
                        state.trunk_impulse_ns += force_n * dt_s;
                    }
                    Part::Link(chain) => {
                        state.links_contact_n += force_n;
                        state.chain_impulses_ns[chain] += force_n * dt_s;
                    }
                    Part::Foot(place) => state.feet[place].force_n += force_n,
                }
            }
        }
    }
}

impl Body for RigidBody {
    fn step(&mut self, dt_s: f64, shafts: &mut [ShaftState], torques: &[f64]) {
        if !self.state.is_finite {
            return;
        }
        let forces = self.pushes.iter().flat_map(|push| push.force_n.iter().chain(&push.place_m));
        if !torques.iter().chain(forces).all(|number| number.is_finite()) {
            self.state.is_finite = false;
            return;
        }
        self.torques.iter_mut().zip(torques).for_each(|(sum, torque)| *sum += torque);
        self.waited += 1;
        if self.waited < self.motor_steps {
            return;
        }
        let dt_s = dt_s * f64::from(self.waited);
        self.waited = 0;
        self.follow_shafts(shafts);
        self.drive(dt_s, shafts);
        self.world.integration_parameters.dt = dt_s;
        self.world.step();
        for (hinge, impulse) in self.hinges.iter_mut().zip(&mut self.state.joint_impulses_nms) {
            let Some((multibody, link)) = self.world.multibody_joints.get(hinge.joint) else { continue };
            let Some(link) = multibody.link(link) else { continue };
            let (angle, speed) = (link.joint().coords()[3], multibody.joint_velocity(link)[0]);
            if !(angle.is_finite() && speed.abs() < FASTEST_RAD_S) {
                self.state.is_finite = false;
                return;
            }
            let shaft = &mut shafts[hinge.shaft];
            let gain = speed - hinge.sign * shaft.speed_rad_s;
            *impulse += hinge.torque_nm * dt_s - shaft.inertia_kg_m2 * gain;
            shaft.position_rad = hinge.zero_rad + hinge.sign * angle;
            shaft.speed_rad_s = hinge.sign * speed;
            shaft.motor_speed_rad_s = shaft.speed_rad_s;
            hinge.known_rad = shaft.position_rad;
        }
        self.observe(Some(dt_s));
    }

    fn push(&mut self, push: &Push) {
        self.pushes.push(*push);
    }

    fn hold_trunk(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    fn carry_trunk(&mut self, height_m: f64) {
        self.is_held = true;
        self.carried = Some(Carried { height_m, still_s: 0.0 });
    }

    fn state(&self) -> Option<&BodyState> {
        Some(&self.state)
    }
}

/// Stiffness and damping of a spring that moves at least `inertia` (kg m^2, or kg), reduced as far as a step of `dt_s` needs
/// to remain stable: as in an implicit step. A stiff stop on a tiny servo throws its joint back and forth otherwise.
fn stable((stiffness, damping): (f64, f64), inertia: f64, dt_s: f64) -> (f64, f64) {
    let share = 1.0 / (1.0 + dt_s * (damping + stiffness * dt_s) / inertia);
    (share * stiffness, share * damping)
}

/// Applies `torque` (N m, about the hinge's axis) between the links of a hinge.
fn turn(bodies: &mut RigidBodySet, hinge: &Hinge, torque: f64) {
    let in_world = bodies[hinge.child].rotation() * (hinge.axis * torque);
    bodies[hinge.child].add_torque(in_world, true);
    bodies[hinge.parent].add_torque(-in_world, true);
}

impl BodyState {
    /// State of a trunk before the first observation, with these feet.
    fn unseen(feet: Vec<FootState>) -> BodyState {
        BodyState {
            position_m: [0.0; 3],
            height_m: 0.0,
            rotation: [0.0, 0.0, 0.0, 1.0],
            velocity_m_s: [0.0; 3],
            rate_rad_s: [0.0; 3],
            specific_force_m_s2: [0.0, 0.0, GRAVITY],
            feet,
            trunk_contact_n: 0.0,
            links_contact_n: 0.0,
            trunk_impulse_ns: 0.0,
            chain_impulses_ns: Vec::new(),
            is_held: false,
            joint_impulses_nms: Vec::new(),
            is_finite: true,
        }
    }
}
