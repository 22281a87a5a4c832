//! `gloss diff`: how far a picture is from a reference.

use super::exit::{Exit, Failure, OrExit};
use super::files::Files;
use super::output::check_png;
use super::parse;
use super::terminal::{note, print, print_json};
use crate::compare::diff::{Difference, Metric, Range, compare};
use crate::compare::flip::DEFAULT_PPD;
use crate::image_io::{Format, Image, read_image, write_rgb8};
use clap::ValueEnum;
use serde_json::json;
use std::path::PathBuf;

/// Measure how far a picture is from a reference
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Numbers are over all pixels and channels, in linear light; a PNG is taken from sRGB to linear first.
  rmse    sqrt(mean((A - B)^2))
  relmse  mean((A - B)^2 / (B + 0.01)^2)
  max     max |A - B|
  mean    mean(A - B); --threshold looks at its absolute value
  flip    mean of FLIP, 0 to 1 (Andersson et al. 2020, 2021): HDR-FLIP; where one picture is a PNG,
          LDR-FLIP of what a display shows, that is of light clipped to [0, 1]

Exit codes: 0 at most the threshold, or none given; 1 more than it; 2 they cannot be compared.

Examples:
  gloss diff lemon.exr reference.exr --map difference.png
  gloss diff lemon.png reference.png --metric flip --threshold 0.02
  gloss diff a.exr b.exr --threshold 0          # any difference that FLIP sees
  gloss diff a.exr b.exr --ldr --exposure 1     # as the PNG files of these would look")]
pub(super) struct Args {
    /// The picture to test: .exr, .hdr or .png
    #[arg(value_name = "A")]
    test: PathBuf,

    /// The reference: .exr, .hdr or .png
    #[arg(value_name = "B")]
    reference: PathBuf,

    /// Write FLIP of each pixel as a picture, from black (the same) through purple to yellow
    #[arg(long, value_name = "OUT.png")]
    map: Option<PathBuf>,

    /// Exit with 1 if the metric is greater than this
    #[arg(long, value_name = "X", value_parser = parse::threshold)]
    threshold: Option<f64>,

    /// What the threshold is for
    #[arg(long, default_value_t, value_enum)]
    metric: Metric,

    /// LDR-FLIP for float files too, of light times the exposure, clipped to [0, 1]
    #[arg(long)]
    ldr: bool,

    /// Stops of exposure for LDR-FLIP of float files
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true, requires = "ldr")]
    exposure: f32,

    /// Pixels per degree of visual angle for FLIP; the default is a 0.7 m wide display of 3840 pixels seen from 0.7 m
    #[arg(long, value_name = "PPD", default_value_t = DEFAULT_PPD, value_parser = parse::ppd)]
    ppd: f32,

    /// Print JSON
    #[arg(long)]
    json: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Compares, tells, and judges.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    if let Some(map) = &args.map {
        let mut files = Files::default();
        files.reads("the picture to test", &args.test)?;
        files.reads("the reference", &args.reference)?;
        check_png(map, "the map", "--map", &mut files)?;
    }
    let mut images = [read_image(&args.test).or_bad()?, read_image(&args.reference).or_bad()?];
    let as_shown = [&args.test, &args.reference].map(|path| Format::of(path).is_ok_and(|f| f == Format::Png));
    let range = if args.ldr || as_shown.contains(&true) { Range::Ldr } else { Range::Hdr };
    for (image, _) in images.iter_mut().zip(as_shown).filter(|(_, as_shown)| !as_shown) {
        expose(image, args.exposure);
    }
    let [test, reference] = &images;
    let difference = compare(test, reference, range, args.ppd).or_bad()?;
    if let Some(map) = &args.map {
        write_rgb8(map, test.width, test.height, &difference.map_rgb8()).or_failed()?;
    }
    tell(args, test.size(), &difference)?;
    Ok(judge(args, &difference))
}

fn expose(image: &mut Image, stops: f32) {
    if stops != 0.0 {
        let factor = stops.exp2();
        image.pixels.iter_mut().for_each(|p| *p *= factor);
    }
}

fn tell(args: &Args, size: [u32; 2], difference: &Difference) -> Result<(), Failure> {
    if args.quiet {
        return Ok(());
    }
    if args.json {
        let mut value = serde_json::to_value(difference).or_failed()?;
        value["size"] = json!(size);
        if let Some(exposures) = difference.exposures {
            value["exposures"] = json!([exposures.start, exposures.stop, exposures.count]);
        } else {
            value["exposure"] = json!(args.exposure);
        }
        return print_json(&value).map(|_| ());
    }
    let Difference { rmse, relmse, max, max_at: [x, y], mean, flip, ppd, .. } = difference;
    let how = match difference.exposures {
        Some(e) => format!("HDR, {} exposures from {:+.2} to {:+.2} stops, ACES", e.count, e.start, e.stop),
        None if args.exposure != 0.0 => format!("LDR, {:+} stops, clipped to [0, 1]", args.exposure),
        None => "LDR, clipped to [0, 1]".to_owned(),
    };
    print(&format!(
        "rmse    {rmse:.6e}\n\
         relmse  {relmse:.6e}\n\
         max     {max:.6e}  (column {x}, row {y})\n\
         mean    {mean:+.6e}\n\
         flip    {flip:.6}  ({how}, {ppd:.2} pixels per degree)\n"
    ))
}

fn judge(args: &Args, difference: &Difference) -> Exit {
    let (Some(threshold), value) = (args.threshold, difference.value(args.metric)) else { return Exit::Done };
    // A number that is none is not within any threshold.
    if value <= threshold {
        return Exit::Done;
    }
    if !args.quiet {
        let metric = args.metric.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
        note(&format!("the pictures differ: {metric} {value:.6e} is more than {threshold:e}"));
    }
    Exit::Failed
}
