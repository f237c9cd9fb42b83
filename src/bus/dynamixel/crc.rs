//! CRC-16 of Dynamixel Protocol 2.0: polynomial 0x8005, start value 0, highest bit first.
//! Source: ROBOTIS e-manual, `dxl/crc`.

const POLYNOMIAL: u16 = 0x8005;

/// Remainder of each value of the high byte.
static TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut high_byte = 0u16;
    while high_byte < 256 {
        let mut remainder = high_byte << 8;
        let mut bit = 0;
        while bit < 8 {
            let carry = remainder & 0x8000 != 0;
            remainder <<= 1;
            if carry {
                remainder ^= POLYNOMIAL;
            }
            bit += 1;
        }
        table[high_byte as usize] = remainder;
        high_byte += 1;
    }
    table
}

/// Continues `crc` over `bytes`; start with 0.
pub(super) fn crc16(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, byte| {
        let [high, low] = crc.to_be_bytes();
        // A byte is always within a table of 256.
        let remainder = TABLE.get(usize::from(high ^ byte)).copied().unwrap_or_default();
        u16::from_be_bytes([low, 0]) ^ remainder
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crc_matches_the_check_value_of_the_catalogue() {
        // CRC-16/UMTS (alias CRC-16/BUYPASS) in the CRC RevEng catalogue has these parameters.
        assert_eq!(crc16(0, b"123456789"), 0xFEE8);
    }

    #[test]
    fn the_crc_of_pieces_is_the_crc_of_the_whole() {
        for split in 0..=9 {
            let (first, second) = b"123456789".split_at(split);
            assert_eq!(crc16(crc16(0, first), second), 0xFEE8);
        }
    }

    #[test]
    fn the_crc_table_matches_the_manual() {
        // First and last entries of the table in the e-manual's example code.
        assert_eq!(TABLE[..4], [0x0000, 0x8005, 0x800F, 0x000A]);
        assert_eq!(TABLE[248..], [0x8213, 0x0216, 0x021C, 0x8219, 0x0208, 0x820D, 0x8207, 0x0202]);
    }
}
