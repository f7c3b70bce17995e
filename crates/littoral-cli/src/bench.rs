//! `littoral bench`: how fast this version is on this machine.

use crate::talk::{Failure, Talk};

/// Measure the speed of this machine and this version.
#[derive(clap::Args)]
pub struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Rays, lines of sight and heights against one fixed map
    Rays,
}

impl Bench {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        match self.what {
            What::Rays => talk.print("not yet\n"),
        }
    }
}
