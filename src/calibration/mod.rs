//! Calibration: takes a robot whose servos answer, and finds where its joints are and which way they turn.
//!
//! In: a robot file, the known calibration of the built robot, a person who moves it by hand. Out: its [`Unit`],
//! saved after every step, so that an interrupted calibration can continue from there. Three steps, all limp except
//! the last: all joints in the marked pose; each joint by hand from end to end; each joint a little by its own
//! motor.

mod bench;
mod by_hand;
mod figure;
mod imu;
mod pose;
mod powered;
mod sweep;
mod zero;

use std::io;
use std::time::Duration;

use toml::value::Date;

use crate::bus::{Buses, Ports, StartError, TransactionError};
use crate::config::Unit;
use crate::model::Robot;
use crate::run::Operator;
use bench::Bench;
pub use figure::figure;
pub use imu::{FoundImu, ImuSetupError, set_up as set_up_imu};
pub use pose::{marked_pose_rad, ways};

/// How often to check for the person's input while no joint is watched.
const LISTEN_EVERY: Duration = Duration::from_millis(20);

/// The person who moves the robot by hand.
pub trait Person {
    /// Shows the person a line of words.
    fn hear(&mut self, words: &str);

    /// The next line of the person's input, if any. Must not block.
    fn answer(&mut self) -> Option<String>;

    /// True if the person wants to stop.
    fn wants_to_stop(&mut self) -> bool;

    /// Saves what is known so far, completely or not at all.
    ///
    /// # Errors
    /// The reason why it could not.
    fn keep(&mut self, unit: &Unit) -> io::Result<()>;
}

/// Why a calibration is not complete. Saved results stay valid: the next run continues from there.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// The servos do not match the robot file.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A servo did not accept a value or did not answer.
    #[error(transparent)]
    Transaction(#[from] TransactionError),
    /// A servo fell silent.
    #[error("servo {id} of joint {joint} on bus {bus} is not heard any more: check its plug and its power")]
    Lost {
        /// Name of the joint.
        joint: String,
        /// Name of the bus.
        bus: String,
        /// The servo's id, in words.
        id: String,
    },
    /// A servo did not make its present position its middle count as asked.
    #[error(
        "{joint}: its servo should have taken its present position as count {middle:.0}, but reports {found:.0}: \
         hold it still; if that does not help, update its firmware"
    )]
    NotCentred {
        /// Name of the joint.
        joint: String,
        /// Count that it reports.
        found: f64,
        /// Count that it should report.
        middle: f64,
    },
    /// Servos whose seam lies in the joint's range.
    #[error(
        "the encoder's seam (where its highest count becomes 0) lies in the range of {}: take the horn off, turn the \
         shaft by hand until 'hippocamp monitor' or 'hippocamp servo read' shows it near its middle count (2048), and \
         put the horn on with the joint in the middle of its range", joints.join(", ")
    )]
    Mount {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// Joints that did not turn.
    #[error("did not turn: {}: check what blocks them, and that their horns are tight", joints.join(", "))]
    Stuck {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// A joint that hangs far outside its range: its motor would turn it a long way.
    #[error("{joint} stands far outside its range: turn it into its range by hand, and run this again")]
    OutsideRange {
        /// Name of the joint.
        joint: String,
    },
    /// Safety stopped a joint.
    #[error("stopped: {reason}")]
    Stopped {
        /// Why.
        reason: String,
    },
    /// The person stopped.
    #[error("ended before it was complete")]
    Left,
    /// The results could not be saved.
    #[error("the unit file could not be written: {0}")]
    Keep(#[from] io::Error),
}

impl CalibrateError {
    fn lost(robot: &Robot, joint: usize) -> CalibrateError {
        let servo = robot.joints[joint].servo;
        CalibrateError::Lost {
            joint: robot.joints[joint].name.clone(),
            bus: servo.map_or_else(String::new, |servo| robot.buses[servo.bus].name.clone()),
            id: servo.map_or_else(String::new, |servo| servo.id.to_string()),
        }
    }
}

/// How a calibration ended.
#[derive(Debug)]
pub struct CalibrationEnd {
    /// Ok if it is complete, else the reason why not.
    pub result: Result<(), CalibrateError>,
    /// True if no servo can still have torque: all have confirmed the end of the last turn.
    pub is_end_heard: bool,
}

/// Continues the calibration of the robot of the robot file `robot`, of which `unit` is known, and seals the unit
/// with `day` when all is done. If it `is_unattended`, it asks no one: it measures the pose as soon as the robot is
/// still, writes cures, and takes a joint's direction from its sweep. `operator` may stop a powered turn.
pub fn calibrate<P: Ports>(
    robot: &Robot,
    unit: &mut Unit,
    ports: P,
    person: &mut impl Person,
    operator: &mut impl Operator,
    is_unattended: bool,
    day: Date,
) -> CalibrationEnd {
    let by_hand = || -> Result<Buses<P>, CalibrateError> {
        let mut buses = Buses::new(robot, ports);
        person.hear("All servos go limp now: put the robot on its stand, or hold it.");
        if !is_unattended {
            listen(&mut buses, person, "Press Enter.")?;
        }
        buses.prepare(robot)?;
        buses.notes().iter().for_each(|note| person.hear(note));
        let mut bench = Bench::new(robot, buses, person);
        zero::measure(&mut bench, unit, is_unattended)?;
        by_hand::sweep_all(&mut bench, unit, is_unattended)?;
        Ok(bench.buses)
    };
    let buses = match by_hand() {
        Ok(buses) => buses,
        Err(error) => return CalibrationEnd { result: Err(error), is_end_heard: true },
    };
    let (result, is_end_heard) = powered::check_all(robot, buses, unit, person, operator, is_unattended);
    let sealed = result.and_then(|()| {
        unit.seal(robot, day);
        Ok(person.keep(unit)?)
    });
    CalibrationEnd { result: sealed, is_end_heard }
}

/// Waits for a line from the person, without talking to any servo.
fn listen<P: Ports>(
    buses: &mut Buses<P>,
    person: &mut impl Person,
    words: &str,
) -> Result<(), CalibrateError> {
    person.hear(words);
    loop {
        if person.wants_to_stop() {
            return Err(CalibrateError::Left);
        }
        if person.answer().is_some() {
            return Ok(());
        }
        let later = buses.ports_mut().now() + LISTEN_EVERY;
        buses.ports_mut().wait_until(later);
    }
}
