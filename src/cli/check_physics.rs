//! `hippocamp check --physics`: what the simulated body makes of each motion.

use anyhow::Result;

use super::BadInput;
use crate::bus::SimPorts;
use crate::ik::Method;
use crate::kinds::Kind;
use crate::model::Robot;
use crate::motion::{Order, Plan};
use crate::plan::RunPlan;
use crate::run::run;
use crate::simulation;
use crate::telemetry::{Report, Verdict};
use hw_sim::FaultScript;

/// Time for which each motion is run, s, and the seed of the way in which the limp robot lies.
const MOVE_FOR_S: f64 = 8.0;
const SEED: u64 = 1;

/// Runs every motion of `kind` on the simulated body of `robot`, and prints what was measured.
///
/// # Errors
/// [`BadInput`] if the robot has no body or no servos.
pub(super) fn measure(robot: &Robot, kind: &dyn Kind) -> Result<()> {
    if robot.physics.is_none() || robot.buses.is_empty() {
        let what = "--physics: expected a robot file with servos and a [physics] section (docs/physics.md)";
        return Err(BadInput(what.to_owned()).into());
    }
    say!();
    say!("On the simulated body, {MOVE_FOR_S} s each, seed {SEED}:");
    say!("{:<24} {:>10} {:>12} {:>9}  verdict", "motion", "asked m/s", "reached m/s", "turn deg");
    for asked in kind.motions() {
        let name = asked.gait.or(asked.stroke).or(asked.pose).unwrap_or("-");
        match kind.plan(robot, &asked) {
            Ok((plan, _)) => say!("{name:<24} {}", line(&run_for(robot, plan)?)),
            Err(refusal) => say!("{name:<24} {:>10} {:>12} {:>9}  {}", "-", "-", "-", refusal.0),
        }
    }
    Ok(())
}

fn run_for(robot: &Robot, motion: Plan) -> Result<Report> {
    let world = simulation::world(robot, SEED, &FaultScript::default())?;
    let plan = RunPlan { motion, method: Method::CcdThenFinish, move_for_s: MOVE_FOR_S, driver: None };
    Ok(run(robot, plan, SimPorts::on_virtual_clock(world), |_| Order::Go)?)
}

/// The measured speeds of a run, its verdict, and its first finding.
fn line(report: &Report) -> String {
    let [asked, reached] = [report.asked, report.reached];
    let speed = |of: Option<f64>| of.map_or("-".to_owned(), |speed_m_s| format!("{speed_m_s:.3}"));
    let turn = reached.map_or("-".to_owned(), |way| format!("{:.0}", way.turn_deg));
    let verdict = match report.verdict {
        Verdict::Good => "good".to_owned(),
        Verdict::Poor | Verdict::Failed => {
            let finding = report.findings.first().map(|finding| finding.what);
            format!("{:?}: {}", report.verdict, finding.unwrap_or(&report.reason)).to_lowercase()
        }
    };
    let speeds = [asked, reached].map(|way| speed(way.map(|way| way.speed_m_s)));
    format!("{:>10} {:>12} {turn:>9}  {verdict}", speeds[0], speeds[1])
}
