//! The thesis' change of gait (Takizawa 2005, 3.1, 3.3, 4.3), at the size of its horse: its results and its
//! failures.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use hippocamp::model::Gait;
use hippocamp::motion::curves::SwingCurve;
use hippocamp::motion::horse::thesis_rule::{SteadyGait, ThesisRule};

/// The thesis' four gaits, slow to fast, each at a speed of its range, m/s.
const PACES: [(&str, f64); 4] = [("walk", 1.89), ("trot", 4.0), ("canter", 8.33), ("gallop", 15.0)];
/// How far fore and aft of its root a foot may be, m (4.3).
const LIMIT_M: f64 = 0.8;
const SWING: SwingCurve = SwingCurve { time_s: 0.3, lift_m: 0.12, ramp_share: 0.1 };
const DT_S: f64 = 0.001;
const LEGS: [usize; 4] = [0, 1, 2, 3];
const LH: usize = 0;
const LF: usize = 1;
const RF: usize = 3;

fn change(from: (&str, f64), to: (&str, f64), start_share: f64) -> ThesisRule {
    let gaits = Gait::built_in();
    let pace = |(name, speed_m_s): (&str, f64)| SteadyGait {
        gait: gaits.iter().find(|gait| gait.name == name).unwrap(),
        speed_m_s,
    };
    ThesisRule::new(SWING, pace(from), pace(to), start_share)
}

/// All twelve ordered pairs, begun at the left hind's lift-off.
fn pairs() -> impl Iterator<Item = (String, ThesisRule)> {
    PACES.into_iter().flat_map(|from| {
        PACES
            .into_iter()
            .filter(move |to| to.0 != from.0)
            .map(move |to| (format!("{} -> {}", from.0, to.0), change(from, to, 0.0)))
    })
}

fn early_legs(rule: &ThesisRule) -> Vec<usize> {
    LEGS.into_iter().filter(|leg| rule.legs()[*leg].lifts_too_early()).collect()
}

fn lifts_out_of_reach(rule: &ThesisRule) -> bool {
    LEGS.into_iter().any(|leg| rule.lift_off_m(leg).abs() > LIMIT_M)
}

/// Moments from two old strides before the change to two new ones after it, s.
fn moments() -> impl Iterator<Item = f64> {
    (-2000..3000).map(|step| f64::from(step) * DT_S)
}

/// The furthest a standing foot gets from its root, m.
fn furthest_stance_m(rule: &ThesisRule, leg: usize) -> f64 {
    let lifts_s = rule.legs()[leg].lift_off_s();
    // With the last moment on the ground before the changed stride, and the first after it.
    let ends = [lifts_s - 1e-9, lifts_s + SWING.time_s + 1e-9];
    let feet = moments().chain(ends).map(|s| rule.foot(leg, s));
    feet.filter(|foot| !foot.is_swing).map(|foot| foot.forward_m.abs()).fold(0.0, f64::max)
}

fn assert_near(values: [f64; 4], expected: [f64; 4], tolerance: f64) {
    for (value, expected) in values.iter().zip(expected) {
        assert!((value - expected).abs() <= tolerance, "{values:?} is not {expected}");
    }
}

#[test]
fn walk_to_trot_adds_the_times_the_thesis_names() {
    let rule = change(PACES[0], PACES[1], 0.0);
    assert_near(rule.legs().map(|leg| leg.added_s), [0.0, 0.1, -0.2, -0.1], 1e-12);
}

#[test]
fn a_change_of_speed_alone_adds_its_distance_until_each_lift_off() {
    // 3.4, 3.5: (V' - V) C on top of V' P / (1 - alpha); walk, T = 1 s, C = phase offset T.
    let rule = change(("walk", 1.2), ("walk", 1.7), 0.0);
    let added_m = rule.legs().map(|leg| leg.stride_m - 1.7 * 1.0);
    assert_near(added_m, [0.0, 0.5 * 0.2, 0.5 * 0.5, 0.5 * 0.7], 1e-12);
    assert_near(rule.legs().map(|leg| leg.added_s), [0.0; 4], 1e-12);
    // Each foot lifts again where it did before: the places against the root are those of the old speed.
    for leg in LEGS {
        let lifts_s = rule.legs()[leg].lift_off_s() + 1.0;
        let foot = rule.foot(leg, lifts_s - 1e-9);
        assert!((foot.forward_m + 0.5 * 0.7 * 1.2).abs() < 1e-6, "leg {leg}: {foot:?}");
    }
}

#[test]
fn walk_to_trot_lifts_feet_far_behind_their_roots() {
    let rule = change(PACES[0], PACES[1], 0.0);
    assert_near(std::array::from_fn(|leg| rule.lift_off_m(leg)), [-0.66, -1.48, -0.92, -1.74], 0.005);
}

#[test]
fn nine_of_twelve_changes_fail_at_a_lift_off() {
    let (mut failing, mut out_of_reach, mut passing) = (0, 0, vec![]);
    for (name, rule) in pairs() {
        let is_early = !early_legs(&rule).is_empty();
        assert_eq!(is_early, ["trot -> canter", "trot -> gallop"].contains(&name.as_str()), "{name}");
        assert!(!is_early || early_legs(&rule) == [RF], "{name}");
        out_of_reach += u32::from(lifts_out_of_reach(&rule));
        if is_early || lifts_out_of_reach(&rule) {
            failing += 1;
        } else {
            passing.push(name);
        }
    }
    assert_eq!((failing, out_of_reach), (9, 8));
    assert_eq!(passing, ["trot -> walk", "canter -> walk", "gallop -> trot"]);
}

#[test]
fn the_other_three_changes_fail_where_a_foot_lands() {
    // The right fore is in the air when the trunk slows down at once: it lands by the old speed, too far ahead.
    // Trot: lifted at the change, lands P later, V T / 2 + (V - V') P = 0.6 + 2.11 * 0.3 = 1.233 m ahead.
    for (name, from, to, lands_m) in [
        ("trot -> walk", PACES[1], PACES[0], 1.233),
        ("canter -> walk", PACES[2], PACES[0], 0.812),
        ("gallop -> trot", PACES[3], PACES[1], 2.07),
    ] {
        let rule = change(from, to, 0.0);
        let furthest_m = furthest_stance_m(&rule, RF);
        // Landings are seen within a step.
        assert!((furthest_m - lands_m).abs() < 0.002 + 15.0 * DT_S, "{name}: {furthest_m}");
        assert!(furthest_m > LIMIT_M, "{name}");
    }
}

#[test]
fn only_the_left_fore_goes_too_far_at_the_speeds_of_the_thesis_figures() {
    // 4.3, figures 4.7 and 4.8: such speeds are a walk at 1.78 m/s (6.4 km/h) and a trot no faster than 2.37 m/s.
    for trot_m_s in [1.78, 2.0, 2.2, 2.37] {
        let rule = change(("walk", 1.78), ("trot", trot_m_s), 0.0);
        let too_far: Vec<usize> =
            LEGS.into_iter().filter(|leg| furthest_stance_m(&rule, *leg) > LIMIT_M).collect();
        assert_eq!(too_far, [LF], "trot at {trot_m_s} m/s");
        assert!(rule.lift_off_m(LF) < -LIMIT_M, "it is too far behind");
    }
    for trot_m_s in [1.77, 2.38] {
        let rule = change(("walk", 1.78), ("trot", trot_m_s), 0.0);
        let too_far: Vec<usize> =
            LEGS.into_iter().filter(|leg| furthest_stance_m(&rule, *leg) > LIMIT_M).collect();
        assert_ne!(too_far, [LF], "trot at {trot_m_s} m/s");
    }
}

#[test]
fn no_foot_slips_or_jumps_and_the_new_gait_is_in_time_wherever_the_change_begins() {
    let gaits = Gait::built_in();
    for from in PACES {
        for to in PACES {
            for start in 0..20 {
                let rule = change(from, to, f64::from(start) / 20.0);
                let name = format!("{} -> {} at {start}/20", from.0, to.0);
                let gait = gaits.iter().find(|gait| gait.name == to.0).unwrap();
                let period_s = gait.period_s(0.3);
                for leg in LEGS {
                    let after_s = rule.legs()[leg].lift_off_s() - rule.legs()[LH].lift_off_s();
                    let error = (after_s / period_s - gait.phase_offsets[leg] + 0.5).rem_euclid(1.0) - 0.5;
                    assert!(error.abs() < 1e-9, "{name}: leg {leg} lifts {after_s} s after the left hind");
                    if !rule.legs()[leg].lifts_too_early() {
                        check_foot(&rule, leg, &name);
                    }
                }
            }
        }
    }
}

/// Over the ground a standing foot stays where it is, and a swinging one is never faster than its stride allows.
fn check_foot(rule: &ThesisRule, leg: usize, name: &str) {
    let over_ground = |s: f64| rule.root_m(s) + rule.foot(leg, s).forward_m;
    // Strides of 3.3 are 2.4 m to 6 m, but 3.6 makes longer ones.
    let longest_m = rule.legs()[leg].stride_m.abs().max(6.0);
    let fastest_m_s = longest_m / (SWING.time_s * (1.0 - SWING.ramp_share));
    for s in moments() {
        let (before, now) = (rule.foot(leg, s), rule.foot(leg, s + DT_S));
        let moved_m = (over_ground(s + DT_S) - over_ground(s)).abs();
        if !before.is_swing && !now.is_swing {
            assert!(moved_m < 1e-9, "{name}: leg {leg} slips {moved_m} m at {s} s");
        }
        assert!(moved_m <= fastest_m_s * DT_S * 1.001, "{name}: leg {leg} jumps {moved_m} m at {s} s");
        assert!(now.up_m >= 0.0 && (now.is_swing || now.up_m < 1e-12), "{name}: leg {leg}");
    }
}

#[test]
fn stances_of_the_new_gait_stay_where_the_old_speed_put_them() {
    // The rule never brings a foot back: after any change each foot lifts V alpha T / 2 behind its root, by the
    // speed and gait before; only its first place depends on the change.
    for (name, rule) in pairs() {
        let (from, _) = name.split_once(" -> ").unwrap();
        let speed_m_s = PACES.iter().find(|pace| pace.0 == from).unwrap().1;
        let gaits = Gait::built_in();
        let gait = gaits.iter().find(|gait| gait.name == from).unwrap();
        let behind_m = 0.5 * speed_m_s * gait.duty_factor * gait.period_s(0.3);
        for leg in LEGS {
            // The last moment on the ground before some later lift-off.
            let mut last = None;
            for s in moments().filter(|s| *s > 1.5) {
                let (now, next) = (rule.foot(leg, s), rule.foot(leg, s + DT_S));
                if !now.is_swing && next.is_swing {
                    last = Some(now.forward_m);
                }
            }
            let lifts_m = last.unwrap();
            assert!(
                (lifts_m + behind_m).abs() < 15.0 * DT_S + 1e-6,
                "{name}: leg {leg} lifts at {lifts_m} m"
            );
        }
    }
}
