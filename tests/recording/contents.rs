//! The content of a recording, read by the mcap crate.

use std::collections::BTreeMap;

use hippocamp::bus::SimPorts;
use hippocamp::model::Robot;
use hippocamp::motion::{Command, GaitChoice, Order, Posture};
use hippocamp::recording::{Recording, TOPICS};
use hippocamp::replay::replay;
use hippocamp::run::run_observed;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hw_sim::FaultScript;
use serde_json::Value;

use crate::common::{
    Memory, ROBOT_FILE, horse, plan, record, record_in_physics, record_in_physics_anew, record_with, recorder,
};
use crate::schema::faults;

/// All messages of one topic in their order.
fn messages(bytes: &[u8], topic: &str) -> Vec<Value> {
    mcap::MessageStream::new(bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|message| message.channel.topic == topic)
        .map(|message| serde_json::from_slice(&message.data).unwrap())
        .collect()
}

#[test]
fn every_cycle_is_on_every_topic() {
    let (report, bytes) = record_in_physics();
    let statistics = mcap::Summary::read(bytes).unwrap().unwrap().stats.unwrap();
    let mut counts = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).unwrap() {
        *counts.entry(message.unwrap().channel.topic.clone()).or_insert(0) += 1;
    }
    for topic in TOPICS {
        // At 100 cycles a second the scene is in every other.
        let expected = if topic.name == "/scene" { report.cycles.div_ceil(2) } else { report.cycles };
        assert_eq!(counts[topic.name], expected, "{}", topic.name);
    }
    assert_eq!(counts.values().sum::<u64>(), statistics.message_count);
    assert_eq!((statistics.attachment_count, statistics.metadata_count), (2, 1));
    let recording = report.recording.as_ref().unwrap();
    assert_eq!((recording.records, recording.dropped, &recording.error), (report.cycles, 0, &None));
}

/// Asserts that every message is as its schema says; the names of the schemas.
fn assert_schemas_kept(bytes: &[u8]) -> Vec<String> {
    let mut schemas: BTreeMap<String, Value> = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!(
            (schema.encoding.as_str(), message.channel.message_encoding.as_str()),
            ("jsonschema", "json")
        );
        let described = schemas
            .entry(schema.name.clone())
            .or_insert_with(|| serde_json::from_slice(&schema.data).unwrap());
        assert_eq!(described["title"], schema.name.as_str());
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        assert_eq!(faults(described, &value, &message.channel.topic), Vec::<String>::new());
    }
    schemas.into_keys().collect()
}

#[test]
fn every_message_follows_its_schema() {
    let schemas = assert_schemas_kept(&record_in_physics().1);
    for name in ["foxglove.SceneUpdate", "foxglove.FrameTransforms", "sensor_msgs/JointState"] {
        assert!(schemas.iter().any(|schema| schema == name), "{name}");
    }
}

#[test]
fn orders_are_recorded_as_given() {
    let robot = horse();
    let ports = SimPorts::on_virtual_clock(simulation::world(&robot, 7, &FaultScript::default()).unwrap());
    let memory = Memory::default();
    let mut recorder = recorder(&robot, memory.clone(), true);
    let posture = Posture { rise_m: -0.001, pitch_rad: 0.01, ..Posture::default() };
    let drive = |gait| Order::Drive(Command { gait, speed_m_s: 0.1 / 3.0, yaw_rate_rad_s: -0.02, posture });
    let mut given = Vec::new();
    let report = run_observed(&robot, &plan(&robot), ports, &mut [&mut recorder], |status: &Status| {
        let order = match status.time_s {
            time_s if time_s < 1.0 => drive(GaitChoice::Stand),
            time_s if time_s < 2.0 => drive(GaitChoice::Gait(2)),
            time_s if time_s < 3.0 => drive(GaitChoice::Auto),
            _ => Order::Stop,
        };
        given.push(order);
        order
    });
    assert_eq!(report.unwrap().reason, "stopped by the operator");
    let bytes = memory.0.lock().unwrap().clone();
    assert_schemas_kept(&bytes);
    let recording = Recording::parse(&bytes, "test").unwrap();
    let kept: Vec<Order> = recording.samples.iter().map(|sample| sample.facts.order).collect();
    assert_eq!(kept, given);
    assert!(replay(&recording).unwrap().agrees());
}

#[test]
fn no_chunk_spans_much_more_than_a_second() {
    let (report, bytes) = record();
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let longest_s = report.duration_s / f64::from(u32::try_from(summary.chunk_indexes.len()).unwrap());
    assert!(longest_s <= 1.0, "{longest_s}");
    for chunk in &summary.chunk_indexes {
        assert!(chunk.message_end_time - chunk.message_start_time <= 1_000_000_000, "{chunk:?}");
        assert_eq!(chunk.compression, "lz4");
    }
}

#[test]
fn a_virtual_run_records_the_same_bytes_each_time() {
    assert!(record().1 == record_with("").1);
}

/// Servos, goals and the truth of the body of one seed, chance pushes with them, to the last bit.
#[test]
fn a_run_in_physics_records_the_same_bytes_each_time() {
    assert!(record_in_physics().1 == record_in_physics_anew().1);
}

#[test]
fn the_robot_file_is_inside() {
    let (_, bytes) = record();
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let index = summary.attachment_indexes.iter().find(|index| index.name == "robot.toml").unwrap();
    let attachment = mcap::read::attachment(bytes, index).unwrap();
    assert_eq!(*attachment.data, *std::fs::read(ROBOT_FILE).unwrap());
}

#[test]
fn joints_are_named_and_in_si_units() {
    let (_, bytes) = record();
    let robot = horse();
    let states = messages(bytes, "/joint_states");
    let last = states.last().unwrap();
    let names: Vec<&str> =
        last["name"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let expected: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, expected);
    for state in &states {
        for (joint, position) in robot.joints.iter().zip(state["position"].as_array().unwrap()) {
            // A limp joint may start a tenth of its range outside.
            let (low, high) = joint.range_rad;
            let slack = 0.1 * (high - low) + 1e-2;
            let angle = position.as_f64().unwrap();
            assert!(angle > low - slack && angle < high + slack, "{}: {angle}", joint.name);
        }
    }
}

#[test]
fn a_standing_robots_measured_feet_are_near_the_ground() {
    let (_, bytes) = record();
    let motion = messages(bytes, "/motion");
    let feet = messages(bytes, "/feet");
    let standing: Vec<&Value> = feet
        .iter()
        .zip(&motion)
        .filter(|(_, motion)| motion["activity"] == "standing")
        .map(|(feet, _)| feet)
        .collect();
    assert!(standing.len() > 10);
    for foot in standing.last().unwrap()["feet"].as_array().unwrap() {
        let height_m = foot["measured_in_world"]["z"].as_f64().unwrap();
        assert!(height_m.abs() < 2e-3, "{foot}");
    }
}

#[test]
fn the_scene_draws_every_link_and_foot_where_the_joints_say() {
    let (_, bytes) = record();
    let robot: Robot = horse();
    let scene = messages(bytes, "/scene").pop().unwrap();
    let states = messages(bytes, "/joint_states");
    let entity = &scene["entities"][0];
    assert_eq!(entity["frame_id"], "body");
    let stamp = |value: &Value| (value["sec"].as_u64().unwrap(), value["nsec"].as_u64().unwrap());
    let at = stamp(&entity["timestamp"]);
    let state = states.iter().find(|state| stamp(&state["header"]["stamp"]) == at).unwrap();
    let angles: Vec<f64> =
        state["position"].as_array().unwrap().iter().map(|angle| angle.as_f64().unwrap()).collect();
    for (chain, line) in robot.chains.iter().zip(entity["lines"].as_array().unwrap()) {
        let points = line["points"].as_array().unwrap();
        assert_eq!(points.len(), chain.joints.len() + 1);
        let tip = robot.tip_in_body(chain, angles[chain.joints.clone()].iter().copied());
        let last = points.last().unwrap();
        let drawn = glam::DVec3::new(
            last["x"].as_f64().unwrap(),
            last["y"].as_f64().unwrap(),
            last["z"].as_f64().unwrap(),
        );
        assert!(drawn.distance(tip) < 1e-12);
    }
}
