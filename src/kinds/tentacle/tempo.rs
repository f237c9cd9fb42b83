//! The fastest tempo at which arms can perform rhythmic strokes within the limits of their joints.

use crate::ik::{Limbs, Method};
use crate::model::{Joint, Robot};
use crate::motion::tentacle::strokes::{STROKES, StrokeKind};
use crate::motion::tentacle::{Performer, TentaclePlan};
use crate::motion::{Stroke, StrokeCommand};
use crate::signals::{JointTargets, State, Targets};

/// Shares of the joints' speed and acceleration limits that a stroke may use: the rest is for the transition
/// to the next.
const RATE_SHARE: f64 = 0.5;
const ACCELERATION_SHARE: f64 = 0.4;
/// Number of strokes checked, after a first one in which the arms get under way: a sway does not repeat.
const CHECKED: f64 = 3.0;
/// Most steps in which they are checked: a thousand per stroke.
const STEPS_MAX: f64 = 4000.0;
/// Most corrections that move arms apart, each of which takes a while: strokes in which arms come near to
/// each other only now and then stay far below.
const CORRECTIONS_MAX: u64 = 10_000;
/// Highest tempo, as a multiple of the robot file's: faster strokes are of no use.
const TEMPO_MAX: f64 = 4.0;

/// The fastest tempo of each stroke, in the order of [`STROKES`]; infinite for strokes without a rhythm.
pub(super) fn of_strokes(robot: &Robot, plan: &TentaclePlan) -> Vec<f64> {
    let tempo_max = |kind: &StrokeKind| match kind.is_rhythmic {
        true => of_stroke(robot, plan, Stroke::of(kind.name)),
        false => f64::INFINITY,
    };
    STROKES.iter().map(tempo_max).collect()
}

fn of_stroke(robot: &Robot, plan: &TentaclePlan, stroke: Stroke) -> f64 {
    let begin_s = plan.settings.stroke_time_s.max(2.0);
    let end_s = begin_s + CHECKED * plan.settings.stroke_time_s;
    let robot = &robot.with_period_of_at_least(end_s / STEPS_MAX);
    let dt_s = robot.period_s();
    let mut performer = Performer::new(robot, plan);
    let mut limbs = Limbs::new(robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(robot), JointTargets::new(robot));
    let state = State::new(robot);
    // Angles in the last two cycles, rad.
    let mut last = [vec![0.0; robot.joints.len()], vec![0.0; robot.joints.len()]];
    let mut tempo = TEMPO_MAX;
    let mut now_s = 0.0;
    while now_s < end_s && limbs.corrections() < CORRECTIONS_MAX {
        performer.step(dt_s, &state, StrokeCommand::of(stroke));
        performer.write(&mut targets);
        limbs.solve(&targets, &mut joints);
        if now_s > begin_s {
            for (index, joint) in robot.joints.iter().enumerate() {
                let (now, before, earlier) = (joints.angles_rad[index], last[0][index], last[1][index]);
                let speed = (now - before).abs() / dt_s;
                let acceleration = (now - 2.0 * before + earlier).abs() / (dt_s * dt_s);
                tempo = tempo.min(highest(robot, joint, speed, acceleration));
            }
        }
        last.swap(0, 1);
        last[0].copy_from_slice(&joints.angles_rad);
        now_s += dt_s;
    }
    // Strokes that were not checked to the end must not go faster than in the file.
    if now_s < end_s { tempo.min(1.0) } else { tempo }
}

/// The highest tempo at which a joint with this motion at tempo 1 keeps its limits: speed grows with the
/// tempo, acceleration with its square.
fn highest(robot: &Robot, joint: &Joint, speed: f64, acceleration: f64) -> f64 {
    let by_rate = RATE_SHARE * robot.safety.rate_share * joint.no_load_speed_rad_s() / speed.max(1e-9);
    let by_acceleration = ACCELERATION_SHARE * robot.safety.acceleration_rad_s2 / acceleration.max(1e-9);
    by_rate.min(by_acceleration.sqrt())
}
