//! Comments of other programs: after `;`, or in brackets.

use std::borrow::Cow;

/// Takes a line apart: what comes before `;` or stands outside of brackets, and the rest.
pub(super) fn without_comment(line: &str) -> (Cow<'_, str>, Option<Cow<'_, str>>) {
    // Some editors begin a file with a mark of its encoding.
    let line = line.trim_start_matches('\u{feff}').trim_end();
    let (code, comment) = match line.split_once(';') {
        Some((code, comment)) => (code, Some(Cow::from(comment))),
        None => (line, None),
    };
    if !is_words(code) || !code.contains('(') {
        return (code.into(), comment);
    }
    let (words, inside) = without_brackets(code);
    (words.into(), comment.or(Some(inside.into())))
}

/// Whether brackets are comments in this line: a message may have brackets of its own.
fn is_words(code: &str) -> bool {
    code.trim_start().starts_with(['G', 'g', 'N', 'n', 'X', 'Y', 'Z', '('])
}

/// Whether a bracket that begins a comment is not closed in its line.
pub(super) fn leaves_bracket_open(line: &str) -> bool {
    let code = line.split_once(';').map_or(line, |(code, _)| code);
    is_words(code) && code.rfind('(').is_some_and(|at| !code[at..].contains(')'))
}

/// Returns what stands outside of brackets, and what stands inside, each after a blank.
fn without_brackets(code: &str) -> (String, String) {
    let (mut words, mut inside, mut rest) = (String::new(), String::new(), code);
    while let Some((before, after)) = rest.split_once('(') {
        let (text, next) = after.split_once(')').unwrap_or((after, ""));
        words.push_str(before);
        words.push(' ');
        inside.push(' ');
        inside.push_str(text);
        rest = next;
    }
    words.push_str(rest);
    (words, inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_comments() {
        let taken = |line: &str| {
            let (code, comment) = without_comment(line);
            (code.trim().to_owned(), comment.map(Cow::into_owned))
        };
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(taken("G1 X5 ; right\r\n"), ("G1 X5".into(), some(" right")));
        assert_eq!(taken("G1 (right) X5\n"), ("G1   X5".into(), some(" right")));
        assert_eq!(taken("(a) G1 (b) X5 (c"), ("G1   X5".into(), some(" a b c")));
        assert_eq!(taken("(only)"), (String::new(), some(" only")));
        assert_eq!(taken("M117 a (b)"), ("M117 a (b)".into(), None));
        assert_eq!(taken(";TYPE:Perimeter"), (String::new(), some("TYPE:Perimeter")));
        assert!(leaves_bracket_open("G1 X5 (oops E3\n") && leaves_bracket_open("(a) G1 (b"));
        assert!(!leaves_bracket_open("G1 (a) X5 ; (b") && !leaves_bracket_open("M117 :-("));
        assert_eq!(taken("\u{feff}G28"), ("G28".into(), None));
    }
}
