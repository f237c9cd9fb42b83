//! Reads the records of a file, one after the other, in memory that does not grow with the file.
//!
//! Takes untrusted bytes. Returns the records that a recording needs, each complete. Every
//! length in a file is checked against a limit, and against the available bytes, before memory is allocated for it.

use std::io::{self, Read};

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::lengths::{are_right, chunk_bytes};
use super::recorder::describe;

/// Longest record that is read, bytes.
pub const RECORD_MAX: u64 = 1 << 20;
/// Largest chunk that is read, bytes, both packed and unpacked.
pub const CHUNK_MAX: u64 = 32 << 20;

/// Head of every record: its opcode and the length of its body.
const HEAD_BYTES: usize = 1 + 8;

/// Reads a file from its beginning.
pub(super) struct Records<R> {
    file: R,
    /// Number of bytes in the file before the next record.
    offset: u64,
    /// The chunk whose records are being read; `None` between chunks.
    chunk: Option<LinearReader>,
    /// Opcode of the last record read.
    opcode: u8,
    body: Vec<u8>,
}

impl<R: Read> Records<R> {
    /// Reads `file`, which is at its beginning.
    ///
    /// # Errors
    /// Why it is not a file of records.
    pub(super) fn of(mut file: R) -> Result<Records<R>, String> {
        let mut magic = [0; mcap::MAGIC.len()];
        read_up_to(&mut file, &mut magic)?;
        if magic != mcap::MAGIC {
            return Err("it does not begin as MCAP files do".to_owned());
        }
        let offset = bytes(magic.len());
        Ok(Records { file, offset, chunk: None, opcode: 0, body: Vec::new() })
    }

    /// Advances to the next record of a kind that is needed; false at the end of the file, or of its data.
    ///
    /// # Errors
    /// The damage, and its place. Nothing after it can be read.
    pub(super) fn advance(&mut self) -> Result<bool, String> {
        loop {
            if let Some(chunk) = &mut self.chunk {
                match next_of(chunk, &mut self.body).map_err(|error| self.damage(&error))? {
                    Some(opcode @ (op::CHANNEL | op::MESSAGE)) => {
                        self.opcode = opcode;
                        if bytes(self.body.len()) > RECORD_MAX {
                            return Err(self.damage(&too_long(
                                "a record",
                                bytes(self.body.len()),
                                RECORD_MAX,
                            )));
                        }
                        return Ok(true);
                    }
                    Some(_) => {}
                    None => self.chunk = None,
                }
                continue;
            }
            let mut head = [0; HEAD_BYTES];
            let found = read_up_to(&mut self.file, &mut head)?;
            let [opcode, length @ ..] = head;
            let length = u64::from_le_bytes(length);
            match opcode {
                _ if found == 0 => return Ok(false),
                _ if found < HEAD_BYTES => return Err(self.damage(ENDS)),
                op::DATA_END => return Ok(false),
                op::CHUNK => self.begin_chunk(head, length).map_err(|why| self.damage(&why))?,
                op::ATTACHMENT | op::CHANNEL | op::MESSAGE | op::METADATA if length <= RECORD_MAX => {
                    self.opcode = opcode;
                    self.body.clear();
                    let room = usize::try_from(length).unwrap_or(usize::MAX);
                    self.body.resize(room, 0);
                    if read_up_to(&mut self.file, &mut self.body)? < room {
                        return Err(self.damage(ENDS));
                    }
                    self.pass(length);
                    return Ok(true);
                }
                op::CHANNEL | op::MESSAGE => {
                    return Err(self.damage(&too_long("a record", length, RECORD_MAX)));
                }
                // No kind of record has this number: this is the empty part of a file that was enlarged.
                0 => return Err(self.damage("zeros, where a record should begin")),
                _ => {
                    let mut rest = (&mut self.file).take(length);
                    let passed = io::copy(&mut rest, &mut io::sink()).map_err(|error| error.to_string())?;
                    if passed < length {
                        return Err(self.damage(ENDS));
                    }
                    self.pass(length);
                }
            }
        }
    }

    /// The present record.
    ///
    /// # Errors
    /// Why it is not a record.
    pub(super) fn record(&self) -> Result<Record<'_>, String> {
        // The parser allocates as much memory as the lengths inside a record demand.
        if !are_right(self.opcode, &self.body) {
            return Err(self.damage("the lengths inside a record are wrong"));
        }
        mcap::parse_record(self.opcode, &self.body).map_err(|error| self.damage(&describe(&error)))
    }

    fn begin_chunk(&mut self, head: [u8; HEAD_BYTES], length: u64) -> Result<(), String> {
        if length > CHUNK_MAX {
            return Err(too_long("a chunk", length, CHUNK_MAX));
        }
        let room = HEAD_BYTES + usize::try_from(length).unwrap_or(usize::MAX);
        let limit = usize::try_from(CHUNK_MAX).unwrap_or(usize::MAX);
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(limit);
        let mut chunk = LinearReader::new_with_options(options);
        let record = &mut chunk.insert(room)[..room];
        let (before, body) = record.split_at_mut(HEAD_BYTES);
        before.copy_from_slice(&head);
        if read_up_to(&mut self.file, body)? < body.len() {
            return Err(ENDS.to_owned());
        }
        let unpacked = chunk_bytes(body).ok_or("the lengths inside a chunk are wrong")?;
        if unpacked > CHUNK_MAX {
            return Err(too_long("a chunk, unpacked,", unpacked, CHUNK_MAX));
        }
        chunk.notify_read(room);
        self.chunk = Some(chunk);
        self.pass(length);
        Ok(())
    }

    fn pass(&mut self, length: u64) {
        self.offset = self.offset.saturating_add(bytes(HEAD_BYTES)).saturating_add(length);
    }

    fn damage(&self, what: &str) -> String {
        let before = if self.chunk.is_some() { "in the chunk that ends at byte" } else { "at byte" };
        format!("{before} {}: {what}", self.offset)
    }
}

const ENDS: &str = "the file ends in the middle of a record";

fn too_long(what: &str, length: u64, most: u64) -> String {
    format!("{what} says that it is {length} bytes long, and at most {most} are read")
}

fn bytes(count: usize) -> u64 {
    u64::try_from(count).unwrap_or(u64::MAX)
}

/// Reads the next record of a complete chunk into `body`; `None` at its end.
fn next_of(chunk: &mut LinearReader, body: &mut Vec<u8>) -> Result<Option<u8>, String> {
    loop {
        match chunk.next_event() {
            None => return Ok(None),
            Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                body.clear();
                body.extend_from_slice(data);
                return Ok(Some(opcode));
            }
            // There is no more: another call tells whether that is its end or damage.
            Some(Ok(LinearReadEvent::ReadRequest(_))) => chunk.notify_read(0),
            Some(Err(error)) => return Err(describe(&error)),
        }
    }
}

/// Reads until `into` is full or the file ends; returns the number of bytes read.
fn read_up_to(file: &mut impl Read, into: &mut [u8]) -> Result<usize, String> {
    let mut count = 0;
    while let Some(left) = into.get_mut(count..).filter(|left| !left.is_empty()) {
        match file.read(left) {
            Ok(0) => break,
            Ok(more) => count += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error.to_string()),
        }
    }
    Ok(count)
}
