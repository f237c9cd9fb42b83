//! Idle swaying, never the same way twice.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::{Needs, Shown, StrokeKind};
use crate::motion::tentacle::arm_plan::ArmPlan;
use crate::motion::tentacle::key_stroke::KEY_NUMBERS;
use crate::motion::tentacle::pseudo_targets::Turn;
use crate::motion::tentacle::rhythm::{OfArm, Rhythm};
use crate::motion::tentacle::variation::Variation;
use crate::signals::{ArmAim, ArmTarget};

/// The stroke.
pub const KIND: StrokeKind = StrokeKind {
    name: "sway",
    meaning: "sways idly, never the same way twice",
    key: Some('1'),
    needs: Needs::Nothing,
    is_rhythmic: true,
    shown: Some(Shown { strokes: 2.0, hold_s: 0.0 }),
    make: |rig| Box::new(Rhythm::new("sway", rig, |arm, _| Sway::new(arm.variation.clone()))),
};

/// Lift in the middle of idle swaying, rad, for all joints together.
const SWAY_LIFT_RAD: f64 = 0.6;
/// Amplitude of lift and sweep about that, for all joints together, rad.
const SWAY_RAD: f64 = 0.9;
/// Phase by which the waves of a sway are ahead at the root of those at the tip, rad.
const SWAY_WAVE_RAD: f64 = 4.0;
/// A joint's bend at the root as a share of that at the tip.
const SWAY_ROOT_SHARE: f64 = 0.4;

/// Rates of a sway's lift and sweep, per stroke: the pattern never repeats.
const SWAY_RATES: [f64; 2] = [1.0, 0.618_033_988_749_895];

/// Idle swaying: waves of bend that run down the arm and never repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// Initial phase of lift and sweep, rad.
    begins: [f64; 2],
}

impl Sway {
    /// The swaying of an arm with these random numbers.
    pub fn new(variation: Variation) -> Sway {
        // The first numbers are those of walk and swim.
        let mut variation = variation.after(2 * KEY_NUMBERS);
        Sway { begins: [(); 2].map(|()| variation.uniform(0.0, TAU)) }
    }

    /// Writes the ends of links of these lengths (m) at `phase`, rad from the start on, arm frame, m.
    pub fn write(&self, phase: f64, links_m: impl Iterator<Item = f64>, places: &mut [DVec3]) {
        let (mut place, mut rotation) = (DVec3::ZERO, DQuat::IDENTITY);
        let count = places.len() as f64;
        for (index, (link_m, end)) in links_m.zip(places).enumerate() {
            let along = index as f64 / count;
            let share = (SWAY_ROOT_SHARE + (1.0 - SWAY_ROOT_SHARE) * along) / count;
            let wave =
                |way: usize| (SWAY_RATES[way] * phase - SWAY_WAVE_RAD * along + self.begins[way]).sin();
            let turn = Turn {
                lift: share * (SWAY_LIFT_RAD + SWAY_RAD * wave(0)),
                sweep: share * SWAY_RAD * wave(1),
                twist: 0.0,
            };
            rotation *= turn.rotation();
            place += rotation * DVec3::X * link_m;
            *end = place;
        }
    }
}

impl OfArm for Sway {
    fn write(&self, arm: &ArmPlan, phase: f64, _turn_rad: f64, target: &mut ArmTarget) {
        target.aim = ArmAim::Places;
        Sway::write(self, phase, arm.links_m(), &mut target.places_in_body);
        target.places_in_body.iter_mut().for_each(|place| *place = arm.to_body(*place));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swaying_is_gentle_and_does_not_repeat() {
        let sway = Sway::new(Variation::new(1, 0, 0.0));
        let links_m = [0.034; 12];
        let mut places = [DVec3::ZERO; 12];
        let mut at = |phase: f64| {
            sway.write(phase, links_m.into_iter(), &mut places);
            places
        };
        let begin = at(0.0);
        for step in 1..2000 {
            let phase = 0.05 * f64::from(step);
            let (now, next) = (at(phase), at(phase + 0.05));
            let lengths = now.windows(2).map(|pair| pair[0].distance(pair[1]));
            assert!(lengths.into_iter().all(|length| (length - 0.034).abs() < 1e-12));
            // No joint bends by more than a tenth of a turn, and the tip moves by less than half the arm per
            // radian.
            assert!(
                now.windows(3).all(|three| (three[1] - three[0]).angle_between(three[2] - three[1]) < 0.3)
            );
            assert!(now[11].distance(next[11]) < 0.5 * 12.0 * 0.034 * 0.05);
            assert!(phase < 1.0 || now[11].distance(begin[11]) > 1e-5, "at {phase}");
        }
    }
}
