//! Ports on simulated buses: on a virtual clock as fast as possible, or paced by the real clock.

use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use hw_sim::World;

use super::port::{PortError, Ports};
use crate::platform::{Meter, Usage};
use crate::signals::TrueBody;
use crate::units::Time;

/// Ports of a simulated world.
pub struct SimPorts {
    world: World,
    /// When the run began on the real clock; `None` on a virtual one.
    real_start: Option<Instant>,
    meter: Meter,
}

impl std::fmt::Debug for SimPorts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SimPorts").field("real_start", &self.real_start).finish_non_exhaustive()
    }
}

impl SimPorts {
    /// Ports of `world` on its own clock: neither waiting nor computing takes time.
    pub fn on_virtual_clock(world: World) -> SimPorts {
        SimPorts { world, real_start: None, meter: Meter::default() }
    }

    /// Ports of `world` paced by the real clock, from now on.
    #[allow(clippy::disallowed_methods, reason = "these ports own the clock")]
    pub fn on_real_clock(world: World) -> SimPorts {
        SimPorts { world, real_start: Some(Instant::now()), meter: Meter::default() }
    }

    /// Ports of `world` on its own clock or paced by the real one.
    pub fn of(world: World, is_virtual: bool) -> SimPorts {
        if is_virtual { SimPorts::on_virtual_clock(world) } else { SimPorts::on_real_clock(world) }
    }

    /// The simulated world, to inspect.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The simulated world, to change.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// Advances the world to the present.
    fn catch_up(&mut self) {
        let now = self.now();
        self.world.advance_to(now.0);
    }

    /// Waits until the real clock reaches the world's time.
    #[allow(clippy::disallowed_methods, reason = "these ports own the only wait")]
    fn sleep_to_world(&self) {
        if let Some(start) = self.real_start {
            let ahead = Duration::from_nanos(self.world.now_ns()).saturating_sub(start.elapsed());
            if !ahead.is_zero() {
                std::thread::sleep(ahead);
            }
        }
    }
}

impl Ports for SimPorts {
    fn now(&mut self) -> Time {
        let real_ns =
            self.real_start.map_or(0, |start| u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX));
        Time(self.world.now_ns().max(real_ns))
    }

    fn usage(&mut self) -> Usage {
        self.real_start.map_or(Usage::default(), |_| self.meter.usage())
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        let mut scratch = [0; 256];
        while self.receive(bus, &mut scratch)? > 0 {}
        Ok(())
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.catch_up();
        self.world.host_send(bus, bytes).map_err(|_| PortError::Gone { bus })
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.catch_up();
        self.world.host_receive(bus, into).map_err(|_| PortError::Gone { bus })
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.catch_up();
        if !self.world.has_imu() {
            return Ok(0);
        }
        self.world.imu_receive(into).map_err(|_| PortError::ImuGone)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.catch_up();
        self.world.advance_to_input(deadline.0);
        self.sleep_to_world();
    }

    fn true_body(&self) -> Option<TrueBody> {
        self.world.body().map(|state| TrueBody {
            position_m: DVec3::from_array(state.position_m),
            orientation: DQuat::from_array(state.rotation),
            velocity_m_s: DVec3::from_array(state.velocity_m_s),
            height_m: state.height_m,
            trunk_contact_n: state.trunk_contact_n,
            is_fallen: state.is_fallen(),
            is_unstable: !state.is_finite,
        })
    }

    fn wait_until(&mut self, deadline: Time) {
        let target = self.now().max(deadline);
        self.world.advance_to(target.0);
        // A fault script may make this host oversleep.
        let stall_ns = self.world.host_stall_ns();
        self.world.advance_to(target.0.saturating_add(stall_ns));
        self.sleep_to_world();
    }
}
