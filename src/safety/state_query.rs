//! Asks a servo that was silent for long whether it still has torque, and which goal it holds.
//!
//! It may have restarted and be limp, or hold any goal that was sent since it was last heard. Its feedback says
//! neither, so it is asked, first for its torque and then for its goal. An answer that does not fit is ignored.

use crate::signals::{JointState, Question};

/// Equal answers that settle whether it has torque: one damaged answer in 256 passes a checksum.
const ANSWERS: u8 = 2;
/// A servo that has not settled a question after this many requests counts as one that cannot answer it.
const QUESTIONS_MAX: u8 = 8;
/// Tolerance of a reported goal against those that were sent, rad: a count of rounding.
pub(super) const GOAL_SLACK_RAD: f64 = 0.01;
/// A servo that its watchdog stopped holds its angle of that moment: no further than this, rad, beyond its way.
const STOPPED_RAD: f64 = 0.05;

/// The result of the questions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum QueriedState {
    /// It has no torque.
    Limp,
    /// It has torque and holds this goal, rad.
    Holding(f64),
}

/// The answers of one servo.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StateQuery {
    /// The last answer about its torque, and the number of equal answers in a row.
    torque: Option<(bool, u8)>,
    /// How often it was asked the present question.
    asked: u8,
    /// True once it has reported a goal that it was not sent.
    is_astray: bool,
}

impl StateQuery {
    /// The next question.
    pub(super) fn question(self) -> Question {
        if self.has_torque() == Some(true) { Question::Goal } else { Question::Torque }
    }

    /// True if it was asked anything.
    pub(super) fn has_begun(self) -> bool {
        self.asked > 0 || self.torque.is_some()
    }

    /// Notes that the question is asked.
    pub(super) fn note_asked(&mut self) {
        self.asked = self.asked.saturating_add(1);
    }

    /// Takes an answer, if one came with `measured`. `sent_rad` are the lowest and the highest goal, rad, that the
    /// servo may hold, and `before_rad` is where it stood when it was last heard before the silence. Returns `None`
    /// while questions are open.
    pub(super) fn take(
        &mut self,
        measured: &JointState,
        sent_rad: (f64, f64),
        before_rad: f64,
    ) -> Option<QueriedState> {
        if let Some(answer) = measured.has_torque {
            let same = self.torque.filter(|(before, _)| *before == answer).map_or(0, |(_, times)| times);
            self.torque = Some((answer, same.saturating_add(1)));
            if self.has_torque() == Some(true) {
                self.asked = 0;
            }
        }
        let (low, high) = sent_rad;
        // The watchdog stops a servo on the way from its old position to a goal that it was sent.
        // Under its load the joint may have sunk since, so where it stands now says nothing.
        let way_rad = (low.min(before_rad) - STOPPED_RAD)..=(high.max(before_rad) + STOPPED_RAD);
        let fits = |goal: &f64| way_rad.contains(goal);
        self.is_astray |= measured.held_goal_rad.is_some_and(|goal| !fits(&goal));
        let is_mute = self.asked >= QUESTIONS_MAX;
        match self.has_torque() {
            Some(false) => Some(QueriedState::Limp),
            Some(true) => {
                // A servo that obeyed a goal meant for another, or whose id two servos share, is let go: its torque
                // rises again from zero. A servo that cannot report its goal holds the possible goal nearest to
                // where it stands.
                if is_mute && self.is_astray && !measured.held_goal_rad.as_ref().is_some_and(fits) {
                    return Some(QueriedState::Limp);
                }
                let nearest = is_mute.then(|| measured.position_rad.clamp(low, high));
                measured.held_goal_rad.filter(fits).or(nearest).map(QueriedState::Holding)
            }
            None => is_mute.then_some(QueriedState::Limp),
        }
    }

    fn has_torque(self) -> Option<bool> {
        self.torque.filter(|(_, times)| *times >= ANSWERS).map(|(answer, _)| answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENT_RAD: (f64, f64) = (0.2, 0.5);
    const BEFORE_RAD: f64 = 0.75;

    fn torque(has_torque: bool) -> JointState {
        JointState { has_torque: Some(has_torque), ..JointState::default() }
    }

    fn goal(rad: f64) -> JointState {
        JointState { held_goal_rad: Some(rad), position_rad: 0.7, ..JointState::default() }
    }

    #[test]
    fn two_equal_answers_determine_the_torque_and_a_sent_goal_determines_the_goal() {
        let mut state_query = StateQuery::default();
        for answer in [true, false, true] {
            assert_eq!(state_query.question(), Question::Torque);
            assert_eq!(state_query.take(&torque(answer), SENT_RAD, BEFORE_RAD), None);
        }
        assert_eq!(state_query.take(&torque(true), SENT_RAD, BEFORE_RAD), None);
        assert_eq!(state_query.question(), Question::Goal);
        assert_eq!(
            state_query.take(&goal(0.85), SENT_RAD, BEFORE_RAD),
            None,
            "no such goal was sent, nor lies it on the way there"
        );
        assert_eq!(
            state_query.take(&goal(0.72), SENT_RAD, BEFORE_RAD),
            Some(QueriedState::Holding(0.72)),
            "it was stopped on its way"
        );
        let other = JointState { position_rad: 1.0, ..goal(0.99) };
        assert_eq!(state_query.take(&other, SENT_RAD, BEFORE_RAD), None, "it cannot have come there");
        assert_eq!(state_query.take(&goal(0.45), SENT_RAD, BEFORE_RAD), Some(QueriedState::Holding(0.45)));
        let mut astray = StateQuery::default();
        (0..2).for_each(|_| assert_eq!(astray.take(&torque(true), SENT_RAD, BEFORE_RAD), None));
        assert_eq!(astray.take(&other, SENT_RAD, BEFORE_RAD), None);
        (0..QUESTIONS_MAX).for_each(|_| astray.note_asked());
        assert_eq!(
            astray.take(&other, SENT_RAD, BEFORE_RAD),
            Some(QueriedState::Limp),
            "nobody sent it there"
        );
        let mut limp = StateQuery::default();
        assert_eq!(limp.take(&torque(false), SENT_RAD, BEFORE_RAD), None);
        assert_eq!(limp.take(&torque(false), SENT_RAD, BEFORE_RAD), Some(QueriedState::Limp));
    }

    #[test]
    fn a_servo_that_cannot_answer_counts_as_limp_or_as_holding_the_goal_nearest_its_position() {
        let here = JointState { position_rad: 0.9, ..JointState::default() };
        let mut state_query = StateQuery::default();
        (0..QUESTIONS_MAX).for_each(|_| state_query.note_asked());
        assert_eq!(state_query.take(&here, SENT_RAD, BEFORE_RAD), Some(QueriedState::Limp));
        let mut state_query = StateQuery::default();
        state_query.take(&torque(true), SENT_RAD, BEFORE_RAD);
        state_query.take(&torque(true), SENT_RAD, BEFORE_RAD);
        assert_eq!(state_query.take(&here, SENT_RAD, BEFORE_RAD), None);
        (0..QUESTIONS_MAX).for_each(|_| state_query.note_asked());
        assert_eq!(state_query.take(&here, SENT_RAD, BEFORE_RAD), Some(QueriedState::Holding(0.5)));
    }
}
