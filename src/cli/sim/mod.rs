//! `hippocamp sim`: the servos of a robot file behind pseudo-terminals, in real time, for any program that drives
//! servos.
//!
//! In: a robot file, scripted faults, and commands typed while it runs. Out: bytes on terminals.

mod console;
mod links;
mod rig;
pub(super) mod typed;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, bounded};
use hw_sim::pty::PtyServer;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use signal_hook::iterator::Signals;

use self::console::Console;
use self::links::Links;
use self::rig::Rig;
use super::run::fault_script;
use super::{BadInput, SimArguments, unit};
use crate::config;
use crate::model::IMU_LINE;

/// Serves the robot's buses until a signal, or `quit`.
pub(super) fn sim(options: &SimArguments) -> Result<()> {
    let mut file = config::load(&options.robot)?;
    if file.robot.buses.is_empty() {
        let path = options.robot.display();
        return Err(BadInput(format!("{path}: {} has no buses, and so no servos", file.robot.name)).into());
    }
    // Servos out of the box have no calibration.
    let unit = match options.factory_new {
        true => None,
        false => unit::find(&options.robot, options.unit.as_deref())?,
    };
    if let Some(unit) = &unit {
        unit.apply(&mut file.robot)?;
    }
    // Servos out of the box lie on a bench, so there is no body.
    if options.no_physics || options.factory_new || file.robot.physics.is_none() {
        file.robot = file.robot.without_body();
    }
    let faults = options.faults.as_deref().map(|path| fault_script(&file.robot, path)).transpose()?;
    let rig = Rig::new(file.robot, options)?;
    let world = rig.world(options, &faults.unwrap_or_default())?;

    // Before the links exist, since an uncaught signal would leave them behind.
    let stop = stop_signals()?;
    let links = Links::take(
        options.link.as_deref(),
        &options.robot,
        world.lines().map(|(name, _)| name).chain(world.has_imu().then_some(IMU_LINE)),
    )?;
    let server = PtyServer::start(world, links.folder())
        .with_context(|| format!("the buses could not be served in {}", links.folder().display()))?;
    rig.announce(&server);
    Console { rig: &rig, server: &server, lines: typed::lines()?, stop }.run();
    Ok(())
}

/// Receives one message for each signal that should end the program.
fn stop_signals() -> Result<Receiver<()>> {
    let (sender, receiver) = bounded(1);
    let mut signals =
        Signals::new([SIGHUP, SIGINT, SIGQUIT, SIGTERM]).context("signals could not be caught")?;
    std::thread::spawn(move || {
        for _ in signals.forever() {
            let _ = sender.try_send(());
        }
    });
    Ok(receiver)
}
