//! The command line: one file per subcommand, flags as they are typed, then resolved.
//!
//! Knows how to ask and to tell; the work is done by the layers below. Read [`main`] first, then `render`. To add a
//! subcommand: write its file with `Args` and `run`, and add its variant to `Command`.

mod accel_args;
mod batch;
mod compare;
mod contender;
mod diff;
mod dump;
mod exit;
mod farm_args;
mod figures;
mod files;
mod generate;
mod info;
mod like;
mod merge;
mod output;
mod parse;
mod progress;
mod render;
mod scene_args;
mod schema;
mod series;
mod settings;
mod signal;
mod stats;
mod submit;
mod sweep;
mod terminal;
mod trace;
mod trade;

use clap::Parser;
use exit::{Exit, Failure};
use std::process::ExitCode;

/// Renders glossy reflection on large meshes, on Embree or on a pure-Rust BVH.
#[derive(Debug, Parser)]
#[command(name = "gloss", version, after_help = HELP_END, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Render(render::Args),
    Info(info::Args),
    Gen(generate::Args),
    Sweep(sweep::Args),
    Batch(batch::Args),
    Merge(merge::Args),
    Submit(submit::Args),
    Diff(diff::Args),
    Figures(figures::Args),
    Compare(compare::Args),
    Trace(trace::Args),
    Trade(trade::Args),
    Schema(schema::Args),
}

/// What every subcommand's exit codes mean.
const HELP_END: &str = "\
Exit codes:
   0  done
   1  failed; of diff: the pictures differ by more than the threshold; of compare: the backends differ
   2  bad usage, bad scene, or pictures that cannot be compared
   3  some of several pictures were not made
  75  interrupted by Ctrl-C, SIGTERM or SIGHUP; no picture is written, but a checkpoint where one is kept

Examples:
  gloss gen knot --triangles 200000 -o knot.ply
  gloss info scenes/lemon.toml
  gloss render scenes/lemon.toml -o lemon.png -o lemon.exr --spp 256
  gloss diff lemon.exr reference.exr --map difference.png
  gloss compare scenes/lemon.toml --html lemon.html
  gloss trade scenes/lemon.toml --time 2m -o trade.html";

/// Runs the program on the process's arguments.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // A reader that has gone away is no concern of ours.
            let _ = error.print();
            return if error.use_stderr() { Exit::Bad } else { Exit::Done }.into();
        }
    };
    let done = match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Gen(args) => generate::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Batch(args) => batch::run(&args),
        Command::Submit(args) => submit::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Figures(args) => figures::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Trade(args) => trade::run(&args),
        Command::Schema(args) => schema::run(&args),
    };
    done.unwrap_or_else(|failure: Failure| failure.report()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_flags_do_not_contradict_each_other() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_subcommand_says_what_it_does_and_shows_an_example() {
        for command in Cli::command().get_subcommands() {
            assert!(command.get_about().is_some(), "{}", command.get_name());
            let end = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(end.contains(&format!("gloss {}", command.get_name())), "{}", command.get_name());
        }
    }

    #[test]
    fn every_flag_is_explained() {
        for command in Cli::command().get_subcommands() {
            for flag in command.get_arguments() {
                assert!(flag.get_help().is_some(), "{} {}", command.get_name(), flag.get_id());
            }
        }
    }
}
