//! Fault scripts as typed in: TOML to a checked list, or every mistake in it.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::kinds::{FaultKind, KINDS, Kind, PUSH_S, Scope};
use super::mistakes::{FaultError, Mistake, Mistakes};
use super::script::{FaultScript, GroundChange, Place, ScriptedFault, ScriptedPush, Target};
use super::targets;
use crate::body::Step;
use crate::config::BusConfig;

/// Keys that only a push has.
const PUSH_KEYS: [&str; 5] = ["impulse_n_s", "force_n", "direction_deg", "place_mm", "every_s"];

/// Keys of all kinds of fault.
const COMMON_KEYS: [&str; 5] = ["kind", "at_s", "for_s", "bus", "id"];

/// Every key of a fault; some kinds lack those from `for_s` on.
fn keys() -> Vec<&'static str> {
    let mut keys = COMMON_KEYS.to_vec();
    for (key, ..) in KINDS.iter().filter_map(|kind| kind.own.as_ref()) {
        if !keys.contains(key) {
            keys.push(key);
        }
    }
    keys.extend(PUSH_KEYS);
    keys
}

const DIRECTION: &str = "a direction in degrees from ahead to the left";

/// Most faults in a script, and most blocks on a ground: more than hours of a bad day.
const FAULTS_MAX: usize = 10_000;
const STEPS_MAX: usize = 1000;
/// Longest piece of the script that a mistake quotes, characters.
const PIECE_SHOWN: usize = 60;

/// Hardest push, N: some hundred times the weight of a robot on a bench.
const FORCE_MAX_N: f64 = 1e4;
/// Longest time in a script, s: 100 days, far from an overflow of nanoseconds.
const TIME_MAX_S: f64 = 8.64e6;

impl FaultScript {
    /// Reads a script: a list of `[[fault]]`, each with `kind`, `at_s`, optionally `for_s` (else for good), `bus`
    /// (else every bus), `id` (else every servo; without `bus`, one that only one bus has), and the kind's own key:
    /// `delay_ms`, `share`, `as_id`, `volts` or `celsius`. A push has `impulse_n_s` or `force_n`, and optionally
    /// `direction_deg`, `place_mm` and `every_s`. A section `[ground]` replaces parts of the robot's own ground.
    ///
    /// # Errors
    /// Every mistake, with its line and key. This does not check whether the buses and servos exist.
    pub fn from_toml(text: &str) -> Result<FaultScript, FaultError> {
        FaultScript::for_buses(text, "fault script", None)
    }

    /// The same for a script in a file called `file_name`, to be played on `buses` if these are given: a bus or a
    /// servo that is not among them counts as one more mistake.
    ///
    /// # Errors
    /// Every mistake, with its line and key.
    pub fn for_buses(
        text: &str,
        file_name: &str,
        buses: Option<&[BusConfig]>,
    ) -> Result<FaultScript, FaultError> {
        let Content { faults, ground, ground_line, mut mistakes } = read(text);
        if let Some(buses) = buses {
            let strangers = faults.iter().filter_map(|fault| targets::buses_of(&fault.target, buses).err());
            strangers.for_each(|mistake| mistakes.push(mistake));
        }
        if let Some(error) = mistakes.finish(file_name) {
            return Err(error);
        }
        Ok(FaultScript { faults, ground, ground_line, file_name: file_name.to_owned() })
    }
}

/// The content of a script, and its mistakes; parts with a mistake hold no meaningful value.
#[derive(Default)]
struct Content {
    faults: Vec<ScriptedFault>,
    ground: GroundChange,
    ground_line: Option<usize>,
    mistakes: Mistakes,
}

fn read(text: &str) -> Content {
    let (document, errors) = DeTable::parse_recoverable(text);
    let lines = Lines::of(text);
    let mut mistakes = Mistakes::default();
    if !errors.is_empty() {
        // Further mistakes in one line usually follow from the first.
        let mut first_in_line = BTreeMap::new();
        for error in &errors {
            let line = lines.line_of(error.span().map_or(0, |span| span.start));
            first_in_line.entry(line).or_insert(error);
        }
        for (line, error) in first_in_line {
            let expected = || format!("TOML; {}", error.message());
            mistakes.note(line, || Mistake { line, key: String::new(), value: None, expected: expected() });
        }
        return Content { mistakes, ..Content::default() };
    }
    let source = Source { text, lines: &lines };
    let mut top = Section { source, path: String::new(), line: 1, table: document.get_ref(), mistakes };
    top.refuse_unknown(&["fault", "ground"]);
    let ground_line = top.value("ground").map(|_| top.line_of("ground"));
    let ground = top.read_ground();
    let items = top.value("fault").map_or(Some(&[][..]), |list| list.as_array().map(|items| &items[..]));
    let Some(items) = items.filter(|items| items.iter().all(|item| item.get_ref().is_table())) else {
        top.mistake("fault", "a list of faults: write [[fault]]");
        return Content { mistakes: top.mistakes, ..Content::default() };
    };
    if items.len() > FAULTS_MAX {
        top.mistake("fault", format!("a list of at most {FAULTS_MAX} faults; these are {}", items.len()));
        return Content { mistakes: top.mistakes, ..Content::default() };
    }
    let (mut faults, mut mistakes) = (Vec::new(), top.mistakes);
    for (entry, item) in items.iter().enumerate() {
        if let Some(table) = item.get_ref().as_table() {
            let line = lines.line_of(item.span().start);
            let mut section = Section { source, path: format!("fault[{entry}]."), line, table, mistakes };
            faults.push(section.read_fault(entry));
            mistakes = section.mistakes;
        }
    }
    Content { faults, ground, ground_line, mistakes }
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Lines {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Lines(std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect())
    }

    /// Line of a byte, from 1.
    fn line_of(&self, byte: usize) -> usize {
        self.0.partition_point(|begin| *begin <= byte)
    }
}

/// The text of the script.
#[derive(Clone, Copy)]
struct Source<'a> {
    text: &'a str,
    lines: &'a Lines,
}

/// One table of the script while it is read.
struct Section<'a> {
    source: Source<'a>,
    /// Prefix of the paths of its keys.
    path: String,
    /// Where it begins.
    line: usize,
    table: &'a DeTable<'a>,
    mistakes: Mistakes,
}

impl<'a> Section<'a> {
    fn read_fault(&mut self, entry: usize) -> ScriptedFault {
        self.refuse_unknown(&keys());
        let kind = self.read_kind();
        if let Some(kind) = kind {
            self.refuse_keys_of_others(kind);
        }
        let own = kind.and_then(|kind| kind.own.as_ref());
        let own = own.map_or(0.0, |(key, meaning, range)| self.number(key, meaning, range));
        let at_s = self.number("at_s", "when it begins in s", &(0.0..=TIME_MAX_S));
        let lasts = 1e-9..=TIME_MAX_S;
        let for_s = self.value("for_s").map(|_| self.number("for_s", "how long it lasts in s", &lasts));
        let make = kind.map_or(KINDS[0].make, |kind| kind.make);
        let mut kind = make(own);
        if let FaultKind::Push(push) = &mut kind {
            *push = self.read_push(for_s);
        }
        ScriptedFault { at_s, for_s, kind, target: self.read_target(entry) }
    }

    fn read_push(&mut self, for_s: Option<f64>) -> ScriptedPush {
        let for_s = for_s.unwrap_or(PUSH_S);
        let impulse_n_s = match (self.value("force_n"), self.value("impulse_n_s")) {
            (Some(_), Some(_)) => {
                self.mistake("force_n", "no such key beside impulse_n_s: one of them tells how strong it is");
                0.0
            }
            (Some(_), None) => {
                for_s * self.number("force_n", "the force of the push in N", &(1e-6..=FORCE_MAX_N))
            }
            (None, _) => self.number("impulse_n_s", "force times time of the push in N s", &(1e-6..=1e4)),
        };
        if self.value("impulse_n_s").is_some() && impulse_n_s > for_s * FORCE_MAX_N {
            let expected = format!("a push of at most {FORCE_MAX_N} N: a weaker one, or over a longer for_s");
            self.mistake("impulse_n_s", expected);
        }
        let direction = self.optional("direction_deg", DIRECTION, &(-360.0..=360.0));
        let every_s = self.optional("every_s", "after how many s it comes again", &(1e-3..=TIME_MAX_S));
        let place_m = self.value("place_mm").map_or([0.0; 3], |value| {
            let numbers: Option<Vec<f64>> =
                value.as_array().and_then(|list| list.iter().map(|item| real(item.get_ref())).collect());
            let place = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
            let place = place.filter(|place| place.iter().all(|number| number.abs() <= 1e5));
            place.map_or_else(
                || {
                    self.mistake("place_mm", "where on the trunk, in mm along x, y, z: a list of 3 numbers");
                    [0.0; 3]
                },
                |place| place.map(|millimetres| millimetres / 1000.0),
            )
        });
        ScriptedPush { impulse_n_s, for_s, towards_rad: direction.map(f64::to_radians), place_m, every_s }
    }

    /// Reads `[ground]` at the top level of the script.
    fn read_ground(&mut self) -> GroundChange {
        let Some(value) = self.value("ground") else { return GroundChange::default() };
        let Some(table) = value.as_table() else {
            self.mistake("ground", "another ground: write [ground]");
            return GroundChange::default();
        };
        let mut ground = self.enter("ground.", self.line_of("ground"), table);
        ground.refuse_unknown(&["friction", "slope_deg", "uphill_deg", "step"]);
        let friction = ground.optional("friction", "the friction of the ground", &(0.0..=5.0));
        let slope = ground.optional("slope_deg", "how steep the ground is, in degrees", &(-45.0..=45.0));
        let uphill = ground.optional("uphill_deg", DIRECTION, &(-360.0..=360.0));
        let steps = ground.read_steps();
        self.mistakes = ground.mistakes;
        let (slope_rad, uphill_rad) = (slope.map(f64::to_radians), uphill.map(f64::to_radians));
        GroundChange { friction, slope_rad, uphill_rad, steps }
    }

    /// Reads `[[ground.step]]` inside `[ground]`.
    fn read_steps(&mut self) -> Option<Vec<Step>> {
        let Some(items) = self.value("step")?.as_array() else {
            self.mistake("step", "blocks across the way: write [[ground.step]]");
            return None;
        };
        if items.len() > STEPS_MAX {
            self.mistake("step", format!("at most {STEPS_MAX} blocks across the way"));
            return None;
        }
        let mut steps = Vec::new();
        for (place, item) in items.iter().enumerate() {
            let Some(table) = item.get_ref().as_table() else {
                self.mistake("step", "blocks across the way: write [[ground.step]]");
                return None;
            };
            let line = self.source.lines.line_of(item.span().start);
            let mut step = self.enter(&format!("ground.step[{place}]."), line, table);
            step.refuse_unknown(&["at_mm", "length_mm", "height_mm"]);
            let at_mm = step.number("at_mm", "where it begins, in mm ahead of the start", &(-1e6..=1e6));
            let length_mm = step.number("length_mm", "how long it is along the way in mm", &(1e-3..=1e6));
            let height_mm = step.number("height_mm", "how high it is in mm", &(1e-3..=1e4));
            self.mistakes = step.mistakes;
            let [at_m, length_m, height_m] = [at_mm, length_mm, height_mm].map(|length| length / 1000.0);
            steps.push(Step { at_m, length_m, height_m });
        }
        Some(steps)
    }

    /// A table inside this one; it takes over the list of mistakes.
    fn enter(&mut self, path: &str, line: usize, table: &'a DeTable<'a>) -> Section<'a> {
        let mistakes = std::mem::take(&mut self.mistakes);
        Section { source: self.source, path: path.to_owned(), line, table, mistakes }
    }

    /// An optional number.
    fn optional(&mut self, key: &str, meaning: &str, range: &RangeInclusive<f64>) -> Option<f64> {
        self.value(key).map(|_| self.number(key, meaning, range))
    }

    fn read_kind(&mut self) -> Option<&'static Kind> {
        let word = self.value("kind").and_then(DeValue::as_str);
        let found = KINDS.iter().find(|kind| Some(kind.word) == word);
        if found.is_none() {
            let words: Vec<String> = KINDS.iter().map(|kind| format!("\"{}\"", kind.word)).collect();
            self.mistake("kind", format!("what happens: one of {}", words.join(", ")));
        }
        found
    }

    fn read_target(&mut self, entry: usize) -> Target {
        let place = Place { entry, bus_line: self.line_of("bus"), id_line: self.line_of("id") };
        let everywhere = Target { place, ..Target::default() };
        let bus = match self.value("bus").map(DeValue::as_str) {
            None => None,
            Some(Some(name)) => Some(name.to_owned()),
            Some(None) => {
                self.mistake("bus", "the name of a bus in quotes");
                return everywhere;
            }
        };
        let id = match self.value("id").map(whole) {
            None => None,
            Some(Some(id)) => Some(id),
            Some(None) => {
                self.mistake("id", "the id of a servo, a whole number from 0 to 253");
                return everywhere;
            }
        };
        Target { bus, id, place }
    }

    fn refuse_keys_of_others(&mut self, kind: &Kind) {
        let own = kind.own.as_ref().map(|(key, ..)| *key);
        for key in &keys()[2..] {
            let belongs = match *key {
                "for_s" => !matches!(kind.scope, Scope::Host | Scope::ServosOnce),
                "bus" => !matches!(kind.scope, Scope::Host | Scope::Imu | Scope::Trunk),
                "id" => matches!(kind.scope, Scope::Servos | Scope::ServosOnce),
                push_key if PUSH_KEYS.contains(&push_key) => kind.scope == Scope::Trunk,
                own_key => own == Some(own_key),
            };
            if !belongs && self.value(key).is_some() {
                self.mistake(key, format!("no such key: kind \"{}\" has none; leave it out", kind.word));
            }
        }
    }

    fn refuse_unknown(&mut self, known: &[&str]) {
        let table = self.table;
        let known_words = known.join(", ");
        for key in table.keys().map(|key| key.get_ref().as_ref()).filter(|key| !known.contains(key)) {
            self.mistake_if_told(key, || format!("a known key; known are {known_words}"));
        }
    }

    fn value(&self, key: &str) -> Option<&'a DeValue<'a>> {
        self.table.get(key).map(Spanned::get_ref)
    }

    /// A required number; 0 after a mistake.
    fn number(&mut self, key: &str, meaning: &str, range: &RangeInclusive<f64>) -> f64 {
        let number = self.value(key).and_then(real).filter(|number| range.contains(number));
        number.unwrap_or_else(|| {
            self.mistake(key, format!("{meaning}, {} to {}", range.start(), range.end()));
            0.0
        })
    }

    /// Line of a key, or of the table if the key is not set.
    fn line_of(&self, key: &str) -> usize {
        let set = self.table.get_key_value(key);
        set.map_or(self.line, |(key, _)| self.source.lines.line_of(key.span().start))
    }

    fn mistake(&mut self, key: &str, expected: impl Into<String>) {
        self.mistake_if_told(key, || expected.into());
    }

    /// Notes a mistake; builds its text only if the error will list it.
    fn mistake_if_told(&mut self, key: &str, expected: impl FnOnce() -> String) {
        let line = self.line_of(key);
        let value = self.table.get(key).and_then(|value| self.source.text.get(value.span()));
        let path = &self.path;
        self.mistakes.note(line, || Mistake {
            line,
            key: format!("{path}{}", shortened(key)),
            // Only a whole section has more than one line, and quoting that is no use.
            value: value.map(|text| shortened(text.lines().next().unwrap_or_default())),
            expected: expected(),
        });
    }
}

fn whole(value: &DeValue<'_>) -> Option<u8> {
    let integer = value.as_integer()?;
    u8::from_str_radix(integer.as_str(), integer.radix()).ok().filter(|id| *id <= 253)
}

fn real(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => integer.as_str().parse().ok(),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

/// A piece of the script, cut to the length that a mistake quotes.
fn shortened(piece: &str) -> String {
    match piece.char_indices().nth(PIECE_SHOWN) {
        Some((end, _)) => format!("{}...", &piece[..end]),
        None => piece.to_owned(),
    }
}
