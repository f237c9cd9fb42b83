//! The result of a campaign: counted episode by episode, and written down so that it can be resumed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Judged, Violation};

/// One line of the file in which a campaign stores its finished episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Line {
    robot: usize,
    number: u64,
    virtual_s: f64,
    faults: Vec<String>,
    findings: Vec<String>,
}

/// Counts of a campaign.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    /// Episodes, by robot and number.
    pub done: BTreeSet<(usize, u64)>,
    /// Virtual time of all episodes, s.
    pub virtual_s: f64,
    /// Virtual time by robot, s.
    pub robots_s: BTreeMap<usize, f64>,
    /// Number of episodes with findings.
    pub wrong_episodes: u64,
    /// Number of faults, by kind.
    pub faults: BTreeMap<String, u64>,
    /// Number of episodes with a finding, by kind.
    pub findings: BTreeMap<String, u64>,
}

impl Tally {
    /// Counts an episode; returns the line to store for it.
    pub fn count(&mut self, judged: &Judged) -> String {
        let kinds: BTreeSet<Violation> = judged.played.findings.iter().map(|finding| finding.wrong).collect();
        let line = Line {
            robot: judged.subject,
            number: judged.number,
            virtual_s: judged.played.virtual_s,
            faults: judged.faults.iter().map(|kind| (*kind).to_owned()).collect(),
            findings: kinds.into_iter().map(|wrong| wrong.name().to_owned()).collect(),
        };
        self.add(&line);
        // A line of numbers and words is always JSON.
        serde_json::to_string(&line).unwrap_or_default()
    }

    /// Counts stored episodes; `text` is lines of [`Tally::count`]. A line that was cut short does not count.
    pub fn take_up(&mut self, text: &str) {
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).for_each(|line| self.add(&line));
    }

    fn add(&mut self, line: &Line) {
        if !self.done.insert((line.robot, line.number)) {
            return;
        }
        self.virtual_s += line.virtual_s;
        *self.robots_s.entry(line.robot).or_default() += line.virtual_s;
        self.wrong_episodes += u64::from(!line.findings.is_empty());
        line.faults.iter().for_each(|kind| *self.faults.entry(kind.clone()).or_default() += 1);
        line.findings.iter().for_each(|wrong| *self.findings.entry(wrong.clone()).or_default() += 1);
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |counts: &BTreeMap<String, u64>| {
            let each = counts.iter().map(|(kind, count)| format!("{kind} {count}"));
            each.collect::<Vec<_>>().join(", ")
        };
        writeln!(
            f,
            "{:.2} virtual hours, {} episodes, {} faults: {}",
            self.virtual_s / 3600.0,
            self.done.len(),
            self.faults.values().sum::<u64>(),
            list(&self.faults)
        )?;
        match self.wrong_episodes {
            0 => write!(f, "nothing found"),
            count => write!(f, "FOUND something in {count} episodes: {}", list(&self.findings)),
        }
    }
}
