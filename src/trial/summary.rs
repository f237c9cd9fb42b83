//! Figures over many trials, and the table they make.

use std::fmt;

use serde::Serialize;

use super::stats::{Figure, Share, mean, median};
use super::{Observed, Tried};
use crate::reflex::FallOutcome;

/// Harm to the robot in one mode, over all falls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Harm {
    /// Mean of the trunk's largest impact, N.
    pub impact_n: Option<Figure>,
    /// Mean of the joints' largest load, N m.
    pub joint_load_nm: Option<Figure>,
}

/// Reduction of harm by the reflex compared with another mode: means of the differences fall by fall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HarmReduction {
    /// Reduction of the trunk's impact, N.
    pub impact_n: Option<Figure>,
    /// Reduction of the joints' load, N m.
    pub joint_load_nm: Option<Figure>,
}

/// Figures over many trials. Falls are those that happen with the reflex off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Trials in which the robot fell.
    pub fell: Share,
    /// Falls that were predicted before the trunk hit the ground.
    pub predicted: Share,
    /// Trials with a predicted fall that never came.
    pub false_alarms: Share,
    /// Median time from the prediction until the trunk hit the ground, s.
    pub lead_s: Option<Figure>,
    /// Shortest of these times, s.
    pub least_lead_s: Option<f64>,
    /// Falls whose predicted direction matches the push.
    pub direction: Share,
    /// With the reflex.
    pub with_reflex: Harm,
    /// Limp from the prediction on.
    pub passive: Harm,
    /// With the reflex off.
    pub off: Harm,
    /// Compared with the passive drop.
    pub less_than_passive: HarmReduction,
    /// Compared with no reflex.
    pub less_than_off: HarmReduction,
    /// Falls predicted before the trunk leant 30 degrees: from then on the reference motion is under way.
    pub told_early: Share,
    /// Falls in which the reflex has a smaller impact on the trunk than the passive drop.
    pub softer_trunk: Share,
    /// The same for a figure's head; only falls in which the head hit the ground in either mode.
    pub softer_head: Share,
    /// If the pushes have only a few strengths (N s): for each, the share of falls with the reflex off, by side,
    /// counted from ahead to the left; otherwise empty.
    pub by_strength: Vec<(f64, Vec<Share>)>,
    /// Falls with the reflex after which the robot got up, as far as it was observed.
    pub got_up: Share,
}

impl Summary {
    /// The summary of these trials.
    pub fn of(tried: &[Tried]) -> Summary {
        let falls: Vec<&Tried> = tried.iter().filter(|tried| tried.off.fallen_s.is_some()).collect();
        // The same falls in each mode.
        let met: Vec<(&Observed, &Observed, &Observed)> = falls
            .iter()
            .filter_map(|tried| Some((&tried.off, tried.reflex.as_ref()?, tried.passive.as_ref()?)))
            .collect();
        let of =
            |pick: fn(&(&Observed, &Observed, &Observed)) -> f64| met.iter().map(pick).collect::<Vec<_>>();
        let leads: Vec<f64> = falls.iter().filter_map(|tried| tried.lead_s()).collect();
        Summary {
            fell: Share::of(tried.iter().map(|tried| tried.off.fallen_s.is_some())),
            predicted: Share::of(falls.iter().filter_map(|tried| tried.is_predicted())),
            false_alarms: Share::of(tried.iter().map(Tried::is_false_alarm)),
            lead_s: median(&leads),
            least_lead_s: leads.iter().copied().reduce(f64::min),
            direction: Share::of(falls.iter().filter_map(|tried| Some(tried.direction()?.1))),
            with_reflex: Harm {
                impact_n: mean(&of(|(_, reflex, _)| reflex.impact_n)),
                joint_load_nm: mean(&of(|(_, reflex, _)| reflex.joint_load_nm)),
            },
            passive: Harm {
                impact_n: mean(&of(|(.., passive)| passive.impact_n)),
                joint_load_nm: mean(&of(|(.., passive)| passive.joint_load_nm)),
            },
            off: Harm {
                impact_n: mean(&of(|(off, ..)| off.impact_n)),
                joint_load_nm: mean(&of(|(off, ..)| off.joint_load_nm)),
            },
            less_than_passive: HarmReduction {
                impact_n: mean(&of(|(_, reflex, passive)| passive.impact_n - reflex.impact_n)),
                joint_load_nm: mean(&of(|(_, reflex, passive)| passive.joint_load_nm - reflex.joint_load_nm)),
            },
            less_than_off: HarmReduction {
                impact_n: mean(&of(|(off, reflex, _)| off.impact_n - reflex.impact_n)),
                joint_load_nm: mean(&of(|(off, reflex, _)| off.joint_load_nm - reflex.joint_load_nm)),
            },
            told_early: Share::of(
                falls.iter().map(|tried| tried.off.told_at_deg.is_some_and(|lean_deg| lean_deg < EARLY_DEG)),
            ),
            softer_trunk: Share::of(
                met.iter().map(|(_, reflex, passive)| reflex.impact_n < passive.impact_n),
            ),
            softer_head: Share::of(
                met.iter()
                    .filter(|(_, reflex, passive)| reflex.head_impact_n.max(passive.head_impact_n) > 0.0)
                    .map(|(_, reflex, passive)| reflex.head_impact_n < passive.head_impact_n),
            ),
            by_strength: by_strength(tried),
            got_up: Share::of(met.iter().map(|(_, reflex, _)| reflex.outcome == FallOutcome::GotUp)),
        }
    }
}

/// A fall that is predicted at more lean than this is predicted late, degrees.
const EARLY_DEG: f64 = 30.0;
/// Most strengths that count as a few.
const STRENGTHS_MAX: usize = 5;
/// Number of sides from which a figure is pushed.
const SIDES: usize = 8;

/// Falls by strength and side, if there are only a few strengths.
fn by_strength(tried: &[Tried]) -> Vec<(f64, Vec<Share>)> {
    let mut strengths: Vec<f64> = tried.iter().map(|tried| tried.scene.impulse_ns).collect();
    strengths.sort_by(f64::total_cmp);
    strengths.dedup();
    if strengths.len() > STRENGTHS_MAX || strengths.len() < 2 {
        return Vec::new();
    }
    let is_at = |tried: &&Tried, strength: f64, side: usize| {
        let turn = std::f64::consts::TAU * side as f64 / SIDES as f64;
        (tried.scene.impulse_ns - strength).abs() <= 0.0 && (tried.scene.towards_rad - turn).abs() < 1e-6
    };
    let sides = |strength: f64| {
        let of_side = |side| {
            Share::of(
                tried
                    .iter()
                    .filter(|tried| is_at(tried, strength, side))
                    .map(|tried| tried.off.fallen_s.is_some()),
            )
        };
        (0..SIDES).map(of_side).collect()
    };
    strengths.into_iter().map(|strength| (strength, sides(strength))).collect()
}

fn share(share: &Share) -> String {
    if share.of == 0 {
        return "0 of 0 | none | none".to_owned();
    }
    let percent = |value: f64| 100.0 * value;
    format!(
        "{} of {} | {:.1} % | {:.1} to {:.1} %",
        share.count,
        share.of,
        percent(share.value()),
        percent(share.low),
        percent(share.high)
    )
}

fn figure(figure: Option<Figure>, digits: usize) -> String {
    figure.map_or_else(
        || "none".to_owned(),
        |Figure { value, low, high }| format!("{value:.digits$} ({low:.digits$} to {high:.digits$})"),
    )
}

impl fmt::Display for Summary {
    /// Two tables of Markdown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| with the reflex off | count | share | 95 % interval |\n|---|---|---|---|")?;
        writeln!(f, "| fell | {} |", share(&self.fell))?;
        writeln!(f, "| falls predicted before the trunk hit the ground | {} |", share(&self.predicted))?;
        writeln!(f, "| predicted, but did not happen: false alarms | {} |", share(&self.false_alarms))?;
        writeln!(f, "| falls whose direction was the push's | {} |", share(&self.direction))?;
        if !self.by_strength.is_empty() {
            writeln!(
                f,
                "| predicted before the trunk leant {EARLY_DEG} degrees | {} |",
                share(&self.told_early)
            )?;
            writeln!(
                f,
                "| trunk hit the ground softer than in the passive drop | {} |",
                share(&self.softer_trunk)
            )?;
            writeln!(f, "| head hit the ground softer, if it hit it | {} |", share(&self.softer_head))?;
            writeln!(
                f,
                "\n| fallen of all pushes | ahead | ahead left | left | back left | back | back right | right | ahead right \
                 |\n|---|---|---|---|---|---|---|---|---|"
            )?;
            for (impulse_ns, sides) in &self.by_strength {
                write!(f, "| {impulse_ns:.3} N s |")?;
                for side in sides {
                    write!(f, " {} of {} |", side.count, side.of)?;
                }
                writeln!(f)?;
            }
        }
        let least = self.least_lead_s.map_or_else(String::new, |least_s| format!("; least {least_s:.2} s"));
        writeln!(
            f,
            "\nFrom then until the trunk hit the ground: median {} s{least}.\n",
            figure(self.lead_s, 2)
        )?;
        writeln!(
            f,
            "| mean over all falls (95 % interval) | reflex | passive | off | less than passive | less than off |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|")?;
        writeln!(
            f,
            "| largest impact on the trunk, N | {} | {} | {} | {} | {} |",
            figure(self.with_reflex.impact_n, 1),
            figure(self.passive.impact_n, 1),
            figure(self.off.impact_n, 1),
            figure(self.less_than_passive.impact_n, 1),
            figure(self.less_than_off.impact_n, 1)
        )?;
        writeln!(
            f,
            "| largest load of any joint, N m | {} | {} | {} | {} | {} |",
            figure(self.with_reflex.joint_load_nm, 2),
            figure(self.passive.joint_load_nm, 2),
            figure(self.off.joint_load_nm, 2),
            figure(self.less_than_passive.joint_load_nm, 2),
            figure(self.less_than_off.joint_load_nm, 2)
        )
    }
}
