//! Keys pressed in the terminal on standard input, read by a thread of its own.

use std::io::{IsTerminal, stdin};

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, Sender, bounded};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{
    LocalModes, OptionalActions, QueueSelector, SpecialCodeIndex, Termios, tcflush, tcgetattr, tcsetattr,
};

use crate::cli::BadInput;
use crate::operator::{Decoder, Key};

/// An escape followed by nothing for this long is the escape key; over slow links arrow keys come in pieces.
const ESCAPE_PAUSE: Timespec = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
/// Most keys that wait for the loop; when there are more, the thread waits, so that none is lost.
const KEYS_WAITING: usize = 64;

/// The terminal; until it is dropped, it hands over each key at once and shows none of them.
pub(in crate::cli) struct Keyboard {
    keys: Receiver<Key>,
    before: Termios,
}

impl Keyboard {
    /// True if there is a terminal to press keys in.
    pub(super) fn is_there() -> bool {
        stdin().is_terminal()
    }

    /// Starts to listen. Ctrl-C remains a signal.
    pub(super) fn start() -> Result<Keyboard> {
        if !stdin().is_terminal() {
            let said = "--keys: standard input is not a terminal, so it has no keys";
            return Err(BadInput(said.to_owned()).into());
        }
        let before = tcgetattr(stdin()).context("the terminal's settings could not be read")?;
        let mut quiet = before.clone();
        quiet.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        quiet.special_codes[SpecialCodeIndex::VMIN] = 1;
        quiet.special_codes[SpecialCodeIndex::VTIME] = 0;
        tcsetattr(stdin(), OptionalActions::Now, &quiet)
            .context("the terminal could not be switched to single keys")?;
        let (sender, keys) = bounded(KEYS_WAITING);
        std::thread::spawn(move || read_keys(&sender));
        Ok(Keyboard { keys, before })
    }

    /// The next key that was pressed, if there is one.
    pub(super) fn pressed(&self) -> Option<Key> {
        self.keys.try_recv().ok()
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        // Keys not read yet must not land in the shell. If the terminal is gone, there is nothing to do.
        let _ = tcflush(stdin(), QueueSelector::IFlush);
        let _ = tcsetattr(stdin(), OptionalActions::Now, &self.before);
    }
}

/// Reads keys until the terminal is gone or the receiver is dropped.
fn read_keys(sender: &Sender<Key>) {
    let terminal = stdin();
    let mut decoder = Decoder::default();
    let mut bytes = [0; 64];
    let hand_over = |keys: &[Option<Key>]| keys.iter().flatten().all(|key| sender.send(*key).is_ok());
    loop {
        let timeout = decoder.is_waiting().then_some(&ESCAPE_PAUSE);
        let is_wanted = match poll(&mut [PollFd::new(&terminal, PollFlags::IN)], timeout) {
            Ok(0) => hand_over(&[decoder.pause()]),
            Ok(_) => match rustix::io::read(&terminal, &mut bytes) {
                Ok(count @ 1..) => bytes[..count].iter().all(|byte| hand_over(&decoder.push(*byte))),
                Err(Errno::INTR | Errno::AGAIN) => true,
                Ok(0) | Err(_) => break,
            },
            Err(Errno::INTR) => true,
            Err(_) => break,
        };
        if !is_wanted {
            return;
        }
    }
    hand_over(&[Some(Key::Gone)]);
}
