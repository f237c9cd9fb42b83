//! A script held against what a horse can do.

use super::Repertoire;
use crate::kinds::Refusal;
use crate::motion::{GaitChoice, Order};
use crate::operator::Script;

/// Refuses gaits the robot cannot do, and remarks where its limits will hold the script back.
pub(super) fn check(
    script: &Script,
    file_name: &str,
    repertoire: &Repertoire,
) -> Result<Vec<String>, Refusal> {
    let mut remarks = Vec::new();
    for entry in &script.entries {
        let Order::Drive(command) = entry.order else { continue };
        let place = format!("{file_name}:{}", entry.line);
        let gait = match command.gait {
            GaitChoice::Gait(index) => repertoire.gaits.get(index).map_or("", |gait| gait.name.as_str()),
            GaitChoice::Auto | GaitChoice::Stand => "any gait",
        };
        if matches!(command.gait, GaitChoice::Gait(index) if !repertoire.can_do(index)) {
            return Err(Refusal(format!(
                "{place}: this robot cannot {gait}: its servos are too slow for it even on the spot; 'hippocamp \
                 check' shows which gaits it can do"
            )));
        }
        let speed_m_s = command.speed_m_s;
        let top_m_s = repertoire.top_m_s(command.gait, speed_m_s);
        if speed_m_s.abs() > top_m_s {
            remarks
                .push(format!("{place}: {speed_m_s} m/s is too fast for {gait}: held at {top_m_s:.3} m/s"));
        }
        let (yaw, top) = (command.yaw_rate_rad_s.to_degrees(), repertoire.yaw_rate_max_rad_s.to_degrees());
        if yaw.abs() > top + 1e-9 {
            remarks
                .push(format!("{place}: {yaw:.1} degrees/s is too fast a turn: held at {top:.1} degrees/s"));
        }
    }
    Ok(remarks)
}
