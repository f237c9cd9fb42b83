//! What a script may say, and what the errors say of one that may not be.

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
    let first = ScriptedFault {
        at_s: 1.5,
        for_s: Some(0.03),
        kind: FaultKind::Silent,
        bus: Some("legs".into()),
        id: Some(3),
    };
    assert_eq!(script.faults[0], first);
    assert_eq!(script.faults[1].kind, FaultKind::LateHost { delay_ms: 40.0 });
    assert_eq!(FaultScript::from_toml("").unwrap(), FaultScript::default());
}

#[test]
fn errors_name_entry_line_key_and_what_was_expected() {
    for (text, expected) in [
        (
            "[[fault]]\nat_s = 0\nkind = 'sleepy'",
            "fault 1 (line 1): `kind` is \"sleepy\"; expected one of silent",
        ),
        (
            "\n[[fault]]\nat_s = -1\nkind = 'echo'",
            "fault 1 (line 2): `at_s` is -1; expected a number of 0 to",
        ),
        ("[[fault]]\nat_s = nan\nkind = 'echo'", "`at_s` is NaN"),
        ("[[fault]]\nat_s = 0\nfor_s = 0\nkind = 'echo'", "`for_s` is 0"),
        (
            "[[fault]]\nat_s = 0\nkind = 'echo'\n\n[[fault]]\nat_s = 0\nkind = 'hot'",
            "fault 2 (line 5): `celsius` is missing; kind \"hot\" needs it",
        ),
        ("[[fault]]\nat_s = 0\nkind = 'silent'\nid = 1", "`id` needs a `bus`"),
        ("[[fault]]\nat_s = 0\nkind = 'echo'\nbus = 'a'\nid = 1", "`id` does not belong to kind \"echo\""),
        ("[[fault]]\nat_s = 0\nkind = 'echo'\nvolts = 3", "`volts` does not belong"),
        ("[[fault]]\nat_s = 0\nfor_s = 2\nkind = 'late-host'\ndelay_ms = 3", "`for_s` does not belong"),
        ("[[fault]]\nat_s = 0\nkind = 'low-voltage'\nvolts = inf", "`volts` is inf"),
        ("[[fault]]\nat_s = 0\nkind = 'echo'\ncolour = 'red'", "line 4"),
        ("[[fault]]\nkind = 'echo'", "at_s"),
        ("[fault]\nat_s = 0\nkind = 'echo'", "line 1"),
        ("[[fault]]\nat_s = 0\nkind = 'silent'\nbus = 'a'\nid = 300", "line 5"),
        ("[[faults]]\nat_s = 0\nkind = 'echo'", "faults"),
    ] {
        let message = FaultScript::from_toml(text).unwrap_err().to_string();
        assert!(message.contains(expected), "{text}\n gave: {message}");
    }
}
