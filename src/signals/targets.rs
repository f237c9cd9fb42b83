//! The targets that the generator computes, and inverse kinematics follows.

use educe::Educe;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::model::{Chain, GROUPS, Joint, Robot, TendonDrive};

/// The kind of targets, as recordings name it; [`Wanted`] holds what belongs to each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aim {
    /// No torque.
    Limp,
    /// Joint angles.
    Pose,
    /// Positions of the chains' tips.
    Tips,
    /// Positions and orientations of soles; joint angles for all other chains.
    Soles,
    /// A target for each arm.
    Arms,
    /// The angle of this joint alone; all other joints have no torque.
    Joint(usize),
}

/// The wishes of the generator for the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted<'a> {
    /// No torque.
    Limp,
    /// Joint angles, rad.
    Pose(&'a [f64]),
    /// The angle of one joint alone; all other joints have no torque.
    Joint {
        /// The joint, index into [`Robot::joints`].
        joint: usize,
        /// Joint angles, rad; only that of `joint` matters.
        pose_rad: &'a [f64],
    },
    /// Positions of the chains' tips.
    Tips {
        /// Position of each chain's tip, body frame, m.
        tips_in_body: &'a [DVec3],
        /// Planned state of each leg's foot; empty while the plan has no feet on the ground.
        feet: &'a [FootTarget],
    },
    /// Positions and orientations of the soles of `feet`; joint angles for all other chains.
    Soles {
        /// Position of each chain's tip, body frame, m.
        tips_in_body: &'a [DVec3],
        /// Rotation of each chain's last link from its orientation at zero joint angles, body frame.
        sole_orientations: &'a [DQuat],
        /// Planned state of each foot.
        feet: &'a [FootTarget],
        /// Joint angles of the chains without a foot, rad.
        pose_rad: &'a [f64],
    },
    /// A target for each chain that is an arm.
    Arms(&'a [ArmTarget]),
}

/// The targets of one cycle. Its buffers get their sizes once; a setter, such as [`Targets::set_pose`], chooses what
/// is wanted and returns the buffers that belong to it.
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct Targets {
    aim: Aim,
    pose_rad: Vec<f64>,
    tips_in_body: Vec<DVec3>,
    sole_orientations: Vec<DQuat>,
    feet: Vec<FootTarget>,
    arms: Vec<ArmTarget>,
    /// Requested share of the permitted torque, 0 to 1.
    pub torque_share: f64,
    /// Planned position of the trunk, world frame, m.
    pub trunk_in_world: DVec3,
    /// Planned rotation of the trunk, from the body frame to the world frame.
    pub trunk_orientation: DQuat,
    /// Share of the way to their neutral posture that the redundant joints move in one cycle.
    pub posture_pull: f64,
    /// True while a servo that has tripped may be restarted; its joint may then hang freely.
    pub may_restart: bool,
}

/// The buffers of targets on feet, to write into.
#[derive(Debug)]
pub struct FeetMut<'a> {
    /// Position of each chain's tip, body frame, m.
    pub tips_in_body: &'a mut [DVec3],
    /// Rotation of each chain's last link from its orientation at zero joint angles, body frame.
    pub sole_orientations: &'a mut [DQuat],
    /// Planned state of each leg's foot.
    pub feet: &'a mut Vec<FootTarget>,
    /// Joint angles, rad.
    pub pose_rad: &'a mut [f64],
}

impl Targets {
    /// Targets of a limp `robot`.
    pub fn new(robot: &Robot) -> Targets {
        Targets {
            aim: Aim::Limp,
            pose_rad: vec![0.0; robot.joints.len()],
            torque_share: 1.0,
            tips_in_body: vec![DVec3::ZERO; robot.chains.len()],
            sole_orientations: vec![DQuat::IDENTITY; robot.chains.len()],
            trunk_in_world: DVec3::ZERO,
            trunk_orientation: DQuat::IDENTITY,
            feet: Vec::with_capacity(robot.chains.len()),
            posture_pull: 0.0,
            may_restart: false,
            arms: robot.chains.iter().map(|chain| ArmTarget::new(chain, robot.joints_of(chain))).collect(),
        }
    }

    /// The kind of targets.
    pub fn aim(&self) -> Aim {
        self.aim
    }

    /// The targets that the generator has set, as one variant with its data.
    pub fn wanted(&self) -> Wanted<'_> {
        match self.aim {
            Aim::Limp => Wanted::Limp,
            Aim::Pose => Wanted::Pose(&self.pose_rad),
            Aim::Joint(joint) => Wanted::Joint { joint, pose_rad: &self.pose_rad },
            Aim::Tips => Wanted::Tips { tips_in_body: &self.tips_in_body, feet: &self.feet },
            Aim::Soles => Wanted::Soles {
                tips_in_body: &self.tips_in_body,
                sole_orientations: &self.sole_orientations,
                feet: &self.feet,
                pose_rad: &self.pose_rad,
            },
            Aim::Arms => Wanted::Arms(&self.arms),
        }
    }

    /// Planned state of each foot on which the robot stands or walks; empty while it does neither.
    pub fn feet(&self) -> &[FootTarget] {
        &self.feet
    }

    /// Position wanted of the tip of this chain, body frame, m; `None` if its tip has no target.
    pub fn tip_in_body(&self, chain: usize) -> Option<DVec3> {
        let has_target = match self.aim {
            Aim::Tips | Aim::Arms => true,
            Aim::Soles => self.feet.iter().any(|foot| foot.chain == chain),
            Aim::Limp | Aim::Pose | Aim::Joint(_) => false,
        };
        self.tips_in_body.get(chain).copied().filter(|_| has_target)
    }

    /// From now on the robot has no torque.
    pub fn set_limp(&mut self) {
        self.set(Aim::Limp);
    }

    /// From now on a pose is wanted: its joint angles, rad, to write.
    pub fn set_pose(&mut self) -> &mut [f64] {
        self.set(Aim::Pose);
        &mut self.pose_rad
    }

    /// From now on only this joint has torque: the joint angles, rad, to write.
    pub fn set_joint(&mut self, joint: usize) -> &mut [f64] {
        self.set(Aim::Joint(joint));
        &mut self.pose_rad
    }

    /// From now on positions of tips are wanted, of no feet yet.
    pub fn set_tips(&mut self) -> FeetMut<'_> {
        self.set(Aim::Tips);
        self.feet_mut()
    }

    /// From now on positions and orientations of soles are wanted, of no feet yet.
    pub fn set_soles(&mut self) -> FeetMut<'_> {
        self.set(Aim::Soles);
        self.feet_mut()
    }

    /// From now on every arm has a target: the targets, and the places of the tips for display.
    pub fn set_arms(&mut self) -> (&mut [ArmTarget], &mut [DVec3]) {
        self.set(Aim::Arms);
        (&mut self.arms, &mut self.tips_in_body)
    }

    /// The feet and the tips' positions, body frame, m, for corrections; `None` while the plan has no feet on the
    /// ground by their tips.
    pub fn walking_tips_mut(&mut self) -> Option<(&[FootTarget], &mut [DVec3])> {
        let is_walking = self.aim == Aim::Tips && !self.feet.is_empty();
        is_walking.then_some((&self.feet[..], &mut self.tips_in_body[..]))
    }

    /// The part of the targets that a recording holds, to restore them from one.
    pub fn recorded_mut(&mut self) -> (&mut Aim, FeetMut<'_>) {
        let Targets { aim, tips_in_body, sole_orientations, feet, pose_rad, .. } = self;
        (aim, FeetMut { tips_in_body, sole_orientations, feet, pose_rad })
    }

    fn set(&mut self, aim: Aim) {
        self.aim = aim;
        self.feet.clear();
    }

    fn feet_mut(&mut self) -> FeetMut<'_> {
        self.recorded_mut().1
    }
}

/// Target positions along one arm.
#[derive(Debug, PartialEq, Educe)]
#[educe(Clone)]
pub struct ArmTarget {
    /// Selects the fields below that apply.
    pub aim: ArmAim,
    /// Ends of the arm's groups, body frame, m; the last is the tip.
    pub ends_in_body: [DVec3; GROUPS],
    /// Direction in which the tip should point, body frame, unit length.
    pub direction_in_body: DVec3,
    /// Ends of all links, root first, body frame, m.
    pub places_in_body: Vec<DVec3>,
    /// A line that the arm's suckers should face if its joints can twist: a point on it (m) and its
    /// direction, body frame. The suckers are on the lower side, -z of each link.
    pub faced_in_body: Option<[DVec3; 2]>,
    /// Counts changes of the arm's action. When the count differs from the last cycle's, the joints blend
    /// over to the new targets from their present angles and speeds; the new motion must begin at rest.
    pub change: u32,
}

/// Selects the positions on an arm that have a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ArmAim {
    /// The ends of its groups.
    #[default]
    Ends,
    /// Its tip only.
    Tip,
    /// Its tip and the tip's direction.
    TipAlong,
    /// The ends of all links.
    Places,
}

/// A foot's plan at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootTarget {
    /// The foot's chain, an index into [`Robot::chains`].
    pub chain: usize,
    /// Planned position, world frame, m.
    pub in_world: DVec3,
    /// Forward distance from the neutral foot point, body frame, m.
    pub excursion_m: f64,
    /// Distance that the plane of the leg's motion has moved since the walk began, positive forward, m: a
    /// foot in stance falls behind the trunk by this much.
    pub plane_distance_m: f64,
    /// True in swing.
    pub is_swing: bool,
    /// Fraction of its share of the weight that the foot should carry: 0 in swing, 1 in stance; it changes
    /// smoothly before lift-off and after landing.
    pub load_share: f64,
    /// Largest acceleration of this stride's swing curve, m/s^2; 0 in stance.
    pub swing_acceleration_m_s2: f64,
}

impl ArmTarget {
    /// A target at the body frame's origin for `chain`, which has these `joints`.
    pub fn new(chain: &Chain, joints: &[Joint]) -> ArmTarget {
        let hinged = || joints.iter().filter(|joint| joint.link_m.length() > 0.0).count();
        let links = chain.tendons.as_ref().map_or_else(hinged, TendonDrive::links);
        ArmTarget {
            aim: ArmAim::Ends,
            ends_in_body: [DVec3::ZERO; GROUPS],
            direction_in_body: DVec3::X,
            places_in_body: vec![DVec3::ZERO; links],
            faced_in_body: None,
            change: 0,
        }
    }
}
