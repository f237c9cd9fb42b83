//! Golden bytes are the examples of the ROBOTIS e-manual, `dxl/protocol2`, unless said otherwise.

use proptest::prelude::*;

use super::*;
use crate::bus::testing::{dynamixel_fast, dynamixel_status, slow_crc};

const ONE: ServoId = ServoId(1);
const BOTH: [ServoId; 2] = [ServoId(1), ServoId(2)];
/// Replies to a sync read of Present Position: servo 1 at 166, servo 2 at 2079.
const SYNC_READ_REPLIES: [u8; 30] = [
    0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x08, 0x00, 0x55, 0x00, 0xA6, 0x00, 0x00, 0x00, 0x8C, 0xC0, //
    0xFF, 0xFF, 0xFD, 0x00, 0x02, 0x08, 0x00, 0x55, 0x00, 0x1F, 0x08, 0x00, 0x00, 0xBA, 0xBE,
];
/// The same replies as one fast reply; CRCs from a bit-by-bit division outside this program.
const FAST_REPLY: [u8; 24] = [
    0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x11, 0x00, 0x55, //
    0x00, 0x01, 0xA6, 0x00, 0x00, 0x00, 0x74, 0x3B, //
    0x00, 0x02, 0x1F, 0x08, 0x00, 0x00, 0x1C, 0x36,
];

fn sent(encode: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out);
    out
}

/// (id, error, data) of good packets; `None` instead of error and data for corrupt ones.
type Found = (u8, Option<(u8, Vec<u8>)>);

fn good(id: u8, data: &[u8]) -> Found {
    (id, Some((0, data.to_vec())))
}

fn both_replies() -> Vec<Found> {
    vec![good(1, &[0xA6, 0, 0, 0]), good(2, &[0x1F, 8, 0, 0])]
}

fn drain(decoder: &mut Decoder, found: &mut Vec<Found>) {
    while let Some(event) = decoder.next_event() {
        found.push(match event {
            Event::Status(Status { id, error, parameters }) => (id.0, Some((error, parameters.to_vec()))),
            Event::Corrupt(id) => (id.0, None),
        });
    }
}

fn decode_into<'a>(decoder: &mut Decoder, pieces: impl IntoIterator<Item = &'a [u8]>) -> Vec<Found> {
    let mut found = Vec::new();
    for mut piece in pieces {
        while !piece.is_empty() {
            let taken = decoder.push(piece);
            assert!(taken > 0, "a decoder that was drained must take bytes");
            piece = &piece[taken..];
            drain(decoder, &mut found);
        }
    }
    decoder.end_of_input();
    drain(decoder, &mut found);
    found
}

fn decode(bytes: &[u8]) -> Vec<Found> {
    decode_into(&mut Decoder::new(16, 0), [bytes])
}

fn decode_fast(servos: usize, data_bytes: usize, bytes: &[u8]) -> Vec<Found> {
    let mut decoder = Decoder::new(data_bytes, servos);
    decoder.expect_fast_reply(servos, data_bytes);
    decode_into(&mut decoder, [bytes])
}

fn only_good(found: Vec<Found>) -> Vec<Found> {
    found.into_iter().filter(|found| found.1.is_some()).collect()
}

#[test]
fn requests_match_the_manual() {
    assert_eq!(
        sent(|out| request(out, ONE, 1, &[])),
        [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E]
    );
    assert_eq!(
        sent(|out| read(out, ONE, 132, 4)),
        [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x02, 0x84, 0x00, 0x04, 0x00, 0x1D, 0x15]
    );
    assert_eq!(
        sent(|out| sync_read(out, 132, 4, &BOTH)),
        [0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x09, 0x00, 0x82, 0x84, 0x00, 0x04, 0x00, 0x01, 0x02, 0xCE, 0xFA]
    );
    // The same except for instruction and CRC.
    assert_eq!(
        sent(|out| fast_sync_read(out, 132, 4, &BOTH)),
        [0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x09, 0x00, 0x8A, 0x84, 0x00, 0x04, 0x00, 0x01, 0x02, 0x4D, 0x72]
    );
    assert_eq!(
        sent(|out| sync_write(out, 116, 4, &mut [(ServoId(1), 150), (ServoId(2), 170)].into_iter())),
        [
            0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x11, 0x00, 0x83, 0x74, 0x00, 0x04, 0x00, //
            0x01, 0x96, 0x00, 0x00, 0x00, 0x02, 0xAA, 0x00, 0x00, 0x00, 0x82, 0x87,
        ]
    );
}

#[test]
fn requests_get_byte_stuffing() {
    // Goal position FF FF FD 00; length and CRC count the stuffed packet.
    assert_eq!(
        sent(|out| write(out, ONE, 116, 4, 0x00FD_FFFF)),
        [
            0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x0A, 0x00, 0x03, 0x74, 0x00, 0xFF, 0xFF, 0xFD, 0xFD, 0x00, 0x21,
            0xE7,
        ]
    );
    // A second packet in the same buffer is separate from the first.
    let two = sent(|out| {
        write(out, ONE, 116, 2, 0xFFFF);
        request(out, ONE, 1, &[]);
    });
    assert!(two.ends_with(&[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E]));
}

#[test]
fn packet_lengths_match_the_protocol() {
    for servos in 1..=32u8 {
        let ids: Vec<ServoId> = (0..servos).map(ServoId).collect();
        let count = usize::from(servos);
        assert_eq!(sent(|out| sync_read(out, 126, 21, &ids)).len(), 14 + count);
        assert_eq!(sent(|out| fast_sync_read(out, 126, 21, &ids)).len(), 14 + count);
        let values = ids.iter().map(|id| (*id, 2048));
        assert_eq!(sent(|out| sync_write(out, 116, 4, &mut { values })).len(), 14 + 5 * count);
    }
    assert!(sent(|out| sync_write(out, 116, 4, &mut std::iter::empty())).is_empty());
}

#[test]
fn replies_of_the_manual_are_decoded() {
    // Ping: model 1030, firmware 38.
    let ping = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04, 0x26, 0x65, 0x5D];
    assert_eq!(decode(&ping), [good(1, &[6, 4, 38])]);
    let write = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x04, 0x00, 0x55, 0x00, 0xA1, 0x0C];
    assert_eq!(decode(&write), [good(1, &[])]);
    assert_eq!(decode(&SYNC_READ_REPLIES), both_replies());
    assert_eq!(decode_fast(2, 4, &FAST_REPLY), both_replies());
}

#[test]
fn byte_stuffing_is_removed() {
    let stuffed =
        [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x09, 0x00, 0x55, 0x00, 0xFF, 0xFF, 0xFD, 0xFD, 0x00, 0xD8, 0x9C];
    assert_eq!(decode(&stuffed), [good(1, &[0xFF, 0xFF, 0xFD, 0x00])]);
    for data in [
        &[0xFF, 0xFF, 0xFD][..],
        &[0xFF, 0xFF, 0xFD, 0xFD],
        &[0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFD],
        &[0xFF, 0xFF, 0xFF, 0xFD, 0xFD, 0xFD],
        &[0xFF; 16],
        &[0xFD; 16],
    ] {
        assert_eq!(decode(&dynamixel_status(9, 0, data)), [good(9, data)], "data {data:02X?}");
    }
    // The pattern may begin in the error byte.
    assert_eq!(
        decode(&dynamixel_status(9, 0xFF, &[0xFF, 0xFD, 1])),
        [(9, Some((0xFF, vec![0xFF, 0xFD, 1])))]
    );
}

#[test]
fn replies_may_come_in_any_pieces() {
    for split in 0..=SYNC_READ_REPLIES.len() {
        let (first, second) = SYNC_READ_REPLIES.split_at(split);
        assert_eq!(decode_into(&mut Decoder::new(4, 0), [first, second]), both_replies());
    }
    for split in 0..=FAST_REPLY.len() {
        let (first, second) = FAST_REPLY.split_at(split);
        let mut decoder = Decoder::new(4, 2);
        decoder.expect_fast_reply(2, 4);
        assert_eq!(decode_into(&mut decoder, [first, second]), both_replies());
    }
}

#[test]
fn a_block_is_returned_before_the_reply_ends() {
    let mut decoder = Decoder::new(4, 2);
    decoder.expect_fast_reply(2, 4);
    decoder.push(&FAST_REPLY[..16]);
    let expected = Status { id: ONE, error: 0, parameters: &[0xA6, 0, 0, 0] };
    assert_eq!(decoder.next_event(), Some(Event::Status(expected)));
    assert_eq!(decoder.next_event(), None);
}

#[test]
fn a_fast_reply_cut_anywhere_gives_the_blocks_before_the_cut() {
    let datas: Vec<[u8; 21]> = (0..4).map(|servo| [servo; 21]).collect();
    let servos: Vec<(u8, u8, &[u8])> = (0..4).map(|i| (i, 0, datas[usize::from(i)].as_slice())).collect();
    let reply = dynamixel_fast(&servos);
    assert_eq!(reply.len(), 8 + 4 * (4 + 21));
    for length in 0..=reply.len() {
        let found = decode_fast(4, 21, &reply[..length]);
        let whole = length.saturating_sub(8) / 25;
        let expected: Vec<Found> = (0..4).take(whole).map(|i| good(i, &datas[usize::from(i)])).collect();
        assert_eq!(found, expected, "cut at {length}");
    }
}

#[test]
fn a_fast_reply_is_not_unstuffed() {
    let data = [0xFF, 0xFF, 0xFD, 0xFD, 0x00];
    assert_eq!(
        decode_fast(2, 5, &dynamixel_fast(&[(1, 0, &data), (2, 0, &data)])),
        [good(1, &data), good(2, &data)]
    );
}

#[test]
fn an_unrequested_fast_reply_is_noise() {
    assert_eq!(decode(&FAST_REPLY), []);
    let bytes = [&FAST_REPLY[..], &SYNC_READ_REPLIES].concat();
    assert_eq!(decode(&bytes), both_replies());
}

#[test]
fn a_truncated_fast_reply_does_not_swallow_what_follows() {
    let bytes = [&FAST_REPLY[..19], &FAST_REPLY].concat();
    let found = decode_fast(2, 4, &bytes);
    assert!(found.ends_with(&both_replies()), "{found:02X?}");
}

#[test]
fn noise_before_between_and_after_packets_hides_none() {
    let (first, second) = SYNC_READ_REPLIES.split_at(15);
    let noises: [&[u8]; 6] = [
        &[0xFF],
        &[0xFF, 0xFF],
        &[0xFF, 0xFF, 0xFD],
        &[0xFF, 0xFF, 0xFD, 0x00, 0x01],
        &[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x09, 0x00, 0x55, 0x00],
        &[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x0B, 0x00],
    ];
    for noise in noises {
        let bytes = [noise, first, noise, second, noise].concat();
        assert_eq!(only_good(decode(&bytes)), both_replies(), "noise {noise:02X?}");
    }
}

#[test]
fn the_echo_of_requests_is_noise() {
    let mut bytes = sent(|out| {
        request(out, ONE, 1, &[]);
        write(out, ONE, 116, 4, 0x55);
        sync_write(out, 116, 4, &mut [(ServoId(1), 0x55)].into_iter());
        sync_read(out, 132, 4, &BOTH);
    });
    bytes.extend(SYNC_READ_REPLIES);
    assert_eq!(decode(&bytes), both_replies());
}

#[test]
fn no_flipped_bit_of_a_reply_gives_wrong_data() {
    for data in [[0xA6, 0, 0, 0], [0xFF; 4], [0xFF, 0xFF, 0xFD, 0x00], [0x00, 0xFF, 0xFF, 0xFD]] {
        let reply = dynamixel_status(1, 0, &data);
        for bit in 0..reply.len() * 8 {
            let mut bytes = reply.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes.extend(&SYNC_READ_REPLIES[15..]);
            let found = only_good(decode(&bytes));
            assert_eq!(found, [good(2, &[0x1F, 8, 0, 0])], "data {data:02X?}, bit {bit}");
        }
    }
}

/// One flipped bit costs one servo; in a CRC, with which the next servo's check starts, it costs two.
#[test]
fn a_flipped_bit_of_a_fast_reply_costs_its_own_block() {
    let datas = [[0x11; 6], [0xFF, 0xFF, 0xFD, 0, 1, 2], [0x33; 6], [0x44; 6]];
    let servos: Vec<(u8, u8, &[u8])> = (1..).zip(&datas).map(|(id, data)| (id, 0, data.as_slice())).collect();
    let reply = dynamixel_fast(&servos);
    for bit in 0..reply.len() * 8 {
        let mut bytes = reply.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let found = only_good(decode_fast(4, 6, &bytes));
        let in_blocks = (bit / 8).checked_sub(8);
        let lost = |servo: usize| match in_blocks {
            None => true,
            Some(byte) => servo == byte / 10 || (byte % 10 >= 8 && servo == byte / 10 + 1),
        };
        let expected: Vec<Found> = (0..4)
            .filter(|servo| !lost(*servo))
            .map(|servo| good(servos[servo].0, servos[servo].2))
            .collect();
        assert_eq!(found, expected, "bit {bit}");
    }
}

#[test]
fn a_broken_crc_names_the_servo() {
    let mut bytes = SYNC_READ_REPLIES;
    bytes[9] ^= 0x10;
    assert_eq!(decode(&bytes), [(1, None), good(2, &[0x1F, 8, 0, 0])]);
    let mut bytes = FAST_REPLY;
    bytes[20] ^= 0x10;
    assert_eq!(decode_fast(2, 4, &bytes), [good(1, &[0xA6, 0, 0, 0]), (2, None)]);
}

/// Bytes drawn mostly from those that form headers, so that false headers are common.
fn header_noise() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![
        4 => Just(vec![0xFF, 0xFF, 0xFD, 0x00]),
        2 => Just(vec![0xFF]),
        1 => Just(vec![0x01, 0x08, 0x00, 0x55]),
        1 => Just(vec![0xFE, 0x11, 0x00, 0x55]),
        2 => any::<u8>().prop_map(|byte| vec![byte]),
    ];
    proptest::collection::vec(byte, 0..30).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn the_crc_matches_a_bitwise_computation(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
        prop_assert_eq!(crc16(0, &bytes).to_le_bytes(), slow_crc(&bytes));
    }

    #[test]
    fn any_bytes_are_handled_without_a_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..600),
        noise in header_noise(),
        data_bytes in 0usize..30,
        servos in 0usize..8,
    ) {
        decode_fast(servos, data_bytes, &bytes);
        decode_fast(servos, data_bytes, &noise);
        decode_fast(2, 4, &noise);
    }

    #[test]
    fn any_data_survive_byte_stuffing(data in proptest::collection::vec(prop_oneof![Just(0xFFu8), Just(0xFD)], 0..17)) {
        prop_assert_eq!(decode(&dynamixel_status(3, 0, &data)), [good(3, &data)]);
    }

    #[test]
    fn requests_contain_no_second_header(values in proptest::collection::vec(prop_oneof![
        Just(0xFD_FFFFu64), Just(0xFFFD_FFFF), Just(0xFFFF_FFFF), Just(0xFFFF_FFFD), any::<u64>(),
    ], 1..20)) {
        let out = sent(|out| sync_write(out, 116, 4, &mut (0..).map(ServoId).zip(values)));
        prop_assert!(!out[7..].windows(4).any(|bytes| bytes == HEADER));
        prop_assert_eq!(usize::from(u16::from_le_bytes([out[5], out[6]])), out.len() - 7);
        prop_assert!(out.ends_with(&slow_crc(&out[..out.len() - 2])));
    }

    #[test]
    fn a_packet_behind_noise_is_found(noise in header_noise(), data in any::<[u8; 4]>()) {
        let bytes = [noise.clone(), dynamixel_status(7, 0, &data)].concat();
        prop_assert!(decode(&bytes).contains(&good(7, &data)));
        let bytes = [noise, dynamixel_fast(&[(1, 0, &data), (2, 0, &data)])].concat();
        let found = decode_fast(2, 4, &bytes);
        prop_assert!(found.ends_with(&[good(1, &data), good(2, &data)]), "{:02X?}", found);
    }
}
