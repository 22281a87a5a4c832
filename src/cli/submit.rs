//! `gloss submit`: work for a scheduler.

use super::Cli;
use super::exit::{Exit, Failure, OrExit};
use super::parse;
use super::terminal::{note, print};
use crate::batch::Jobs;
use crate::farm::submit::{Engine, Submission, Work};
use crate::image_io::Format;
use anyhow::{Context, bail};
use clap::Parser;
use std::io::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Share a picture or a file of jobs among many machines
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A scene becomes an array of shards and a merge that waits for all of them; a file of jobs (`gloss batch`) becomes an
array whose tasks have a share of the pictures each. A task that is told to end keeps a checkpoint, runs again and goes
on from there; one that runs twice does no harm.

slurm: sbatch is asked; a task's threads are those of SLURM_CPUS_PER_TASK, and it is told to end a minute before the
       limit of --time.
parallel: a script for GNU parallel on this machine is run; unfinished tasks go on when it runs again.
openjd: a job template of the Open Job Description goes to stdout: hand it to your render farm.

Flags of `gloss render` or `gloss batch` follow after --.

Exit codes: 0 done, 1 failed, 2 bad usage.

Examples:
  gloss submit scenes/lemon.toml -o lemon.png --engine slurm --tasks 8 --cpus 16 --time 1h -- --spp 4096
  gloss submit scenes/lemon.toml -o lemon.png --engine parallel --tasks 4 --dry-run
  gloss submit jobs.toml --engine slurm --tasks 20 --option=--partition=long")]
pub(super) struct Args {
    /// Scene file, or file of jobs
    work: PathBuf,

    /// Who schedules
    #[arg(long, value_enum)]
    engine: Engine,

    /// Into how many tasks the work is cut
    #[arg(long, value_name = "N")]
    tasks: NonZeroU32,

    /// Picture to write, by its ending: .exr or .png; may be given again. For a scene only
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,

    /// Where the shards and logs go; OUTPUT.shards if it is left out
    #[arg(long, value_name = "DIR")]
    directory: Option<PathBuf>,

    /// Processors for each task
    #[arg(long, value_name = "N", default_value = "1")]
    cpus: NonZeroU32,

    /// Break a task off after this long, and let it go on later
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    time: Option<Duration>,

    /// An option for the scheduler itself, such as --option=--partition=long; may be given again
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    option: Vec<String>,

    /// Print what would be submitted
    #[arg(long)]
    dry_run: bool,

    /// Flags of `gloss render` or `gloss batch`
    #[arg(last = true, value_name = "FLAGS")]
    flags: Vec<String>,
}

/// Prints or submits.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let submission = submission(args)?;
    check_flags(&submission)?;
    if args.dry_run || args.engine == Engine::Openjd {
        let text = match args.engine {
            Engine::Slurm => submission.slurm(),
            Engine::Parallel => submission.parallel(),
            Engine::Openjd => format!("{:#}\n", submission.openjd()),
        };
        print(&text)?;
        return Ok(Exit::Done);
    }
    if let Work::Picture { directory, .. } = &submission.work {
        std::fs::create_dir_all(directory)
            .with_context(|| format!("cannot make {}", directory.display()))
            .or_failed()?;
    }
    match args.engine {
        Engine::Slurm => {
            submit_to_slurm(&submission.slurm_array(), submission.slurm_merge().as_deref()).or_failed()?;
        }
        Engine::Parallel | Engine::Openjd => run_script(&submission.parallel()).or_failed()?,
    }
    Ok(Exit::Done)
}

fn submission(args: &Args) -> Result<Submission, Failure> {
    let program = std::env::current_exe().or_failed()?;
    let input = absolute(&args.work)?;
    let work = if Jobs::read(&input).is_ok() {
        if !args.output.is_empty() {
            return Err(Failure::bad(
                "a file of jobs says itself where its pictures go: leave --output out".to_owned(),
            ));
        }
        Work::Batch { jobs: input }
    } else {
        // What is refused here need not be refused by every task.
        if !input.is_file() {
            return Err(Failure::bad(format!("{} is no file", input.display())));
        }
        let Some(first) = args.output.first() else {
            return Err(Failure::bad("where does the picture go? Give --output FILE".to_owned()));
        };
        for output in &args.output {
            Format::of(output).or_bad()?;
        }
        let outputs = args.output.iter().map(|output| absolute(output)).collect::<Result<_, _>>()?;
        let beside = PathBuf::from(format!("{}.shards", first.display()));
        let directory = absolute(args.directory.as_ref().unwrap_or(&beside))?;
        Work::Picture { scene: input, outputs, directory }
    };
    Ok(Submission {
        program,
        work,
        tasks: args.tasks.get(),
        flags: args.flags.clone(),
        cpus: args.cpus.get(),
        time: args.time,
        options: args.option.clone(),
    })
}

/// Refuses flags that every task would refuse.
fn check_flags(submission: &Submission) -> Result<(), Failure> {
    let first = submission.task("0", &format!("0/{}", submission.tasks), "1");
    let Err(error) = Cli::try_parse_from(first) else { return Ok(()) };
    let text = error.to_string();
    let why = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
    Err(Failure::bad(format!("of the flags after `--`, which all tasks get: {why}")))
}

/// The path from everywhere, for a script, which is text.
fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    let path = std::path::absolute(path).or_failed()?;
    if path.to_str().is_none() {
        let message = "is no UTF-8, which a scheduler's script is: give it another name";
        return Err(Failure::bad(format!("{} {message}", path.display())));
    }
    Ok(path)
}

/// Hands the array and the merge that depends on it to `sbatch`.
fn submit_to_slurm(array: &str, merge: Option<&str>) -> anyhow::Result<()> {
    let id = sbatch(array, &[])?;
    note(&format!("submitted the array {id}"));
    if let Some(merge) = merge {
        let merge =
            sbatch(merge, &[format!("--dependency=afterok:{id}"), "--kill-on-invalid-dep=yes".to_owned()])?;
        note(&format!("submitted the merge {merge}"));
        println_ids(&[id, merge])
    } else {
        println_ids(&[id])
    }
}

/// The jobs' numbers on stdout, for scripts.
fn println_ids(ids: &[String]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for id in ids {
        writeln!(out, "{id}")?;
    }
    Ok(())
}

/// Submits a script; the job's number.
fn sbatch(script: &str, options: &[String]) -> anyhow::Result<String> {
    let mut child = Command::new("sbatch")
        .arg("--parsable")
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("cannot start sbatch: is Slurm installed on this machine?")?;
    child.stdin.take().context("sbatch has no stdin")?.write_all(script.as_bytes())?;
    let output = child.wait_with_output()?;
    if !output.status.success() {
        bail!("sbatch refused the job");
    }
    let answer = String::from_utf8_lossy(&output.stdout);
    // On several clusters it is `ID;CLUSTER`.
    Ok(answer.trim().split(';').next().unwrap_or_default().to_owned())
}

/// Runs a shell script to its end.
fn run_script(script: &str) -> anyhow::Result<()> {
    if Command::new("parallel").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err()
    {
        bail!("cannot start parallel: install GNU parallel, or use --dry-run and run the script elsewhere");
    }
    let status = Command::new("sh").args(["-c", script]).status().context("cannot start sh")?;
    if !status.success() {
        bail!("some tasks failed ({status}): run the same command again to go on");
    }
    Ok(())
}
