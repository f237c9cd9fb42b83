//! Requests to single servos through the crate `dynamixel2`, on a copy of the line's descriptor.

use std::io;

use dynamixel2::instructions::FactoryResetKind;
use dynamixel2::{ReadError, TransferError, WriteError};
use serial2::SerialPort;
use serialport::TTYPort;

use crate::bus::ask::{Answer, Ask, Library};
use crate::platform::descriptor;
use crate::units::ServoId;

#[derive(Debug)]
struct Dynamixel2(dynamixel2::Bus<Vec<u8>, Vec<u8>>);

/// The longest packet in either direction, stuffed.
const BUFFER_BYTES: usize = 512;

/// The library on the same line.
///
/// # Errors
/// The system's error.
pub(super) fn open(line: &TTYPort) -> Result<Box<dyn Library>, String> {
    let copy = descriptor(line).try_clone_to_owned().map_err(|error| error.to_string())?;
    let port = SerialPort::from(copy);
    let bus = dynamixel2::Bus::with_buffers(port, vec![0; BUFFER_BYTES], vec![0; BUFFER_BYTES]);
    Ok(Box::new(Dynamixel2(bus.map_err(|error| error.to_string())?)))
}

impl Library for Dynamixel2 {
    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        self.0.set_baud_rate(baud)
    }

    fn ask(&mut self, id: ServoId, ask: &Ask<'_>) -> io::Result<Answer> {
        let bus = &mut self.0;
        let result = match *ask {
            Ask::Ping => bus.ping(id.0).map(|reply| {
                let [low, high] = reply.data.model.to_le_bytes();
                vec![low, high, reply.data.firmware]
            }),
            Ask::Read { start, bytes } => bus.read(id.0, start, u16::from(bytes)).map(|reply| reply.data),
            Ask::Write { start, data } => bus.write(id.0, start, data).map(|_| Vec::new()),
            Ask::Reboot => bus.reboot(id.0).map(|_| Vec::new()),
            Ask::Reset => bus.factory_reset(id.0, FactoryResetKind::KeepIdAndBaudRate).map(|_| Vec::new()),
        };
        match result {
            Ok(data) => Ok(Answer::Data(data)),
            Err(TransferError::ReadError(ReadError::MotorError(error))) => {
                Ok(Answer::Refused(error.error_number()))
            }
            Err(TransferError::ReadError(ReadError::Io(error)))
                if error.kind() == io::ErrorKind::TimedOut =>
            {
                Ok(Answer::Missing)
            }
            Err(TransferError::ReadError(ReadError::Io(error))) => Err(error),
            Err(TransferError::WriteError(WriteError::DiscardBuffer(error) | WriteError::Write(error))) => {
                Err(error)
            }
            // A wrong checksum, another servo's answer, or one of the wrong length.
            Err(_) => Ok(Answer::Damaged),
        }
    }
}
