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
use crate::kinds::horse::Gamepad;
use crate::kinds::tentacle::Show;
use crate::kinds::{KeyDriver, Kind};
use crate::model::Robot;
use crate::motion::Order;
use crate::operator::{Instruction, Playback, Script};
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
    Keys(Box<dyn KeyDriver>, Keyboard),
    Gamepad(Gamepad, Pad),
    /// A show of strokes and its name; keys park and end it, if there is a terminal.
    Show(Box<Show>, String, Option<Keyboard>),
}

impl Driver {
    /// The driver that `options` name, for a robot of this `kind`: reads its script, or listens to its terminal or
    /// gamepad from now on.
    ///
    /// # Errors
    /// Bad input: a bad script, a gait in it that the robot cannot do, no terminal, no gamepad.
    pub(super) fn start(options: &DriverArguments, robot: &Robot, kind: &dyn Kind) -> Result<Driver> {
        if let Some(wanted) = &options.gamepad {
            let repertoire = kind.repertoire().map_err(BadInput::from)?;
            let silence_s = options.gamepad_silence;
            if !(silence_s.is_finite() && silence_s >= SILENCE_SMALLEST_S) {
                let said =
                    format!("--gamepad-silence {silence_s}: expected seconds, {SILENCE_SMALLEST_S} or more");
                return Err(BadInput(said).into());
            }
            return Ok(Driver::Gamepad(Gamepad::new(repertoire, silence_s), Pad::start(wanted.clone())?));
        }
        if let Some(path) = &options.script {
            let script = load_script(path, robot, kind)?;
            return Ok(Driver::Script(Playback::new(script), path.clone()));
        }
        if options.keys {
            return Ok(Driver::Keys(kind.keys(), Keyboard::start()?));
        }
        Ok(Driver::Plan)
    }

    /// A show of `script` called `name`; keys park and end it, if there is a terminal.
    ///
    /// # Errors
    /// If the terminal's settings cannot be read.
    pub(super) fn show(robot: &Robot, script: Script, name: String) -> Result<Driver> {
        let keyboard = Keyboard::is_there().then(Keyboard::start).transpose()?;
        Ok(Driver::Show(Box::new(Show::new(robot, script)), name, keyboard))
    }

    /// Instructions for the person who drives, a line each.
    pub(super) fn help(&self) -> Vec<String> {
        match self {
            Driver::Plan | Driver::Script(..) | Driver::Show(_, _, None) => Vec::new(),
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
            Driver::Keys(..) => f.write_str("the keyboard"),
            Driver::Show(_, name, _) => f.write_str(name),
            Driver::Gamepad(_, pad) => write!(f, "the gamepad {}", pad.name()),
        }
    }
}

/// Loads a script for `robot`, which is of this `kind`, and prints where its limits will hold the script back.
pub(super) fn load_script(path: &Path, robot: &Robot, kind: &dyn Kind) -> Result<Script> {
    let script = config::load_script(path, robot)?;
    let remarks = kind.check_script(&script, &path.display().to_string()).map_err(BadInput::from)?;
    remarks.iter().for_each(|remark| say!("{remark}"));
    Ok(script)
}
