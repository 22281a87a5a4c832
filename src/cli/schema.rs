//! `gloss schema`: what a scene file may say.

use super::exit::{Exit, Failure};
use super::terminal::print_json;
use crate::scene;

/// Print the JSON schema of scene files
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  gloss schema > gloss.schema.json     # then `\"$schema\"` in an editor completes scene files")]
pub(super) struct Args {}

/// Prints it.
pub(super) fn run(_: &Args) -> Result<Exit, Failure> {
    print_json(&scene::schema())
}
