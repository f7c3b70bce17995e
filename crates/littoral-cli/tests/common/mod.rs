//! The command, run by tests.

use serde_json::Value;
use std::process::{Command, Output};

/// Runs it.
pub fn littoral(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_littoral")).args(arguments).output().expect("the command runs")
}

/// What it printed.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

/// Succeeds and prints one JSON object.
pub fn json(arguments: &[&str]) -> Value {
    let mut arguments = arguments.to_vec();
    arguments.push("--json");
    let output = littoral(&arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    let value: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(value["warnings"].is_array(), "warnings are always listed");
    value
}

/// Fails with an exit code and a message that has some words in it; nothing on stdout.
pub fn fails(arguments: &[&str], code: i32, words: &str) {
    let output = littoral(arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty() && !said.contains("panicked"), "{arguments:?}");
    // Help is wrapped to the width of the terminal.
    let plain = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(plain.contains(words), "{arguments:?}: {said} lacks {words}");
}
