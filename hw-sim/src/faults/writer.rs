//! Writes faults as a script in TOML, so that a person can replay faults that a program has drawn at random.

use std::fmt::Write;

use super::kinds::FaultKind;
use super::script::{FaultScript, ScriptedFault};

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
    if let (Some((own, ..)), Some(value)) =
        (fault.kind.entry().and_then(|kind| kind.own.as_ref()), fault.kind.own())
    {
        key(own, value);
    }
    if let FaultKind::Push(push) = fault.kind {
        key("impulse_n_s", push.impulse_n_s);
        for_s = Some(push.for_s);
        push.towards_rad.into_iter().for_each(|towards_rad| key("direction_deg", towards_rad.to_degrees()));
        push.every_s.into_iter().for_each(|every_s| key("every_s", every_s));
        let [x, y, z] = push.place_m.map(|metres| metres * 1000.0);
        let _ = writeln!(text, "place_mm = [{x:?}, {y:?}, {z:?}]");
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
