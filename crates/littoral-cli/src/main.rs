//! The `littoral` command: pictures, films, measurements and meshes of height fields.
//!
//! Results go to stdout, talk to stderr. `--json` prints one JSON object and nothing else. Exit 0 for success, 1 when
//! the input or the work failed, 2 when the command line was wrong.

mod bench;
mod detail;
mod film;
mod fly;
mod ground;
mod height;
mod info;
mod input;
mod lakes;
mod mesh;
mod objects;
mod plot;
mod points;
mod profile;
mod render;
mod sight;
mod subject;
mod sun;
mod talk;
mod viewshed;
mod waves;

use clap::{Parser, Subcommand};
use std::process::ExitCode;
use talk::{Failure, Talk};

/// Pictures, films, measurements and meshes of land and sea from any height file.
#[derive(Parser)]
#[command(
    name = "littoral",
    version,
    max_term_width = 100,
    after_help = "Start here:
  littoral render                  the built-in coast, into littoral.png
  littoral render dem.tif          your land, from a view chosen by itself
  littoral info dem.tif            what a file is, and what is assumed about it
  littoral COMMAND --help          all options of a command, with examples

Coordinates are those of the file's own coordinate system (--lonlat: degrees); heights are
metres, angles degrees, bearings clockwise from north. Results go to stdout, everything else
to stderr. Exit codes: 0 done, 1 the input or the work failed, 2 the command line was wrong."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    general: General,
}

#[derive(clap::Args)]
struct General {
    /// Print one JSON object on stdout and nothing else
    #[arg(long, global = true, help_heading = "General")]
    json: bool,
    /// Number of threads [default: all]
    #[arg(long, global = true, value_name = "N", help_heading = "General", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Subcommand)]
enum Command {
    Render(Box<render::Render>),
    Fly(fly::Fly),
    Info(info::Info),
    Height(height::Height),
    Profile(profile::Profile),
    Sight(sight::Sight),
    Viewshed(viewshed::Viewshed),
    Mesh(Box<mesh::Mesh>),
    Waves(waves::Waves),
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse_from(input::shielded(std::env::args_os())) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are answers, everything else is a wrong command line.
            let _ = error.print(); // a closed pipe wants no answer
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    std::panic::set_hook(Box::new(|panic| {
        littoral_data::write::abandon();
        eprintln!("littoral: internal error, please report it with the command line: {panic}");
        std::process::exit(1);
    }));
    // An interrupted program leaves no half-written files behind.
    let interrupted = ctrlc::set_handler(|| {
        littoral_data::write::abandon();
        talk::interrupted();
        std::process::exit(130);
    });
    if let Some(threads) = arguments.general.threads {
        // Only fails if a pool was made before, which nothing does.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
    }
    let mut talk = Talk::new(arguments.general.json);
    if let Err(error) = interrupted {
        talk.warn(format!("Ctrl-C cannot be caught ({error}): when interrupted, temporary files may be left behind"));
    }
    let done = match arguments.command {
        Command::Render(command) => command.run(&mut talk),
        Command::Fly(command) => command.run(),
        Command::Info(command) => command.run(&mut talk),
        Command::Height(command) => command.run(&mut talk),
        Command::Profile(command) => command.run(&mut talk),
        Command::Sight(command) => command.run(&mut talk),
        Command::Viewshed(command) => command.run(&mut talk),
        Command::Mesh(command) => command.run(&mut talk),
        Command::Waves(command) => command.run(&mut talk),
        Command::Bench(command) => command.run(&mut talk),
    };
    match done {
        Ok(()) | Err(Failure::ReaderGone) => ExitCode::SUCCESS,
        Err(Failure::Work(message)) => {
            eprintln!("littoral: {message}");
            ExitCode::from(1)
        }
        Err(Failure::Usage(message)) => {
            eprintln!("littoral: {message}");
            ExitCode::from(2)
        }
    }
}
