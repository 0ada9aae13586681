//! Text from files and numbers from anywhere, as they may stand before people: on a terminal, in a report, in a table.
use std::borrow::Cow;

/// Digits before the point beyond which a number is written with an exponent.
const LONGEST: usize = 20;

/// Whether a character changes what a terminal or a page shows beside itself: control characters, and those that turn the direction
/// of writing. A line's end and a tabulator are none.
fn is_hidden(c: char) -> bool {
    (c.is_control() && c != '\n' && c != '\t') || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Text in which hidden characters are written out, as `\u001b`: a name from a file can't move a cursor, colour a terminal, or turn
/// what follows it about.
pub fn plain(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_hidden(c) {
            plain += &format!("\\u{:04x}", u32::from(c));
        } else {
            plain.push(c);
        }
    }
    Cow::Owned(plain)
}

/// A number exactly, in digits as long as they can be read, else with an exponent.
pub fn exactly(x: f64) -> String {
    let digits = x.to_string();
    if digits.len() > LONGEST { format!("{x:e}") } else { digits }
}

/// A measured number with six significant digits, without a sign before a zero.
pub fn figure(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if rounded == 0.0 {
        return "0".into();
    }
    if (1e-4..1e9).contains(&rounded.abs()) || !rounded.is_finite() {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// Text whose numbers have sensible digits: no `-0.00`, no `0.000000000`, no 309 digits. Words, names and dates stay.
pub fn sensible(text: &str) -> String {
    let mut sensible = String::with_capacity(text.len());
    let mut rest = text;
    let mut before = ' ';
    while let Some(c) = rest.chars().next() {
        let number = if stands_alone(before) { number_at(rest) } else { "" };
        if number.is_empty() {
            sensible.push(c);
            before = c;
            rest = &rest[c.len_utf8()..];
        } else {
            sensible += &shortened(number);
            before = '0';
            rest = &rest[number.len()..];
        }
    }
    sensible
}

/// Whether a number may begin after this character.
fn stands_alone(before: char) -> bool {
    !(before.is_alphanumeric() || "_-./:#".contains(before))
}

/// The number that a text begins with, with its sign; empty where it begins with none, or with one that is part of a word.
fn number_at(text: &str) -> &str {
    let digits = |s: &str| s.bytes().take_while(u8::is_ascii_digit).count();
    let sign = usize::from(text.starts_with('-'));
    let whole = digits(&text[sign..]);
    let mut end = sign + whole;
    if whole == 0 {
        return "";
    }
    if text[end..].starts_with('.') {
        let decimals = digits(&text[end + 1..]);
        end += if decimals > 0 { 1 + decimals } else { 0 };
    }
    let after = text[end..].chars().next().unwrap_or(' ');
    let dotted = after == '.' && text[end + 1..].starts_with(|c: char| c.is_alphanumeric());
    if after.is_alphanumeric() || "_-/:".contains(after) || dotted { "" } else { &text[..end] }
}

fn shortened(number: &str) -> Cow<'_, str> {
    let unsigned = number.strip_prefix('-').unwrap_or(number);
    let (whole, decimals) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    if unsigned.bytes().all(|b| b == b'0' || b == b'.') {
        // a file's number 000 isn't a zero
        return if decimals.len() > 6 {
            "0".into()
        } else if whole == "0" {
            unsigned.into()
        } else {
            number.into()
        };
    }
    match number.parse::<f64>() {
        Ok(x) if whole.len() > LONGEST => format!("{x:e}").into(),
        _ => number.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_written_out() {
        assert_eq!(plain("a\u{1b}[31mred\u{9b}2J\u{202e}\0"), "a\\u001b[31mred\\u009b2J\\u202e\\u0000");
        assert!(matches!(plain("Tusche, rot\tb\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn numbers_have_sensible_digits() {
        for (text, expected) in [
            ("force -0.00 N of 1.05 N", "force 0.00 N of 1.05 N"),
            ("turned by 0.000000000 deg", "turned by 0 deg"),
            ("(x -104.8 mm, y -0.0 mm)", "(x -104.8 mm, y 0.0 mm)"),
            ("-0.04 and -0", "-0.04 and 0"),
            (
                "a-0.0.svg 2026-00-00 v1.0.0 #000000 trial-0 00:00.0",
                "a-0.0.svg 2026-00-00 v1.0.0 #000000 trial-0 00:00.0",
            ),
            ("strokes=10-20, 000 and [0, -0.0]", "strokes=10-20, 000 and [0, 0.0]"),
        ] {
            assert_eq!(sensible(text), expected);
        }
        assert_eq!(sensible(&format!("not {}", 1e308)), "not 1e308");
        assert_eq!(sensible(&format!("at {:.1} N.", -1.5e300)), "at -1.5e300 N.");
    }

    #[test]
    fn figures_are_short_and_exact_numbers_exact() {
        assert_eq!(
            [figure(0.123_456_789), figure(-0.0), figure(1e300), figure(12.0)],
            ["0.123457", "0", "1e300", "12"]
        );
        assert_eq!([figure(1e-9), figure(7.25e8)], ["1e-9", "725000000"]);
        assert_eq!([exactly(1e308), exactly(0.1), exactly(1e6), exactly(f64::NAN)], ["1e308", "0.1", "1000000", "NaN"]);
    }
}
