//! Checks whether the lengths inside a record fit into it.

use mcap::records::op;

/// The unread rest of a record.
struct Rest<'b>(&'b [u8]);

impl<'b> Rest<'b> {
    fn take(&mut self, count: u64) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(count).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    fn u32(&mut self) -> Option<u64> {
        self.take(4)?.try_into().ok().map(u32::from_le_bytes).map(u64::from)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// A text or a table of entries, preceded by its length.
    fn counted(&mut self) -> Option<&'b [u8]> {
        let count = self.u32()?;
        self.take(count)
    }

    /// A table that maps texts to texts.
    fn table(&mut self) -> Option<()> {
        let mut entries = Rest(self.counted()?);
        while !entries.0.is_empty() {
            entries.counted()?;
            entries.counted()?;
        }
        Some(())
    }
}

/// True if the lengths inside the `body` of a record fit into it; false for kinds that are not read here.
pub(super) fn are_right(opcode: u8, body: &[u8]) -> bool {
    let mut rest = Rest(body);
    let rest = &mut rest;
    let fits = match opcode {
        op::ATTACHMENT => attachment(rest),
        op::CHANNEL => {
            rest.take(4).and_then(|_| rest.counted()).and_then(|_| rest.counted()).and_then(|_| rest.table())
        }
        op::MESSAGE => rest.take(2 + 4 + 8 + 8).map(drop),
        op::METADATA => rest.counted().and_then(|_| rest.table()),
        _ => None,
    };
    fits.is_some()
}

fn attachment(rest: &mut Rest<'_>) -> Option<()> {
    // Two times, name, kind; then the bytes and their checksum.
    rest.take(8 + 8)?;
    rest.counted()?;
    rest.counted()?;
    let count = rest.u64()?;
    rest.take(count)?;
    rest.take(4)?;
    rest.0.is_empty().then_some(())
}

/// Unpacked size of the records in the chunk whose record has this `body`; `None` if its lengths are
/// wrong.
pub(super) fn chunk_bytes(body: &[u8]) -> Option<u64> {
    let mut rest = Rest(body);
    // Start and end time.
    rest.take(8 + 8)?;
    let unpacked = rest.u64()?;
    // Checksum and compression.
    rest.take(4)?;
    let packing = rest.counted()?;
    let packed = rest.u64()?;
    // Otherwise a record could run into the bytes after it.
    let is_all = usize::try_from(packed).is_ok_and(|packed| packed == rest.0.len());
    // Unpacked bytes must keep their size.
    let is_same = !packing.is_empty() || packed == unpacked;
    (is_all && is_same).then_some(unpacked)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A text after its length, which is `more` too large.
    fn text(letters: &str, more: u32) -> Vec<u8> {
        let count = u32::try_from(letters.len()).unwrap().wrapping_add(more);
        [&count.to_le_bytes()[..], letters.as_bytes()].concat()
    }

    #[test]
    fn lengths_that_fit_are_right_and_larger_ones_are_not() {
        let channel = |topic: u32, kind: u32, table: u32, key: u32, value: u32| {
            let entries = [text("k", key), text("v", value)].concat();
            let count = u32::try_from(entries.len()).unwrap().wrapping_add(table);
            [&[0; 4][..], &text("/a", topic), &text("json", kind), &count.to_le_bytes(), &entries].concat()
        };
        assert!(are_right(op::CHANNEL, &channel(0, 0, 0, 0, 0)));
        for too_much in [1, 1 << 20, u32::MAX - 100, u32::MAX] {
            for place in 0..5 {
                let mut more = [0; 5];
                more[place] = too_much;
                let [topic, kind, table, key, value] = more;
                // A topic one byte too short shifts everything after it.
                assert!(!are_right(op::CHANNEL, &channel(topic, kind, table, key, value)), "{more:?}");
            }
        }
        let attachment = |data: u64, behind: usize| {
            [&[0; 16][..], &text("a", 0), &text("b", 0), &data.to_le_bytes(), &vec![7; behind]].concat()
        };
        assert!(are_right(op::ATTACHMENT, &attachment(5, 5 + 4)));
        for (data, behind) in
            [(5, 8), (5, 10), (5, 3), (0, 2), (u64::MAX, 9), (1 << 62, 9), (u64::MAX - 3, 9)]
        {
            assert!(!are_right(op::ATTACHMENT, &attachment(data, behind)), "{data} {behind}");
        }
        assert!(are_right(op::MESSAGE, &[0; 22]) && !are_right(op::MESSAGE, &[0; 21]));
    }

    #[test]
    fn the_size_of_a_chunk_is_read_from_its_record() {
        let chunk = |unpacked: u64, packing: &str, packed: u64, there: usize| {
            let sum = [0; 4];
            [
                &[0; 16][..],
                &unpacked.to_le_bytes(),
                &sum,
                &text(packing, 0),
                &packed.to_le_bytes(),
                &vec![0; there],
            ]
            .concat()
        };
        assert_eq!(chunk_bytes(&chunk(100, "lz4", 10, 10)), Some(100));
        assert_eq!(chunk_bytes(&chunk(10, "", 10, 10)), Some(10));
        assert_eq!(chunk_bytes(&chunk(1 << 62, "lz4", 10, 10)), Some(1 << 62));
        for (unpacked, packing, packed, there) in
            [(100, "lz4", 11, 10), (100, "lz4", 9, 10), (100, "lz4", u64::MAX, 10), (11, "", 10, 10)]
        {
            assert_eq!(
                chunk_bytes(&chunk(unpacked, packing, packed, there)),
                None,
                "{unpacked} {packed} {there}"
            );
        }
    }
}
