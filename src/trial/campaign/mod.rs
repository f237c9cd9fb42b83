//! Runs with many faults: robots run over and over, and a judge that trusts none of their reports checks each run.
//!
//! Input: robots, and a seed. Output: the faults found in each episode ([`Judged`]), and the smallest episode
//! that still shows them. Each episode runs the whole program on a virtual clock; the same robot, seed and
//! number give the same episode on any number of processors. See docs/faults.md.

mod draw;
mod faults;
mod judge;
mod shrink;
mod stage;
mod subject;
mod tally;

use std::collections::BTreeSet;
use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::TrialError;
pub use draw::{Episode, Ordered};
pub use judge::{Ended, Finding, Judge, Violation};
pub use shrink::smallest;
pub use stage::{Played, play};
pub use subject::Subject;
pub use tally::Tally;

/// Number of findings of each kind that are reduced for each robot; the others are only counted.
const SHRUNK_OF_A_KIND: usize = 2;

/// One episode, judged.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Index of the robot in the campaign.
    pub subject: usize,
    /// Number of the episode in the series of the campaign's seed and this robot.
    pub number: u64,
    /// Kinds of the faults that were scripted.
    pub faults: Vec<&'static str>,
    /// Its outcome.
    pub played: Played,
    /// The smallest episodes found that show the same faults.
    pub smallest: Vec<(Violation, Episode, Played)>,
}

/// Many episodes of robots.
#[derive(Debug)]
pub struct Campaign {
    subjects: Vec<Subject>,
    seed: u64,
}

impl Campaign {
    /// Episodes of these robots, with all random numbers from `seed`.
    pub fn new(subjects: Vec<Subject>, seed: u64) -> Campaign {
        Campaign { subjects, seed }
    }

    /// The robots.
    pub fn subjects(&self) -> &[Subject] {
        &self.subjects
    }

    /// Plays episodes, each robot in turn, on all processors, until they add up to `most_s` of virtual time
    /// or `is_to_stop` returns true. Skips those that are already `done`, by robot and number, and counts
    /// them as `done_s`. Calls `tell` with each as soon as it is judged, in any order.
    ///
    /// # Errors
    /// The first error that occurred.
    pub fn run(
        &self,
        most_s: f64,
        done: &BTreeSet<(usize, u64)>,
        done_s: f64,
        is_to_stop: impl Fn() -> bool + Sync,
        tell: impl FnMut(Judged) + Send,
    ) -> Result<(), TrialError> {
        let next = AtomicU64::new(0);
        let is_over = AtomicBool::new(done_s >= most_s);
        let shared = Mutex::new(Shared { tell, virtual_s: done_s, shrunk: Vec::new(), error: None });
        let count = u64::try_from(self.subjects.len().max(1)).unwrap_or(1);
        let work = || {
            while !is_over.load(Ordering::Relaxed) && !is_to_stop() {
                let turn = next.fetch_add(1, Ordering::Relaxed);
                let subject = usize::try_from(turn % count).unwrap_or(0);
                let number = turn / count;
                if done.contains(&(subject, number)) {
                    continue;
                }
                let judged = self.judge(subject, number, &shared, &is_to_stop);
                let Ok(mut shared) = shared.lock() else { return };
                match judged {
                    Ok(judged) => {
                        shared.virtual_s += judged.played.virtual_s;
                        if shared.virtual_s >= most_s {
                            is_over.store(true, Ordering::Relaxed);
                        }
                        (shared.tell)(judged);
                    }
                    Err(error) => {
                        shared.error.get_or_insert(error);
                        is_over.store(true, Ordering::Relaxed);
                    }
                }
            }
        };
        std::thread::scope(|scope| {
            let workers = std::thread::available_parallelism().map_or(1, NonZero::get);
            (0..workers).for_each(|_| drop(scope.spawn(work)));
        });
        let shared = shared.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        shared.error.map_or(Ok(()), Err)
    }

    fn judge<T: FnMut(Judged) + Send>(
        &self,
        index: usize,
        number: u64,
        shared: &Mutex<Shared<T>>,
        is_to_stop: &dyn Fn() -> bool,
    ) -> Result<Judged, TrialError> {
        let subject = &self.subjects[index];
        let episode = Episode::draw(subject, self.seed, number);
        let played = play(subject, &episode)?;
        let mut kinds: Vec<Violation> = played.findings.iter().map(|finding| finding.wrong).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let mut all_smallest = Vec::new();
        for wrong in kinds {
            if !shared.lock().is_ok_and(|mut shared| shared.may_shrink(index, wrong)) {
                continue;
            }
            let small = smallest(subject, &episode, wrong, is_to_stop);
            let played = play(subject, &small)?;
            all_smallest.push((wrong, small, played));
        }
        let faults = episode.faults.iter().map(|fault| fault.kind.name()).collect();
        Ok(Judged { subject: index, number, faults, played, smallest: all_smallest })
    }
}

/// The data that all processors share.
struct Shared<T> {
    tell: T,
    virtual_s: f64,
    /// Findings that were reduced.
    shrunk: Vec<(usize, Violation)>,
    error: Option<TrialError>,
}

impl<T> Shared<T> {
    /// True if another finding of this kind should be reduced; it then counts as reduced.
    fn may_shrink(&mut self, subject: usize, wrong: Violation) -> bool {
        let may = self.shrunk.iter().filter(|of| **of == (subject, wrong)).count() < SHRUNK_OF_A_KIND;
        if may {
            self.shrunk.push((subject, wrong));
        }
        may
    }
}
