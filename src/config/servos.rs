//! `servo` of a joint, and `servos` of an arm: the servo that turns each joint, and its zero count.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::buses::BusEntry;
use super::reader::Section;
use crate::model::{Bus, Protocol, Servo, ServoModel};
use crate::units::ServoId;

/// Most rows of an arm's servos: one for each hinge of the largest arm.
const ROWS_MAX: usize = 180;

/// The buses with the servos found on them so far.
pub(super) struct ServoPlaces<'b> {
    buses: &'b [BusEntry<'b>],
    taken: BTreeMap<(usize, u8), usize>,
    /// True for each bus that has a servo.
    is_used: Vec<bool>,
    /// Model of the first servo of each bus.
    series: Vec<Option<&'static ServoModel>>,
    /// Models that do not speak their bus's protocol, each reported once.
    strangers: Vec<(usize, &'static str)>,
    /// Every model in use, with its bus.
    pub(super) models: Vec<(usize, &'static ServoModel)>,
}

impl<'b> ServoPlaces<'b> {
    /// Without servos yet.
    pub(super) fn new(buses: &'b [BusEntry<'b>]) -> ServoPlaces<'b> {
        let is_used = vec![false; buses.len()];
        let series = vec![None; buses.len()];
        ServoPlaces {
            buses,
            taken: BTreeMap::new(),
            is_used,
            series,
            strangers: Vec::new(),
            models: Vec::new(),
        }
    }

    /// Reads a joint's servo: `Some(None)` for a joint of a robot on paper, `None` for a fault.
    pub(super) fn read(
        &mut self,
        joint: &Section<'_>,
        range_rad: Option<(f64, f64)>,
    ) -> Option<Option<Servo>> {
        if !joint.has("servo") && self.buses.is_empty() {
            return Some(None);
        }
        if self.buses.is_empty() {
            joint.fault("servo", "no servo, as the file has no [[bus]]; add the bus, or take the servo out");
            return None;
        }
        let meaning = "the servo that turns this joint: { model, bus, id, reversed }";
        joint.section("servo", meaning, |servo| self.read_servo(joint, servo, range_rad)).map(Some)
    }

    fn read_servo(
        &mut self,
        joint: &Section<'_>,
        servo: &Section<'_>,
        range_rad: Option<(f64, f64)>,
    ) -> Option<Servo> {
        let (model, bus) = self.read_kind(servo);
        let id = read_id(servo);
        let reversed = servo.flag_or("reversed", "whether a positive joint turn is a falling count", false);
        if let (Some(bus), Some(id)) = (bus, id) {
            self.take(servo, "id", bus, id);
        }
        if let (Some(model), Some(range)) = (model, range_rad) {
            check_reach(joint, "range_deg", model, range);
        }

        let (model, reversed) = (model?, reversed?);
        let zero_count = zero_count(model, range_rad?, reversed);
        Some(Servo { model, bus: bus?, id: ServoId(id?), reversed, zero_count, firmware: None })
    }

    /// Model and bus of a servo, or of a row of them.
    fn read_kind(&mut self, servo: &Section<'_>) -> (Option<&'static ServoModel>, Option<usize>) {
        let models: Vec<_> = ServoModel::all().map(|model| (model.name, model)).collect();
        let model = servo.choice("model", "a servo model", &models);
        let names: Vec<_> = self.buses.iter().map(|bus| bus.name).collect();
        let bus = servo.reference("bus", "the name of a [[bus]]", &names);
        if let Some(bus) = bus {
            self.is_used[bus] = true;
        }
        if let (Some(model), Some(bus)) = (model, bus) {
            self.check_language(servo, model, bus);
            self.check_series(servo, model, bus);
            check_baud(servo, model, self.buses[bus].bus.as_ref());
            self.models.push((bus, model));
        }
        (model, bus)
    }

    /// Reads the servos of an arm with this many `joints` of this many `hinges`, row by row from its root: none for
    /// an arm on paper.
    pub(super) fn read_rows(
        &mut self,
        arm: &Section<'_>,
        joints: Option<usize>,
        hinges: Option<usize>,
        range_rad: Option<(f64, f64)>,
    ) -> Option<Vec<ServoRow>> {
        if self.buses.is_empty() {
            if arm.has("servos") {
                let expected = "no servos, as the file has no [[bus]]; add the bus, or take the servos out";
                arm.fault("servos", expected);
                return None;
            }
            return Some(Vec::new());
        }
        let rows = arm.list("servos", "the servos from root to tip", ROWS_MAX, |row| {
            self.read_row(row, hinges?, range_rad?)
        });
        if rows.is_empty() {
            arm.fault(
                "servos",
                "the servos from root to tip: [[arm.servos]] with model, bus, joints, first_id",
            );
            return None;
        }
        let rows: Vec<ServoRow> = rows.into_iter().collect::<Option<_>>()?;
        let count: usize = rows.iter().map(|row| row.count).sum();
        let (joints, hinges) = (joints?, hinges?);
        if count != joints * hinges {
            let have = count / hinges;
            arm.fault(
                "servos",
                format!("rows of {joints} joints all together, as the arm has; they have {have}"),
            );
            return None;
        }
        Some(rows)
    }

    fn read_row(&mut self, row: &Section<'_>, hinges: usize, range_rad: (f64, f64)) -> Option<ServoRow> {
        let (model, bus) = self.read_kind(row);
        let joints =
            row.integer("joints", "how many joints these servos turn", 1..=u32::from(Protocol::ID_MAX));
        let meaning = "the id of the first of these servos; the others follow it";
        let first = row.integer("first_id", meaning, 0..=u32::from(Protocol::ID_MAX));
        let reversed = row.flag_or("reversed", "whether a positive joint turn is a falling count", false);
        let count = usize::try_from(joints?).ok()? * hinges;
        let first = u8::try_from(first?).ok()?;
        let last = usize::from(first) + count - 1;
        if last > usize::from(Protocol::ID_MAX) {
            row.fault("first_id", format!("ids of {} at most: the last would be {last}", Protocol::ID_MAX));
            return None;
        }
        for id in (first..=Protocol::ID_MAX).take(count) {
            if let Some(bus) = bus {
                self.take(row, "first_id", bus, id);
            }
        }
        let model = model?;
        check_reach(row, "model", model, range_rad);
        Some(ServoRow { model, bus: bus?, first_id: first, reversed: reversed?, count })
    }

    /// Reports each model of the wrong protocol once for each bus.
    fn check_language(&mut self, servo: &Section<'_>, model: &'static ServoModel, bus: usize) {
        let Some(protocol) = self.buses[bus].protocol.filter(|protocol| *protocol != model.protocol) else {
            return;
        };
        if self.strangers.contains(&(bus, model.name)) {
            return;
        }
        self.strangers.push((bus, model.name));
        servo.fault(
            "model",
            format!(
                "a model that speaks {}, as its bus does; {} speaks {} (reported once for all of them on this bus)",
                protocol.name(),
                model.name,
                model.protocol.name()
            ),
        );
    }

    /// Checks that all servos of a bus are of one series: the loop asks them all in the same way.
    fn check_series(&mut self, servo: &Section<'_>, model: &'static ServoModel, bus: usize) {
        let first = *self.series[bus].get_or_insert(model);
        let is_other = model.protocol == first.protocol && model.registers != first.registers;
        if is_other && !self.strangers.contains(&(bus, model.name)) {
            self.strangers.push((bus, model.name));
            servo.fault(
                "model",
                format!(
                    "a model of the series of {}, which is on this bus before it: other registers need a bus of their \
                     own (reported once for all {} on this bus)",
                    first.name, model.name
                ),
            );
        }
    }

    fn take(&mut self, servo: &Section<'_>, key: &str, bus: usize, id: u8) {
        match self.taken.get(&(bus, id)) {
            Some(line) => servo.fault(
                key,
                format!(
                    "an id that is free on this bus: the joint in line {line} has it; \
                     each joint needs a servo and each servo of a bus an id of its own"
                ),
            ),
            None => {
                self.taken.insert((bus, id), servo.line(key));
            }
        }
    }

    /// Notes every bus that has no servo, unless a servo's bus could not be read.
    pub(super) fn refuse_idle_buses(&self, file: &Section<'_>, all_servos_read: bool) {
        if !all_servos_read {
            return;
        }
        for (place, _) in self.is_used.iter().enumerate().filter(|(_, is_used)| !**is_used) {
            file.fault(
                &format!("bus[{place}].name"),
                "a bus that some servo names; name it in a servo, or take the bus out",
            );
        }
    }
}

/// Servos with consecutive ids, which turn the hinges of an arm.
pub(super) struct ServoRow {
    model: &'static ServoModel,
    bus: usize,
    first_id: u8,
    reversed: bool,
    pub(super) count: usize,
}

impl ServoRow {
    /// The servo at this index in the row, for a hinge of this range.
    pub(super) fn servo(&self, place: usize, range_rad: (f64, f64)) -> Servo {
        // The row ends within the valid ids.
        let id = self.first_id.saturating_add(u8::try_from(place).unwrap_or(u8::MAX));
        Servo {
            model: self.model,
            bus: self.bus,
            id: ServoId(id),
            reversed: self.reversed,
            zero_count: zero_count(self.model, range_rad, self.reversed),
            firmware: None,
        }
    }
}

fn read_id(servo: &Section<'_>) -> Option<u8> {
    let meaning = "the servo's id (254 is the broadcast address, 253 and 255 occur in packet headers)";
    let id = servo.integer("id", meaning, 0..=u32::from(Protocol::ID_MAX))?;
    u8::try_from(id).ok()
}

fn check_baud(servo: &Section<'_>, model: &ServoModel, bus: Option<&Bus>) {
    let Some(bus) = bus.filter(|bus| bus.protocol == model.protocol && bus.baud > model.baud_max) else {
        return;
    };
    servo.fault(
        "model",
        format!(
            "a model that can be set to {} baud, as its bus is; {} reaches {}",
            bus.baud, model.name, model.baud_max
        ),
    );
}

/// With the middle of the range at the servo's middle count, both ends must lie within its counts.
fn check_reach(section: &Section<'_>, key: &str, model: &ServoModel, (low, high): (f64, f64)) {
    let middle = model.middle_count();
    let room = (f64::from(model.count_range.1) - middle).min(middle - f64::from(model.count_range.0));
    let widest_rad = 2.0 * room / counts_per_rad(model);
    if high - low > widest_rad {
        let widest = (widest_rad.to_degrees() * 10.0).floor() / 10.0;
        section.fault(
            key,
            format!(
                "at most {widest} degrees from end to end: the counts of {} reach no further with the \
                 middle of the range at count {middle}",
                model.name
            ),
        );
    }
}

/// Count at joint angle zero if the middle of the range is at the middle count.
fn zero_count(model: &ServoModel, (low, high): (f64, f64), reversed: bool) -> f64 {
    let sign = if reversed { -1.0 } else { 1.0 };
    model.middle_count() - sign * 0.5 * (low + high) * counts_per_rad(model)
}

fn counts_per_rad(model: &ServoModel) -> f64 {
    model.counts_per_turn / TAU
}
