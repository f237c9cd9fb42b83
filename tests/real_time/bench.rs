//! A line with simulated servos on it, and the program.

use std::path::PathBuf;
use std::process::{Command, Output};

use hippocamp::platform::request_real_time;
use hw_sim::pty::PtyServer;
use hw_sim::{BusConfig, FaultScript, Model, Protocol, ServoConfig, World};
use tempfile::TempDir;

pub(crate) struct Bench {
    pub(crate) server: PtyServer,
    _folder: TempDir,
}

/// A line called `line` at `baud`, with servos of one model and these ids.
pub(crate) fn line(model: &str, baud: u32, ids: &[u8]) -> BusConfig {
    let servo = |id: &u8| ServoConfig {
        model: Model::named(model).unwrap().clone(),
        id: *id,
        return_delay_us: 0,
        position_counts: 1000.0 + 100.0 * f64::from(*id),
    };
    let is_feetech = model.starts_with('S');
    BusConfig {
        name: "line".into(),
        protocol: if is_feetech { Protocol::Feetech } else { Protocol::Dynamixel },
        baud,
        adapter_latency_us: 0,
        supply_v: if model == "XL330-M288" { 5.0 } else { 12.0 },
        supply_ohm: 0.0,
        servos: ids.iter().map(servo).collect(),
    }
}

impl Bench {
    pub(crate) fn new(bus: BusConfig) -> Bench {
        Bench::with_faults(bus, "")
    }

    pub(crate) fn with_faults(bus: BusConfig, faults: &str) -> Bench {
        let folder = tempfile::tempdir().unwrap();
        let faults = FaultScript::from_toml(faults).unwrap();
        let world = World::new(&[bus], faults, 1).unwrap();
        // Servos of a real line do not wait for a processor.
        let server =
            PtyServer::start_prepared(world, folder.path(), || drop(request_real_time(None))).unwrap();
        Bench { server, _folder: folder }
    }

    pub(crate) fn port(&self) -> PathBuf {
        self.server.paths()[0].clone()
    }

    /// `hippocamp COMMAND PORT ARGUMENTS`; its output, all in one.
    pub(crate) fn run(&self, command: &[&str], arguments: &[&str]) -> (i32, String) {
        let output: Output = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
            .args(command)
            .arg(self.port())
            .args(arguments)
            .stdin(std::process::Stdio::null())
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code().unwrap(), format!("{}{}", text(&output.stdout), text(&output.stderr)))
    }

    /// The same for a command that must succeed.
    pub(crate) fn good(&self, command: &[&str], arguments: &[&str]) -> String {
        let (code, text) = self.run(command, arguments);
        assert_eq!(code, 0, "{command:?} {arguments:?}: {text}");
        text
    }

    /// A byte of the control table of the servo that has this id now.
    pub(crate) fn byte(&self, id: u8, address: u16) -> u8 {
        self.server.with_world(|world| world.register(0, id, address)).unwrap()
    }
}
