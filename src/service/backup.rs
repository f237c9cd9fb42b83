//! The settings of a servo, saved in a file, and restored byte for byte.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::{Address, ServiceError};
use super::servo::Servo;
use crate::bus::table::{Access, RegisterInfo, Series, decode_bytes};
use crate::input::read_text;
use crate::model::Protocol;
use crate::output;
use crate::units::ServoId;

/// Version of the schema.
const VERSION: u32 = 1;

/// Every register of a servo at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Backup {
    /// Address at which it answered.
    pub address: Address,
    /// Its control table.
    pub series: &'static Series,
    /// Content of its model number register.
    pub model_number: u16,
    /// Its registers by address, each with its bytes in the servo's order.
    pub registers: Vec<(RegisterInfo, Vec<u8>)>,
    /// Their meanings in words, for people.
    words: Vec<String>,
    /// Firmware and model, for people.
    heading: String,
}

/// Why a file is not a valid backup.
#[derive(Debug, thiserror::Error)]
pub enum BackupError {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It is not a backup, or an edit made it invalid.
    #[error("{}: {key}: expected {expected}; 'servo backup' writes such a file", path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// The faulty key.
        key: String,
        /// The expected content.
        expected: String,
    },
}

/// The content of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    version: u32,
    protocol: String,
    baud: u32,
    id: u8,
    model_number: u16,
    #[serde(rename = "firmware")]
    _firmware: String,
    settings: BTreeMap<String, String>,
    #[serde(default)]
    volatile: BTreeMap<String, String>,
    #[serde(default)]
    fixed: BTreeMap<String, String>,
}

impl Backup {
    /// Reads every register of `servo`.
    ///
    /// # Errors
    /// If no good answer came.
    pub fn of(servo: &mut Servo<'_>) -> Result<Backup, ServiceError> {
        let identity = servo.identity();
        let mut registers = Vec::new();
        let mut words = Vec::new();
        for (register, value, bytes) in servo.read_all_bytes()? {
            words.push(if value.unit.is_empty() {
                value.to_string()
            } else {
                format!("{value} ({})", value.raw)
            });
            registers.push((register, bytes));
        }
        let model = identity.model_names().unwrap_or_else(|| "unknown model".to_owned());
        Ok(Backup {
            address: servo.address(),
            series: identity.series,
            model_number: identity.model_number,
            registers,
            words,
            heading: format!("# {model}\nfirmware = \"{}\"", identity.firmware),
        })
    }

    /// The registers that can be restored.
    pub fn settings(&self) -> impl Iterator<Item = &(RegisterInfo, Vec<u8>)> {
        self.registers.iter().filter(|(register, _)| register.access == Access::Setting)
    }

    /// Address of the servo according to these registers: the same as `address`, unless the file was edited.
    pub fn home(&self) -> Address {
        let byte =
            |name: &str| self.settings().find(|(register, _)| register.name == name)?.1.first().copied();
        let baud = byte("baud_rate").and_then(|code| self.address.protocol.baud_of_code(i64::from(code)));
        Address {
            id: byte("id").map_or(self.address.id, ServoId),
            baud: baud.unwrap_or(self.address.baud),
            ..self.address
        }
    }

    /// The count that `bytes` of `register` encode.
    pub(super) fn count(&self, register: &RegisterInfo, bytes: &[u8]) -> i64 {
        decode_bytes(self.series, register.register, bytes)
    }

    fn to_toml(&self) -> String {
        let Address { protocol, baud, id } = self.address;
        let mut text = format!(
            "# Every register of a servo: its bytes in hexadecimal as they stand in it, and what they mean. 'hippocamp\n\
             # servo restore' restores the settings; the rest is for people to read.\n\
             version = {VERSION}\nprotocol = \"{}\"\nbaud = {baud}\nid = {id}\nmodel_number = {} {}\n",
            protocol.name(),
            self.model_number,
            self.heading
        );
        for (title, access) in
            [("settings", Access::Setting), ("volatile", Access::Volatile), ("fixed", Access::Fixed)]
        {
            let _ = writeln!(text, "\n[{title}]");
            for ((register, bytes), words) in self.registers.iter().zip(&self.words) {
                if register.access == access {
                    let entry = format!("{} = \"{}\"", register.name, hex(bytes));
                    let _ = writeln!(text, "{entry:<44} # {words}");
                }
            }
        }
        text
    }

    /// Writes it to a new file at `path`: completely, or not at all.
    ///
    /// # Errors
    /// If the file already exists, or cannot be written.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        output::write_new(path, self.to_toml().as_bytes())
    }

    /// Loads a file that [`Backup::save`] wrote.
    ///
    /// # Errors
    /// The fault of the file.
    pub fn load(path: &Path) -> Result<Backup, BackupError> {
        let wrong = |key: &str, expected: String| BackupError::Wrong {
            path: path.to_owned(),
            key: key.to_owned(),
            expected,
        };
        let text = read_text(path)
            .map_err(|error| BackupError::Unreadable { path: path.to_owned(), source: error.into() })?;
        let text: Text = toml::from_str(&text)
            .map_err(|error| wrong("file", format!("a backup ({})", error.message())))?;
        if text.version != VERSION {
            return Err(wrong("version", format!("{VERSION}, the only one this program knows")));
        }
        let known = || Protocol::all().map(|of| format!("\"{}\"", of.name())).collect::<Vec<_>>();
        let protocol = Protocol::all().find(|of| of.name() == text.protocol);
        let protocol = protocol.ok_or_else(|| wrong("protocol", known().join(" or ")))?;
        if text.id > Protocol::ID_MAX {
            return Err(wrong("id", format!("0 to {}", Protocol::ID_MAX)));
        }
        let byte_order = text.fixed.get("byte_order").map(String::as_str);
        let identity =
            super::servo::identity_of_backup(protocol, text.model_number, byte_order == Some("01"));
        let all = text.settings.iter().chain(&text.volatile).chain(&text.fixed);
        let mut registers = Vec::new();
        for (name, written) in all {
            let Some(register) = identity.register(name) else {
                return Err(wrong(name, "the name of a register of this model".to_owned()));
            };
            let count = register.register.bytes;
            let bytes = bytes_of(written).filter(|bytes| bytes.len() == usize::from(count));
            let bytes = bytes.ok_or_else(|| {
                wrong(name, format!("{count} bytes such as \"{}\"", "0a ".repeat(count.into()).trim()))
            })?;
            registers.push((register, bytes));
        }
        registers.sort_by_key(|(register, _)| register.register.address);
        let words = vec![String::new(); registers.len()];
        Ok(Backup {
            address: Address { protocol, baud: text.baud, id: ServoId(text.id) },
            series: identity.series,
            model_number: text.model_number,
            registers,
            words,
            heading: String::new(),
        })
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn bytes_of(text: &str) -> Option<Vec<u8>> {
    let is_byte = |word: &str| word.len() == 2;
    text.split(' ').map(|word| is_byte(word).then(|| u8::from_str_radix(word, 16).ok())?).collect()
}

/// A setting that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The register.
    pub register: RegisterInfo,
    /// The servo's value, in words.
    pub held: String,
    /// The backup's value, in words.
    pub wanted: String,
    bytes: Vec<u8>,
}

/// The settings of `servo` that differ from `backup`.
///
/// # Errors
/// If it is another model, or no good answer came.
pub fn differences(servo: &mut Servo<'_>, backup: &Backup) -> Result<Vec<Difference>, ServiceError> {
    let identity = servo.identity();
    if identity.model_number != backup.model_number || servo.address().protocol != backup.address.protocol {
        return Err(ServiceError::OtherModel {
            address: servo.address(),
            found: identity.model_number,
            expected: backup.model_number,
        });
    }
    let held = servo.read_all_bytes()?;
    let mut differences = Vec::new();
    for (register, bytes) in backup.settings() {
        let Some((_, value, _)) = held.iter().find(|(of, _, held)| of.name == register.name && held != bytes)
        else {
            continue;
        };
        let wanted = identity.value(register, backup.count(register, bytes));
        differences.push(Difference {
            register: register.clone(),
            held: value.to_string(),
            wanted: wanted.to_string(),
            bytes: bytes.clone(),
        });
    }
    Ok(differences)
}

/// Restores the settings of `servo` that differ: id and rate last, so that the servo can be found again if this
/// breaks off. Then reads all of them back.
///
/// # Errors
/// If the servo does not accept one; those before it are then written, and another call continues from there.
pub(crate) fn restore(
    servo: &mut Servo<'_>,
    backup: &Backup,
    differences: &[Difference],
) -> Result<(), ServiceError> {
    let home = backup.home();
    if servo.address() != home && servo.is_anybody_else_at(home)? {
        return Err(ServiceError::IdTaken { address: home });
    }
    let is_address = |of: &&Difference| ["id", "baud_rate"].contains(&&*of.register.name);
    servo.change_settings(|servo| {
        for difference in differences.iter().filter(|of| !is_address(of)) {
            servo.put_bytes(&difference.register, &difference.bytes)?;
        }
        // The rate first, unless another servo has this id at that rate.
        let between = Address { id: servo.address().id, ..home };
        let is_rate_first = between == home || !servo.is_anybody_else_at(between)?;
        let mut rest: Vec<&Difference> = differences.iter().filter(is_address).collect();
        rest.sort_by_key(|of| (of.register.name == "id") == is_rate_first);
        for difference in rest {
            servo.put_setting(&difference.register, backup.count(&difference.register, &difference.bytes))?;
        }
        Ok(())
    })?;
    match self::differences(servo, backup)?.first() {
        None => Ok(()),
        Some(left) => {
            Err(ServiceError::NotKept { address: servo.address(), register: left.register.name.to_string() })
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn sample() -> Backup {
        let identity = super::super::servo::identity_of_backup(Protocol::Feetech, 777, false);
        let registers: Vec<_> = identity
            .registers()
            .into_iter()
            .map(|register| {
                let bytes = vec![0x85, 0x08][..usize::from(register.register.bytes)].to_vec();
                (register, bytes)
            })
            .collect();
        let words = vec!["0.5 deg (5)".to_owned(); registers.len()];
        let address = Address { protocol: Protocol::Feetech, baud: 1_000_000, id: ServoId(1) };
        Backup {
            address,
            series: identity.series,
            model_number: 777,
            registers,
            words,
            heading: "# STS3215\nfirmware = \"3.10\"".into(),
        }
    }

    #[test]
    fn a_backup_holds_every_byte() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.toml");
        sample().save(&path).unwrap();
        let loaded = Backup::load(&path).unwrap();
        assert_eq!(loaded.registers, sample().registers);
        assert_eq!((loaded.address, loaded.model_number), (sample().address, 777));
        let names: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(names.len(), 1, "no part is left");
        assert!(sample().save(&path).is_err(), "no file is written over");
    }

    #[test]
    fn a_bad_backup_is_reported_by_key() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.toml");
        sample().save(&path).unwrap();
        let good = fs::read_to_string(&path).unwrap();
        for (from, to, told) in [
            ("version = 1", "version = 2", "version: expected 1"),
            ("protocol = \"feetech\"", "protocol = \"morse\"", "protocol: expected \"dynamixel\""),
            ("id = \"85\"", "id = \"8\"", "id: expected 1 bytes"),
            ("homing_offset = \"85 08\"", "homing_offset = \"85\"", "homing_offset: expected 2 bytes"),
            ("phase =", "phrase =", "phrase: expected the name"),
            ("[settings]", "", "expected a backup"),
        ] {
            assert!(good.contains(from), "{from}");
            fs::write(&path, good.replacen(from, to, 1)).unwrap();
            let error = Backup::load(&path).unwrap_err().to_string();
            assert!(error.contains(told), "{from}: {error}");
        }
    }
}
