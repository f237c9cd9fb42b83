//! Driving with a gamepad, which a person must arm and which must keep sending.
//!
//! ```text
//! disarmed --- Start, sticks centred ---> armed
//! armed ------ stop button, unplugged, or silent while it asks for motion ---> disarmed
//! ```
//! When disarmed, the robot slows down and stands.

use super::Repertoire;
use crate::motion::{Command, GaitChoice, Order, Posture};
use crate::operator::{Ending, Instruction};

/// Share of a stick's travel around its middle that counts as centred.
const CENTRED_SHARE: f64 = 0.12;

/// An event from a gamepad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PadEvent {
    /// Position of a stick, -1 to 1: forward and left are positive.
    Moved(Axis, f64),
    /// A button went down.
    Pressed(Button),
    /// Any other event: a sign of life.
    Heard,
    /// It was unplugged, or can no longer be read.
    Unplugged,
    /// It is back.
    PluggedIn,
}

/// The axis of a stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Fore and aft.
    Speed,
    /// To the sides.
    Turn,
}

/// The function of a button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Button {
    /// Listen to the sticks from now on.
    Arm,
    /// Slow down and stand.
    Stop,
    /// Slow down, take the stop action, end.
    End,
    /// The stop action at once.
    EmergencyStop,
    /// The next gait in the robot file.
    NextGait,
    /// The previous one.
    PreviousGait,
}

/// The gamepad and its orders so far; it starts disarmed.
#[derive(Debug, Clone, PartialEq)]
pub struct Gamepad {
    repertoire: Repertoire,
    silence_s: f64,
    gait: GaitChoice,
    speed: f64,
    turn: f64,
    is_armed: bool,
    /// Time of its last event, s.
    heard_s: f64,
    ending: Ending,
}

impl Gamepad {
    /// For a robot with this `repertoire`. If the gamepad is silent for longer than `silence_s` while it asks for
    /// motion, it counts as frozen.
    pub fn new(repertoire: Repertoire, silence_s: f64) -> Gamepad {
        Gamepad {
            repertoire,
            silence_s,
            gait: GaitChoice::Auto,
            speed: 0.0,
            turn: 0.0,
            is_armed: false,
            heard_s: 0.0,
            ending: Ending::default(),
        }
    }

    /// Descriptions of buttons and sticks for people, a line each.
    pub fn help() -> [&'static str; 6] {
        [
            "Start               arms it, sticks centred; until then the robot stands",
            "left stick          speed and turn",
            "right, left bumper  next, previous gait; before the first, the one that suits the speed",
            "A or cross          stop and stand; Start continues",
            "Select or Back      stop, sit down and end",
            "B or circle         EMERGENCY STOP: the stop action at once",
        ]
    }

    /// Takes in an event from the gamepad at `at_s`; returns a message for the person who holds it, if any.
    pub fn hear(&mut self, event: PadEvent, at_s: f64) -> Option<&'static str> {
        self.heard_s = self.heard_s.max(at_s);
        match event {
            PadEvent::Moved(Axis::Speed, share) => self.speed = beyond_centre(share),
            PadEvent::Moved(Axis::Turn, share) => self.turn = beyond_centre(share),
            PadEvent::Heard => {}
            PadEvent::Unplugged => {
                (self.is_armed, self.speed, self.turn) = (false, 0.0, 0.0);
                return Some("GAMEPAD UNPLUGGED: the robot stops. Plug it in and press Start to continue");
            }
            PadEvent::PluggedIn => return Some("the gamepad is there: press Start to arm it"),
            PadEvent::Pressed(button) => return self.press(button),
        }
        None
    }

    /// The instruction at `now_s`, on the clock of [`Gamepad::hear`]; and a message for the person, if any.
    pub fn instruction(&mut self, now_s: f64) -> (Instruction, Option<&'static str>) {
        let mut note = None;
        if self.is_armed && !self.is_centred() && now_s - self.heard_s > self.silence_s {
            self.is_armed = false;
            note = Some("GAMEPAD SILENT: the robot stops. Let go of the sticks and press Start to go on");
        }
        let command = if self.is_armed && !self.is_centred() {
            self.repertoire.command(self.gait, self.speed, self.turn, Posture::default())
        } else {
            Command::default()
        };
        (self.ending.or(Order::Drive(command)), note)
    }

    fn is_centred(&self) -> bool {
        self.speed.abs() <= 0.0 && self.turn.abs() <= 0.0
    }

    fn press(&mut self, button: Button) -> Option<&'static str> {
        match button {
            Button::Arm if !self.is_centred() => {
                return Some("not armed: let go of the sticks, then press Start");
            }
            Button::Arm if !self.is_armed => {
                self.is_armed = true;
                return Some("the gamepad is armed");
            }
            Button::Arm => {}
            Button::Stop => {
                self.is_armed = false;
                return Some("stopped: let go of the sticks and press Start to continue");
            }
            Button::End => {
                self.ending.stop();
            }
            Button::EmergencyStop => self.ending.stop_at_once(),
            Button::NextGait => self.gait = self.repertoire.next(self.gait),
            Button::PreviousGait => self.gait = self.repertoire.previous(self.gait),
        }
        None
    }
}

/// Demand of a stick at `share`: zero near its middle, and from there rising to full.
fn beyond_centre(share: f64) -> f64 {
    // A value that is not finite counts as centred.
    let share = if share.is_finite() { share.clamp(-1.0, 1.0) } else { 0.0 };
    share.signum() * ((share.abs() - CENTRED_SHARE) / (1.0 - CENTRED_SHARE)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORWARD: PadEvent = PadEvent::Moved(Axis::Speed, 1.0);
    const LET_GO: PadEvent = PadEvent::Moved(Axis::Speed, 0.05);
    const START: PadEvent = PadEvent::Pressed(Button::Arm);

    fn pad() -> Gamepad {
        Gamepad::new(Repertoire::example(), 0.5)
    }

    /// Armed at 1 s and walking forward since 2 s.
    fn walking() -> Gamepad {
        let mut pad = pad();
        pad.hear(START, 1.0);
        pad.hear(FORWARD, 2.0);
        assert!(speed_m_s(&mut pad, 2.0) > 0.39);
        pad
    }

    fn command(pad: &mut Gamepad, now_s: f64) -> Command {
        match pad.instruction(now_s).0.order {
            Order::Drive(command) => command,
            other => panic!("{other:?}"),
        }
    }

    fn speed_m_s(pad: &mut Gamepad, now_s: f64) -> f64 {
        command(pad, now_s).speed_m_s
    }

    fn assert_stands(pad: &mut Gamepad, now_s: f64) {
        assert_eq!(command(pad, now_s), Command::default(), "at {now_s} s");
    }

    /// Asserts that it stands, and keeps standing until the stick is released and Start is pressed again.
    fn assert_needs_arming(mut pad: Gamepad, now_s: f64) {
        assert_stands(&mut pad, now_s);
        pad.hear(FORWARD, now_s + 0.1);
        assert_stands(&mut pad, now_s + 0.1);
        assert!(pad.hear(START, now_s + 0.2).is_some_and(|note| note.contains("let go of the sticks")));
        assert_stands(&mut pad, now_s + 0.2);
        pad.hear(LET_GO, now_s + 0.3);
        pad.hear(FORWARD, now_s + 0.4);
        assert_stands(&mut pad, now_s + 0.4);
        pad.hear(LET_GO, now_s + 0.5);
        assert!(pad.hear(START, now_s + 0.6).is_some_and(|note| note.contains("armed")));
        pad.hear(FORWARD, now_s + 0.7);
        assert!(speed_m_s(&mut pad, now_s + 0.7) > 0.0);
    }

    #[test]
    fn a_gamepad_does_nothing_until_it_is_armed() {
        let mut pad = pad();
        pad.hear(FORWARD, 0.5);
        assert_stands(&mut pad, 0.5);
        assert_needs_arming(pad, 1.0);
    }

    #[test]
    fn sticks_set_shares_of_the_top_speed_of_the_gait() {
        let mut pad = walking();
        assert_eq!(command(&mut pad, 2.0).gait, GaitChoice::Auto);
        assert!((speed_m_s(&mut pad, 2.0) - 0.4).abs() < 1e-12);
        pad.hear(PadEvent::Pressed(Button::NextGait), 2.1);
        assert_eq!(command(&mut pad, 2.1).gait, GaitChoice::Gait(0));
        assert!((speed_m_s(&mut pad, 2.1) - 0.1).abs() < 1e-12);
        pad.hear(PadEvent::Pressed(Button::NextGait), 2.2);
        assert_eq!(command(&mut pad, 2.2).gait, GaitChoice::Gait(2), "trot cannot be done");
        pad.hear(PadEvent::Moved(Axis::Turn, -1.0), 2.3);
        assert!((command(&mut pad, 2.3).yaw_rate_rad_s + 0.3).abs() < 1e-12);
        for _ in 0..5 {
            pad.hear(PadEvent::Pressed(Button::PreviousGait), 2.4);
        }
        assert_eq!(command(&mut pad, 2.4).gait, GaitChoice::Auto);
        pad.hear(PadEvent::Moved(Axis::Speed, f64::NAN), 2.5);
        assert!(command(&mut pad, 2.5).is_finite());
    }

    #[test]
    fn an_unplugged_gamepad_stops_the_robot_until_it_is_armed_again() {
        let mut pad = walking();
        assert!(pad.hear(PadEvent::Unplugged, 2.2).is_some_and(|note| note.contains("UNPLUGGED")));
        assert_stands(&mut pad, 2.2);
        pad.hear(PadEvent::PluggedIn, 4.0);
        assert_needs_arming(pad, 5.0);
    }

    #[test]
    fn a_gamepad_unplugged_while_the_robot_stands_must_be_armed_again() {
        let mut pad = pad();
        pad.hear(START, 1.0);
        pad.hear(PadEvent::Unplugged, 2.0);
        pad.hear(PadEvent::PluggedIn, 3.0);
        assert_needs_arming(pad, 4.0);
    }

    #[test]
    fn a_gamepad_silent_or_frozen_for_half_a_second_stops_the_robot_until_it_is_armed_again() {
        let mut pad = walking();
        assert!(speed_m_s(&mut pad, 2.49) > 0.0);
        let (_, note) = pad.instruction(2.51);
        assert!(note.is_some_and(|note| note.contains("SILENT")));
        assert_eq!(pad.instruction(2.52).1, None, "said once");
        assert_needs_arming(pad, 3.0);
    }

    #[test]
    fn any_gamepad_event_counts_as_a_sign_of_life() {
        let mut pad = walking();
        for tenths in 21..60 {
            let now_s = f64::from(tenths) * 0.1;
            pad.hear(PadEvent::Heard, now_s);
            assert!(speed_m_s(&mut pad, now_s + 0.09) > 0.0, "at {now_s} s");
        }
    }

    #[test]
    fn a_gamepad_with_centred_sticks_may_stay_silent() {
        let mut pad = pad();
        pad.hear(START, 1.0);
        pad.hear(LET_GO, 1.1);
        assert_eq!(pad.instruction(600.0).1, None);
        assert_stands(&mut pad, 600.0);
        pad.hear(FORWARD, 601.0);
        assert!(speed_m_s(&mut pad, 601.0) > 0.0);
    }

    #[test]
    fn the_stop_button_stops_the_robot_until_the_gamepad_is_armed_again() {
        let mut pad = walking();
        pad.hear(PadEvent::Pressed(Button::Stop), 2.1);
        assert_needs_arming(pad, 2.2);
    }

    #[test]
    fn an_ordered_end_stays_whether_armed_or_not() {
        let ended = |mut pad: Gamepad, buttons: &[Button]| {
            for button in buttons {
                pad.hear(PadEvent::Pressed(*button), 2.1);
            }
            pad.hear(LET_GO, 2.2);
            pad.hear(START, 2.3);
            pad.instruction(2.4).0.order
        };
        use Button::{EmergencyStop, End};
        for pad in [pad(), walking()] {
            assert_eq!(ended(pad.clone(), &[End]), Order::Stop);
            assert_eq!(ended(pad.clone(), &[EmergencyStop]), Order::StopAtOnce);
            assert_eq!(ended(pad.clone(), &[End, EmergencyStop]), Order::StopAtOnce);
            assert_eq!(ended(pad, &[EmergencyStop, End]), Order::StopAtOnce);
        }
    }
}
