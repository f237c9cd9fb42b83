//! As much of JSON Schema as the recordings use, written from the specification's words.

use serde_json::Value;

/// The violations of `schema` in `value`; `place` is the path of `value`.
///
/// Stricter than JSON Schema in one thing: a field the schema does not have is a fault.
pub(crate) fn faults(schema: &Value, value: &Value, place: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fault = |what: String| found.push(format!("{place}: {what}"));
    if let Some(wanted) = schema["type"].as_str() {
        let is_right = match wanted {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            "number" => value.is_number(),
            "integer" => value.is_i64() || value.is_u64(),
            other => panic!("{place}: the schema has a type {other}"),
        };
        if !is_right {
            fault(format!("{value} is no {wanted}"));
        }
    }
    if let (Some(minimum), Some(number)) = (schema["minimum"].as_f64(), value.as_f64())
        && number < minimum
    {
        fault(format!("{number} is below {minimum}"));
    }
    if let (Some(maximum), Some(number)) = (schema["maximum"].as_f64(), value.as_f64())
        && number > maximum
    {
        fault(format!("{number} is above {maximum}"));
    }
    if let Some(words) = schema["enum"].as_array()
        && !words.contains(value)
    {
        fault(format!("{value} is none of {words:?}"));
    }
    if let Some(choices) = schema["oneOf"].as_array()
        && !choices.iter().any(|choice| choice["const"] == *value)
    {
        fault(format!("{value} is none of the constants"));
    }
    for name in schema["required"].as_array().into_iter().flatten() {
        if value.get(name.as_str().unwrap()).is_none() {
            fault(format!("{name} is missing"));
        }
    }
    for (name, inner) in value.as_object().into_iter().flatten() {
        match schema["properties"].get(name) {
            Some(schema) => found.extend(faults(schema, inner, &format!("{place}.{name}"))),
            None => found.push(format!("{place}: {name} is not in the schema")),
        }
    }
    for (index, inner) in value.as_array().into_iter().flatten().enumerate() {
        found.extend(faults(&schema["items"], inner, &format!("{place}[{index}]")));
    }
    found
}

#[test]
fn the_checker_finds_what_is_wrong() {
    let schema = serde_json::json!({
        "type": "object",
        "properties": {"a": {"type": "array", "items": {"type": "integer", "minimum": 0}}, "b": {"type": "string"}},
        "required": ["a"],
    });
    assert_eq!(faults(&schema, &serde_json::json!({"a": [1, 2]}), "m"), Vec::<String>::new());
    assert_eq!(faults(&schema, &serde_json::json!({"a": [1, -2]}), "m"), ["m.a[1]: -2 is below 0"]);
    assert_eq!(faults(&schema, &serde_json::json!({"b": null}), "m").len(), 2);
    assert_eq!(faults(&schema, &serde_json::json!({"a": [], "c": 1}), "m"), ["m: c is not in the schema"]);
}
