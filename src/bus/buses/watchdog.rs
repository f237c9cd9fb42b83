//! The servos' own bus watchdog: if this program dies, they stop by themselves.
//!
//! Armed before a run, while there is no torque and so nothing is watched yet; every exchange is a sign of
//! life. A servo that has heard nothing for too long, because the loop stalled or its plug was out, has stopped
//! and takes no goals; the exchanges after it is heard again clear its watchdog and set it again
//! ([`super::settings_resend`]). Servos without such a watchdog (Feetech) are left alone.
//!
//! Source: ROBOTIS e-manual, X-series, Bus Watchdog (98).

use std::time::Duration;

use super::{Buses, StartError};
use crate::bus::port::Ports;
use crate::model::Robot;

/// The register's unit.
pub(super) const UNIT: Duration = Duration::from_millis(20);
/// The register's largest value.
const UNITS_MAX: u8 = 127;
/// Shortest time, so that one hiccup of the machine does not stop the robot.
const SHORTEST: Duration = Duration::from_millis(200);
/// Shortest time in cycles of the loop.
const CYCLES: f64 = 10.0;
/// Number of times that an unanswered write is sent, in case one is lost.
const TRIES: u8 = 3;

/// How long the servos of `robot` may hear nothing before they stop by themselves: ten cycles of the loop, at least
/// 200 ms and at most 2.54 s, the longest possible time.
pub fn watchdog_time(robot: &Robot) -> Duration {
    UNIT * u32::from(units(robot))
}

fn units(robot: &Robot) -> u8 {
    let wanted_s = (CYCLES * robot.period_s()).max(SHORTEST.as_secs_f64());
    let wanted = (wanted_s / UNIT.as_secs_f64() - 1e-9).ceil();
    // The loop compares within the register's own range.
    (1..=UNITS_MAX).find(|units| f64::from(*units) >= wanted).unwrap_or(UNITS_MAX)
}

impl<P: Ports> Buses<P> {
    /// Sets the watchdog of every servo that has one to [`watchdog_time`]. Call it while torque is off,
    /// before a run; from torque on, exchanges must come at least that often.
    ///
    /// # Errors
    /// [`StartError::Transaction`] if a servo does not take it.
    pub fn arm_watchdogs(&mut self, robot: &Robot) -> Result<(), StartError> {
        let units = units(robot);
        for (index, joint) in robot.joints.iter().enumerate() {
            let Some(servo) = &joint.servo else { continue };
            let Some(register) = servo.model.registers.bus_watchdog else { continue };
            self.write(index, register, i64::from(units))?;
        }
        let now = self.ports.now();
        for line in &mut self.lines {
            if line.client.registers().bus_watchdog.is_some() {
                line.settings_resend.arm_watchdog(units, now);
            }
        }
        Ok(())
    }

    /// Switches the watchdogs off after a run, when nothing talks to the servos any more. No servo answers, so a
    /// missing line is no error.
    pub fn disarm_watchdogs(&mut self) {
        for _ in 0..TRIES {
            let mut sent_by = self.ports.now();
            for line in self.lines.iter_mut().filter(|line| line.settings_resend.has_watchdog()) {
                let bytes = line.client.begin_watchdog(0);
                if self.ports.send(line.bus, bytes).is_ok() {
                    sent_by = sent_by.max(self.ports.now() + line.client.reply_deadline());
                }
            }
            self.ports.wait_until(sent_by);
        }
        for line in &mut self.lines {
            line.settings_resend.disarm_watchdog();
        }
    }
}
