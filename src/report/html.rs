//! What every HTML page of the program shares.

use crate::math::plain;

const PAGE_STYLE: &str = include_str!("page.css");
/// Style of plots, on pages and in files of their own.
pub(super) const PLOT_STYLE: &str = include_str!("plot.css");

/// A page around a body, with the program's style and nothing from outside.
pub fn document(title: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>{title}</title>\n<style>\n{PAGE_STYLE}{PLOT_STYLE}</style>\n</head>\n<body>\n\
         {body}</body>\n</html>\n"
    )
}

/// Text that may stand in HTML, in attributes too; control characters are written out.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in plain(text).chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            c => safe.push(c),
        }
    }
    safe
}
