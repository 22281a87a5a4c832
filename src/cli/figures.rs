//! `gloss figures`: the textbook's figures and their contact sheet.

use super::accel_args::AccelArgs;
use super::exit::{Exit, Failure, OrExit};
use super::parse;
use super::signal::Interrupt;
use super::terminal::{note, print};
use crate::figures::scatter::{self, PLOTS};
use crate::figures::{self, FAMILIES, Family, Size};
use crate::image_io::label::Canvas;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Render the textbook's figures of glossy reflection, each labelled, and a contact sheet
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The figures are those of Suffern 2007, Ray Tracing from the Ground Up, chapter 25, with the book's numbers, plots of what
the samplers and the lobe draw (chapter 7), and what the rules against self-hits lose on a knot.

Examples:
  gloss figures -o figures
  gloss figures -o preview --scale 0.25 --spp 4
  gloss figures -o figures --only 25-08")]
pub(super) struct Args {
    /// Folder for the pictures; made if it is missing
    #[arg(short, long, value_name = "DIR", required = true)]
    output: PathBuf,

    /// Factor of the pictures' width and height
    #[arg(long, value_name = "F", default_value_t = 1.0, value_parser = parse::scale)]
    scale: f32,

    /// Camera samples per pixel in place of the book's; figures whose point they are keep their own
    #[arg(long, value_name = "N")]
    spp: Option<NonZeroU32>,

    /// Only figures whose names begin so
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    only: String,

    #[command(flatten)]
    accel: AccelArgs,
}

/// Longest edge of a picture on the contact sheet, in pixels.
const SHEET_EDGE: u32 = 240;

/// Edge of one view in a plot of directions, in pixels at scale 1.
const PLOT_EDGE: f32 = 200.0;

/// Draws, writes and tells.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    std::fs::create_dir_all(&args.output)
        .map_err(|e| anyhow::anyhow!("cannot make the folder {}: {e}", args.output.display()))
        .or_failed()?;
    let interrupt = Interrupt::listen()?;
    interrupt.stops_softly();
    let mut book = Book { folder: &args.output, only: &args.only, pictures: vec![] };
    print(&row("figure", "file", "seconds"))?;
    for family in &FAMILIES {
        if !draw_family(args, family, &interrupt, &mut book)? {
            note("interrupted: the figures so far are written");
            return Ok(Exit::Interrupted);
        }
    }
    for plot in &PLOTS {
        if !book.wants(plot.name) {
            continue;
        }
        let clock = Instant::now();
        let edge = ((PLOT_EDGE * args.scale) as u32).max(32);
        book.add(plot.name, plot.caption, &scatter::draw(plot, edge), clock)?;
    }
    if book.pictures.is_empty() {
        return Err(Failure::bad(format!("no figure's name begins with `{}`", args.only)));
    }
    let clock = Instant::now();
    let sheet = figures::sheet(&book.pictures, SHEET_EDGE);
    book.write("contact-sheet", "all of them", &sheet, clock)?;
    Ok(Exit::Done)
}

/// Draws one scene's figures; false if it was interrupted.
fn draw_family(
    args: &Args,
    family: &Family,
    interrupt: &Interrupt,
    book: &mut Book,
) -> Result<bool, Failure> {
    if !book.wants_any(family) {
        return Ok(true);
    }
    let size = Size { scale: args.scale, spp: args.spp.map(NonZeroU32::get) };
    let scenes = family.load(size).or_bad()?;
    let accel = args.accel.build(figures::most_demanding(&scenes))?;
    let mut images = Vec::with_capacity(scenes.len());
    for (figure, scene) in family.figures.iter().zip(&scenes) {
        if !(book.wants(figure.name) || book.wants_difference(family)) {
            continue;
        }
        let clock = Instant::now();
        let Some(drawn) = figures::draw(scene, &*accel, args.accel.build.threads, interrupt.stop()) else {
            return Ok(false);
        };
        let dropped = drawn.outcome.film.dropped;
        if !dropped.is_empty() {
            note(&format!("warning: {}: samples dropped: {dropped:?}", figure.name));
        }
        book.add(figure.name, figure.caption, &Canvas::of_image(&drawn.image, 0.0), clock)?;
        images.push(drawn.image);
    }
    if let (Some((name, caption)), [first, second, ..], true) =
        (family.difference, &images[..], book.wants_difference(family))
    {
        book.add(name, caption, &figures::apart(first, second), Instant::now())?;
    }
    Ok(true)
}

/// The pictures so far.
struct Book<'a> {
    folder: &'a Path,
    only: &'a str,
    pictures: Vec<(Canvas, String)>,
}

impl Book<'_> {
    fn wants(&self, name: &str) -> bool {
        name.starts_with(self.only)
    }

    fn wants_difference(&self, family: &Family) -> bool {
        family.difference.is_some_and(|(name, _)| self.wants(name))
    }

    fn wants_any(&self, family: &Family) -> bool {
        family.figures.iter().any(|figure| self.wants(figure.name)) || self.wants_difference(family)
    }

    /// Writes a picture with its caption, tells of it, and keeps it for the contact sheet.
    fn add(&mut self, name: &str, caption: &str, picture: &Canvas, clock: Instant) -> Result<(), Failure> {
        self.write(name, caption, &figures::labelled(picture, caption), clock)?;
        self.pictures.push((picture.clone(), caption.to_owned()));
        Ok(())
    }

    fn write(&self, name: &str, caption: &str, picture: &Canvas, clock: Instant) -> Result<(), Failure> {
        let file = format!("{name}.png");
        picture.write_png(&self.folder.join(&file)).or_failed()?;
        print(&row(caption, &file, &format!("{:.2}", clock.elapsed().as_secs_f64())))
    }
}

/// A line of the table.
fn row(figure: &str, file: &str, seconds: &str) -> String {
    format!("{figure:<44} {file:<24} {seconds:>8}\n")
}
