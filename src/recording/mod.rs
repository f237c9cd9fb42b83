//! Recordings: every cycle of a run in one MCAP file that the `mcap` readers and Foxglove open.
//!
//! Takes one [`CycleRecord`](crate::observe::CycleRecord) a cycle, through a [`Recorder`], which hands it
//! to a separate thread and never delays the loop. Produces the file, and, read back, a [`Recording`].
//!
//! The file holds JSON messages with their JSON schemas, in chunks of at most a second (lz4), all times on the
//! run's clock; a message's sequence number is that of its cycle:
//!
//! | topic | schema | holds |
//! |---|---|---|
//! | `/joint_states` | `sensor_msgs/JointState` | joints heard at least once: rad, rad/s, N m |
//! | `/joint_goals` | `sensor_msgs/JointState` | joints with torque on: goal rad, torque limit N m as effort |
//! | `/servos` | `hippocamp.Servos` | goal and reply of each servo in its own counts, and how the reply came |
//! | `/feet` | `hippocamp.Feet` | each tip: target and measured place in body and world frame, m |
//! | `/trunk` | `foxglove.PoseInFrame` | the planned place of the trunk in the world, m |
//! | `/motion` | `hippocamp.Motion` | order, activity, planned speed, what safety permits |
//! | `/buses` | `hippocamp.Buses` | each bus: exchange time, replies missing and damaged so far |
//! | `/loop` | `hippocamp.Loop` | number and beginning of the cycle; how late, work and exchange times |
//! | `/true_body` | `hippocamp.TrueBody` | the true state of the simulated body, if there is one |
//! | `/tf` | `foxglove.FrameTransforms` | world to body |
//! | `/scene` | `foxglove.SceneUpdate` | the robot as lines and spheres, for display; at most 50 a second |
//!
//! Attachments: `robot.toml`, the robot file; `run.json`, a [`RunHeader`]. Metadata `outcome`: how the run ended.
//! A replay needs nothing else.

mod decode;
mod header;
mod lengths;
pub mod messages;
mod orders;
mod reader;
mod recorder;
mod records;
mod sample;
mod scene;
mod strokes;
mod task;
mod topics;
mod writer;

pub use header::{RunHeader, ServoHeader};
pub(crate) use orders::gait_is_of;
pub use reader::{Cycles, Ending, ReadError, RecordedRun, Recording, open, read};
pub use recorder::Recorder;
pub use records::{CHUNK_MAX, RECORD_MAX};
pub use sample::Sample;
pub use strokes::StrokeFields;
pub use task::Task;
pub use topics::{TOPICS, Topic};
