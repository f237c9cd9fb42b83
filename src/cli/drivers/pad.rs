//! A gamepad as Linux shows it (evdev), read by a thread of its own.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;
use crossbeam_channel::{Receiver, SendError, Sender, bounded};
use evdev::{AbsoluteAxisCode, Device, EventSummary, InputEvent, KeyCode};

use crate::cli::BadInput;
use crate::kinds::horse::{Axis, Button, PadEvent};
use crate::platform::{monotonic, sleep_until};

/// Most events that wait for the loop; when there are more, the thread waits, so that none is lost.
const EVENTS_WAITING: usize = 256;
/// Time between attempts to find an unplugged gamepad.
const LOOK_EVERY: Duration = Duration::from_millis(500);

const AXES: [(AbsoluteAxisCode, Axis); 2] =
    [(AbsoluteAxisCode::ABS_Y, Axis::Speed), (AbsoluteAxisCode::ABS_X, Axis::Turn)];
const BUTTONS: [(KeyCode, Button); 6] = [
    (KeyCode::BTN_START, Button::Arm),
    (KeyCode::BTN_SOUTH, Button::Stop),
    (KeyCode::BTN_SELECT, Button::End),
    (KeyCode::BTN_EAST, Button::EmergencyStop),
    (KeyCode::BTN_TR, Button::NextGait),
    (KeyCode::BTN_TL, Button::PreviousGait),
];

/// An event, and when it was read on the clock of [`monotonic`].
type TimedEvent = (PadEvent, Duration);

/// A connected gamepad.
pub(in crate::cli) struct Pad {
    events: Receiver<TimedEvent>,
    name: String,
}

impl Pad {
    /// Starts to listen to the gamepad `wanted`, or to the only one there.
    pub(super) fn start(wanted: Option<PathBuf>) -> Result<Pad, BadInput> {
        let reader = Reader::find(wanted.as_deref())?;
        let name = reader.device.name().unwrap_or("without a name").to_owned();
        let (sender, events) = bounded(EVENTS_WAITING);
        std::thread::spawn(move || listen(wanted.as_deref(), reader, &sender));
        Ok(Pad { events, name })
    }

    /// The gamepad's own name.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// The next event, if there is one, and its time, s.
    pub(super) fn heard(&self) -> Option<(PadEvent, f64)> {
        let (event, at) = self.events.try_recv().ok()?;
        Some((event, at.as_secs_f64()))
    }
}

/// Sends events until the receiver is dropped; finds an unplugged gamepad again.
fn listen(wanted: Option<&Path>, mut reader: Reader, sender: &Sender<TimedEvent>) {
    loop {
        let Err(Lost::Device) = reader.hand_over_all(sender) else { return };
        if sender.send((PadEvent::Unplugged, monotonic())).is_err() {
            return;
        }
        reader = loop {
            sleep_until(monotonic() + LOOK_EVERY);
            if let Ok(found) = Reader::find(wanted) {
                break found;
            }
        };
        if sender.send((PadEvent::PluggedIn, monotonic())).is_err() {
            return;
        }
    }
}

/// The side that is gone.
enum Lost {
    Device,
    Listener,
}

impl From<std::io::Error> for Lost {
    fn from(_: std::io::Error) -> Lost {
        Lost::Device
    }
}

impl From<SendError<TimedEvent>> for Lost {
    fn from(_: SendError<TimedEvent>) -> Lost {
        Lost::Listener
    }
}

/// An open gamepad.
struct Reader {
    device: Device,
    /// Lowest and highest value of each of [`AXES`].
    ranges: [(i32, i32); 2],
}

impl Reader {
    fn find(wanted: Option<&Path>) -> Result<Reader, BadInput> {
        let mut found: Vec<(PathBuf, Reader)> = Vec::new();
        if let Some(path) = wanted {
            let device = Device::open(path).map_err(|error| {
                BadInput(format!("--gamepad={}: {error}; {}", path.display(), candidates()))
            })?;
            let reader = Reader::of(device).ok_or_else(|| {
                BadInput(format!(
                    "--gamepad={}: expected a gamepad, with a left stick and a Start button; {}",
                    path.display(),
                    candidates()
                ))
            })?;
            return Ok(reader);
        }
        found.extend(evdev::enumerate().filter_map(|(path, device)| Some((path, Reader::of(device)?))));
        match (found.pop(), found.is_empty()) {
            (Some((_, only)), true) => Ok(only),
            (Some(_), false) => Err(BadInput(format!("--gamepad: there is more than one; {}", candidates()))),
            (None, _) => Err(BadInput(format!("--gamepad: found none; {}", candidates()))),
        }
    }

    /// `None` if the device is not a gamepad.
    fn of(device: Device) -> Option<Reader> {
        let axes = device.supported_absolute_axes()?;
        let keys = device.supported_keys()?;
        let is_gamepad = AXES.iter().all(|(code, _)| axes.contains(*code))
            && [KeyCode::BTN_SOUTH, KeyCode::BTN_START].iter().all(|code| keys.contains(*code));
        if !is_gamepad {
            return None;
        }
        let states = device.get_abs_state().ok()?;
        let range = |code: AbsoluteAxisCode| {
            states.get(usize::from(code.0)).map(|state| (state.minimum, state.maximum))
        };
        Some(Reader { ranges: [range(AXES[0].0)?, range(AXES[1].0)?], device })
    }

    /// Sends the positions of the sticks, and from then on every event.
    fn hand_over_all(&mut self, sender: &Sender<TimedEvent>) -> Result<(), Lost> {
        let states = self.device.get_abs_state()?;
        for (place, (code, axis)) in AXES.iter().enumerate() {
            let value = states.get(usize::from(code.0)).map_or(0, |state| state.value);
            sender.send((PadEvent::Moved(*axis, share(value, self.ranges[place])), monotonic()))?;
        }
        loop {
            let ranges = self.ranges;
            let events = self.device.fetch_events()?;
            let at = monotonic();
            for event in events {
                sender.send((meaning(event, ranges), at))?;
            }
        }
    }
}

fn meaning(event: InputEvent, ranges: [(i32, i32); 2]) -> PadEvent {
    match event.destructure() {
        EventSummary::AbsoluteAxis(_, code, value) => {
            let place = AXES.iter().position(|(known, _)| *known == code);
            place.map_or(PadEvent::Heard, |place| PadEvent::Moved(AXES[place].1, share(value, ranges[place])))
        }
        EventSummary::Key(_, code, 1) => {
            let button = BUTTONS.iter().find(|(known, _)| *known == code);
            button.map_or(PadEvent::Heard, |(_, button)| PadEvent::Pressed(*button))
        }
        _ => PadEvent::Heard,
    }
}

/// Deflection of a stick at `value`, 1 to -1: evdev counts backwards and to the right.
fn share(value: i32, (lowest, highest): (i32, i32)) -> f64 {
    let (lowest, highest) = (f64::from(lowest), f64::from(highest));
    (highest + lowest - 2.0 * f64::from(value)) / (highest - lowest)
}

/// The available gamepads, in words.
fn candidates() -> String {
    let named = |(path, device): (PathBuf, Device)| {
        let name = device.name().unwrap_or("without a name").to_owned();
        Reader::of(device).map(|_| format!("{} ({name})", path.display()))
    };
    let found: Vec<String> = evdev::enumerate().filter_map(named).collect();
    match found.is_empty() {
        true => {
            "no gamepad that this user may read is plugged in; members of the group that owns /dev/input, often \
             'input', may read them"
                .to_owned()
        }
        false => format!("gamepads are {}: name one with --gamepad=DEVICE", found.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_forward_and_to_the_left_are_positive() {
        for (range, forward, middle, back) in [((-32768, 32767), -32768, 0, 32767), ((0, 255), 0, 128, 255)] {
            assert!((share(forward, range) - 1.0).abs() < 1e-9);
            assert!(share(middle, range).abs() < 0.01);
            assert!((share(back, range) + 1.0).abs() < 1e-9);
        }
        let up = InputEvent::new(evdev::EventType::ABSOLUTE.0, AbsoluteAxisCode::ABS_Y.0, 0);
        assert_eq!(meaning(up, [(0, 255); 2]), PadEvent::Moved(Axis::Speed, 1.0));
        let left = InputEvent::new(evdev::EventType::ABSOLUTE.0, AbsoluteAxisCode::ABS_X.0, 0);
        assert_eq!(meaning(left, [(0, 255); 2]), PadEvent::Moved(Axis::Turn, 1.0));
    }

    #[test]
    fn buttons_count_when_they_go_down() {
        let start = |value| InputEvent::new(evdev::EventType::KEY.0, KeyCode::BTN_START.0, value);
        assert_eq!(meaning(start(1), [(0, 255); 2]), PadEvent::Pressed(Button::Arm));
        // Released, or held: no second press, but a sign of life.
        for value in [0, 2] {
            assert_eq!(meaning(start(value), [(0, 255); 2]), PadEvent::Heard);
        }
    }
}
