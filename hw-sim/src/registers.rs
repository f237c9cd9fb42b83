//! Control tables: their descriptions, and one servo's copy of the values. The tables themselves are in the folders of
//! the protocols.
//!
//! In: addresses and bytes or numbers. Out: bytes or numbers. Does not know the meaning of the numbers.

/// Which side may change a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// The servo alone.
    Read,
    /// The host too.
    ReadWrite,
}

/// How the bits of a register encode a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Plain.
    Unsigned,
    /// Two's complement over the register's width.
    TwosComplement,
    /// Sign in this bit, magnitude in the bits below it.
    SignMagnitude(u8),
}

/// One register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// First address.
    pub address: u16,
    /// Bytes: 1, 2 or 4.
    pub size: u8,
    /// True if the high byte stands first, as in Feetech's SCS series.
    pub is_big_endian: bool,
    /// The maker's name.
    pub name: &'static str,
    /// Which side may change it.
    pub access: Access,
    /// Encoding of its bits.
    pub encoding: Encoding,
    /// Value as shipped.
    pub default: i64,
    /// Lowest value a host may write.
    pub min: i64,
    /// Highest value a host may write.
    pub max: i64,
}

/// A difference between a model and its family's table.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Change {
    /// The model lacks the register at this address.
    Absent(u16),
    /// One more register.
    Add(Register),
    /// Address, default, lowest, highest.
    Range(u16, i64, i64, i64),
}

const fn entry(
    access: Access,
    address: u16,
    size: u8,
    name: &'static str,
    encoding: Encoding,
    range: (i64, i64, i64),
) -> Register {
    let (default, min, max) = range;
    Register { address, size, is_big_endian: false, name, access, encoding, default, min, max }
}

/// Unsigned, writable by the host; `(default, min, max)`.
pub(crate) const fn rw(address: u16, size: u8, name: &'static str, range: (i64, i64, i64)) -> Register {
    entry(Access::ReadWrite, address, size, name, Encoding::Unsigned, range)
}

/// Writable by the host, other encoding.
pub(crate) const fn rw_as(
    address: u16,
    size: u8,
    name: &'static str,
    encoding: Encoding,
    range: (i64, i64, i64),
) -> Register {
    entry(Access::ReadWrite, address, size, name, encoding, range)
}

/// Unsigned, read only.
pub(crate) const fn ro(address: u16, size: u8, name: &'static str, default: i64) -> Register {
    entry(Access::Read, address, size, name, Encoding::Unsigned, (default, 0, 0))
}

/// Read only, other encoding.
pub(crate) const fn ro_as(address: u16, size: u8, name: &'static str, encoding: Encoding) -> Register {
    entry(Access::Read, address, size, name, encoding, (0, 0, 0))
}

impl Register {
    /// The number that these bytes encode.
    pub(crate) fn decode(&self, bytes: &[u8]) -> i64 {
        let mut word = [0u8; 8];
        let used = &mut word[..bytes.len()];
        used.copy_from_slice(bytes);
        if self.is_big_endian {
            used.reverse();
        }
        let raw = i64::from_le_bytes(word);
        let bits = 8 * u32::from(self.size);
        match self.encoding {
            Encoding::Unsigned => raw,
            Encoding::TwosComplement => (raw << (64 - bits)) >> (64 - bits),
            Encoding::SignMagnitude(bit) => {
                let magnitude = raw & ((1 << bit) - 1);
                if raw >> bit & 1 == 1 { -magnitude } else { magnitude }
            }
        }
    }

    /// The register's bytes for a number, or for the nearest it can hold; the first `size` of the eight count.
    fn encode(&self, value: i64) -> [u8; 8] {
        let bits = 8 * u32::from(self.size);
        let raw = match self.encoding {
            Encoding::Unsigned => value.clamp(0, (1 << bits) - 1),
            Encoding::TwosComplement => value.clamp(-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            Encoding::SignMagnitude(bit) => {
                let magnitude = value.abs().min((1 << bit) - 1);
                if value < 0 { magnitude | 1 << bit } else { magnitude }
            }
        };
        let mut bytes = raw.to_le_bytes();
        if self.is_big_endian {
            bytes[..usize::from(self.size)].reverse();
        }
        bytes
    }

    /// One past the last address.
    fn end(&self) -> usize {
        usize::from(self.address) + usize::from(self.size)
    }
}

/// The registers of one servo.
#[derive(Debug, Clone)]
pub(crate) struct RegisterFile {
    table: Vec<Register>,
    bytes: Vec<u8>,
    /// The index in the table of the register that each address belongs to.
    owner: Vec<Option<u16>>,
    /// The number in the register that each address belongs to, 0 if there is none: read far more often than
    /// changed.
    numbers: Vec<i64>,
}

impl RegisterFile {
    /// The registers of a servo as shipped.
    pub(crate) fn new(table: Vec<Register>) -> RegisterFile {
        let end = table.iter().map(Register::end).max().unwrap_or(0);
        let mut file = RegisterFile {
            table: Vec::new(),
            bytes: vec![0; end],
            owner: vec![None; end],
            numbers: vec![0; end],
        };
        for (index, register) in table.iter().enumerate() {
            file.owner[usize::from(register.address)..register.end()].fill(u16::try_from(index).ok());
        }
        file.table = table;
        for index in 0..file.table.len() {
            file.set(file.table[index].address, file.table[index].default);
        }
        file
    }

    /// The register that this address belongs to.
    pub(crate) fn at(&self, address: u16) -> Option<&Register> {
        let index = (*self.owner.get(usize::from(address))?)?;
        self.table.get(usize::from(index))
    }

    /// The number in the register that starts at `address`; 0 if the model lacks it.
    pub(crate) fn get(&self, address: u16) -> i64 {
        self.numbers.get(usize::from(address)).copied().unwrap_or(0)
    }

    /// Sets the register to the nearest number it can hold; does nothing if the model lacks it.
    pub(crate) fn set(&mut self, address: u16, value: i64) {
        if self.get(address) == value {
            return;
        }
        if let Some(&register) = self.at(address) {
            let (bytes, places) = (register.encode(value), usize::from(register.address)..register.end());
            let bytes = &bytes[..usize::from(register.size)];
            self.bytes[places.clone()].copy_from_slice(bytes);
            self.numbers[places].fill(register.decode(bytes));
        }
    }

    /// Resets every register whose address lies in `addresses` to its value as shipped.
    pub(crate) fn reset(&mut self, addresses: std::ops::Range<u16>) {
        for index in 0..self.table.len() {
            let Register { address, default, .. } = self.table[index];
            if addresses.contains(&address) {
                self.set(address, default);
            }
        }
    }

    /// Copies from `other`, of the same table, the registers whose address lies in `addresses`.
    pub(crate) fn copy(&mut self, other: &RegisterFile, addresses: std::ops::Range<u16>) {
        let places = usize::from(addresses.start)..usize::from(addresses.end).min(self.bytes.len());
        self.bytes[places.clone()].copy_from_slice(&other.bytes[places.clone()]);
        self.numbers[places.clone()].copy_from_slice(&other.numbers[places]);
    }

    /// One byte, if a register has it.
    pub(crate) fn byte(&self, address: u16) -> Option<u8> {
        self.at(address).and_then(|_| self.bytes.get(usize::from(address)).copied())
    }

    /// The number that `data` would put into `register`.
    pub(crate) fn meaning(register: &Register, data: &[u8]) -> i64 {
        register.decode(data)
    }
}

/// The table of a series with a model's own changes.
pub(crate) fn changed(table: &[Register], changes: &[Change]) -> Vec<Register> {
    let mut table = table.to_vec();
    for change in changes {
        match *change {
            Change::Absent(address) => table.retain(|register| register.address != address),
            Change::Add(register) => table.push(register),
            Change::Range(address, default, min, max) => {
                for register in table.iter_mut().filter(|register| register.address == address) {
                    (register.default, register.min, register.max) = (default, min, max);
                }
            }
        }
    }
    table.sort_by_key(|register| register.address);
    table
}

/// Pairs of an indirect address register, 2 bytes, and a byte of indirect data that stands for the byte it points
/// at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndirectBlock {
    /// The first address register.
    pub address: u16,
    /// The first byte of data.
    pub data: u16,
    /// Number of pairs.
    pub pairs: u16,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    #[test]
    fn tables_do_not_overlap_and_defaults_fit() {
        for model in Model::all() {
            let table = &model.registers;
            for pair in table.windows(2) {
                assert!(pair[0].end() <= usize::from(pair[1].address), "{}: {:?}", model.name, pair);
            }
            for register in table {
                assert_eq!(
                    register.decode(&register.encode(register.default)[..register.size.into()]),
                    register.default,
                    "{}: {register:?}",
                    model.name
                );
            }
        }
    }

    #[test]
    fn encodings_follow_the_manuals() {
        let offset = rw_as(31, 2, "Position Offset", Encoding::SignMagnitude(11), (0, -2047, 2047));
        assert_eq!(offset.encode(-5)[..2], [0x05, 0x08]);
        assert_eq!(offset.decode(&[0x05, 0x08]), -5);
        let goal = rw_as(116, 4, "Goal Position", Encoding::TwosComplement, (0, 0, 0));
        assert_eq!(goal.encode(-1)[..4], [0xFF; 4]);
        assert_eq!(goal.decode(&[0xFE, 0xFF, 0xFF, 0xFF]), -2);
        // Feetech wiki, memory-scscl: the high byte is at the leading address.
        let limit = Register { is_big_endian: true, ..rw(11, 2, "Max Angle Limit", (1003, 0, 1023)) };
        assert_eq!(limit.encode(1003)[..2], [0x03, 0xEB]);
        assert_eq!(limit.decode(&[0x03, 0xEB]), 1003);
    }
}
