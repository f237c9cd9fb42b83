//! Robots run under many faults, and a judge reads their servos' own registers.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::collections::BTreeSet;
use std::sync::Mutex;

use common::config_file;
use hippocamp::config;
use hippocamp::kinds;
use hippocamp::trial::campaign::{Campaign, Episode, Judged, Subject, Tally, play};

const ALL: [&str; 5] = ["horse.toml", "horse-dynamixel.toml", "figure.toml", "octopus.toml", "tentacle.toml"];

fn subject(name: &str) -> Subject {
    let robot = config::load(&config_file(name)).unwrap_or_else(|error| panic!("{error}")).robot;
    let kind = kinds::of(&robot).unwrap_or_else(|error| panic!("{error}"));
    Subject::new(robot, kind).unwrap_or_else(|error| panic!("{error}"))
}

/// All episodes of a campaign of these robots, in their order.
fn campaign(names: &[&str], seed: u64, hours: f64) -> (Vec<Judged>, Tally) {
    let campaign = Campaign::new(names.iter().map(|name| subject(name)).collect(), seed);
    let all = Mutex::new(Vec::new());
    campaign
        .run(3600.0 * hours, &BTreeSet::new(), 0.0, || false, |judged| all.lock().unwrap().push(judged))
        .unwrap_or_else(|error| panic!("{error}"));
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|judged| (judged.subject, judged.number));
    let mut tally = Tally::default();
    for judged in &all {
        let line = tally.count(judged);
        let mut again = Tally::default();
        again.take_up(&line);
        assert_eq!(again.done.len(), 1, "{line}");
    }
    (all, tally)
}

/// The findings, in words.
fn found(all: &[Judged]) -> Vec<String> {
    let words = |judged: &Judged| {
        let findings = judged.played.findings.clone().into_iter();
        let (subject, number) = (judged.subject, judged.number);
        findings
            .map(move |finding| format!("robot {subject}, episode {number}: {finding:?}"))
            .collect::<Vec<_>>()
    };
    all.iter().flat_map(words).collect()
}

#[test]
fn a_short_campaign_finds_nothing_and_repeats_exactly() {
    let names = ["tentacle.toml", "horse.toml"];
    let (all, tally) = campaign(&names, 5, 0.03);
    assert_eq!(found(&all), [""; 0]);
    assert!(tally.virtual_s >= 0.03 * 3600.0 && tally.robots_s.len() == 2, "{tally}");
    // One after the other, in another order, on one processor.
    let subjects = names.map(subject);
    for judged in all.iter().rev().take(4) {
        let subject = &subjects[judged.subject];
        let episode = Episode::draw(subject, 5, judged.number);
        assert_eq!(play(subject, &episode).unwrap(), judged.played, "{}", judged.number);
    }
}

#[test]
fn a_long_campaign_of_all_robots_finds_nothing() {
    if !common::is_full() {
        return;
    }
    let (all, tally) = campaign(&ALL, 11, 2.0);
    assert_eq!(found(&all), [""; 0], "{tally}");
}
