//! Topics and their schemas.

/// Name and message format of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// Name.
    pub name: &'static str,
    /// Name of the schema.
    pub schema_name: &'static str,
    /// JSON schema of the messages.
    pub schema: &'static str,
}

macro_rules! topics {
    ($($constant:ident $name:literal $schema_name:literal $file:literal;)*) => {
        $(pub(super) const $constant: Topic = Topic {
            name: $name,
            schema_name: $schema_name,
            schema: include_str!(concat!("schemas/", $file)),
        };)*
        /// Every topic of a recording.
        pub const TOPICS: &[Topic] = &[$($constant),*];
    };
}

// The foxglove ones: the fields that Foxglove publishes for its schemas (github.com/foxglove/foxglove-sdk).
topics! {
    JOINT_STATES "/joint_states" "sensor_msgs/JointState" "JointState.json";
    JOINT_GOALS "/joint_goals" "sensor_msgs/JointState" "JointState.json";
    SERVOS "/servos" "hippocamp.Servos" "Servos.json";
    FEET "/feet" "hippocamp.Feet" "Feet.json";
    IMU "/imu" "hippocamp.Imu" "Imu.json";
    TRUNK "/trunk" "foxglove.PoseInFrame" "foxglove.PoseInFrame.json";
    MOTION "/motion" "hippocamp.Motion" "Motion.json";
    BUSES "/buses" "hippocamp.Buses" "Buses.json";
    LOOP "/loop" "hippocamp.Loop" "Loop.json";
    TRUE_BODY "/true_body" "hippocamp.TrueBody" "TrueBody.json";
    TRANSFORMS "/tf" "foxglove.FrameTransforms" "foxglove.FrameTransforms.json";
    SCENE "/scene" "foxglove.SceneUpdate" "foxglove.SceneUpdate.json";
}
