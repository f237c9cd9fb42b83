//! The command line: parses what the user typed, and calls the command.

#[macro_use]
mod say;
mod calibrate;
mod campaign;
mod check;
mod check_physics;
mod confirm;
mod doctor;
mod drivers;
mod guard;
mod imu;
mod interrupt;
mod jog;
mod load;
mod mode;
mod monitor;
mod operator;
mod panics;
mod plot;
mod ports;
#[cfg(debug_assertions)]
mod provoke;
mod readable;
mod record;
mod refusal;
mod replay;
mod run;
mod scan;
mod servo;
mod setup;
mod sim;
mod status;
mod trial;
mod unit;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};
use refusal::{BadInput, Several};
use run::RunArguments;

use crate::config::UnitFile;
use crate::model::Robot;
use crate::output::Place;

/// Everything was done as asked.
const COMPLETED: u8 = 0;
/// Any result without a code of its own.
const FAILED: u8 = 1;
/// A file or an option is wrong; nothing was touched.
const BAD_INPUT: u8 = 2;
/// Safety stopped the robot.
const STOPPED_BY_SAFETY: u8 = 3;
/// A replay found nothing wrong, but could not judge the whole run.
const NOT_ALL_JUDGED: u8 = 4;
/// The robot fell, or could not rise, and lies limp.
const FALLEN: u8 = 5;
/// Exit code of a run that completed and was poor, with `--strict`.
const POOR: u8 = 6;

/// Drives servo-driven horses, octopus arms and human figures on real or simulated servo buses.
///
/// Exit codes: 0 completed, 2 bad input (nothing was touched), 3 stopped by safety, 4 not all of a recording could
/// be judged, 5 fallen or not able to rise, 6 completed but poor (with --strict), 1 anything else.
#[derive(Debug, Parser)]
#[command(version, after_help = "Example: hippocamp run config/horse.toml --gait trot --for 20")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Checks a robot file and prints what the robot can do.
    ///
    /// Prints joints and servos, how far each leg reaches (half-excursion E and neutral foot point), the top
    /// speed of each gait with what limits it, and how long one exchange takes on each bus.
    #[command(after_help = "Example: hippocamp check config/horse.toml")]
    Check {
        /// The robot file.
        robot: PathBuf,
        /// Write the robot as URDF to this file.
        #[arg(long, value_name = "FILE")]
        urdf: Option<PathBuf>,
        /// Run every gait, stroke or pose on the simulated body, and print what it reaches: takes some seconds.
        #[arg(long)]
        physics: bool,
    },
    /// Judges a recording again.
    ///
    /// Prints a summary, checks that ranges, rates and footholds were kept, and runs the controller again on the
    /// servos' recorded answers, which must give the same goals. Exit codes: 0 all of it agrees, 1 something
    /// differs, 2 the file is no recording, 4 nothing differs but cycles were dropped, or the file was cut short or
    /// damaged.
    #[command(
        after_help = "Examples:\n  hippocamp replay trot.mcap\n  hippocamp replay trot.mcap --html trot.html"
    )]
    Replay {
        /// A file of 'run --record'.
        recording: PathBuf,
        /// Write a page that plays the recording to this file; opens in any browser, without a network.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
    },
    /// Stands up, walks, stops.
    ///
    /// The robot starts limp wherever its joints are, stands up, walks for the time asked, slows down and takes
    /// the stop action of its file. Ctrl-C or SIGTERM makes it slow down and stop the same way; a second one
    /// skips the slowing down. With --script, --keys or --gamepad it does what they say instead, until they end it.
    /// Buses are simulated, unless the unit file or --port names the device of each.
    #[command(after_help = "Examples:\n  hippocamp run config/horse.toml --for 20\n  \
                            hippocamp run config/horse.toml --keys\n  \
                            hippocamp run config/horse.toml --script config/scripts/round.toml --virtual\n  \
                            hippocamp run config/horse-dynamixel.toml --gait trot --speed 0.2 --virtual --report trot.json")]
    Run(Box<RunArguments>),
    /// Plays a show of strokes on arms, on repeat, until you end it.
    ///
    /// The strokes are those of --script, or all of them. If the robot file says `tripped_servo = "freeze"`, a
    /// servo that trips on overload leaves its joint frozen, and is restarted while the arms are parked. Servos
    /// that get hot park the arms until they are cool. In a terminal p parks and continues, q ends, x is the
    /// emergency stop.
    #[command(after_help = "Examples:\n  hippocamp show config/tentacle.toml\n  \
                            hippocamp show config/tentacle.toml --script docs/strokes.toml --for 3600 --virtual")]
    Show(Box<RunArguments>),
    /// Turns one joint to an angle, slowly, and lets it go again.
    ///
    /// Only this joint gets torque, from its present angle; all others stay limp. An angle outside the joint's
    /// range is clamped to it. The joint holds its goal for a second; then the command prints what it measures.
    #[command(after_help = "Example: hippocamp jog config/horse.toml left_hind.hip -85 --virtual")]
    Jog(JogArguments),
    /// Looks for everything that makes real robots fail; changes nothing.
    ///
    /// Each line is ok, a warning or a fault, with what to do: the unit file, real-time permission, devices and
    /// their latency, echoes, every servo's model, firmware, id, rate, settings, limits, supply, temperature and
    /// alarms, the time of an exchange, current against plugs. Servos are only read. Exit codes: 0 no fault, 1 a
    /// fault, 2 bad input.
    #[command(after_help = "Examples:\n  hippocamp doctor config/horse.toml\n  \
                            hippocamp doctor config/horse.toml --port main=/dev/ttyACM0 --json")]
    Doctor(DoctorArguments),
    /// Sets up the inertial measurement unit of a built robot, or shows what it measures.
    #[command(subcommand)]
    Imu(ImuCommand),
    /// Measures where the joints of a built robot are and which way they turn, and saves it in its unit file.
    ///
    /// All servos go limp. You bring the robot into the drawn pose, then turn each joint by hand from end to end;
    /// then each joint turns a few degrees by itself, at a fifth of its torque, and you say whether it went the
    /// right way. The command reports an encoder whose seam is in a joint's way, and cures it if the servo allows
    /// that. It saves every step at once: end it at any moment, and the same command continues from there. See
    /// docs/calibration.md. Exit codes: 0 calibrated, 1 not complete, 2 bad input, 3 stopped by safety.
    #[command(after_help = "Examples:\n  hippocamp calibrate config/horse.toml\n  \
                            hippocamp calibrate config/horse.toml --again left_hind.hip")]
    Calibrate(CalibrateArguments),
    /// Shows what every servo reports, live; writes nothing to any.
    ///
    /// A table of every joint, redrawn in place on a terminal: goal, angle, speed, load (of stall torque), supply,
    /// temperature, alarms. Torque stays as it is. A servo that falls silent is shown as lost, and returns once it
    /// answers. The unit file need not be calibrated. Ctrl-C ends it.
    #[command(after_help = "Examples:\n  hippocamp monitor config/horse.toml --port main=/dev/ttyACM0\n  \
                            hippocamp monitor config/horse.toml --json --for 10")]
    Monitor(MonitorArguments),
    /// Draws what the robot would do under a motion script, without servos.
    ///
    /// Gaits, inverse kinematics and safety run at the robot's own rate on joints that follow their goals exactly;
    /// a robot without buses will do. Writes, as SVG: feet.svg (each foot against its root, and its reach),
    /// footfalls.svg (which foot is on the ground when), joints.svg (angles and ranges), poses.svg (stick figures),
    /// and with --thesis thesis.svg. Exit codes: 0 drawn, 2 bad input.
    #[command(after_help = "Example:\n  hippocamp plot config/thoroughbred.toml \
                            --script docs/walk-to-trot.toml --thesis --out pictures")]
    Plot(PlotArguments),
    /// Finds the servos on a serial line.
    ///
    /// Asks every id, at all rates of servos, in both protocols; prints the servos that answered, and notices ids
    /// that two servos have and adapters that echo. Writes nothing. Exit codes: 0 a servo answered, 1 none did.
    #[command(after_help = "Examples:\n  hippocamp scan /dev/ttyUSB0\n  \
                            hippocamp scan /dev/ttyUSB0 --protocol feetech --baud 1000000 --ids 1-20")]
    Scan(scan::ScanArguments),
    /// Sets up a robot's new servos, one after the other.
    ///
    /// Asks you to plug in the servo of each joint, finds it, saves a backup of it, gives it id, rate and modes,
    /// and reads all of it back. If you interrupt it, run it again: it continues from there. Leave servos that are
    /// set up plugged in. Writes the devices to the unit file. See docs/servos.md.
    #[command(after_help = "Example: hippocamp setup config/horse.toml --port main=/dev/ttyUSB0")]
    Setup(setup::SetupArguments),
    /// Reads and sets a single servo.
    ///
    /// Finds its rate and protocol unless you give them. Every command says what it is about to write and asks
    /// first, unless you add --yes. See docs/servos.md.
    #[command(subcommand)]
    Servo(servo::ServoCommand),
    /// Pushes the simulated robot over and over, and says how it falls.
    ///
    /// Every trial is a run of its own with a push, a gait, a speed and a friction of its own, on all processors.
    /// Each runs with the reflex off; if a fall was certain then, it runs again with the reflex, and as a passive
    /// drop. The command prints shares with their 95 % intervals (Wilson) and means with theirs (by resampling).
    /// The same seed gives the same trials. See docs/falls.md.
    ///
    /// With --faults random it runs robots, with and without physics, while servos, buses, supply and host fail at
    /// random, and checks the simulated servos' own registers and shafts: goals beyond range or rate, snaps, torque
    /// after the end, runs that do not end, reports that are untrue. Each finding is reduced to its smallest form
    /// and saved in a folder. Exit code 1 if something was found. See docs/faults.md.
    #[command(after_help = "Examples:\n  hippocamp try config/horse.toml --runs 300 --seed 2\n  \
                            hippocamp try config/horse.toml config/tentacle.toml --faults random --hours 2")]
    Try(trial::TryArguments),
    /// Puts the robot's servos behind pseudo-terminals, for any program that drives servos.
    ///
    /// Every bus of the robot file is a serial device under a name that stays, and its servos answer there in real
    /// time, byte for byte as real ones, at the rate the program that opens it has set. Commands typed on standard
    /// input plug servos in, pull them out and turn them by hand ('help' lists them). Runs until Ctrl-C, SIGTERM or
    /// 'quit'; the end of standard input does not end it. See docs/simulated-buses.md.
    #[command(after_help = "Examples:\n  hippocamp sim config/horse.toml\n  \
                            hippocamp sim config/horse.toml --factory-new --link ports --reversed left_hind.hip")]
    Sim(SimArguments),
    /// Takes the torque off if the controller that started it dies. For internal use.
    #[command(hide = true)]
    Guard {
        /// The robot file.
        robot: PathBuf,
        /// The device of each bus.
        #[arg(long = "port", value_name = "BUS=PATH")]
        ports: Vec<ports::PortOption>,
    },
}

impl Command {
    /// The files in its arguments, the main one first.
    fn files(&self) -> Vec<&Path> {
        let (about, others): (_, Vec<&Option<PathBuf>>) = match self {
            Command::Check { robot, urdf, .. } => (robot, vec![urdf]),
            Command::Guard { robot, .. } => (robot, vec![]),
            Command::Replay { recording, html } => (recording, vec![html]),
            Command::Run(of) | Command::Show(of) => {
                let outputs = [&of.report, &of.record, &of.html];
                let inputs = [&of.unit.unit, &of.driver.script, &of.faults];
                (&of.robot, [inputs, outputs].concat())
            }
            Command::Jog(of) => (&of.robot, vec![&of.unit.unit]),
            Command::Doctor(of) => (&of.robot, vec![&of.unit]),
            Command::Imu(ImuCommand::Setup(of) | ImuCommand::Show { options: of, .. }) => {
                (&of.robot, vec![&of.unit])
            }
            Command::Calibrate(of) => (&of.robot, vec![&of.unit]),
            Command::Monitor(of) => (&of.robot, vec![&of.unit.unit, &of.faults]),
            Command::Plot(of) => return vec![&of.robot, &of.script],
            Command::Setup(of) => (&of.robot, vec![&of.unit]),
            Command::Try(of) => {
                let options = [&of.faults, &of.campaign.episode, &of.picture, &of.kept];
                let named = options.into_iter().flatten().filter(|path| **path != Path::new("random"));
                return of.robots.iter().chain(named).map(PathBuf::as_path).collect();
            }
            Command::Sim(of) => (&of.robot, vec![&of.unit, &of.faults]),
            Command::Scan(_) | Command::Servo(_) => return Vec::new(),
        };
        std::iter::once(about).chain(others.into_iter().flatten()).map(PathBuf::as_path).collect()
    }
}

/// Options that name the built robot and its devices, or ask for a simulated one.
#[derive(Debug, clap::Args)]
struct UnitArguments {
    /// The unit file of this robot [default: the robot file's name with .unit.toml for .toml, if there is one].
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    /// Serial device of a bus, instead of the unit file's (paths in /dev/serial/by-id stay the same).
    #[arg(long = "port", value_name = "BUS=PATH")]
    ports: Vec<ports::PortOption>,
    /// Run on simulated buses, even where the unit file names devices.
    #[arg(long, conflicts_with = "ports")]
    simulate: bool,
    /// Run on simulated buses and a virtual clock, as fast as it can.
    #[arg(long = "virtual", conflicts_with = "ports")]
    is_virtual: bool,
    /// Let the joints of the simulated robot turn freely, even where its file has a [physics] section.
    #[arg(long, conflicts_with = "ports")]
    no_physics: bool,
    /// On hardware: keep the loop to this processor, counted from 0.
    #[arg(long, value_name = "N")]
    processor: Option<usize>,
}

impl UnitArguments {
    /// Lets simulated joints turn freely if the user asked for it, or if the file has no body.
    fn take_physics_off(&self, robot: &mut Robot, unit: Option<&UnitFile>) {
        let is_simulated = ports::is_simulated(self, unit).unwrap_or_default();
        if is_simulated && (self.no_physics || robot.physics.is_none()) {
            (robot.physics, robot.bears_weight) = (None, false);
        }
    }
}

/// Options of `jog`.
#[derive(Debug, clap::Args)]
struct JogArguments {
    /// The robot file.
    robot: PathBuf,
    /// The joint's full name, such as left_hind.hip.
    joint: String,
    /// The angle, in degrees.
    #[arg(value_name = "DEG", allow_negative_numbers = true)]
    angle_deg: f64,
    #[command(flatten)]
    unit: UnitArguments,
}

/// Options of `doctor`.
#[derive(Debug, clap::Args)]
struct DoctorArguments {
    /// The robot file.
    robot: PathBuf,
    /// The unit file [default: the robot file's name with .unit.toml for .toml, if there is one].
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    /// Serial device of a bus, instead of the unit file's.
    #[arg(long = "port", value_name = "BUS=PATH")]
    ports: Vec<ports::PortOption>,
    /// Print all of it as JSON.
    #[arg(long = "json")]
    is_json: bool,
}

/// What to do with the inertial measurement unit.
#[derive(Debug, Subcommand)]
enum ImuCommand {
    /// Finds the unit, sets it up, and finds how it is mounted while you tilt the robot.
    ///
    /// Tries all its line rates; sets its output, its rate and its line rate as the robot file says, and saves
    /// these settings in the unit; then asks you to hold the robot level, nose down, level and left side down.
    /// Writes the result into the unit file. Touches no servo: hold the robot limp, or with its power off.
    #[command(after_help = "Example: hippocamp imu setup config/horse.toml --port imu=/dev/ttyUSB1")]
    Setup(ImuArguments),
    /// Shows roll, pitch, yaw and turn rates of the body, and how old they are, five times a second.
    Show {
        #[command(flatten)]
        options: ImuArguments,
        /// How long, in s [default: until Ctrl-C].
        #[arg(long = "for", value_name = "S")]
        for_s: Option<f64>,
    },
}

/// Options of `imu`.
#[derive(Debug, clap::Args)]
struct ImuArguments {
    /// The robot file.
    robot: PathBuf,
    /// The unit file [default: the robot file's name with .unit.toml for .toml].
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    /// Serial device of the unit, as imu=PATH, instead of the unit file's.
    #[arg(long = "port", value_name = "imu=PATH")]
    ports: Vec<ports::PortOption>,
}

/// Options of `calibrate`.
#[derive(Debug, clap::Args)]
struct CalibrateArguments {
    /// The robot file.
    robot: PathBuf,
    /// The unit file to write [default: the robot file's name with .unit.toml for .toml].
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
    /// Serial device of a bus, instead of the unit file's; kept there if it has none.
    #[arg(long = "port", value_name = "BUS=PATH")]
    ports: Vec<ports::PortOption>,
    /// Forget the calibration of these joints, or of all if none is named, and calibrate them again.
    #[arg(long, value_name = "JOINT", num_args = 0..)]
    again: Option<Vec<String>>,
    /// Ask nothing: measure the pose once the robot is still, write cures into the servos, and take a joint's
    /// direction from its sweep. For scripts.
    #[arg(long = "yes")]
    is_unattended: bool,
}

/// Options of `monitor`.
#[derive(Debug, clap::Args)]
struct MonitorArguments {
    /// The robot file.
    robot: PathBuf,
    /// Print a line of JSON each time instead of a table.
    #[arg(long = "json")]
    is_json: bool,
    /// End after this many seconds [default: at Ctrl-C].
    #[arg(long = "for", value_name = "SECONDS", allow_negative_numbers = true)]
    for_s: Option<f64>,
    /// Time between two tables or lines, in seconds [default: 0.2 on a terminal, 1 elsewhere].
    #[arg(long = "every", value_name = "SECONDS", allow_negative_numbers = true)]
    every_s: Option<f64>,
    /// Faults of the simulated buses, and their times (TOML; see docs/faults.md).
    #[arg(long, value_name = "FILE", conflicts_with = "ports")]
    faults: Option<PathBuf>,
    #[command(flatten)]
    unit: UnitArguments,
}

/// Options of `plot`.
#[derive(Debug, clap::Args)]
struct PlotArguments {
    /// The robot file.
    robot: PathBuf,
    /// The motion script (TOML; see docs/scripts.md).
    #[arg(long, value_name = "FILE")]
    script: PathBuf,
    /// The directory to write to; created if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Where the pictures begin, in seconds since the robot stood [default: 0].
    #[arg(long = "from", value_name = "SECONDS", allow_negative_numbers = true)]
    from_s: Option<f64>,
    /// Where they end [default: the end of the script].
    #[arg(long = "to", value_name = "SECONDS", allow_negative_numbers = true)]
    to_s: Option<f64>,
    /// Draw the first change of gait beside the same change by the rule of the thesis (Takizawa 2005, 3.3).
    #[arg(long)]
    thesis: bool,
}

/// Options of `sim`.
#[derive(Debug, clap::Args)]
struct SimArguments {
    /// The robot file.
    robot: PathBuf,
    /// The folder for the links to the terminals, one for each bus, by its name; created if it does not exist [default: one
    /// named after the robot file in the user's folder for running programs].
    #[arg(long, value_name = "DIR")]
    link: Option<PathBuf>,
    /// Faults of the buses, and their times (TOML; see docs/faults.md).
    #[arg(long, value_name = "FILE")]
    faults: Option<PathBuf>,
    /// New servos: all with id 1 and every register as shipped, horns at random angles, none plugged in.
    #[arg(long, conflicts_with = "unit")]
    factory_new: bool,
    /// With --factory-new, horns are put on within this many degrees of where the robot file has them, as a person who
    /// follows docs/wiring.md does; without it, at any angle.
    #[arg(long, value_name = "DEG", requires = "factory_new", value_parser = clap::value_parser!(u16).range(0..=180))]
    horns_within_deg: Option<u16>,
    /// Joints whose servo is mounted the other way round than the robot file says.
    #[arg(long, value_name = "JOINT", value_delimiter = ',')]
    reversed: Vec<String>,
    /// Seed for the start angles of the limp joints, the mounting of the horns, and everything else that is random.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = seed)]
    seed: u64,
    /// Let the joints turn freely, even where the robot file has a [physics] section.
    #[arg(long)]
    no_physics: bool,
    /// The unit file of the robot that is simulated [default: the robot file's name with .unit.toml for .toml, if
    /// there is one].
    #[arg(long, value_name = "FILE")]
    unit: Option<PathBuf>,
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a whole number, 0 or more, at most {}", u64::MAX))
}

/// Writes all of `text` to its place, or nothing.
fn write_whole(place: &Place, text: &str) -> anyhow::Result<()> {
    place.write(text.as_bytes()).with_context(|| format!("{} could not be written", place.path().display()))
}

/// Parses the command line, carries out the command, and returns the exit code.
pub fn main() -> ExitCode {
    let arguments = match refusal::parse() {
        Ok(arguments) => arguments,
        Err(code) => return ExitCode::from(code),
    };
    let result = match &arguments.command {
        Command::Check { robot, urdf, physics } => {
            check::check(robot, urdf.as_deref(), *physics).map(|()| COMPLETED)
        }
        Command::Replay { recording, html } => replay::replay(recording, html.as_deref()),
        Command::Run(options) => run::run(options, mode::RunMode::Run),
        Command::Show(options) => run::run(options, mode::RunMode::Show),
        Command::Jog(options) => jog::jog(options),
        Command::Doctor(options) => doctor::doctor(options),
        Command::Imu(command) => imu::imu(command),
        Command::Calibrate(options) => calibrate::calibrate(options),
        Command::Monitor(options) => monitor::monitor(options),
        Command::Plot(options) => plot::plot(options).map(|()| COMPLETED),
        Command::Scan(options) => scan::scan(options),
        Command::Try(options) => trial::try_it(options),
        Command::Setup(options) => setup::setup(options).map(|()| COMPLETED),
        Command::Servo(command) => servo::servo(command).map(|()| COMPLETED),
        Command::Sim(options) => sim::sim(options).map(|()| COMPLETED),
        Command::Guard { robot, ports } => guard::guard(robot, ports).map(|()| COMPLETED),
    };
    let code = result.unwrap_or_else(|error| refusal::tell(&error, &arguments.command.files()));
    ExitCode::from(say::end(code))
}
