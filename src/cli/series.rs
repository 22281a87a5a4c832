//! Many pictures one after the other: `sweep` and `batch`.

use super::accel_args::AccelArgs;
use super::exit::{Exit, Failure, OrExit};
use super::files::{Files, OF_SCENE};
use super::output::check_png;
use super::parse;
use super::progress::{Reporter, Style};
use super::signal::Interrupt;
use super::terminal::{note, print};
use crate::batch::{Made, Picture, PictureError, Record, Workshop, WorkshopOptions};
use crate::image_io::label::{Canvas, contact_sheet};
use crate::scene;
use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// Flags of all who make many pictures.
#[derive(Debug, clap::Args)]
pub(super) struct SeriesArgs {
    /// Brightness of PNGs in stops: each one doubles the light
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse::exposure,
          allow_negative_numbers = true)]
    exposure: f32,

    /// Only say what would be made
    #[arg(long)]
    pub(super) dry_run: bool,

    /// All pictures, small, with their names, in one PNG
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,

    /// Add a line of JSON for each picture to this file; without it, they go to stdout if that is no terminal
    #[arg(long, value_name = "FILE")]
    records: Option<PathBuf>,

    /// Leave out pictures that the --records of an earlier run have, if their scenes and files are still the same
    #[arg(long, requires = "records")]
    resume: bool,

    /// Memory for geometry that a later picture may need
    #[arg(long, value_name = "SIZE", default_value = "2GB", value_parser = parse::bytes)]
    cache: usize,

    #[command(flatten)]
    accel: AccelArgs,

    /// How to tell about progress on stderr
    #[arg(long, value_name = "STYLE", default_value_t, value_enum)]
    progress: Style,

    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// What names the files of pictures: an output's template, or a job.
const A_PICTURE: &str = "a picture";

/// Largest edge of a picture on a contact sheet.
const THUMBNAIL: u32 = 256;

/// Says what would be made.
pub(super) fn dry_run(pictures: &[Picture]) -> Result<Exit, Failure> {
    let mut text = String::new();
    for picture in pictures {
        let outputs: Vec<_> = picture.outputs.iter().map(|path| path.display().to_string()).collect();
        let overrides: Vec<_> = picture.overrides.iter().map(ToString::to_string).collect();
        let scene = picture.scene.display();
        text += format!("{}: {scene} {}", outputs.join(", "), overrides.join(" ")).trim_end();
        text.push('\n');
    }
    print(&text)?;
    Ok(Exit::Done)
}

/// Makes the pictures; one that cannot be made does not stop the rest.
pub(super) fn make_all(args: &SeriesArgs, pictures: &[Picture], files: Files) -> Result<Exit, Failure> {
    args.check_files(pictures, files)?;
    let mut series = Series {
        args,
        records: Records::open(args.records.as_ref())?,
        workshop: Workshop::new(WorkshopOptions {
            backend: args.accel.backend,
            build: args.accel.build_options(),
            exposure: args.exposure,
            cache_bytes: args.cache,
            thumbnail: args.sheet.is_some().then_some(THUMBNAIL),
        }),
        earlier: args.earlier()?,
        done: vec![],
        thumbnails: vec![],
    };
    let interrupt = Interrupt::listen()?;
    interrupt.stops_softly();
    for (index, picture) in pictures.iter().enumerate() {
        if !series.make(picture, (index + 1, pictures.len()), &interrupt)? {
            let left = pictures.len() - index;
            note(&format!(
                "interrupted: {left} of {} pictures are not made, the others are whole",
                pictures.len()
            ));
            return Ok(Exit::Interrupted);
        }
    }
    series.finish()
}

impl SeriesArgs {
    /// Checks that nothing is written over another file of the series.
    fn check_files(&self, pictures: &[Picture], mut files: Files) -> Result<(), Failure> {
        for picture in pictures {
            files.reads("the scene", &picture.scene)?;
        }
        for output in pictures.iter().flat_map(|picture| &picture.outputs) {
            files.writes(A_PICTURE, output)?;
        }
        if let Some(sheet) = &self.sheet {
            check_png(sheet, "the sheet", "--sheet", &mut files)?;
        }
        self.records.as_ref().map_or(Ok(()), |path| files.writes("--records", path))?;
        pictures.iter().try_for_each(|picture| self.check_files_of(picture))
    }

    /// Checks that what a picture's scene names stays; it may well be a picture that was made before.
    fn check_files_of(&self, picture: &Picture) -> Result<(), Failure> {
        // A scene that cannot be loaded says so when its picture is made.
        let named = scene::named_files(&picture.scene, &picture.overrides).unwrap_or_default();
        let mut files = Files::default();
        named.iter().try_for_each(|path| files.reads(OF_SCENE, path))?;
        picture.outputs.iter().try_for_each(|path| files.writes(A_PICTURE, path))?;
        self.sheet.as_ref().map_or(Ok(()), |path| files.writes("--sheet", path))?;
        self.records.as_ref().map_or(Ok(()), |path| files.writes("--records", path))
    }

    /// Pictures that an earlier run has made, the latest record of each by its first file.
    fn earlier(&self) -> Result<HashMap<String, Record>, Failure> {
        let Some(path) = self.records.as_ref().filter(|_| self.resume) else { return Ok(HashMap::new()) };
        let text = match std::fs::read_to_string(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            read => read.map_err(|e| anyhow::anyhow!("cannot read {}: {e}", path.display())).or_failed()?,
        };
        let records = Record::of_lines(&text).into_iter();
        Ok(records.filter_map(|record| Some((record.outputs.first()?.clone(), record))).collect())
    }
}

struct Series<'a> {
    args: &'a SeriesArgs,
    earlier: HashMap<String, Record>,
    records: Records,
    workshop: Workshop,
    done: Vec<Record>,
    thumbnails: Vec<(Canvas, String)>,
}

impl Series<'_> {
    /// Makes one picture; whether to go on.
    fn make(
        &mut self,
        picture: &Picture,
        (number, count): (usize, usize),
        interrupt: &Interrupt,
    ) -> Result<bool, Failure> {
        if self.is_done(picture) {
            if !self.args.quiet {
                note(&format!("{number}/{count} {}: made already", picture.name));
            }
            return Ok(true);
        }
        let reporter = Reporter::start(if self.args.quiet { Style::None } else { self.args.progress });
        let made = self.workshop.make(picture, &reporter, interrupt.stop());
        reporter.finish();
        let record = match made {
            Err(PictureError::Interrupted) => return Ok(false),
            Err(error) => {
                note(&format!("error: {}: {error}", picture.name));
                Record { error: Some(error.to_string()), ..Workshop::record_of(picture) }
            }
            Ok(Made { record, thumbnail, warnings }) => {
                self.tell(&record, (number, count), &warnings);
                self.thumbnails.extend(thumbnail.map(|small| (small, picture.label.clone())));
                record
            }
        };
        self.records.add(&record)?;
        self.done.push(record);
        Ok(true)
    }

    fn is_done(&mut self, picture: &Picture) -> bool {
        let first = picture.outputs.first().map(|path| path.display().to_string());
        let Some(record) = first.and_then(|name| self.earlier.get(&name)) else { return false };
        // A scene that cannot be loaded says so when its picture is made.
        self.workshop.is_done(picture, record).unwrap_or(false)
    }

    fn tell(&self, record: &Record, (number, count): (usize, usize), warnings: &[String]) {
        if self.args.quiet {
            return;
        }
        for warning in warnings {
            note(&format!("warning: {}: {warning}", record.name));
        }
        if record.dropped > 0 {
            note(&format!("warning: {}: {} samples dropped", record.name, record.dropped));
        }
        let kept = if record.structure_kept {
            format!("geometry kept, {:.2} s saved", record.saved_seconds)
        } else {
            format!("load {:.2} s, build {:.2} s", record.load_seconds, record.build_seconds)
        };
        note(&format!(
            "{number}/{count} {}: {}, render {:.2} s, {kept}",
            record.name,
            record.outputs.join(", "),
            record.render_seconds
        ));
    }

    fn finish(self) -> Result<Exit, Failure> {
        if let Some(sheet) = &self.args.sheet {
            contact_sheet(&self.thumbnails).write_png(sheet).or_failed()?;
        }
        let failed = self.done.iter().filter(|record| record.error.is_some()).count();
        if !self.args.quiet {
            note(&summary(&self.done));
        }
        Ok(if failed > 0 { Exit::Some } else { Exit::Done })
    }
}

/// A line for each job, and one for all.
fn summary(records: &[Record]) -> String {
    let mut jobs: Vec<&str> = records.iter().map(|record| record.job.as_str()).collect();
    jobs.dedup();
    let mut seen: Vec<&str> = vec![];
    jobs.retain(|job| {
        !seen.contains(job) && {
            seen.push(job);
            true
        }
    });
    let width = jobs.iter().map(|job| job.chars().count()).max().unwrap_or(0).max(3);
    let mut lines =
        vec![format!("{:width$}  pictures  failed  load s  build s  render s  write s  saved s", "job")];
    let line = |name: &str, of: Vec<&Record>| {
        let sum = |seconds: fn(&Record) -> f64| of.iter().map(|record| seconds(record)).sum::<f64>();
        let failed = of.iter().filter(|record| record.error.is_some()).count();
        format!(
            "{name:width$}  {:8}  {failed:6}  {:6.2}  {:7.2}  {:8.2}  {:7.2}  {:7.2}",
            of.len(),
            sum(|r| r.load_seconds),
            sum(|r| r.build_seconds),
            sum(|r| r.render_seconds),
            sum(|r| r.write_seconds),
            sum(|r| r.saved_seconds),
        )
    };
    lines.extend(jobs.iter().map(|job| line(job, records.iter().filter(|r| r.job == *job).collect())));
    if jobs.len() > 1 {
        lines.push(line("all", records.iter().collect()));
    }
    lines.join("\n")
}

/// Where the lines of JSON go.
enum Records {
    File(PathBuf, File),
    Stdout,
    Nowhere,
}

impl Records {
    fn open(path: Option<&PathBuf>) -> Result<Self, Failure> {
        match path {
            Some(path) => {
                let file = OpenOptions::new().create(true).append(true).open(path);
                let file =
                    file.map_err(|e| anyhow::anyhow!("cannot write {}: {e}", path.display())).or_failed()?;
                Ok(Self::File(path.clone(), file))
            }
            None if std::io::stdout().is_terminal() => Ok(Self::Nowhere),
            None => Ok(Self::Stdout),
        }
    }

    /// A line at once, so that lines of several processes do not mix.
    fn add(&mut self, record: &Record) -> Result<(), Failure> {
        let line = format!("{}\n", record.to_line());
        match self {
            Self::Nowhere => Ok(()),
            Self::Stdout => print(&line),
            Self::File(path, file) => file
                .write_all(line.as_bytes())
                .map_err(|e| anyhow::anyhow!("cannot write {}: {e}", path.display()))
                .or_failed(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_has_a_line_for_each_job_and_one_for_all() {
        let record = |job: &str, error: Option<&str>| Record {
            job: job.into(),
            error: error.map(Into::into),
            render_seconds: 1.5,
            ..Record::default()
        };
        let records = [record("a", None), record("lemon", Some("no mesh")), record("a", None)];
        let text = summary(&records);
        let lines: Vec<Vec<_>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[1][..3], ["a", "2", "0"]);
        assert_eq!(lines[2][..3], ["lemon", "1", "1"]);
        assert_eq!(lines[3][..3], ["all", "3", "1"]);
        assert_eq!(lines[3][5], "4.50");
    }
}
