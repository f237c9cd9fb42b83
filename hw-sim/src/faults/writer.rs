//! Writes faults as a script in TOML, so that a person can replay faults that a program has drawn at random.

use std::fmt::Write;

use super::script::{FaultKind, FaultScript, ScriptedFault};

impl FaultKind {
    /// Its name in scripts.
    pub fn name(self) -> &'static str {
        match self {
            FaultKind::Silent => "silent",
            FaultKind::Slow { .. } => "slow",
            FaultKind::BitFlip => "bit-flip",
            FaultKind::Garbled => "garbled",
            FaultKind::Scrambled { .. } => "scrambled",
            FaultKind::CutShort => "cut-short",
            FaultKind::Noise => "noise",
            FaultKind::Echo => "echo",
            FaultKind::WrongId { .. } => "wrong-id",
            FaultKind::Unplugged => "unplugged",
            FaultKind::LateHost { .. } => "late-host",
            FaultKind::Stuck => "stuck",
            FaultKind::Overload => "overload",
            FaultKind::BrownOut => "brown-out",
            FaultKind::Reset => "reset",
            FaultKind::LowVoltage { .. } => "low-voltage",
            FaultKind::Push(_) => "push",
            FaultKind::Hot { .. } => "hot",
            FaultKind::ImuSilent => "imu-silent",
            FaultKind::ImuFrozen => "imu-frozen",
            FaultKind::ImuGarbled => "imu-garbled",
            FaultKind::ImuUnplugged => "imu-unplugged",
        }
    }
}

impl FaultScript {
    /// A script of these faults, on the robot's own ground.
    pub fn of(faults: Vec<ScriptedFault>) -> FaultScript {
        FaultScript { faults, ..FaultScript::default() }
    }

    /// The faults as TOML that [`FaultScript::from_toml`] reads; the ground is left out.
    pub fn to_toml(&self) -> String {
        self.faults.iter().map(one).collect::<Vec<_>>().join("\n")
    }
}

fn one(fault: &ScriptedFault) -> String {
    let mut text = format!("[[fault]]\nkind = \"{}\"\nat_s = {:?}\n", fault.kind.name(), fault.at_s);
    let mut key = |key: &str, value: f64| {
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "{key} = {value:?}");
    };
    let mut for_s = fault.for_s;
    match fault.kind {
        FaultKind::Slow { delay_ms } | FaultKind::LateHost { delay_ms } => key("delay_ms", delay_ms),
        FaultKind::Scrambled { share } => key("share", share),
        FaultKind::WrongId { as_id } => key("as_id", f64::from(as_id)),
        FaultKind::LowVoltage { volts } => key("volts", volts),
        FaultKind::Hot { celsius } => key("celsius", celsius),
        FaultKind::Push(push) => {
            key("impulse_n_s", push.impulse_n_s);
            for_s = Some(push.for_s);
            push.towards_rad
                .into_iter()
                .for_each(|towards_rad| key("direction_deg", towards_rad.to_degrees()));
            push.every_s.into_iter().for_each(|every_s| key("every_s", every_s));
            let [x, y, z] = push.place_m.map(|metres| metres * 1000.0);
            let _ = writeln!(text, "place_mm = [{x:?}, {y:?}, {z:?}]");
        }
        _ => {}
    }
    if let Some(for_s) = for_s {
        let _ = writeln!(text, "for_s = {for_s:?}");
    }
    if let Some(bus) = &fault.target.bus {
        let _ = writeln!(text, "bus = {}", toml::Value::from(bus.as_str()));
    }
    if let Some(id) = fault.target.id {
        let _ = writeln!(text, "id = {id}");
    }
    text
}
