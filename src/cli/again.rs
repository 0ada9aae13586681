//! The command that goes on with what was interrupted.
use std::ffi::OsStr;

/// What was typed, with `--resume`, as a shell takes it.
pub(super) fn command() -> String {
    line(std::env::args_os())
}

fn line<S: AsRef<OsStr>>(typed: impl Iterator<Item = S>) -> String {
    let mut words: Vec<String> = typed.map(|w| quoted(&w.as_ref().to_string_lossy())).collect();
    if !words.iter().any(|w| w == "--resume") {
        words.push("--resume".into());
    }
    words.join(" ")
}

/// A word as it is, or in quotes where a shell would make something else of it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_takes_it_as_it_was_typed() {
        let typed =
            ["calamus", "run", "a b.toml", "--set", "drawing.pattern={kind=\"grid\",n=5}", "--set", "name=it's"];
        let expected =
            r#"calamus run 'a b.toml' --set 'drawing.pattern={kind="grid",n=5}' --set 'name=it'\''s' --resume"#;
        assert_eq!(line(typed.iter()), expected);
        assert_eq!(line(["calamus", "run", "x", "--resume"].iter()), "calamus run x --resume");
    }
}
