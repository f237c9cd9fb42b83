//! Collects replies: one slot per servo in an exchange, one answer in a transaction.

use crate::bus::codec::Codec;
use crate::bus::packet::{Event, Status};
use crate::bus::protocols::ProtocolSpec;
use crate::bus::register::decode_ordered;
use crate::bus::{Feedback, Slot};
use crate::model::servo_model::Register;
use crate::model::{Protocol, Registers};
use crate::signals::{Question, ServoAnswer};
use crate::units::ServoId;

/// Result of a single transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The servo answered.
    Done {
        /// The register read, decoded; 0 for a ping and a write.
        value: i64,
        /// Alarm bits, as in [`Feedback::alarms`].
        alarms: u8,
    },
    /// The servo refused, with its protocol's number of the error.
    Refused {
        /// The error number.
        error: u8,
    },
    /// Bytes of an answer came, but did not pass their checksum or had the wrong shape.
    Corrupt,
    /// No answer came.
    Missing,
}

/// The request to one servo.
#[derive(Debug, Clone, Copy)]
pub(super) enum RequestKind {
    Ping,
    Read(Register),
    Write,
}

/// The replies that are awaited.
#[derive(Debug)]
pub(super) enum Awaited {
    Nothing,
    /// Every servo's feedback block, or instead its answer to a question.
    Feedback(Option<Question>),
    /// This servo's answer.
    Answer {
        id: ServoId,
        question: RequestKind,
        answer: Answer,
    },
}

/// Replies of the request under way.
#[derive(Debug)]
pub(super) struct Inbox {
    spec: &'static ProtocolSpec,
    pub(super) ids: Vec<ServoId>,
    pub(super) registers: &'static Registers,
    pub(super) slots: Vec<Slot>,
    pub(super) awaited: Awaited,
    /// Good packets from servos that were not asked, since the start.
    pub(super) unknown: u64,
}

impl Inbox {
    pub(super) fn new(protocol: Protocol, registers: &'static Registers, ids: &[ServoId]) -> Inbox {
        Inbox {
            spec: protocol.spec(),
            ids: ids.to_vec(),
            registers,
            slots: vec![Slot::Missing; ids.len()],
            awaited: Awaited::Nothing,
            unknown: 0,
        }
    }

    /// Prepares for the replies to a request that is about to be sent.
    pub(super) fn expect(&mut self, awaited: Awaited) {
        if matches!(awaited, Awaited::Feedback(_)) {
            self.slots.fill(Slot::Missing);
        }
        self.awaited = awaited;
    }

    /// True if no more replies are due. A corrupt one may have been noise, so the good one is still awaited.
    pub(super) fn is_complete(&self) -> bool {
        match &self.awaited {
            Awaited::Nothing => true,
            Awaited::Feedback(_) => self.slots.iter().all(|slot| slot.is_good()),
            Awaited::Answer { answer, .. } => matches!(answer, Answer::Done { .. } | Answer::Refused { .. }),
        }
    }

    /// Feeds `bytes` to the decoder and sorts its packets into slots or the answer.
    pub(super) fn decode(&mut self, codec: &mut Codec, mut bytes: &[u8]) {
        loop {
            let taken = codec.push(bytes);
            self.drain(codec);
            bytes = bytes.get(taken..).unwrap_or_default();
            // A drained decoder takes at least one byte; if it ever did not, the loop still ends here.
            if bytes.is_empty() || taken == 0 {
                return;
            }
        }
    }

    /// Sorts the packets that the decoder still finds.
    pub(super) fn drain(&mut self, codec: &mut Codec) {
        while let Some(event) = codec.next_event() {
            match (event, &self.awaited) {
                (_, Awaited::Nothing) => {}
                (Event::Status(status), Awaited::Feedback(asked)) => self.take_feedback(status, *asked),
                (Event::Status(status), Awaited::Answer { id, question, .. }) => {
                    self.take_answer(status, *id, *question);
                }
                (Event::Corrupt(id), _) => self.mark_corrupt(id),
            }
        }
    }

    fn take_feedback(&mut self, status: Status<'_>, asked: Option<Question>) {
        let (alarms, refusal) = (self.spec.alarms_and_refusal)(status.error);
        let reply = match asked {
            None => feedback(self.registers, status.parameters, alarms).map(Slot::Fresh),
            Some(question) => self.answer_to(question, status.parameters).map(Slot::Answered),
        };
        match (slot_of(&self.ids, &mut self.slots, status.id), reply.filter(|_| refusal == 0)) {
            (Some(slot), Some(reply)) => *slot = reply,
            (Some(_), None) => self.mark_corrupt(status.id),
            (None, _) => self.unknown = self.unknown.saturating_add(1),
        }
    }

    fn take_answer(&mut self, status: Status<'_>, asked: ServoId, question: RequestKind) {
        if status.id != asked {
            self.unknown = self.unknown.saturating_add(1);
            return;
        }
        let (alarms, refusal) = (self.spec.alarms_and_refusal)(status.error);
        let (bytes, register) = match question {
            RequestKind::Ping if (self.spec.may_be_echoed_ping)(status.error, status.parameters) => return,
            RequestKind::Ping => (self.spec.ping_bytes, None),
            RequestKind::Read(register) => {
                ((self.spec.asked_bytes)(u16::from(register.bytes)), Some(register))
            }
            RequestKind::Write => (0, None),
        };
        let value = match register {
            Some(register) => decode_ordered(register, status.parameters, self.registers.is_big_endian),
            None => Some(0),
        };
        let answer = match value {
            _ if refusal != 0 => Answer::Refused { error: refusal },
            Some(value) if status.parameters.len() == usize::from(bytes) => Answer::Done { value, alarms },
            _ => return self.mark_corrupt(asked),
        };
        self.awaited = Awaited::Answer { id: asked, question, answer };
    }

    /// Reads the answer to a question; `None` when it has the wrong length.
    fn answer_to(&self, question: Question, data: &[u8]) -> Option<ServoAnswer> {
        let registers = self.registers;
        if data.len() != usize::from(self.asked_register(question).1) {
            return None;
        }
        let value = decode_ordered(register_of(registers, question), data, registers.is_big_endian)?;
        Some(match question {
            Question::Torque => ServoAnswer::Torque(value != 0),
            Question::Alarms => ServoAnswer::Alarms(u8::try_from(value).unwrap_or(u8::MAX)),
            Question::Goal => ServoAnswer::Goal(saturate(value)),
        })
    }

    /// First address and number of bytes that every servo is asked to send.
    pub(super) fn asked_of(&self, question: Option<Question>) -> (u16, u16) {
        match question {
            None => (self.registers.feedback_address, self.registers.feedback_bytes),
            Some(question) => self.asked_register(question),
        }
    }

    /// First address and number of bytes to read in order to answer `question`.
    fn asked_register(&self, question: Question) -> (u16, u16) {
        let register = register_of(self.registers, question);
        let bytes = u16::from(register.bytes);
        // Only where servos are asked one by one could a reply be taken for the echo of its request.
        let asked = if self.registers.has_sync_read { bytes } else { (self.spec.asked_bytes)(bytes) };
        (register.address, asked)
    }

    /// Marks the slot or answer of `id` as corrupt, unless a good reply was already there.
    fn mark_corrupt(&mut self, id: ServoId) {
        match &mut self.awaited {
            Awaited::Feedback(_) => {
                if let Some(slot @ Slot::Missing) = slot_of(&self.ids, &mut self.slots, id) {
                    *slot = Slot::Corrupt;
                }
            }
            Awaited::Answer { id: asked, answer: answer @ Answer::Missing, .. } if *asked == id => {
                *answer = Answer::Corrupt;
            }
            Awaited::Nothing | Awaited::Answer { .. } => {}
        }
    }
}

fn slot_of<'a>(ids: &[ServoId], slots: &'a mut [Slot], id: ServoId) -> Option<&'a mut Slot> {
    ids.iter().zip(slots).find(|(known, _)| **known == id).map(|(_, slot)| slot)
}

/// Reads a feedback block; `None` when it has the wrong length.
fn feedback(registers: &Registers, block: &[u8], alarms: u8) -> Option<Feedback> {
    if block.len() != usize::from(registers.feedback_bytes) {
        return None;
    }
    let field = |register: Register| {
        let offset = register.address.checked_sub(registers.feedback_address)?;
        decode_ordered(register, block.get(usize::from(offset)..)?, registers.is_big_endian)
    };
    Some(Feedback {
        position: saturate(field(registers.present_position)?),
        speed: saturate(field(registers.present_speed)?),
        load: saturate(field(registers.present_load)?),
        // A voltage or temperature beyond its type is beyond every limit too.
        voltage_decivolt: u16::try_from(field(registers.present_voltage)?).unwrap_or(u16::MAX),
        temperature_c: u8::try_from(field(registers.present_temperature)?).unwrap_or(u8::MAX),
        alarms,
    })
}

/// The register that answers `question`.
fn register_of(registers: &Registers, question: Question) -> Register {
    match question {
        Question::Torque => registers.torque_enable,
        Question::Alarms => registers.alarm_status,
        Question::Goal => registers.goal_position,
    }
}

/// The nearest `i32`.
fn saturate(value: i64) -> i32 {
    i32::try_from(value).unwrap_or(if value < 0 { i32::MIN } else { i32::MAX })
}
