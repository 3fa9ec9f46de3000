//! Words: what the library is, and what is wrong with a refused call.

use crate::status::*;
use core::ffi::{CStr, c_char};

#[cfg(feature = "std")]
macro_rules! variant {
    () => {
        "with the standard library"
    };
}
#[cfg(not(feature = "std"))]
macro_rules! variant {
    () => {
        "without heap and operating system"
    };
}
#[cfg(target_arch = "x86_64")]
macro_rules! processor {
    () => {
        "x86-64"
    };
}
#[cfg(target_arch = "aarch64")]
macro_rules! processor {
    () => {
        "64-bit ARM"
    };
}
#[cfg(target_arch = "arm")]
macro_rules! processor {
    () => {
        "32-bit ARM"
    };
}
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "arm")))]
macro_rules! processor {
    () => {
        "another processor"
    };
}

/// Version, variant and processor, as [`blik_build_info`] gives them.
const BUILD: &CStr = match CStr::from_bytes_with_nul(
    concat!("blik ", env!("CARGO_PKG_VERSION"), ", ", variant!(), ", ", processor!(), "\0").as_bytes(),
) {
    Ok(text) => text,
    Err(_) => c"blik",
};

/// Version, variant and processor of the library that is linked, in words: never null, never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn blik_build_info() -> *const c_char {
    BUILD.as_ptr()
}

/// Text of a refused call's error, in one line without its end: status, field, value, index, sizes.
///
/// Returns the length of the whole text, as snprintf does: where it is not below `size`, the text was cut.
///
/// - `error`: what a call wrote; null: an empty text
/// - `text`: receives the text with a zero at its end; null: the length alone is wanted
/// - `size`: number of characters that there is room for, the zero included
///
/// # Safety
/// Pointers are null or valid; `text` has room for `size` characters.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_error_text(error: *const blik_error, text: *mut c_char, size: usize) -> usize {
    let mut line = Line { at: text.cast(), room: if text.is_null() { 0 } else { size }, length: 0 };
    if !error.is_null() && error.is_aligned() {
        // SAFETY: by the caller's promise.
        line.error(&unsafe { error.read() });
    }
    line.end();
    line.length
}

/// Digits of a number of double precision that are told.
const DIGITS: i32 = 10;

/// The least number of a given count of digits.
const UNIT: u64 = 10u64.pow(DIGITS as u32 - 1);

/// A text of the caller's in the making.
struct Line {
    at: *mut u8,
    room: usize,
    length: usize,
}

impl Line {
    fn byte(&mut self, byte: u8) {
        if self.length.saturating_add(1) < self.room {
            // SAFETY: within the caller's text, a place before its last.
            unsafe { self.at.add(self.length).write(byte) };
        }
        self.length = self.length.saturating_add(1);
    }

    /// The zero behind what there was room for.
    fn end(&mut self) {
        if let Some(last) = self.room.checked_sub(1) {
            // SAFETY: within the caller's text.
            unsafe { self.at.add(self.length.min(last)).write(0) };
        }
    }

    fn text(&mut self, text: &[u8]) {
        text.iter().for_each(|byte| self.byte(*byte));
    }

    fn count(&mut self, name: &[u8], number: usize) {
        self.text(name);
        self.decimal(number as u64, 0);
    }

    /// `number` with a point before the last `after` of its digits, of which there is one more at least.
    fn decimal(&mut self, mut number: u64, after: usize) {
        // twenty digits and a point, from the last
        let (mut text, mut length) = ([0; 21], 0);
        for (place, to) in text.iter_mut().enumerate() {
            if place == after && after > 0 {
                *to = b'.';
            } else {
                *to = b'0' + (number % 10) as u8;
                number /= 10;
            }
            length = place + 1;
            // a digit stands before the point
            if number == 0 && (after == 0 || place > after) {
                break;
            }
        }
        text.iter().take(length).rev().for_each(|byte| self.byte(*byte));
    }

    fn real(&mut self, number: f64) {
        if number.is_nan() {
            return self.text(b"nan");
        }
        if number.is_sign_negative() {
            self.byte(b'-');
        }
        let size = number.abs();
        if size.is_infinite() {
            return self.text(b"inf");
        }
        // the number is `scaled` in [1, 10) times ten to the `exponent`
        let (mut scaled, mut exponent) = (size, 0);
        while scaled >= 10.0 {
            (scaled, exponent) = (scaled / 10.0, exponent + 1);
        }
        while scaled > 0.0 && scaled < 1.0 {
            (scaled, exponent) = (scaled * 10.0, exponent - 1);
        }
        let mut digits = (scaled * UNIT as f64 + 0.5) as u64;
        if digits >= 10 * UNIT {
            (digits, exponent) = (digits / 10, exponent + 1);
        }
        let plain = (-4..DIGITS).contains(&exponent);
        let mut after = if plain { DIGITS - 1 - exponent } else { DIGITS - 1 };
        while after > 0 && digits.is_multiple_of(10) {
            (digits, after) = (digits / 10, after - 1);
        }
        self.decimal(digits, after.unsigned_abs() as usize);
        if !plain {
            self.text(if exponent < 0 { b"e-" } else { b"e+" });
            if exponent.unsigned_abs() < 10 {
                self.byte(b'0');
            }
            self.decimal(u64::from(exponent.unsigned_abs()), 0);
        }
    }

    fn error(&mut self, error: &blik_error) {
        self.text(status_text(error.status).to_bytes());
        let field = field_text(error.field).to_bytes();
        if !field.is_empty() {
            self.text(b": ");
            self.text(field);
        }
        let status = error.status;
        let of_value = [
            BLIK_ERROR_MATERIAL,
            BLIK_ERROR_REFLECTANCE_SUM,
            BLIK_ERROR_RANGE,
            BLIK_ERROR_CHOICE,
            BLIK_ERROR_VERTEX_INDEX,
            BLIK_ERROR_NORMAL_INDEX,
            BLIK_ERROR_MATERIAL_INDEX,
        ];
        if of_value.contains(&status) {
            self.text(b", value ");
            self.real(error.value);
        }
        if [BLIK_ERROR_MATERIAL, BLIK_ERROR_REFLECTANCE_SUM].contains(&status) || error.band != 0 {
            self.count(b", band ", error.band);
        }
        let of_index = [
            BLIK_ERROR_VERTEX,
            BLIK_ERROR_NORMAL,
            BLIK_ERROR_VERTEX_INDEX,
            BLIK_ERROR_NORMAL_INDEX,
            BLIK_ERROR_MATERIAL_INDEX,
            BLIK_ERROR_MATERIAL,
            BLIK_ERROR_REFLECTANCE_SUM,
            BLIK_ERROR_BODY,
        ];
        let of_ray = (BLIK_FIELD_RAY_ORIGIN..=BLIK_FIELD_RAY_SKIP).contains(&error.field);
        if of_index.contains(&status) || of_ray || error.index != 0 {
            self.count(b", index ", error.index);
        }
        if error.needed != 0 {
            self.count(b", needed ", error.needed);
            self.count(b", given ", error.given);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(error: &blik_error) -> std::string::String {
        let mut buffer = [0x7f; 256];
        // SAFETY: as long as said.
        let length = unsafe { blik_error_text(error, buffer.as_mut_ptr(), buffer.len()) };
        // SAFETY: ended by a zero.
        let text = unsafe { CStr::from_ptr(buffer.as_ptr()) }.to_str().unwrap();
        assert_eq!(text.len(), length);
        text.into()
    }

    fn real(number: f64) -> std::string::String {
        let whole = text(&blik_error::of(BLIK_ERROR_RANGE).at(0, 0, number));
        whole.rsplit(", value ").next().unwrap().into()
    }

    #[test]
    fn numbers_are_told_to_ten_digits() {
        assert_eq!(real(0.0), "0");
        assert_eq!(real(-1.5), "-1.5");
        assert_eq!(real(0.1), "0.1");
        assert_eq!(real(4_294_967_295.0), "4294967295");
        assert_eq!(real(1e37), "1e+37");
        assert_eq!(real(2.0 / 3.0), "0.6666666667");
        assert_eq!(real(-2.5e-9), "-2.5e-09");
        assert_eq!(real(f64::NAN), "nan");
        assert_eq!(real(f64::NEG_INFINITY), "-inf");
        for number in [1.7e308, f64::MIN_POSITIVE, 5e-324, 0.099_999_999_99, 9.999_999_999_9, 1e9, 7.0 / 9.0]
        {
            let told: f64 = real(number).parse().unwrap();
            // ten digits, the tenth rounded; the powers of ten by repeated steps
            assert!((told - number).abs() <= 1e-8 * number.max(1e-315), "{number:e}: {told:e}");
        }
    }

    #[test]
    fn an_error_is_one_line_and_a_cut_one_still_ends() {
        let error = blik_error::of(BLIK_ERROR_MATERIAL).field(BLIK_FIELD_DIFFUSE).at(7, 2, 1.25);
        let whole = "a material's value is out of range: diffuse, value 1.25, band 2, index 7";
        assert_eq!(text(&error), whole);
        let mut short = [0x7f; 8];
        // SAFETY: as long as said.
        let length = unsafe { blik_error_text(&error, short.as_mut_ptr(), short.len()) };
        assert_eq!((length, short.map(|c| c as u8)), (whole.len(), *b"a mater\0"));
        // SAFETY: null stands for no text and no error.
        unsafe {
            assert_eq!(blik_error_text(&error, core::ptr::null_mut(), 99), whole.len());
            assert_eq!(blik_error_text(core::ptr::null(), short.as_mut_ptr(), 8), 0);
        }
        assert_eq!(short[0], 0);
    }
}
