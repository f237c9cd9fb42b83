//! Makes a shaft's present position the middle of its servo's counts, with the servo's own offset.

use std::time::Duration;

use super::error::{Address, ServiceError};
use super::servo::Servo;
use crate::bus::table::{Offset, RegisterInfo, Value};

/// Time within which a servo measures again.
const SETTLE: Duration = Duration::from_millis(50);
/// A shaft this near to the middle stands there, counts: a hand does not hold it more still.
const UNREST: i64 = 20;

/// The change to write.
#[derive(Debug, Clone, PartialEq)]
pub struct CentrePlan {
    /// Present position of the shaft.
    pub present: Value,
    /// The present offset of the servo.
    pub held: Value,
    /// The new offset.
    pub wanted: Value,
    register: RegisterInfo,
}

/// Why a servo cannot be centred.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CentreError {
    /// It has no offset register.
    #[error(
        "{0} has no offset: turn its horn on the spline until the middle of its travel is where you want it"
    )]
    NoOffset(Address),
    /// The offset would be too large.
    #[error(
        "{address} would need an offset of {needed} counts and accepts {largest}: take its horn off, turn the \
         shaft by about {} degrees, and put the horn on again", (needed.unsigned_abs() * 360 / 4096)
    )]
    TooFar {
        /// Address of the servo.
        address: Address,
        /// Offset needed, counts.
        needed: i64,
        /// Largest offset, counts.
        largest: i64,
    },
    /// It does not stand at the middle afterwards.
    #[error(
        "{address} accepted the offset, but its shaft reads {found}, and {middle} was promised{}", cure(*found, *middle, *turn)
    )]
    NotThere {
        /// Address of the servo.
        address: Address,
        /// Position that it reads now, counts.
        found: i64,
        /// The middle count.
        middle: i64,
        /// Counts in a turn.
        turn: i64,
    },
    /// A request to it failed.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// The change that puts the shaft of `servo` at the middle count. Writes nothing.
///
/// # Errors
/// If its offset cannot achieve that.
pub fn plan(servo: &mut Servo<'_>) -> Result<CentrePlan, CentreError> {
    let address = servo.address();
    let series = servo.identity().series;
    let (Ok(register), Some(Offset { sign, largest })) = (servo.register("homing_offset"), series.offset)
    else {
        return Err(CentreError::NoOffset(address));
    };
    let (present, held) = (servo.read("present_position")?, servo.read("homing_offset")?);
    let turn = counts_per_turn(servo);
    let encoder = present.raw - sign * held.raw;
    // The nearest solution: whole turns do not matter.
    let needed = (sign * (turn / 2 - encoder) + turn / 2).rem_euclid(turn) - turn / 2;
    if needed.abs() > largest {
        return Err(CentreError::TooFar { address, needed, largest });
    }
    let wanted = servo.identity().value(&register, needed);
    Ok(CentrePlan { present, held, wanted, register })
}

/// Writes the offset, and reads the new position of the shaft back.
///
/// # Errors
/// If the servo does not accept the offset, or does not stand at the middle count then.
pub(crate) fn carry_out(servo: &mut Servo<'_>, plan: &CentrePlan) -> Result<Value, CentreError> {
    servo.write_raw(&plan.register, plan.wanted.raw)?;
    servo.pause(SETTLE);
    let now = servo.read("present_position")?;
    let turn = counts_per_turn(servo);
    let (found, middle) = (now.raw, turn / 2);
    if (found - middle).abs() > UNREST {
        return Err(CentreError::NotThere { address: servo.address(), found, middle, turn });
    }
    Ok(now)
}

#[allow(clippy::cast_possible_truncation, reason = "a few thousand")]
fn counts_per_turn(servo: &Servo<'_>) -> i64 {
    servo.identity().series.counts_per_turn.round() as i64
}

/// The cure for a shaft that reads `found` in the place of `middle`.
fn cure(found: i64, middle: i64, turn: i64) -> &'static str {
    let off = (found - middle).rem_euclid(turn);
    if off.min(turn - off) <= UNREST {
        ": it counts whole turns; take its power off and on again, so that it counts from the present one, and let 'hippocamp \
         setup' set its phase register, after which it counts one turn only"
    } else {
        ": hold the shaft still and try again"
    }
}
