//! The smallest episode with the same fault: leaves out whatever can be left out, one thing after another.

use hw_sim::faults::ScriptedFault;

use super::draw::Episode;
use super::judge::Violation;
use super::stage::play_until;
use super::subject::Subject;
use crate::model::TrippedServoPolicy;

/// Most plays for one finding.
const PLAYS_MAX: u32 = 120;
/// Shortest duration of a fault, s.
const SHORTEST_S: f64 = 0.004;

/// A way to reduce an episode; `None` if it does not reduce it.
type Cut = Box<dyn Fn(&Episode) -> Option<Episode>>;

/// The smallest episode of `subject` that still has a finding of the kind `wrong`, as `episode` has. Stops
/// early when `is_to_stop` returns true.
pub fn smallest(
    subject: &Subject,
    episode: &Episode,
    wrong: Violation,
    is_to_stop: &dyn Fn() -> bool,
) -> Episode {
    let is_still = |smaller: &Episode| {
        let played = play_until(subject, smaller, Some(wrong));
        played.is_ok_and(|played| played.findings.iter().any(|found| found.wrong == wrong))
    };
    smallest_by(episode, &|smaller| !is_to_stop() && is_still(smaller))
}

/// The same, with `is_still` as the test for the finding.
pub(super) fn smallest_by(episode: &Episode, is_still: &dyn Fn(&Episode) -> bool) -> Episode {
    let mut smallest = episode.clone();
    let mut plays = 0;
    loop {
        let mut has_changed = false;
        for cut in cuts(&smallest) {
            let Some(smaller) = cut(&smallest) else { continue };
            if plays >= PLAYS_MAX {
                return smallest;
            }
            plays += 1;
            if is_still(&smaller) {
                smallest = smaller;
                has_changed = true;
            }
        }
        if !has_changed {
            return smallest;
        }
    }
}

/// Everything that might be left out of `episode` or reduced, the last first, so that indices stay valid.
fn cuts(episode: &Episode) -> Vec<Cut> {
    let mut cuts: Vec<Cut> = vec![change(|smaller| smaller.has_physics = false)];
    for index in (0..episode.faults.len()).rev() {
        cuts.push(Box::new(move |episode| {
            let mut smaller = episode.clone();
            (index < smaller.faults.len()).then(|| smaller.faults.remove(index))?;
            Some(smaller)
        }));
    }
    for index in (0..episode.orders.len()).rev() {
        cuts.push(Box::new(move |episode| {
            let mut smaller = episode.clone();
            (index < smaller.orders.len()).then(|| smaller.orders.remove(index))?;
            Some(smaller)
        }));
    }
    cuts.push(change(|smaller| smaller.sits = true));
    cuts.push(change(|smaller| smaller.tripped_servo = TrippedServoPolicy::Stop));
    for share in [0.5, 0.8] {
        cuts.push(change(move |smaller| smaller.end_s = milliseconds(share * smaller.end_s)));
        for index in 0..episode.faults.len() {
            cuts.push(of_fault(index, move |fault| {
                fault.for_s = fault.for_s.map(|for_s| milliseconds(share * for_s).max(SHORTEST_S));
            }));
        }
    }
    for index in 0..episode.faults.len() {
        cuts.push(of_fault(index, |fault| fault.at_s = milliseconds(fault.at_s)));
    }
    cuts
}

/// Whole milliseconds, s.
fn milliseconds(time_s: f64) -> f64 {
    (time_s * 1e3).round() / 1e3
}

/// The episode after this change; `None` if the change makes no difference.
fn change(change: impl Fn(&mut Episode) + 'static) -> Cut {
    Box::new(move |episode| {
        let mut smaller = episode.clone();
        change(&mut smaller);
        let same = |a: f64, b: f64| (a - b).abs() <= 0.0;
        let is_same = smaller.has_physics == episode.has_physics
            && smaller.sits == episode.sits
            && smaller.tripped_servo == episode.tripped_servo
            && same(smaller.end_s, episode.end_s)
            && smaller.faults == episode.faults;
        (!is_same).then_some(smaller)
    })
}

fn of_fault(index: usize, with: impl Fn(&mut ScriptedFault) + 'static) -> Cut {
    change(move |smaller| {
        if let Some(fault) = smaller.faults.get_mut(index) {
            with(fault);
        }
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use hw_sim::faults::FaultKind;

    use super::*;
    use crate::config;
    use crate::kinds;
    use crate::trial::campaign::play;

    /// A robot that safety stops for heat, among unrelated faults.
    #[test]
    fn shrinking_leaves_only_the_fault_that_is_the_cause() {
        let text = include_str!("../../../config/tentacle.toml");
        let robot = config::parse(text, "tentacle.toml").unwrap().robot;
        let subject = Subject::new(robot.clone(), kinds::of(&robot).unwrap()).unwrap();
        let mut episode = Episode::draw(&subject, 3, 0);
        (episode.end_s, episode.has_physics, episode.sits) = (6.0, false, true);
        let template = episode.faults[0].clone();
        let fault =
            |at_s, kind| ScriptedFault { at_s, for_s: Some(0.05), kind, target: template.target.clone() };
        let hot = ScriptedFault { for_s: Some(4.0), ..fault(1.5, FaultKind::Hot { celsius: 100.0 }) };
        episode.faults = vec![
            fault(1.0, FaultKind::Silent),
            fault(1.2, FaultKind::Noise),
            hot,
            fault(2.0, FaultKind::BitFlip),
            fault(2.5, FaultKind::Echo),
        ];
        let is_still = |episode: &Episode| {
            play(&subject, episode).is_ok_and(|played| played.reason.contains("its limit is"))
        };
        assert!(is_still(&episode));
        let smallest = smallest_by(&episode, &is_still);
        assert_eq!(smallest.faults.len(), 1, "{:?}", smallest.faults);
        assert!(matches!(smallest.faults[0].kind, FaultKind::Hot { .. }));
        assert!(smallest.faults[0].for_s < Some(4.0) && smallest.orders.is_empty(), "{smallest:?}");
        assert!(is_still(&smallest));
    }
}
