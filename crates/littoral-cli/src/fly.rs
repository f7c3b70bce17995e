//! `littoral fly`: the window, which is a program of its own.

use crate::talk::Failure;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::Command;

/// Open a window and fly: `littoral fly --help` lists what it takes.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub struct Fly {
    /// Files and options of littoral-fly
    #[arg(value_name = "ARGUMENT", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl Fly {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        let name = format!("littoral-fly{}", std::env::consts::EXE_SUFFIX);
        // The one that was built with this program rather than another one that is installed.
        let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name)).filter(|file| file.is_file());
        let program = beside.unwrap_or_else(|| PathBuf::from(&name));
        match Command::new(&program).args(&self.arguments).status() {
            Ok(status) if status.success() => Ok(()),
            // It has said why.
            Ok(status) => std::process::exit(status.code().unwrap_or(1)),
            Err(error) if error.kind() == ErrorKind::NotFound => Err(Failure::Work(format!(
                "expected the program {name} beside this one or on the PATH, found none; build it with \
                 `cargo install --path crates/littoral-fly`, or try it with `cargo run -p littoral-fly --release`"
            ))),
            Err(error) => {
                let program = program.display();
                Err(Failure::Work(format!("{program}: expected a program that starts, got \"{error}\"; build it anew")))
            }
        }
    }
}
