//! Words of the status line for a horse.

use crate::kinds::Words;
use crate::motion::{Command, GaitChoice, Order, Posture};
use crate::signals::Status;

/// Slower turns are not shown, rad/s.
const TURN_SHOWN_RAD_S: f64 = 1e-4;

/// Names of the robot's gaits, for people.
pub(super) struct HorseWords(Vec<String>);

impl Words for HorseWords {
    fn doing(&self, status: &Status, order: Order) -> String {
        let gait = status.gait.and_then(|gait| self.0.get(gait)).map(String::as_str);
        let Order::Drive(asked) = order else {
            return gait.map_or("standing".to_owned(), |_| format!("walking {:.3} m/s", status.speed_m_s));
        };
        self.steps(gait, status, &asked) + &posture_words(&asked.posture)
    }
}

impl HorseWords {
    /// Words for a horse with these gaits.
    pub(super) fn new(gaits: Vec<String>) -> HorseWords {
        HorseWords(gaits)
    }

    /// Words for its steps, if it takes any.
    fn steps(&self, gait: Option<&str>, status: &Status, asked: &Command) -> String {
        let doing = match (gait, asked.gait) {
            (None, GaitChoice::Stand) => return "standing".to_owned(),
            (None, choice) => format!("standing -> {}", self.of(choice)),
            (Some(gait), GaitChoice::Auto) => format!("{gait} (auto)"),
            (Some(gait), choice) if self.of(choice) == gait => gait.to_owned(),
            (Some(gait), choice) => format!("{gait} -> {}", self.of(choice)),
        };
        let turn = turn_words(status.yaw_rate_rad_s, asked.yaw_rate_rad_s);
        format!("{doing} {:.3} of {:.3} m/s{turn}", status.speed_m_s, asked.speed_m_s)
    }

    fn of(&self, choice: GaitChoice) -> &str {
        match choice {
            GaitChoice::Stand => "stand",
            GaitChoice::Auto => "auto",
            GaitChoice::Gait(gait) => self.0.get(gait).map_or("stand", String::as_str),
        }
    }
}

/// Words for the ordered posture, if it is not the level stand.
fn posture_words(posture: &Posture) -> String {
    let mut words = String::new();
    let mut add = |value: f64, unit: &str, [positive, negative]: [&str; 2]| {
        // Less than half of the last digit shown counts as zero.
        if value.abs() >= 0.05 {
            let direction = if value > 0.0 { positive } else { negative };
            words += &format!(", {:.1} {unit} {direction}", value.abs());
        }
    };
    add(posture.rise_m * 1e3, "mm", ["higher", "lower"]);
    add(posture.pitch_rad.to_degrees(), "deg", ["nose down", "nose up"]);
    add(posture.roll_rad.to_degrees(), "deg", ["left up", "right up"]);
    add(posture.sway_m * 1e3, "mm", ["to the left", "to the right"]);
    words
}

/// Words for the turn rate and the ordered one, both positive towards the ordered side.
fn turn_words(turns_rad_s: f64, asked_rad_s: f64) -> String {
    if turns_rad_s.abs().max(asked_rad_s.abs()) < TURN_SHOWN_RAD_S {
        return String::new();
    }
    let is_asked = asked_rad_s.abs() >= TURN_SHOWN_RAD_S;
    let is_left = if is_asked { asked_rad_s > 0.0 } else { turns_rad_s > 0.0 };
    let (sign, side) = if is_left { (1.0, "left") } else { (-1.0, "right") };
    // Zero prints as 0, not as -0.
    let [turns, asked] = [turns_rad_s, asked_rad_s].map(|rate| sign * rate.to_degrees() + 0.0);
    format!(", {turns:.1} of {asked:.1} deg/s {side}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_shows_the_motion_and_the_order() {
        let asked = |gait, yaw_deg_s: f64| {
            let yaw_rate_rad_s = yaw_deg_s.to_radians();
            Order::Drive(Command { gait, speed_m_s: 0.2, yaw_rate_rad_s, ..Command::default() })
        };
        let leaning = |order| match order {
            Order::Drive(command) => {
                let pitch_rad = -(2_f64.to_radians());
                let posture = Posture { rise_m: -0.005, pitch_rad, ..Posture::default() };
                Order::Drive(Command { posture, ..command })
            }
            other => other,
        };
        let walking = Status { gait: Some(1), speed_m_s: 0.1234, ..Status::LIMP };
        let turning = Status { yaw_rate_rad_s: 3_f64.to_radians(), ..walking };
        let standing = Status { gait: None, ..walking };
        use GaitChoice::{Auto, Gait, Stand};
        for (status, order, words) in [
            (walking, asked(Gait(1), 0.0), "trot 0.123 of 0.200 m/s"),
            (walking, asked(Gait(0), 0.0), "trot -> walk 0.123 of 0.200 m/s"),
            (walking, asked(Auto, 0.0), "trot (auto) 0.123 of 0.200 m/s"),
            (walking, asked(Stand, 0.0), "trot -> stand 0.123 of 0.200 m/s"),
            (turning, asked(Gait(1), 5.0), "m/s, 3.0 of 5.0 deg/s left"),
            (turning, asked(Gait(1), -5.0), "m/s, -3.0 of 5.0 deg/s right"),
            (turning, asked(Gait(1), 0.0), "m/s, 3.0 of 0.0 deg/s left"),
            (standing, asked(Stand, 0.0), "standing"),
            (standing, leaning(asked(Stand, 0.0)), "standing, 5.0 mm lower, 2.0 deg nose up"),
            (walking, leaning(asked(Gait(1), 0.0)), "0.200 m/s, 5.0 mm lower, 2.0 deg nose up"),
            (standing, asked(Gait(0), 0.0), "standing -> walk"),
        ] {
            let line = HorseWords::new(["walk", "trot"].map(str::to_owned).into()).doing(&status, order);
            assert!(line.contains(words), "no '{words}' in {line}");
        }
    }
}
