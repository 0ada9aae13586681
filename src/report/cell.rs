//! Text as a cell of a table that spreadsheets open.
use crate::math::plain;

/// Text that may stand in a cell of CSV, before it is quoted: without control characters, and never a formula. What begins as one, with
/// `=`, `+`, `-` or `@`, and isn't a number, gets an apostrophe before it, which spreadsheets don't show.
pub fn cell(text: &str) -> String {
    let text = plain(text);
    let formula = text.trim_start().starts_with(['=', '+', '-', '@']) && text.parse::<f64>().is_err();
    if formula { format!("'{text}") } else { text.into_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_is_a_formula() {
        for text in ["=1+1", "+cmd|'/c calc'!A0", "-x", "@SUM(A1)", " =1", "\t=1"] {
            assert_eq!(cell(text), format!("'{text}"));
        }
        assert_eq!([cell("-3.5"), cell("+1e3"), cell("a=b"), cell("")], ["-3.5", "+1e3", "a=b", ""]);
        assert_eq!(cell("\u{1b}[2Jx"), "\\u001b[2Jx");
    }
}
