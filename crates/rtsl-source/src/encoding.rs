//! Encodings of text files. All texts are in UTF-8, with or without the mark that some editors write before them.

/// The mark of UTF-8: U+FEFF.
const MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// Converts the bytes of a file to a text, which keeps its mark.
///
/// # Errors
/// If they are in another encoding: a clause that names it.
///
/// ```
/// use rtsl_source::encoding::utf8;
///
/// assert_eq!(utf8(b"text".to_vec()), Ok("text".to_owned()));
/// assert_eq!(utf8(b"\xff\xfet\0".to_vec()), Err("it is in UTF-16: save it as UTF-8"));
/// ```
pub fn utf8(bytes: Vec<u8>) -> Result<String, &'static str> {
    check_width(&bytes)?;
    String::from_utf8(bytes).map_err(|_| "it is not UTF-8")
}

/// Checks that a text has letters of one byte, as those of UTF-8 and of older encodings.
///
/// # Errors
/// If the text begins like one in UTF-16 or UTF-32: a clause that names the encoding.
pub fn check_width(bytes: &[u8]) -> Result<(), &'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Err("it is in UTF-32: save it as UTF-8"),
        // The mark, or a letter of ASCII.
        [0xff, 0xfe, ..]
        | [0xfe, 0xff, ..]
        | [1..=127, 0, 1..=127, 0, ..]
        | [0, 1..=127, 0, 1..=127, ..] => Err("it is in UTF-16: save it as UTF-8"),
        _ => Ok(()),
    }
}

/// Returns the bytes of a text after its mark, if it has one.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(&MARK).unwrap_or(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_encodings_are_named() {
        let wide = |text: &str| text.encode_utf16().collect::<Vec<u16>>();
        let little =
            |units: Vec<u16>| -> Vec<u8> { units.into_iter().flat_map(u16::to_le_bytes).collect() };
        let big =
            |units: Vec<u16>| -> Vec<u8> { units.into_iter().flat_map(u16::to_be_bytes).collect() };
        let problem = Err("it is in UTF-16: save it as UTF-8");
        for text in ["\u{feff}# a scene", "# a scene"] {
            assert_eq!(check_width(&little(wide(text))), problem);
            assert_eq!(check_width(&big(wide(text))), problem);
        }
        assert!(check_width(b"\xff\xfe\0\0a\0\0\0").unwrap_err().contains("UTF-32"));
        assert_eq!(utf8(b"caf\xe9".to_vec()), Err("it is not UTF-8"));
        for text in ["", "a", "\u{feff}a"] {
            assert_eq!(utf8(text.into()), Ok(text.to_owned()));
        }
        assert_eq!(without_mark("\u{feff}a".as_bytes()), b"a");
        assert_eq!(without_mark(b"a"), b"a");
    }
}
