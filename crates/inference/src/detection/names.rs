//! Names of classes as exporters leave them in a file.

use super::config::MOST_CLASSES;

/// The names in `text`, in the order of their numbers: a dictionary from number to name or a list of names, as Python writes them
/// (`{0: 'person', 1: "dog's bed"}`, `['person', 'car']`), or JSON. `None` where it is neither, a number is missing or there are
/// too many.
pub(super) fn parsed(text: &str) -> Option<Vec<String>> {
    let mut reader = Reader { rest: text.trim() };
    let close = match reader.taken()? {
        '{' => '}',
        '[' => ']',
        _ => return None,
    };
    let mut names = Vec::new();
    loop {
        reader.skip_blanks();
        if reader.follows(close) {
            break;
        }
        if close == '}' && reader.number()? != names.len() {
            return None;
        }
        names.push(reader.quoted()?);
        if names.len() > MOST_CLASSES {
            return None;
        }
        reader.skip_blanks();
        if !reader.follows(',') {
            reader.follows(close).then_some(())?;
            break;
        }
    }
    (reader.rest.is_empty() && !names.is_empty()).then_some(names)
}

struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    fn taken(&mut self) -> Option<char> {
        let mut letters = self.rest.chars();
        let first = letters.next()?;
        self.rest = letters.as_str();
        Some(first)
    }

    fn follows(&mut self, letter: char) -> bool {
        let rest = self.rest.strip_prefix(letter);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn skip_blanks(&mut self) {
        self.rest = self.rest.trim_start();
    }

    /// A number, bare or in quotes, and the colon behind it.
    fn number(&mut self) -> Option<usize> {
        let (number, rest) = self.rest.split_once(':')?;
        self.rest = rest.trim_start();
        number.trim().trim_matches(['"', '\'']).parse().ok()
    }

    /// What stands in quotes, with what a backslash keeps from ending it.
    fn quoted(&mut self) -> Option<String> {
        let quote = self.taken().filter(|c| matches!(c, '"' | '\''))?;
        let mut name = String::new();
        loop {
            match self.taken()? {
                letter if letter == quote => return Some(name),
                '\\' => name.push(self.taken().filter(|c| matches!(c, '"' | '\'' | '\\' | '/'))?),
                letter => name.push(letter),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::parsed;

    #[test]
    fn dictionaries_and_lists_of_python_and_json_are_read() {
        let read = |text: &str| parsed(text).unwrap_or_default().join("|");
        assert_eq!(read("{0: 'person', 1: 'traffic light'}"), "person|traffic light");
        assert_eq!(read("{0: 'car', 1: \"dog's bed\", 2: 'it\\'s: {x}, y',}"), "car|dog's bed|it's: {x}, y");
        assert_eq!(read(" {\"0\": \"a\", \"1\": \"b\"} "), "a|b");
        assert_eq!(read("['a', \"b\"]"), "a|b");
        assert_eq!(read("{0:'a'}"), "a");
    }

    #[test]
    fn what_is_no_list_of_names_is_refused() {
        let many = format!("[{}]", "'a', ".repeat(10_001));
        for text in [
            "",
            "{",
            "[",
            "{}",
            "[]",
            "person",
            "{0: 'a'",
            "{1: 'a'}",
            "{0: 'a', 2: 'b'}",
            "{0: a}",
            "['a' 'b']",
            "['a'] x",
            "{0: 'a}",
            "{-1: 'a'}",
            "{'a'}",
            "['\\n']",
            "['\\",
            &many,
        ] {
            assert_eq!(parsed(text), None, "{text:.40}");
        }
    }
}
