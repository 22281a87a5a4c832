//! `gloss gen`: meshes of any size to try things on.

use super::exit::{Exit, Failure, OrExit};
use super::terminal::{bytes, note};
use crate::core::memory;
use crate::geometry::{Generator, generate, obj, ply};
use crate::image_io::atomic;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// Make a mesh of any size
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Kinds:
  sphere   convex
  terrain  a square of fractal hills: open, seen from above
  knot     a tube about a torus knot: closed and concave, it reflects itself
  blob     a sphere with bumps of many sizes: closed

Examples:
  gloss gen knot --triangles 200000 -o knot.ply
  gloss gen terrain --triangles 1000000 --seed 7 -o hills.obj")]
pub(super) struct Args {
    /// What to make
    #[arg(value_parser = kinds())]
    kind: Generator,

    /// About how many triangles
    #[arg(short = 'n', long, value_name = "N", default_value_t = 100_000,
          value_parser = clap::value_parser!(u32).range(8..=1_000_000_000))]
    triangles: u32,

    /// Which of all terrains and blobs
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// File to write: .obj (text) or .ply (binary)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// About what a triangle takes while it is made: three indices, half a vertex with its normal, and as much again while
/// lists grow.
const BYTES_PER_TRIANGLE: u64 = 2 * (12 + 36 / 2);

/// The generators by name.
fn kinds() -> impl TypedValueParser<Value = Generator> {
    let names = PossibleValuesParser::new(Generator::ALL.map(Generator::name));
    names.map(|typed| {
        let named = Generator::ALL.into_iter().find(|kind| kind.name() == typed);
        named.expect("only the names of generators pass the parser before")
    })
}

/// A mesh file's writer.
type Writer = fn(&Path, &crate::geometry::MeshSource) -> std::io::Result<()>;

fn writer(path: &Path) -> Result<Writer, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("obj") => Ok(obj::write),
        Some("ply") => Ok(ply::write),
        _ => Err(Failure::bad(format!(
            "{}: unknown mesh format; the name must end in .obj (text) or .ply (binary)",
            path.display()
        ))),
    }
}

/// Makes it.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let write = writer(&args.output)?;
    atomic::check_writable(&args.output).or_failed()?;
    let needed = BYTES_PER_TRIANGLE * u64::from(args.triangles);
    if !memory::gives(needed) {
        let (n, needed) = (args.triangles, bytes(needed));
        let message = format!("{n} triangles take {needed}, more than this machine gives: ask for fewer");
        return Err(Failure::failed(message));
    }
    let mesh = generate::generate(args.kind, args.triangles as usize, args.seed);
    atomic::replace(&args.output, |temporary| write(temporary, &mesh)).or_failed()?;
    if !args.quiet {
        let size = std::fs::metadata(&args.output).map_or(0, |m| m.len());
        note(&format!(
            "{}: {} triangles, {} vertices, {}",
            args.output.display(),
            mesh.indices.len(),
            mesh.positions.len(),
            bytes(size)
        ));
    }
    Ok(Exit::Done)
}
