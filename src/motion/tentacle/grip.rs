//! The grip of an arm on the pole it is wound round, controlled by the load that its servos report.
//!
//! The arm's targets lie a little inside the pole's surface, deeper until its joints bear the requested load.

use crate::signals::JointState;

/// Fastest change of the depth, m/s.
const RATE_M_S: f64 = 0.005;
/// Largest depth, as a share of the arm's radius: as far as its skin gives.
const DEEPEST_SHARE: f64 = 0.3;
/// Loads within this share of the request are accepted.
const RIGHT_SHARE: f64 = 0.1;

/// A grip.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grip {
    /// Requested mean load, a share of stall torque.
    load_share: f64,
    squeeze_m: f64,
}

impl Grip {
    pub(super) fn new(load_share: f64) -> Grip {
        Grip { load_share, squeeze_m: 0.0 }
    }

    /// Present depth, m.
    pub(super) fn squeeze_m(&self) -> f64 {
        self.squeeze_m
    }

    /// Moves out, for `dt_s`, towards the depth at which the arm only lies on the pole.
    pub(super) fn loosen(&mut self, dt_s: f64) {
        self.squeeze_m = (self.squeeze_m - RATE_M_S * dt_s).max(0.0);
    }

    pub(super) fn is_loose(&self) -> bool {
        self.squeeze_m <= 0.0
    }

    /// Resets the grip of an arm that is not on its pole.
    pub(super) fn let_go(&mut self) {
        self.squeeze_m = 0.0;
    }

    /// Moves deeper or less deep, for `dt_s`, by the load of the hinges that lie on the pole, counting only
    /// those that were heard just now and are in service. If there are none, the depth stays.
    pub(super) fn step(&mut self, dt_s: f64, arm_radius_m: f64, hinges: &[JointState], is_out: &[bool]) {
        let heard =
            |(hinge, is_out): &(&JointState, &bool)| hinge.is_known && hinge.age_s <= 0.0 && !**is_out;
        let loads = hinges.iter().zip(is_out).filter(heard).map(|(hinge, _)| hinge.load_share.abs());
        let (sum, count) = loads.fold((0.0, 0.0), |(sum, count), load| (sum + load, count + 1.0));
        if count <= 0.0 {
            return;
        }
        let load = sum / count;
        if (load - self.load_share).abs() <= RIGHT_SHARE * self.load_share {
            return;
        }
        let step_m = if load < self.load_share { RATE_M_S * dt_s } else { -RATE_M_S * dt_s };
        self.squeeze_m = (self.squeeze_m + step_m).clamp(0.0, DEEPEST_SHARE * arm_radius_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(load_share: f64) -> JointState {
        JointState { is_known: true, load_share, ..JointState::default() }
    }

    /// Depth and load at which the grip comes to rest on a pole that presses back in proportion to the depth.
    fn gripped(stiffness_per_m: f64) -> (f64, f64) {
        let mut grip = Grip::new(0.15);
        let mut load_share = 0.0;
        for _ in 0..1000 {
            grip.step(0.01, 0.02, &[heard(load_share); 4], &[false; 4]);
            load_share = -stiffness_per_m * grip.squeeze_m();
        }
        (grip.squeeze_m(), load_share.abs())
    }

    #[test]
    fn a_grip_tightens_to_the_set_load_and_no_deeper_than_the_skin_gives() {
        let (_, load_share) = gripped(50.0);
        assert!((load_share - 0.15).abs() <= 0.1 * 0.15 + 50.0 * RATE_M_S * 0.01, "{load_share}");
        // On a pole that gives way it stops at the limit.
        assert!((gripped(1.0).0 - 0.006).abs() < 1e-12);
    }

    #[test]
    fn a_grip_yields_where_the_load_is_too_high() {
        let mut grip = Grip::new(0.15);
        grip.squeeze_m = 0.003;
        (0..200).for_each(|_| grip.step(0.01, 0.02, &[heard(0.4); 4], &[false; 4]));
        assert!(grip.squeeze_m() <= 0.0);
    }

    #[test]
    fn silent_and_failed_hinges_do_not_take_part_in_a_grip() {
        let late = JointState { age_s: 0.05, ..heard(0.0) };
        let hinges = [heard(0.15), late, heard(0.0), JointState::default()];
        let mut grip = Grip::new(0.15);
        (0..100).for_each(|_| grip.step(0.01, 0.02, &hinges, &[false, false, true, false]));
        assert!(grip.squeeze_m() <= 0.0, "the one that is heard bears what it should");
        (0..100).for_each(|_| grip.step(0.01, 0.02, &[late; 4], &[false; 4]));
        assert!(grip.squeeze_m() <= 0.0, "where none is heard it stays");
        (0..100).for_each(|_| grip.step(0.01, 0.02, &[heard(0.0); 4], &[false; 4]));
        assert!(grip.squeeze_m() > 0.0);
    }
}
