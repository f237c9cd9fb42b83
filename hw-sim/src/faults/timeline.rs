//! Faults in the order they begin, so that a look-up of the active ones need not search all: a script of hours has
//! thousands. In: faults. Out: the active ones.

use super::kinds::FaultKind;

/// One fault on one bus.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fault {
    pub(super) kind: FaultKind,
    pub(super) from_ns: u64,
    /// End, exclusive.
    pub(super) until_ns: u64,
    /// `None` means every servo of the bus.
    pub(super) id: Option<u8>,
}

impl Fault {
    pub(super) fn is_on(&self, now_ns: u64) -> bool {
        (self.from_ns..self.until_ns).contains(&now_ns)
    }

    /// True if the plug of one servo, and not that of the adapter, is out.
    pub(super) fn is_one_plug(&self) -> bool {
        self.kind == FaultKind::Unplugged && self.id.is_some()
    }

    /// True if the plug of the adapter is out.
    pub(super) fn is_adapters_plug(&self) -> bool {
        self.kind == FaultKind::Unplugged && self.id.is_none()
    }

    pub(super) fn is_of(&self, id: u8) -> bool {
        self.id.is_none_or(|own| own == id)
    }
}

/// All faults of one bus, or of one inertial measurement unit.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    /// Each fault with the latest end among it and all that began before it, ns.
    faults: Vec<(Fault, u64)>,
}

impl Timeline {
    pub(super) fn add(&mut self, fault: Fault) {
        let place = self.faults.partition_point(|(other, _)| other.from_ns <= fault.from_ns);
        self.faults.insert(place, (fault, 0));
        self.find_ends(place);
    }

    /// Drops all faults but those for which `is_kept` is true.
    pub(super) fn retain(&mut self, mut is_kept: impl FnMut(&Fault) -> bool) {
        self.faults.retain(|(fault, _)| is_kept(fault));
        self.find_ends(0);
    }

    fn find_ends(&mut self, first: usize) {
        let mut latest_ns = first.checked_sub(1).map_or(0, |before| self.faults[before].1);
        for (fault, until_ns) in &mut self.faults[first..] {
            latest_ns = latest_ns.max(fault.until_ns);
            *until_ns = latest_ns;
        }
    }

    /// Active faults, the latest begun first.
    pub(super) fn on(&self, now_ns: u64) -> impl Iterator<Item = &Fault> {
        let begun = self.faults.partition_point(|(fault, _)| fault.from_ns <= now_ns);
        let not_over = self.faults[..begun].iter().rev().take_while(move |(_, until_ns)| *until_ns > now_ns);
        not_over.map(|(fault, _)| fault).filter(move |fault| fault.is_on(now_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_active_from_its_start_to_its_end() {
        // Unordered, some inside others, some alike, one for good.
        let spans = [(50, 60), (10, 90), (10, 12), (95, u64::MAX), (0, 5), (55, 55), (50, 60), (20, 30)];
        let fault = |(id, (from_ns, until_ns)): (u8, (u64, u64))| Fault {
            kind: FaultKind::Silent,
            from_ns,
            until_ns,
            id: Some(id),
        };
        let mut timeline = Timeline::default();
        for numbered in (0..).zip(spans) {
            timeline.add(fault(numbered));
        }
        let on = |timeline: &Timeline, now_ns| {
            let mut ids: Vec<u8> = timeline.on(now_ns).filter_map(|fault| fault.id).collect();
            ids.sort_unstable();
            ids
        };
        for now_ns in 0..100 {
            let all = (0..).zip(spans).filter(|(_, (from, until))| (*from..*until).contains(&now_ns));
            assert_eq!(on(&timeline, now_ns), all.map(|(id, _)| id).collect::<Vec<_>>(), "at {now_ns}");
        }
        timeline.retain(|fault| fault.id != Some(1));
        assert_eq!((on(&timeline, 25), on(&timeline, 40)), (vec![7], vec![]));
    }
}
