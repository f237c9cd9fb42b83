//! Robots run over and over while everything goes wrong, before a judge who believes none of their reports.
//!
//! Comes in: robots, and a seed. Goes out: what was wrong in each episode ([`Judged`]), and the smallest episode in which
//! it still is. Each episode runs the whole program on a virtual clock; the same robot, seed and number give the same
//! episode, on however many processors. See docs/faults.md.

mod chance;
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
pub use judge::{Ended, Finding, Judge, Wrong};
pub use shrink::smallest;
pub use stage::{Played, play};
pub use subject::Subject;
pub use tally::Tally;

/// So many findings of a kind are made smaller for each robot; of the others only the number is told.
const SHRUNK_OF_A_KIND: usize = 2;

/// One episode, judged.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Which robot, by its place among the campaign's.
    pub subject: usize,
    /// Number of the episode among those of the campaign's seed and this robot.
    pub number: u64,
    /// Kinds of the faults that were scripted.
    pub faults: Vec<&'static str>,
    /// What became of it.
    pub played: Played,
    /// The smallest episodes found in which the same is wrong.
    pub smallest: Vec<(Wrong, Episode, Played)>,
}

/// Many episodes of robots.
#[derive(Debug)]
pub struct Campaign {
    subjects: Vec<Subject>,
    seed: u64,
}

impl Campaign {
    /// Of these robots, all chance from `seed`.
    pub fn new(subjects: Vec<Subject>, seed: u64) -> Campaign {
        Campaign { subjects, seed }
    }

    /// Who is tried.
    pub fn subjects(&self) -> &[Subject] {
        &self.subjects
    }

    /// Plays episodes, robot by robot in turn, on all processors there are, until they come to `most_s` of virtual time or
    /// `is_to_stop`. Leaves out those that were `done`, by robot and number, and counts them as `done_s`. `tell` hears of
    /// each when it is judged, in whatever order that is.
    ///
    /// # Errors
    /// The first that occurred.
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
        let mut kinds: Vec<Wrong> = played.findings.iter().map(|finding| finding.wrong).collect();
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

/// What all processors share.
struct Shared<T> {
    tell: T,
    virtual_s: f64,
    /// What was made smaller.
    shrunk: Vec<(usize, Wrong)>,
    error: Option<TrialError>,
}

impl<T> Shared<T> {
    /// Whether another finding of this kind is to be made smaller; it is then one that was.
    fn may_shrink(&mut self, subject: usize, wrong: Wrong) -> bool {
        let may = self.shrunk.iter().filter(|of| **of == (subject, wrong)).count() < SHRUNK_OF_A_KIND;
        if may {
            self.shrunk.push((subject, wrong));
        }
        may
    }
}
