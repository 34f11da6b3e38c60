//! Numbers as programs want them: shortest fixed-point form, never an exponent, never `-0`.

/// The powers of ten that [`quantum`] can ask for.
const SCALES: [f64; 7] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Returns how many of the last decimal place are one.
///
/// # Panics
///
/// When `decimals` exceeds 6.
#[must_use]
pub(crate) fn scale(decimals: usize) -> f64 {
    SCALES[decimals]
}

/// Returns `value` as a whole number of the last decimal place.
///
/// # Panics
///
/// When `decimals` exceeds 6.
#[must_use]
pub(crate) fn quantum(value: f64, decimals: usize) -> i64 {
    // Halves away from zero. Saturates far outside of what any axis reaches.
    let scaled = value * SCALES[decimals];
    (scaled + 0.5_f64.copysign(scaled)) as i64
}

/// Returns the value that `count` of the last decimal place stand for.
#[must_use]
pub(crate) fn value(count: i64, decimals: usize) -> f64 {
    count as f64 / SCALES[decimals]
}

/// Sign, point and the digits of the greatest `u64`.
const MOST_CHARACTERS: usize = 22;

/// Appends a whole number of the last decimal place as a decimal number without trailing zeros.
pub(crate) fn push_quantum(out: &mut Vec<u8>, count: i64, decimals: usize) {
    let mut text = [0; MOST_CHARACTERS];
    let mut first = MOST_CHARACTERS;
    let mut put = |character: u8| {
        first -= 1;
        text[first] = character;
    };
    let mut rest = count.unsigned_abs();
    let mut places = decimals;
    while places > 0 && rest.is_multiple_of(10) {
        rest /= 10;
        places -= 1;
    }
    if places > 0 {
        for _ in 0..places {
            put(b'0' + (rest % 10) as u8);
            rest /= 10;
        }
        put(b'.');
    }
    loop {
        put(b'0' + (rest % 10) as u8);
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    if count < 0 {
        put(b'-');
    }
    out.extend_from_slice(&text[first..]);
}

/// Returns `value` with at most `decimals` places.
#[must_use]
pub fn decimal(value: f64, decimals: usize) -> String {
    let mut out = Vec::new();
    push_quantum(&mut out, quantum(value, decimals), decimals);
    String::from_utf8(out).expect("digits are ASCII")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortest_form() {
        for (value, decimals, text) in [
            (1.5, 3, "1.5"),
            (-0.000_4, 3, "0"),
            (-0.000_6, 3, "-0.001"),
            (12.0, 5, "12"),
            (0.000_01, 5, "0.00001"),
            (-17.340_2, 4, "-17.3402"),
            (1e6 + 0.1, 1, "1000000.1"),
            (0.0, 0, "0"),
            (100.0, 3, "100"),
            (-0.5, 1, "-0.5"),
            (1e300, 6, "9223372036854.775807"),
        ] {
            assert_eq!(decimal(value, decimals), text);
        }
    }

    #[test]
    fn equals_the_formatter_of_the_standard_library() {
        for i in 0..20_000_i64 {
            let value = (i as f64 - 10_000.0) * 0.012_34;
            let expected = format!("{value:.4}");
            let expected = expected.trim_end_matches('0').trim_end_matches('.');
            let expected = if expected == "-0" { "0" } else { expected };
            let ours = decimal(value, 4);
            // Halves may round the other way; the value must still be the nearest.
            let parsed: f64 = ours.parse().unwrap();
            assert!(ours == expected || (parsed - value).abs() <= 0.5e-4 * 1.000_001, "{ours}");
        }
    }
}
