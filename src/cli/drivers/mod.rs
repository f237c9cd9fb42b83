//! The driver of a run: its plan, a script, the keyboard or a gamepad.
//!
//! The threads that read terminal and gamepad are here; [`crate::operator`] gives their keys and sticks a meaning.

mod keyboard;
mod pad;

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::BadInput;
use crate::config;
use crate::model::{FigureMotion, Robot, TentacleMotion};
use crate::motion::{GaitChoice, Order};
use crate::operator::{Gamepad, Instruction, Keys, Playback, PoseKeys, Repertoire, Script, Show, StrokeKeys};
use crate::platform::monotonic;
use crate::signals::Status;
use keyboard::Keyboard;
use pad::Pad;

/// Smallest allowed limit on a pad's silence: one cycle of the slowest loop.
const SILENCE_SMALLEST_S: f64 = 0.1;

/// Options that choose the driver.
#[derive(Debug, clap::Args)]
pub(super) struct DriverArguments {
    /// Drive by this motion script (TOML; see docs/scripts.md).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["keys", "gamepad", "gait", "speed"])]
    pub(super) script: Option<PathBuf>,
    /// Drive by keys in this terminal; it shows which. The robot stands until one is pressed.
    #[arg(long, conflicts_with_all = ["gamepad", "gait", "speed", "walk_for_s"])]
    keys: bool,
    /// Drive with a gamepad: the only one there, or this device. It must be armed with Start (see docs/gamepad.md).
    #[arg(long, value_name = "DEVICE", num_args = 0..=1, require_equals = true,
          conflicts_with_all = ["gait", "speed", "walk_for_s", "is_virtual"])]
    gamepad: Option<Option<PathBuf>>,
    /// How long the gamepad may be silent while it asks for motion, in seconds, before the robot stops.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.5, requires = "gamepad")]
    gamepad_silence: f64,
}

impl DriverArguments {
    /// True if the user named a driver other than the plan.
    pub(super) fn is_some(&self) -> bool {
        self.script.is_some() || self.is_by_hand()
    }

    /// True if a person drives.
    pub(super) fn is_by_hand(&self) -> bool {
        self.keys || self.gamepad.is_some()
    }

    /// The script, if there is one.
    pub(super) fn script(&self) -> Option<&Path> {
        self.script.as_deref()
    }
}

/// Gives the orders, once a cycle.
pub(super) enum Driver {
    Plan,
    Script(Playback, PathBuf),
    Keys(Keys, Keyboard),
    StrokeKeys(Box<StrokeKeys>, Keyboard),
    PoseKeys(PoseKeys, Keyboard),
    Gamepad(Gamepad, Pad),
    /// A show of strokes and its name; keys park and end it, if there is a terminal.
    Show(Box<Show>, String, Option<Keyboard>),
}

impl Driver {
    /// The driver that `options` name: reads its script, or listens to its terminal or gamepad from now on.
    ///
    /// # Errors
    /// Bad input: a bad script, a gait in it that the robot cannot do, no terminal, no gamepad.
    pub(super) fn start(options: &DriverArguments, robot: &Robot, repertoire: Repertoire) -> Result<Driver> {
        if let Some(path) = &options.script {
            let script = load_script(path, robot, &repertoire)?;
            return Ok(Driver::Script(Playback::new(script), path.clone()));
        }
        if options.keys {
            return Ok(Driver::Keys(Keys::new(repertoire), Keyboard::start()?));
        }
        if let Some(wanted) = &options.gamepad {
            let silence_s = options.gamepad_silence;
            if !(silence_s.is_finite() && silence_s >= SILENCE_SMALLEST_S) {
                let said =
                    format!("--gamepad-silence {silence_s}: expected seconds, {SILENCE_SMALLEST_S} or more");
                return Err(BadInput(said).into());
            }
            return Ok(Driver::Gamepad(Gamepad::new(repertoire, silence_s), Pad::start(wanted.clone())?));
        }
        Ok(Driver::Plan)
    }

    /// A show called `name`; keys park and end it, if there is a terminal.
    ///
    /// # Errors
    /// If the terminal's settings cannot be read.
    pub(super) fn show(show: Show, name: String) -> Result<Driver> {
        let keyboard = Keyboard::is_there().then(Keyboard::start).transpose()?;
        Ok(Driver::Show(Box::new(show), name, keyboard))
    }

    /// The same for arms, whose scripts `load` reads.
    ///
    /// # Errors
    /// Bad input: a bad script, no terminal.
    pub(super) fn of_arms(
        options: &DriverArguments,
        tentacle: &TentacleMotion,
        load: impl Fn(&Path) -> Result<Script>,
    ) -> Result<Driver> {
        if options.gamepad.is_some() {
            let said = "--gamepad: arms are driven by --keys or --script";
            return Err(BadInput(said.to_owned()).into());
        }
        if let Some(path) = &options.script {
            return Ok(Driver::Script(Playback::new(load(path)?), path.clone()));
        }
        Ok(Driver::StrokeKeys(Box::new(StrokeKeys::new(tentacle)), Keyboard::start()?))
    }

    /// The same for a figure.
    ///
    /// # Errors
    /// Bad input: a bad script, no terminal.
    pub(super) fn of_figure(
        options: &DriverArguments,
        figure: &FigureMotion,
        load: impl Fn(&Path) -> Result<Script>,
    ) -> Result<Driver> {
        if options.gamepad.is_some() {
            let said = "--gamepad: a figure is driven by --keys or --script";
            return Err(BadInput(said.to_owned()).into());
        }
        if let Some(path) = &options.script {
            return Ok(Driver::Script(Playback::new(load(path)?), path.clone()));
        }
        Ok(Driver::PoseKeys(PoseKeys::new(figure), Keyboard::start()?))
    }

    /// Instructions for the person who drives, a line each.
    pub(super) fn help(&self) -> Vec<String> {
        match self {
            Driver::Plan | Driver::Script(..) | Driver::Show(_, _, None) => Vec::new(),
            Driver::StrokeKeys(keys, _) => keys.help(),
            Driver::PoseKeys(keys, _) => keys.help(),
            Driver::Show(..) => Show::help().map(str::to_owned).into(),
            Driver::Keys(keys, _) => keys.help(),
            Driver::Gamepad(..) => Gamepad::help().map(str::to_owned).into(),
        }
    }

    /// The order for this cycle. Messages for the person go to `note`.
    pub(super) fn instruction(&mut self, status: &Status, mut note: impl FnMut(&'static str)) -> Instruction {
        match self {
            Driver::Plan => Order::Go.into(),
            Driver::Script(playback, _) => playback.instruction(status),
            Driver::Keys(keys, keyboard) => {
                while let Some(key) = keyboard.pressed() {
                    if let Some(words) = keys.press(key) {
                        note(words);
                    }
                }
                keys.instruction()
            }
            Driver::StrokeKeys(keys, keyboard) => {
                while let Some(key) = keyboard.pressed() {
                    if let Some(words) = keys.press(key) {
                        note(words);
                    }
                }
                keys.instruction()
            }
            Driver::PoseKeys(keys, keyboard) => {
                while let Some(key) = keyboard.pressed() {
                    if let Some(words) = keys.press(key) {
                        note(words);
                    }
                }
                keys.instruction()
            }
            Driver::Show(show, _, keyboard) => {
                while let Some(key) = keyboard.as_ref().and_then(Keyboard::pressed) {
                    if let Some(words) = show.press(key) {
                        note(words);
                    }
                }
                let (instruction, said) = show.instruction(status);
                if let Some(words) = said {
                    note(words);
                }
                instruction
            }
            Driver::Gamepad(gamepad, pad) => {
                while let Some((event, at_s)) = pad.heard() {
                    if let Some(words) = gamepad.hear(event, at_s) {
                        note(words);
                    }
                }
                let (instruction, said) = gamepad.instruction(monotonic().as_secs_f64());
                if let Some(words) = said {
                    note(words);
                }
                instruction
            }
        }
    }
}

/// Worded to follow "driven by".
impl fmt::Display for Driver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Driver::Plan => f.write_str("its plan"),
            Driver::Script(_, path) => write!(f, "the script {}", path.display()),
            Driver::Keys(..) | Driver::StrokeKeys(..) | Driver::PoseKeys(..) => f.write_str("the keyboard"),
            Driver::Show(_, name, _) => f.write_str(name),
            Driver::Gamepad(_, pad) => write!(f, "the gamepad {}", pad.name()),
        }
    }
}

/// Loads a script for a robot with this `repertoire`.
pub(super) fn load_script(path: &Path, robot: &Robot, repertoire: &Repertoire) -> Result<Script> {
    let script = config::load_script(path, robot)?;
    check_script(&script, path, repertoire)?;
    Ok(script)
}

/// Refuses gaits the robot cannot do, and prints where its limits will hold the script back.
fn check_script(script: &Script, path: &Path, repertoire: &Repertoire) -> Result<(), BadInput> {
    for entry in &script.entries {
        let Order::Drive(command) = entry.order else { continue };
        let place = format!("{}:{}", path.display(), entry.line);
        let gait = match command.gait {
            GaitChoice::Gait(index) => repertoire.gaits.get(index).map_or("", |gait| gait.name.as_str()),
            GaitChoice::Auto | GaitChoice::Stand => "any gait",
        };
        if matches!(command.gait, GaitChoice::Gait(index) if !repertoire.can_do(index)) {
            return Err(BadInput(format!(
                "{place}: this robot cannot {gait}: its servos are too slow for it even on the spot; 'hippocamp \
                 check' shows which gaits it can do"
            )));
        }
        let speed_m_s = command.speed_m_s;
        let top_m_s = repertoire.top_m_s(command.gait, speed_m_s);
        if speed_m_s.abs() > top_m_s {
            say!("{place}: {speed_m_s} m/s is too fast for {gait}: held at {top_m_s:.3} m/s");
        }
        let (yaw, top) = (command.yaw_rate_rad_s.to_degrees(), repertoire.yaw_rate_max_rad_s.to_degrees());
        if yaw.abs() > top + 1e-9 {
            say!("{place}: {yaw:.1} degrees/s is too fast a turn: held at {top:.1} degrees/s");
        }
    }
    Ok(())
}
