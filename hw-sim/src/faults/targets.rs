//! Which buses a fault affects.

use super::mistakes::Mistake;
use super::script::Target;
use crate::config::BusConfig;

/// Indices in `buses` of the buses meant: the named one, the only one that has the id, or all.
pub(super) fn buses_of(target: &Target, buses: &[BusConfig]) -> Result<Vec<usize>, Mistake> {
    let entry = target.place.entry;
    let at_bus = |name: &str, expected| Mistake {
        line: target.place.bus_line,
        key: format!("fault[{entry}].bus"),
        value: Some(format!("\"{name}\"")),
        expected,
    };
    let at_id = |id: u8, expected| Mistake {
        line: target.place.id_line,
        key: format!("fault[{entry}].id"),
        value: Some(id.to_string()),
        expected,
    };
    let has = |bus: &BusConfig, id: u8| bus.servos.iter().any(|servo| servo.id == id);
    let all = || (0..buses.len()).collect::<Vec<_>>();
    let named = match &target.bus {
        None => all(),
        Some(name) => match buses.iter().position(|bus| bus.name == *name) {
            Some(place) => vec![place],
            None => return Err(at_bus(name, format!("the name of a bus: {}", names(buses, &all())))),
        },
    };
    let Some(id) = target.id else { return Ok(named) };
    let with_id: Vec<usize> = named.iter().copied().filter(|place| has(&buses[*place], id)).collect();
    match with_id.len() {
        0 => Err(at_id(id, format!("the id of a servo: {}", ids(buses, &named)))),
        1 => Ok(with_id),
        _ => {
            let which = names(buses, &with_id);
            Err(at_id(id, format!("an id that only one bus has, or bus beside it: {which} have this one")))
        }
    }
}

fn names(buses: &[BusConfig], places: &[usize]) -> String {
    let names: Vec<String> = places.iter().map(|place| format!("\"{}\"", buses[*place].name)).collect();
    names.join(", ")
}

/// The ids on these buses, bus by bus.
fn ids(buses: &[BusConfig], places: &[usize]) -> String {
    let of_bus = |place: &usize| {
        let bus = &buses[*place];
        let ids: Vec<String> = bus.servos.iter().map(|servo| servo.id.to_string()).collect();
        format!("{} on \"{}\"", ids.join(", "), bus.name)
    };
    places.iter().map(of_bus).collect::<Vec<_>>().join("; ")
}
