//! Numbers in text: tokens and lines read with bounded memory, whatever the file.

use super::Input;
use crate::Error;
use std::io::{BufRead, BufReader, Seek, SeekFrom};

/// No number and no word of a header is longer.
const LONGEST_TOKEN: usize = 128;

/// Words between white space, one after the other.
pub struct Tokens<'a> {
    reader: BufReader<&'a mut Input>,
    token: Vec<u8>,
    /// How many were handed out.
    pub count: u64,
    /// Whether white space followed the last one. If not, the file ended there, perhaps in the midst of a number.
    pub closed: bool,
}

impl<'a> Tokens<'a> {
    /// Begins at `offset`.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn new(input: &'a mut Input, offset: u64) -> Result<Tokens<'a>, Error> {
        let name = input.name.clone();
        let mut reader = input.from_start()?;
        reader.seek(SeekFrom::Start(offset)).map_err(|e| Error::io(&name, e))?;
        Ok(Tokens { reader, token: Vec::with_capacity(LONGEST_TOKEN), count: 0, closed: true })
    }

    /// The next word, `None` at the end.
    ///
    /// # Errors
    /// If the file cannot be read, or this is no text.
    pub fn next_token(&mut self) -> Result<Option<&str>, Error> {
        self.token.clear();
        loop {
            let buffer = match self.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) => return Err(Error::io(&self.reader.get_ref().name, e)),
            };
            if buffer.is_empty() {
                self.closed = false;
                break;
            }
            let skip = if self.token.is_empty() {
                buffer.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(buffer.len())
            } else {
                0
            };
            let word = buffer[skip..].iter().position(u8::is_ascii_whitespace);
            let end = word.map_or(buffer.len(), |length| skip + length);
            if self.token.len() + end - skip > LONGEST_TOKEN {
                let problem = format!(
                    "expected numbers between spaces, got a word of over {LONGEST_TOKEN} bytes after {}",
                    self.count
                );
                return Err(self.reader.get_ref().error(problem));
            }
            self.token.extend_from_slice(&buffer[skip..end]);
            self.reader.consume(end);
            if word.is_some() && !self.token.is_empty() {
                self.closed = true;
                break;
            }
        }
        if self.token.is_empty() {
            return Ok(None);
        }
        self.count += 1;
        match std::str::from_utf8(&self.token) {
            Ok(token) => Ok(Some(token)),
            Err(_) => {
                let got = String::from_utf8_lossy(&self.token).into_owned();
                Err(self.reader.get_ref().error(format!("expected text, got {got:?} as word {}", self.count)))
            }
        }
    }

    /// The next word as a number, `None` at the end.
    ///
    /// # Errors
    /// If it is none; decimal commas are named.
    pub fn next_number(&mut self) -> Result<Option<f64>, Error> {
        let problem = match self.next_token()? {
            None => return Ok(None),
            Some(token) => match number(token) {
                Some(value) => return Ok(Some(value)),
                None => not_a_number(token),
            },
        };
        Err(self.reader.get_ref().error(format!("{problem} (value {})", self.count)))
    }
}

/// "expected a number, got …", with a hint when commas are in it.
pub fn not_a_number(token: &str) -> String {
    let hint = if token.contains(',') { "; it seems to have decimal commas: replace each ',' by '.'" } else { "" };
    format!("expected a number, got {token:?}{hint}")
}

/// A number as programs print it, with Fortran's `D` exponents and the spellings of NaN that have been seen in the wild.
pub fn number(token: &str) -> Option<f64> {
    if let Ok(value) = token.parse() {
        return Some(value);
    }
    if token == "*" || token.contains("#IND") || token.contains("#QNAN") || token.contains("#INF") {
        return Some(f64::NAN);
    }
    if token.bytes().any(|b| b == b'd' || b == b'D') {
        return token.replace(['d', 'D'], "e").parse().ok();
    }
    None
}

/// Lines of a text, without their ends; those longer than `LONGEST_LINE` are an error.
pub struct Lines<'a> {
    reader: BufReader<&'a mut Input>,
    line: Vec<u8>,
    /// How many were handed out.
    pub count: u64,
}

const LONGEST_LINE: usize = 4096;

impl<'a> Lines<'a> {
    /// Begins at the start.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn new(input: &'a mut Input) -> Result<Lines<'a>, Error> {
        Ok(Lines { reader: input.from_start()?, line: Vec::new(), count: 0 })
    }

    /// The next line, `None` at the end.
    ///
    /// # Errors
    /// If the file cannot be read, or this is no text.
    pub fn next_line(&mut self) -> Result<Option<&str>, Error> {
        self.line.clear();
        loop {
            let buffer = match self.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) => return Err(Error::io(&self.reader.get_ref().name, e)),
            };
            let end = buffer.iter().position(|&b| b == b'\n');
            let take = end.unwrap_or(buffer.len());
            if self.line.len() + take > LONGEST_LINE {
                let problem =
                    format!("expected lines of text, got one of over {LONGEST_LINE} bytes after {}", self.count);
                return Err(self.reader.get_ref().error(problem));
            }
            self.line.extend_from_slice(&buffer[..take]);
            let done = end.is_some() || buffer.is_empty();
            if buffer.is_empty() && self.line.is_empty() {
                return Ok(None);
            }
            self.reader.consume(take + usize::from(end.is_some()));
            if done {
                break;
            }
        }
        self.count += 1;
        match std::str::from_utf8(&self.line) {
            Ok(line) => Ok(Some(line.trim_end_matches('\r'))),
            Err(_) => {
                Err(self.reader.get_ref().error(format!("expected text, got other bytes in line {}", self.count)))
            }
        }
    }
}

/// Whether these first bytes of a file look like text.
pub fn is_text(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    !head.is_empty() && head.iter().all(|&b| b.is_ascii_graphic() || b.is_ascii_whitespace() || b >= 0x80)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_know_whether_the_last_was_closed() {
        let mut input = Input::memory("t", b"  1\t-2.5e3\r\n 3".to_vec());
        let mut tokens = Tokens::new(&mut input, 0).expect("memory");
        assert_eq!(tokens.next_number().expect("number"), Some(1.0));
        assert_eq!(tokens.next_number().expect("number"), Some(-2500.0));
        assert!(tokens.closed);
        assert_eq!(tokens.next_number().expect("number"), Some(3.0));
        assert!(!tokens.closed);
        assert_eq!(tokens.next_number().expect("end"), None);
    }

    #[test]
    fn bad_words_are_errors() {
        for (text, words) in [("1,5", "decimal commas"), ("abc", "\"abc\""), (&"9".repeat(200_000), "over 128 bytes")] {
            let mut input = Input::memory("t", text.as_bytes().to_vec());
            let error = Tokens::new(&mut input, 0).expect("memory").next_number().expect_err("bad").to_string();
            assert!(error.contains(words), "{error}");
        }
        let mut input = Input::memory("t", vec![b'x'; 10_000]);
        assert!(Lines::new(&mut input).expect("memory").next_line().is_err());
    }

    #[test]
    fn numbers_of_other_tongues() {
        assert_eq!(number("0.5579D+06"), Some(557_900.0));
        assert!(number("1.#QNAN").is_some_and(f64::is_nan));
        assert!(number("*").is_some_and(f64::is_nan));
        assert_eq!(number("d"), None);
    }

    #[test]
    fn lines_of_all_ends() {
        let mut input = Input::memory("t", b"a b\r\n\nc".to_vec());
        let mut lines = Lines::new(&mut input).expect("memory");
        assert_eq!(lines.next_line().expect("text"), Some("a b"));
        assert_eq!(lines.next_line().expect("text"), Some(""));
        assert_eq!(lines.next_line().expect("text"), Some("c"));
        assert_eq!(lines.next_line().expect("text"), None);
    }
}
