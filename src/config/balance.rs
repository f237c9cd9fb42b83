//! `[balance]`: how a robot keeps its balance on its feet.

use super::limb::ChainEntry;
use super::number::Limits;
use super::physics::{FRICTION, refuse_legs_without_feet};
use super::reader::Section;
use crate::model::{BalanceSettings, Motion, Physics};

/// Gains that kept a horse of this size up in simulation, as half and twice these gains did too.
const ROLL_RATE_S: f64 = 0.1;
const PITCH_RATE_S: f64 = 0.05;
const HEADING_M_S: f64 = 0.2;
/// Together with the motors' own braking, this lets a figure on stiff ankles sway no more than once.
const LEAN_BRAKE_HZ: f64 = 8.0;

/// Reads `[balance]`; `Some(None)` if the file has none.
pub(super) fn read(
    file: &Section<'_>,
    chains: &[ChainEntry<'_>],
    motion: Option<&Motion>,
    physics: Option<&Physics>,
) -> Option<Option<BalanceSettings>> {
    let meaning = "how the robot keeps its balance";
    file.describe_default(
        "balance",
        &format!("{meaning}, a table"),
        "none: the robot follows its plan uncorrected",
    );
    if !file.has("balance") {
        return Some(None);
    }
    if !file.has("physics") {
        refuse_legs_without_feet(file, chains, motion, "balance is worked out from what the leg stands on");
    }
    let is_figure = motion.is_some_and(|motion| motion.figure().is_some());
    let ground = physics.map(|physics| physics.ground.friction);
    file.section("balance", meaning, |section| read_settings(section, is_figure, ground)).map(Some)
}

/// `ground` is the friction of the simulated ground, if there is one.
fn read_settings(section: &Section<'_>, is_figure: bool, ground: Option<f64>) -> Option<BalanceSettings> {
    let meaning = "the friction between feet and ground that the balance assumes";
    section.describe_default(
        "friction",
        &format!("{meaning}, a number from 0 to 5"),
        &format!("that of [physics], or {FRICTION}"),
    );
    let friction = match section.has("friction") {
        true => section.number("friction", meaning, Limits::FromTo(0.0, 5.0)),
        false => Some(ground.unwrap_or(FRICTION)),
    };
    let sag = section.flag_or("sag_correction", "whether goals correct the sag of loaded joints", true);
    let gain = |key: &'static str, meaning: &str, largest: f64, default: f64| {
        section.number_or(key, meaning, Limits::FromTo(0.0, largest), default)
    };
    if is_figure {
        let meaning =
            "how fast a lean is braked, in m/s^2 for each m above the soles and rad/s of roll or pitch";
        let brake = gain("lean_brake_hz", meaning, 50.0, LEAN_BRAKE_HZ);
        return Some(BalanceSettings {
            friction: friction?,
            sag_correction: sag?,
            roll_rate_s: 0.0,
            pitch_rate_s: 0.0,
            lean_brake_hz: brake?,
            heading_m_s: 0.0,
        });
    }
    let meaning = "how far a foot is raised, in m for each m it is to the left and rad/s of roll";
    let roll_rate = gain("roll_rate_gain_s", meaning, 0.5, ROLL_RATE_S);
    let meaning = "how far a foot is lowered, in m for each m it is ahead and rad/s of pitch";
    let pitch_rate = gain("pitch_rate_gain_s", meaning, 0.5, PITCH_RATE_S);
    let meaning =
        "how much faster the left feet go, in m/s for each rad the trunk is turned to the left of its plan";
    let heading = gain("heading_gain_m_s", meaning, 2.0, HEADING_M_S);
    Some(BalanceSettings {
        friction: friction?,
        sag_correction: sag?,
        roll_rate_s: roll_rate?,
        pitch_rate_s: pitch_rate?,
        lean_brake_hz: 0.0,
        heading_m_s: heading?,
    })
}
