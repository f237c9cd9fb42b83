//! Which chains are a robot's legs.

use super::limb::ChainEntry;
use super::reader::Section;

/// The chains named by these keys of a robot's legs.
pub(super) fn read_legs<const N: usize>(
    section: &Section<'_>,
    chains: &[ChainEntry<'_>],
    keys: [&'static str; N],
) -> Option<[usize; N]> {
    let names: Vec<_> = chains.iter().map(|chain| chain.name).collect();
    let mut legs = [None; N];
    for place in 0..legs.len() {
        let leg = section.reference(keys[place], "the name of this leg's chain", &names);
        let twin = (0..place).find(|earlier| leg.is_some() && legs[*earlier] == leg);
        if let Some(twin) = twin {
            let twin = keys[twin];
            section.fault(keys[place], format!("a chain of its own: {twin} is this chain already"));
        }
        legs[place] = leg;
    }
    let all_found = legs.iter().all(Option::is_some);
    all_found.then(|| legs.map(Option::unwrap_or_default))
}
