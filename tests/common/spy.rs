//! Ports that record the packets sent.

use hippocamp::bus::{PortError, Ports, SimPorts};
use hippocamp::units::Time;
use hw_sim::World;

/// Simulated ports on a virtual clock that remember the packets sent, and call the test after each wait.
pub(crate) struct Spy<W> {
    inner: SimPorts,
    /// Every packet sent, whatever the bus.
    pub(crate) sent: Vec<Vec<u8>>,
    /// The bus whose adapter is gone.
    pub(crate) gone: Option<usize>,
    /// Names of its lines.
    pub(crate) devices: &'static [&'static str],
    after_wait: W,
}

impl<W: FnMut(&SimPorts)> Spy<W> {
    /// Ports on the buses of `world`, all of them present.
    pub(crate) fn new(world: World, after_wait: W) -> Spy<W> {
        let inner = SimPorts::on_virtual_clock(world);
        Spy { inner, sent: Vec::new(), gone: None, devices: &[], after_wait }
    }
}

impl<W: FnMut(&SimPorts)> Ports for Spy<W> {
    fn now(&mut self) -> Time {
        self.inner.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        if self.gone == Some(bus) { Err(PortError::Gone { bus }) } else { self.inner.discard_input(bus) }
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.sent.push(bytes.to_vec());
        self.inner.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.inner.receive(bus, into)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.inner.receive_imu(into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.inner.wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.inner.wait_until(deadline);
        (self.after_wait)(&self.inner);
    }

    fn device(&self, bus: usize) -> Option<&str> {
        self.devices.get(bus).copied()
    }
}
