//! Base64 (RFC 4648, section 4): an SVG holds its bitmaps as text.

const ALPHABET: [char; 64] = {
    let mut alphabet = ['+'; 64];
    let mut i = 0;
    while i < 26 {
        alphabet[i] = (b'A' + i as u8) as char;
        alphabet[26 + i] = (b'a' + i as u8) as char;
        if i < 10 {
            alphabet[52 + i] = (b'0' + i as u8) as char;
        }
        i += 1;
    }
    alphabet[63] = '/';
    alphabet
};

/// The text of some bytes, padded.
pub(crate) fn encode(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| group.get(i).map_or(0, |&byte| u32::from(byte));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            // One byte gives two digits, two bytes give three.
            text.push(if digit <= group.len() {
                ALPHABET[(bits >> (18 - 6 * digit)) as usize & 63]
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::encode;

    /// The test vectors of RFC 4648, section 10, and all digits in their order.
    #[test]
    fn base64_is_that_of_the_rfc() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (bytes, text) in vectors {
            assert_eq!(encode(bytes.as_bytes()), text);
        }
        let digits: Vec<u8> = (0..16_u32)
            .flat_map(|k| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| 4 * k + i);
                let bits = a << 18 | b << 12 | c << 6 | d;
                bits.to_be_bytes().into_iter().skip(1)
            })
            .collect();
        let all = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        assert_eq!(encode(&digits), all);
    }
}
