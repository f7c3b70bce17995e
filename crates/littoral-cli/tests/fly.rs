//! `littoral fly` finds the window's program, hands over what was asked, and ends as it ends.

#![cfg(unix)]

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `littoral fly` from a copy in a folder, with nothing else on the path.
fn fly(folder: &Path, arguments: &[&str]) -> Output {
    let own = folder.join("littoral");
    if !own.exists() {
        std::fs::copy(env!("CARGO_BIN_EXE_littoral"), &own).expect("copied");
    }
    Command::new(&own).arg("fly").args(arguments).env("PATH", folder.join("nothing")).output().expect("runs")
}

#[test]
fn the_windows_program_is_found_beside_or_missed_in_a_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let missed = fly(folder.path(), &[]);
    let said = String::from_utf8_lossy(&missed.stderr);
    assert_eq!(missed.status.code(), Some(1), "{said}");
    assert!(said.contains("littoral-fly") && said.contains("cargo install"), "{said}");
    assert!(missed.stdout.is_empty() && !said.contains("panicked"), "{said}");

    let program = folder.path().join("littoral-fly");
    std::fs::write(&program, "#!/bin/sh\nprintf '%s|' \"$@\"\nexit 7\n").expect("written");
    std::fs::set_permissions(&program, PermissionsExt::from_mode(0o755)).expect("may be run");
    let flown = fly(folder.path(), &["dem.tif", "--smoke", "5", "--help"]);
    assert_eq!(String::from_utf8_lossy(&flown.stdout), "dem.tif|--smoke|5|--help|");
    assert_eq!(flown.status.code(), Some(7), "the program's own end");

    std::fs::set_permissions(&program, PermissionsExt::from_mode(0o644)).expect("may not be run");
    let refused = fly(folder.path(), &[]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("expected a program that starts"), "{said}");
}
