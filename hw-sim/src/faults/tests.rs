//! What a script may contain, and the errors for one that is wrong.

use super::*;

#[test]
fn a_script_of_every_kind_is_read() {
    let text = "
[[fault]]
at_s = 1.5
for_s = 0.03
kind = 'silent'
bus = 'legs'
id = 3
[[fault]]
at_s = 2
kind = 'late-host'
delay_ms = 40.0
[[fault]]
at_s = 0
kind = 'low-voltage'
volts = 9.5
[[fault]]
at_s = 0
kind = 'hot'
celsius = 75
bus = 'legs'
";
    let script = FaultScript::from_toml(text).unwrap();
    assert_eq!(script.faults.len(), 4);
    let first = &script.faults[0];
    assert_eq!((first.at_s, first.for_s, first.kind), (1.5, Some(0.03), FaultKind::Silent));
    assert_eq!((first.target.bus.as_deref(), first.target.id), (Some("legs"), Some(3)));
    assert_eq!(script.faults[1].kind, FaultKind::LateHost { delay_ms: 40.0 });
    assert_eq!(FaultScript::from_toml("").unwrap().faults, []);
}

#[test]
fn errors_name_line_key_value_and_what_was_expected() {
    for (text, expected) in [
        (
            "[[fault]]\nat_s = 0\nkind = 'sleepy'",
            "script:3: fault[0].kind = 'sleepy': expected what happens: one of \"silent\", \"slow\"",
        ),
        (
            "[[fault]]\nat_s = 0",
            "script:1: fault[0].kind is not set: expected what happens: one of \"silent\"",
        ),
        ("[[fault]]\nat_s = 0\nkind = 3", "fault[0].kind = 3: expected what happens"),
        (
            "\n[[fault]]\nat_s = -1\nkind = 'echo'",
            "script:3: fault[0].at_s = -1: expected when it begins in s, 0 to 8640000",
        ),
        ("[[fault]]\nat_s = nan\nkind = 'echo'", "fault[0].at_s = nan: expected when"),
        ("[[fault]]\nat_s = 0\nfor_s = 0\nkind = 'echo'", "fault[0].for_s = 0: expected how long"),
        (
            "[[fault]]\nat_s = 0\nkind = 'echo'\n\n[[fault]]\nat_s = 0\nkind = 'hot'",
            "script:5: fault[1].celsius is not set: expected the temperature of the servo, -40 to 200",
        ),
        (
            "[[fault]]\nat_s = 0\nkind = 'echo'\nbus = 'a'\nid = 1",
            "script:5: fault[0].id = 1: expected no such key: kind \"echo\" has none",
        ),
        ("[[fault]]\nat_s = 0\nkind = 'echo'\nvolts = 3", "fault[0].volts = 3: expected no such key"),
        (
            "[[fault]]\nat_s = 0\nfor_s = 2\nkind = 'late-host'\ndelay_ms = 3",
            "fault[0].for_s = 2: expected no such",
        ),
        (
            "[[fault]]\nat_s = 0\nkind = 'low-voltage'\nvolts = inf",
            "fault[0].volts = inf: expected the voltage",
        ),
        (
            "[[fault]]\nat_s = 0\nkind = 'echo'\ncolour = 'red'",
            "script:4: fault[0].colour = 'red': expected a known key; known are kind, at_s",
        ),
        ("[[fault]]\nkind = 'echo'", "script:1: fault[0].at_s is not set: expected when it begins"),
        (
            "[fault]\nat_s = 0\nkind = 'echo'",
            "script:1: fault = [fault]: expected a list of faults: write [[fault]]",
        ),
        (
            "[[fault]]\nat_s = 0\nkind = 'silent'\nbus = 'a'\nid = 300",
            "script:5: fault[0].id = 300: expected the id",
        ),
        ("[[fault]]\nat_s = 0\nkind = 'silent'\nbus = 7", "script:4: fault[0].bus = 7: expected the name"),
        ("[[faults]]\nat_s = 0\nkind = 'echo'", "faults = [[faults]]: expected a known key; known are fault"),
        (
            "[[fault]]\nkind = 'push'\nat_s = 0\nfor_s = 1e-9\nimpulse_n_s = 1e4",
            "script:5: fault[0].impulse_n_s = 1e4: expected a push of at most 10000 N",
        ),
        ("[[fault]]\nat_s 0", "script:2: expected TOML"),
    ] {
        let error = FaultScript::from_toml(text).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(expected), "{text}\n gave: {message}");
        assert_eq!(error.mistakes.len(), 1, "{text}\n gave: {message}");
    }
}

#[test]
fn all_mistakes_are_reported_at_once_in_script_order() {
    let text = "[[fault]]\nkind = 'thunder'\nbus = 'wings'\nat_s = -1\n[[fault]]\nid = 1000\ncolour = 1\n";
    let legs = [crate::BusConfig {
        name: "legs".into(),
        protocol: crate::Protocol::Feetech,
        baud: 1_000_000,
        adapter_latency_us: 0,
        supply_v: 12.0,
        supply_ohm: 0.0,
        servos: vec![],
    }];
    let places = |buses| {
        let error = FaultScript::for_buses(text, "faults.toml", buses).unwrap_err();
        assert!(error.to_string().starts_with("faults.toml:2: fault[0].kind = 'thunder'"), "{error}");
        error.mistakes.into_iter().map(|mistake| (mistake.line, mistake.key)).collect::<Vec<_>>()
    };
    let expected = |keys: &[(usize, &str)]| {
        keys.iter().map(|(line, key)| (*line, (*key).to_owned())).collect::<Vec<_>>()
    };
    assert_eq!(
        places(Some(&legs)),
        expected(&[
            (2, "fault[0].kind"),
            (3, "fault[0].bus"),
            (4, "fault[0].at_s"),
            (5, "fault[1].kind"),
            (5, "fault[1].at_s"),
            (6, "fault[1].id"),
            (7, "fault[1].colour"),
        ])
    );
    assert_eq!(places(None).len(), 6);
}
