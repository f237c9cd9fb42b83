//! The space in which a chain moves: the plane that its hinges share, or all three dimensions. The rest of
//! the code is written once for both.
//!
//! A leg's hinges are parallel, so its poses are points and directions in a plane: half the arithmetic of
//! three dimensions, and no rotations to compose.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

use glam::{DMat3, DVec2, DVec3};

use crate::model::{Chain, Joint};

/// Hinges this parallel share a plane: sine of the angle between their axes.
const PARALLEL: f64 = 1e-9;

/// A chain's fixed geometry and the arithmetic of its poses.
pub(super) trait Geometry: Debug + Copy {
    /// A position or a lever, m.
    type Vector: Vector;
    /// A hinge's axis and the link after it, in the frame of the link before it.
    type Hinge: Debug + Copy;
    /// Orientation of a link.
    type Rotation: Copy;
    /// A hinge's axis in the present pose.
    type Axis: Debug + Copy + Default;

    /// The joints' hinges, root first.
    fn hinges(&self, joints: &[Joint]) -> Vec<Self::Hinge>;

    /// The nearest point to `in_body` in the space where the chain moves, and its distance, m.
    fn project(&self, in_body: DVec3) -> (Self::Vector, f64);

    /// Position of the first hinge, and orientation of its base.
    fn root(&self) -> (Self::Vector, Self::Rotation);

    /// A hinge's axis if the link before it has this orientation.
    fn axis(rotation: Self::Rotation, hinge: Self::Hinge) -> Self::Axis;

    /// Orientation of a link turned about `axis` by the angle with this sine and cosine, from its orientation
    /// at angle zero.
    fn turned(rotation: Self::Rotation, axis: Self::Axis, sine: f64, cosine: f64) -> Self::Rotation;

    /// The link after a hinge at this orientation.
    fn link(rotation: Self::Rotation, hinge: Self::Hinge) -> Self::Vector;

    /// Derivative of a lever's end as the lever turns about `axis`, per rad.
    fn motion(axis: Self::Axis, lever: Self::Vector) -> Self::Vector;

    /// Sine and cosine of the angle from one lever to another as seen along `axis`, times both lengths.
    fn angle_between(axis: Self::Axis, from: Self::Vector, to: Self::Vector) -> (f64, f64);

    /// A lever turned about `axis` by the angle with this sine and cosine.
    fn turn_lever(axis: Self::Axis, lever: Self::Vector, sine: f64, cosine: f64) -> Self::Vector;
}

/// Two or three coordinates, m.
pub(super) trait Vector:
    Debug + Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
    /// A symmetric matrix: a sum of outer products.
    type Normal: Copy + Default;

    fn dot(self, other: Self) -> f64;

    /// `normal` + `weight` `self` `self`^T.
    fn add_to(self, normal: &mut Self::Normal, weight: f64);

    /// The x of (`normal` + `damping` trace(`normal`) I) x = `self`; not finite if there is none.
    fn solved_by(self, normal: &Self::Normal, damping: f64) -> Self;
}

/// The plane of parallel hinges: coordinates along two directions across them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    across: [DVec3; 2],
    normal: DVec3,
    root_m: DVec2,
    /// Position of the tip along the normal, m: the same in every pose.
    height_m: f64,
    root_rotation: glam::DQuat,
}

impl Plane {
    /// The plane of `chain`, if its hinges are parallel.
    pub(super) fn of(chain: &Chain, joints: &[Joint]) -> Option<Plane> {
        let normal = chain.root_rotation * joints.first()?.axis;
        let is_parallel = |joint: &Joint| {
            (chain.root_rotation * joint.axis).cross(normal).length() <= PARALLEL * normal.length()
        };
        if !joints.iter().all(is_parallel) {
            return None;
        }
        let (u, v) = normal.any_orthonormal_pair();
        let height_m =
            joints.iter().map(|joint| chain.root_rotation * joint.link_m).sum::<DVec3>() + chain.root_m;
        Some(Plane {
            across: [u, v],
            normal,
            root_m: DVec2::new(chain.root_m.dot(u), chain.root_m.dot(v)),
            height_m: height_m.dot(normal),
            root_rotation: chain.root_rotation,
        })
    }

    fn coordinates(&self, vector: DVec3) -> DVec2 {
        DVec2::new(vector.dot(self.across[0]), vector.dot(self.across[1]))
    }
}

impl Geometry for Plane {
    type Vector = DVec2;
    /// The link at angle zero of all joints, and 1 or -1: along or against the normal.
    type Hinge = (DVec2, f64);
    /// Cosine and sine.
    type Rotation = DVec2;
    type Axis = f64;

    fn hinges(&self, joints: &[Joint]) -> Vec<Self::Hinge> {
        let sense = |joint: &Joint| (self.root_rotation * joint.axis).dot(self.normal).signum();
        joints
            .iter()
            .map(|joint| (self.coordinates(self.root_rotation * joint.link_m), sense(joint)))
            .collect()
    }

    fn project(&self, in_body: DVec3) -> (DVec2, f64) {
        (self.coordinates(in_body), in_body.dot(self.normal) - self.height_m)
    }

    fn root(&self) -> (DVec2, DVec2) {
        (self.root_m, DVec2::X)
    }

    #[inline]
    fn axis(_: DVec2, (_, sense): Self::Hinge) -> f64 {
        sense
    }

    #[inline]
    fn turned(rotation: DVec2, sense: f64, sine: f64, cosine: f64) -> DVec2 {
        DVec2::new(cosine, sense * sine).rotate(rotation)
    }

    #[inline]
    fn link(rotation: DVec2, (link, _): Self::Hinge) -> DVec2 {
        rotation.rotate(link)
    }

    #[inline]
    fn motion(sense: f64, lever: DVec2) -> DVec2 {
        lever.perp() * sense
    }

    #[inline]
    fn angle_between(sense: f64, from: DVec2, to: DVec2) -> (f64, f64) {
        (sense * from.perp_dot(to), from.dot(to))
    }

    #[inline]
    fn turn_lever(sense: f64, lever: DVec2, sine: f64, cosine: f64) -> DVec2 {
        DVec2::new(cosine, sense * sine).rotate(lever)
    }
}

impl Vector for DVec2 {
    /// xx, xy, yy.
    type Normal = [f64; 3];

    #[inline]
    fn dot(self, other: DVec2) -> f64 {
        self.dot(other)
    }

    #[inline]
    fn add_to(self, [xx, xy, yy]: &mut [f64; 3], weight: f64) {
        *xx += weight * self.x * self.x;
        *xy += weight * self.x * self.y;
        *yy += weight * self.y * self.y;
    }

    #[inline]
    fn solved_by(self, &[xx, xy, yy]: &[f64; 3], damping: f64) -> DVec2 {
        let damping = damping * (xx + yy) + f64::MIN_POSITIVE;
        let (xx, yy) = (xx + damping, yy + damping);
        let scale = 1.0 / (xx * yy - xy * xy);
        DVec2::new(yy * self.x - xy * self.y, xx * self.y - xy * self.x) * scale
    }
}

/// Three dimensions: the body frame's own coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Space {
    root_m: DVec3,
    root_rotation: DMat3,
}

impl Space {
    pub(super) fn of(chain: &Chain) -> Space {
        Space { root_m: chain.root_m, root_rotation: DMat3::from_quat(chain.root_rotation) }
    }
}

impl Geometry for Space {
    type Vector = DVec3;
    /// Axis and link.
    type Hinge = (DVec3, DVec3);
    type Rotation = DMat3;
    type Axis = DVec3;

    fn hinges(&self, joints: &[Joint]) -> Vec<Self::Hinge> {
        joints.iter().map(|joint| (joint.axis, joint.link_m)).collect()
    }

    fn project(&self, in_body: DVec3) -> (DVec3, f64) {
        (in_body, 0.0)
    }

    fn root(&self) -> (DVec3, DMat3) {
        (self.root_m, self.root_rotation)
    }

    #[inline]
    fn axis(rotation: DMat3, (axis, _): Self::Hinge) -> DVec3 {
        rotation * axis
    }

    #[inline]
    fn turned(rotation: DMat3, axis: DVec3, sine: f64, cosine: f64) -> DMat3 {
        let turn = |column| Space::turn_lever(axis, column, sine, cosine);
        DMat3::from_cols(turn(rotation.x_axis), turn(rotation.y_axis), turn(rotation.z_axis))
    }

    #[inline]
    fn link(rotation: DMat3, (_, link): Self::Hinge) -> DVec3 {
        rotation * link
    }

    #[inline]
    fn motion(axis: DVec3, lever: DVec3) -> DVec3 {
        axis.cross(lever)
    }

    #[inline]
    fn angle_between(axis: DVec3, from: DVec3, to: DVec3) -> (f64, f64) {
        (axis.dot(from.cross(to)), from.dot(to) - axis.dot(from) * axis.dot(to))
    }

    /// Rodrigues' formula.
    #[inline]
    fn turn_lever(axis: DVec3, lever: DVec3, sine: f64, cosine: f64) -> DVec3 {
        lever * cosine + axis.cross(lever) * sine + axis * (axis.dot(lever) * (1.0 - cosine))
    }
}

impl Vector for DVec3 {
    /// xx, xy, xz, yy, yz, zz.
    type Normal = [f64; 6];

    #[inline]
    fn dot(self, other: DVec3) -> f64 {
        self.dot(other)
    }

    #[inline]
    fn add_to(self, [xx, xy, xz, yy, yz, zz]: &mut [f64; 6], weight: f64) {
        let weighted = self * weight;
        *xx += weighted.x * self.x;
        *xy += weighted.x * self.y;
        *xz += weighted.x * self.z;
        *yy += weighted.y * self.y;
        *yz += weighted.y * self.z;
        *zz += weighted.z * self.z;
    }

    #[inline]
    fn solved_by(self, &[xx, xy, xz, yy, yz, zz]: &[f64; 6], damping: f64) -> DVec3 {
        let damping = damping * (xx + yy + zz) + f64::MIN_POSITIVE;
        let x = DVec3::new(xx + damping, xy, xz);
        let y = DVec3::new(xy, yy + damping, yz);
        let z = DVec3::new(xz, yz, zz + damping);
        let across = y.cross(z);
        let scale = 1.0 / x.dot(across);
        DVec3::new(self.dot(across), self.dot(z.cross(x)), self.dot(x.cross(y))) * scale
    }
}
