//! The line of the inertial measurement unit.

use super::World;
use crate::error::{BuildError, Unplugged};
use crate::imu::{Imu, ImuConfig};

impl World {
    /// Fits a unit into the trunk, at most one; its errors come from `seed`. The script's faults of the inertial
    /// measurement unit apply to it.
    ///
    /// # Errors
    /// [`BuildError::BadImu`] names the first number that is impossible.
    pub fn fit_imu(&mut self, config: &ImuConfig, seed: u64) -> Result<(), BuildError> {
        let faults = std::mem::take(&mut self.imu_faults);
        self.imu = Some(Box::new(Imu::new(config, faults, self.now_ns, seed)?));
        Ok(())
    }

    /// True if there is a unit.
    pub fn has_imu(&self) -> bool {
        self.imu.is_some()
    }

    /// Hands bytes to the unit's adapter.
    ///
    /// # Errors
    /// [`Unplugged`] while a script has the adapter out, or when there is no unit.
    pub fn imu_send(&mut self, bytes: &[u8]) -> Result<(), Unplugged> {
        self.imu.as_mut().ok_or(Unplugged)?.send(self.now_ns, bytes)
    }

    /// Takes the unit's bytes that have reached the host by now; returns how many, 0 when there are none.
    ///
    /// # Errors
    /// As [`World::imu_send`].
    pub fn imu_receive(&mut self, into: &mut [u8]) -> Result<usize, Unplugged> {
        self.imu.as_mut().ok_or(Unplugged)?.receive(self.now_ns, into)
    }

    /// True if a script has the unit's adapter out now, or there is no unit.
    pub fn is_imu_unplugged(&self) -> bool {
        self.imu.as_ref().is_none_or(|imu| imu.is_unplugged(self.now_ns))
    }

    /// Sets the rate at which the unit's host talks and listens from now on, bit/s. Does nothing if there is no
    /// unit.
    pub fn set_imu_host_baud(&mut self, baud: u32) {
        if let Some(imu) = &mut self.imu {
            imu.set_host_baud(baud);
        }
    }

    /// Hands turn the trunk of a world without a body, which only the unit feels, to this roll, pitch and yaw, rad.
    /// Does nothing if there is no unit, or a number is not finite.
    pub fn tilt_by_hand(&mut self, roll_pitch_yaw_rad: [f64; 3]) {
        if let Some(imu) =
            self.imu.as_mut().filter(|_| roll_pitch_yaw_rad.iter().all(|angle| angle.is_finite()))
        {
            imu.tilt(roll_pitch_yaw_rad);
        }
    }

    /// True while hands are turning it.
    pub fn is_tilting(&self) -> bool {
        self.imu.as_ref().is_some_and(|imu| imu.is_tilting())
    }

    /// Switches the unit's power off and on: it loses settings that were not saved. Does nothing if there is none.
    pub fn restart_imu(&mut self) {
        if let Some(imu) = &mut self.imu {
            imu.restart(self.now_ns);
        }
    }

    /// Resets the unit to factory settings: 10 Hz at 9600 bit/s. Does nothing if there is none.
    pub fn reset_imu_to_factory(&mut self) {
        if let Some(imu) = &mut self.imu {
            imu.reset_to_factory(self.now_ns);
        }
    }
}
