//! Damaged recordings, read and judged as `replay --html` does: no panic, and no more memory than libFuzzer's limit.
//!
//! The bytes describe edits of a good recording, which is made here; some inputs are used as a file directly. So
//! all the code runs from the first input on, and the inputs are short. It is several times as fast without a
//! sanitizer:
//! `cargo fuzz run -s none recordings -- -len_control=0 -max_len=300 -rss_limit_mb=500`.
#![no_main]

#[allow(dead_code, reason = "a test uses the rest")]
#[path = "../recordings.rs"]
mod recordings;

use std::path::Path;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use recordings::{Length, edited, good, lengths, look, unpacked};

/// A good recording, and where its lengths are.
struct Good(Vec<u8>, Vec<Length>);

impl Good {
    fn of(bytes: Vec<u8>) -> Good {
        let lengths = lengths(&bytes);
        Good(bytes, lengths)
    }
}

static GOOD: LazyLock<[Good; 3]> = LazyLock::new(|| {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let [figure, arms] = ["figure.toml", "tentacle.toml"].map(|name| good(&config.join(name), 4));
    [Good::of(unpacked(&figure)), Good::of(figure), Good::of(unpacked(&arms))]
});

fuzz_target!(|bytes: &[u8]| {
    let Some((which, script)) = bytes.split_first() else { return };
    let Good(good, lengths) = match which % 16 {
        0 => {
            look(script);
            return;
        }
        1 | 2 => &GOOD[1],
        // Slow: its robot takes long to be made ready.
        3 => &GOOD[2],
        _ => &GOOD[0],
    };
    look(&edited(good, lengths, script));
});
