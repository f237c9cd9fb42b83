//! The gait as data: periods, stride lengths, lift-off order (Takizawa 2005, 2.2, 3.1, 3.3, chapter 4).

use std::f64::consts::TAU;

use super::{Gait, VerticalOscillation};

/// The least share of a period that counts as flight.
const FLIGHT_SHARE: f64 = 0.02;
/// Phases nearer than this are the same.
const ROUNDING: f64 = 1e-9;

impl Gait {
    /// The built-in gaits of a horse: the table of Takizawa 2005, 2.2, with the phase offsets of 3.3, and our own in
    /// addition.
    ///
    /// `walk-steady` has a longer stance, which keeps a robot inside the triangle of its standing feet. The thesis'
    /// canter and gallop begin with the left hind foot and lead with the right feet; `-left` is the mirror image.
    /// The rotary gallop, LH RH RF LF, is only named in 2.2.4 and no two phase offsets give it: here it is the gallop with
    /// its fore feet exchanged, so that beats and flight stay the same; its fore feet lead on the other side.
    ///
    /// Walk, trot, canter and gallop are chosen by speed: trot above the Froude number 0.35 (horse-like
    /// walkers change near it), canter above 2.5 (Alexander and Jayes 1983: trot to gallop at 2 to 3), gallop
    /// above 9 (the fastest canter of the thesis' table, 40 km/h, at 1.4 m).
    pub fn built_in() -> Vec<Gait> {
        let of_thesis = |name: &str, duty_factor, fore_hind_phase_offset, left_right_phase_offset| Gait {
            name: name.to_owned(),
            duty_factor,
            phase_offsets: Gait::phase_offsets_of_thesis(fore_hind_phase_offset, left_right_phase_offset),
            vertical_oscillation: VerticalOscillation::NONE,
            auto_froude_max: match name {
                "walk" => Some(0.35),
                "trot" => Some(2.5),
                "canter" => Some(9.0),
                "gallop" => Some(f64::INFINITY),
                _ => None,
            },
        };
        let canter = of_thesis("canter", 0.30, 0.20, 0.20);
        let gallop = of_thesis("gallop", 0.25, 0.35, 0.20);
        let [lh, lf, rh, rf] = gallop.phase_offsets;
        let rotary = Gait {
            name: "rotary-gallop".to_owned(),
            phase_offsets: [lh, rf, rh, lf],
            auto_froude_max: None,
            ..gallop.clone()
        };
        vec![
            of_thesis("walk", 0.70, 0.20, 0.50),
            of_thesis("walk-steady", 0.75, 0.25, 0.50),
            of_thesis("trot", 0.50, 0.50, 0.50),
            canter.clone(),
            canter.mirrored("canter-left"),
            gallop.clone(),
            gallop.mirrored("gallop-left"),
            rotary.clone(),
            rotary.mirrored("rotary-gallop-left"),
        ]
    }

    /// The mirror image, left for right, with phases counted from its own left hind's lift-off.
    fn mirrored(&self, name: &str) -> Gait {
        let [lh, lf, rh, rf] = self.phase_offsets;
        let phase_offsets = [rh, rf, lh, lf].map(|phase_offset| share_of_period(phase_offset - rh));
        Gait { name: name.to_owned(), phase_offsets, auto_froude_max: None, ..self.clone() }
    }

    /// Lift-off of each leg as shares of the period, from the thesis' two phase offsets: D1 of the fore foot after the hind
    /// foot of its side, D2 of the right feet after the left ones. LH 0, LF D1, RH D2, RF D1 + D2, modulo 1.
    pub fn phase_offsets_of_thesis(fore_hind_phase_offset: f64, left_right_phase_offset: f64) -> [f64; 4] {
        [
            0.0,
            fore_hind_phase_offset,
            left_right_phase_offset,
            share_of_period(fore_hind_phase_offset + left_right_phase_offset),
        ]
    }

    /// Period T = P / (1 - alpha), s, for the swing time P (thesis 3.2).
    pub fn period_s(&self, swing_time_s: f64) -> f64 {
        swing_time_s / (1.0 - self.duty_factor)
    }

    /// Duration of a foot's stance in one stride, alpha T, s.
    pub fn stance_s(&self, swing_time_s: f64) -> f64 {
        self.duty_factor * self.period_s(swing_time_s)
    }

    /// Stride length S = V P / (1 - alpha), m (thesis 3.3).
    pub fn stride_m(&self, speed_m_s: f64, swing_time_s: f64) -> f64 {
        speed_m_s * self.period_s(swing_time_s)
    }

    /// Share of a period in which no foot is on the ground.
    pub fn flight_share(&self) -> f64 {
        let swing = 1.0 - self.duty_factor;
        let lands = self.phase_offsets.map(|lift_off| share_of_period(lift_off + swing));
        // A flight ends where a foot lands: it has lasted since the last lift-off, if every foot was in swing until then.
        let flight_before = |landing: f64| {
            let since_lift_off = self.phase_offsets.map(|lift_off| share_of_period(landing - lift_off));
            let is_flight = since_lift_off.iter().all(|since| *since <= swing + ROUNDING);
            if is_flight { since_lift_off.into_iter().fold(swing, f64::min) } else { 0.0 }
        };
        let is_first = |leg: usize| lands[..leg].iter().all(|other| (other - lands[leg]).abs() > ROUNDING);
        (0..lands.len()).filter(|leg| is_first(*leg)).map(|leg| flight_before(lands[leg])).sum()
    }

    /// True if it has a moment of flight, in which no foot is on the ground.
    pub fn has_flight(&self) -> bool {
        self.flight_share() > FLIGHT_SHARE
    }

    /// True if `leg` is in swing at the clock's `phase` (periods since the left hind's lift-off).
    pub fn is_swing(&self, leg: usize, phase: f64) -> bool {
        (phase - self.phase_offsets[leg]).rem_euclid(1.0) < 1.0 - self.duty_factor
    }
}

impl VerticalOscillation {
    /// No vertical oscillation: the trunk stays at its height.
    pub const NONE: VerticalOscillation = VerticalOscillation { rise_m: 0.0, per_stride: 0, highest_at: 0.0 };

    /// Height above the mean at the clock's `phase`, m.
    pub fn height_m(&self, phase: f64) -> f64 {
        0.5 * self.rise_m * (TAU * f64::from(self.per_stride) * (phase - self.highest_at)).cos()
    }
}

/// A time in periods, modulo 1; a whole period, within rounding, counts as the start of the next.
fn share_of_period(periods: f64) -> f64 {
    let share = periods.rem_euclid(1.0);
    if 1.0 - share < 1e-9 { 0.0 } else { share }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LH: usize = 0;
    const LF: usize = 1;
    const RH: usize = 2;
    const RF: usize = 3;

    fn built_in(name: &str) -> Gait {
        Gait::built_in().into_iter().find(|gait| gait.name == name).unwrap()
    }

    /// Instants of a period, between those at which feet lift or land.
    fn phases() -> impl Iterator<Item = f64> {
        (0..1000).map(|step| (f64::from(step) + 0.5) / 1000.0)
    }

    #[test]
    fn period_and_stride_match_the_check_values_of_the_thesis() {
        // V 15 m/s, P 0.3 s, alpha 0.25 give T 0.4 s, S 6 m; the foot's mean swing speed is S / P = 20 m/s.
        let gallop = built_in("gallop");
        assert!((gallop.period_s(0.3) - 0.4).abs() < 1e-12);
        assert!((gallop.stride_m(15.0, 0.3) - 6.0).abs() < 1e-12);
    }

    /// Beats of a gait from the lift-off of `first` on: groups of legs that lift together, in order.
    fn beats(gait: &Gait, first: usize) -> Vec<Vec<usize>> {
        let since_first = |leg: usize| share_of_period(gait.phase_offsets[leg] - gait.phase_offsets[first]);
        let mut order: Vec<usize> = (0..4).collect();
        order.sort_by(|&a, &b| since_first(a).total_cmp(&since_first(b)));
        let mut beats: Vec<Vec<usize>> = Vec::new();
        for leg in order {
            match beats.last_mut() {
                Some(beat) if (since_first(beat[0]) - since_first(leg)).abs() < 1e-9 => beat.push(leg),
                _ => beats.push(vec![leg]),
            }
        }
        beats.iter_mut().for_each(|beat| beat.sort_unstable());
        beats
    }

    #[test]
    fn footfalls_come_in_the_order_and_beats_of_horses() {
        let expected: [(&str, usize, &[&[usize]]); 9] = [
            ("walk", LH, &[&[LH], &[LF], &[RH], &[RF]]),
            ("walk-steady", LH, &[&[LH], &[LF], &[RH], &[RF]]),
            ("trot", LH, &[&[LH, RF], &[LF, RH]]),
            ("canter", LH, &[&[LH], &[LF, RH], &[RF]]),
            ("canter-left", RH, &[&[RH], &[LH, RF], &[LF]]),
            ("gallop", LH, &[&[LH], &[RH], &[LF], &[RF]]),
            ("gallop-left", RH, &[&[RH], &[LH], &[RF], &[LF]]),
            ("rotary-gallop", LH, &[&[LH], &[RH], &[RF], &[LF]]),
            ("rotary-gallop-left", RH, &[&[RH], &[LH], &[LF], &[RF]]),
        ];
        let names: Vec<String> = Gait::built_in().into_iter().map(|gait| gait.name).collect();
        assert_eq!(names, expected.map(|(name, ..)| name));
        for (name, first, order) in expected {
            assert_eq!(beats(&built_in(name), first), order, "{name}");
        }
    }

    #[test]
    fn the_number_of_feet_in_the_air_matches_the_thesis() {
        let in_air = |gait: &Gait, phase: f64| (0..4).filter(|&leg| gait.is_swing(leg, phase)).count();
        assert!(phases().all(|phase| in_air(&built_in("walk"), phase) >= 1));
        assert!(phases().all(|phase| in_air(&built_in("walk-steady"), phase) == 1));
        assert!(phases().all(|phase| in_air(&built_in("trot"), phase) == 2));
        assert!(["walk", "walk-steady", "trot"].iter().all(|name| !built_in(name).has_flight()));
        for (name, flight) in [("canter", 0.3), ("gallop", 0.2), ("rotary-gallop", 0.2)] {
            for name in [name.to_owned(), format!("{name}-left")] {
                let gait = built_in(&name);
                let aloft: Vec<bool> = phases().map(|phase| in_air(&gait, phase) == 4).collect();
                let all = aloft.iter().filter(|aloft| **aloft).count();
                assert!(gait.has_flight() && (gait.flight_share() - flight).abs() < 0.01, "{name}");
                assert!((all as f64 / 1000.0 - flight).abs() < 0.002, "{name}: {all} of 1000");
                // One flight per period, not several: it ends once.
                let ends = (0..1000).filter(|&at| aloft[at] && !aloft[(at + 1) % 1000]).count();
                assert_eq!(ends, 1, "{name}");
            }
        }
    }

    #[test]
    fn the_other_lead_is_the_mirror_image_of_the_gait_some_time_later() {
        for name in ["canter", "gallop", "rotary-gallop"] {
            let (gait, other) = (built_in(name), built_in(&format!("{name}-left")));
            // Both gaits begin with a hind foot: the other's right hind lifts when this gait's left hind does.
            let later = other.phase_offsets[RH] - gait.phase_offsets[LH];
            for (leg, mirrored) in [(LH, RH), (LF, RF), (RH, LH), (RF, LF)] {
                for phase in phases() {
                    assert_eq!(
                        gait.is_swing(leg, phase),
                        other.is_swing(mirrored, phase + later),
                        "{name}: leg {leg} at {phase}"
                    );
                }
            }
        }
        // In the thesis' terms the other lead is D2 -> 1 - D2 (3.3).
        for (name, fore_hind_phase_offset, left_right_phase_offset) in
            [("canter-left", 0.2, 0.8), ("gallop-left", 0.35, 0.8)]
        {
            let phase_offsets =
                Gait::phase_offsets_of_thesis(fore_hind_phase_offset, left_right_phase_offset);
            for (phase_offset, expected) in built_in(name).phase_offsets.iter().zip(phase_offsets) {
                assert!((phase_offset - expected).abs() < 1e-9, "{name}: {phase_offset}, not {expected}");
            }
        }
    }
}
