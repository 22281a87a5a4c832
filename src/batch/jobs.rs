//! A file of jobs.

use super::frames::Frames;
use super::keyframe::Track;
use super::name::{NameError, Variables};
use super::picture::{Picture, check_names_differ};
use crate::scene::Override;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The file: what all jobs share, and the jobs. Paths in it are relative to it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Where the pictures of jobs go that do not say it.
    #[serde(default)]
    output: Outputs,
    /// What is changed of every scene, by path.
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    #[serde(default, rename = "job")]
    jobs: Vec<Job>,
}

/// Pictures of one scene.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Job {
    /// What reports and `{job}` call it; the scene's name if it is left out.
    name: Option<String>,
    scene: PathBuf,
    #[serde(default)]
    output: Outputs,
    /// Which frames; one picture without a frame if it is left out.
    frames: Option<String>,
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    /// Keyframes by path.
    #[serde(default)]
    animate: BTreeMap<String, Track>,
}

/// One template or several.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "a file name or a list of them")]
enum Outputs {
    One(String),
    Many(Vec<String>),
}

impl Default for Outputs {
    fn default() -> Self {
        Self::Many(vec![])
    }
}

impl Outputs {
    fn templates(&self) -> &[String] {
        match self {
            Self::One(template) => std::slice::from_ref(template),
            Self::Many(templates) => templates,
        }
    }
}

/// Jobs that were read.
#[derive(Clone, Debug)]
pub struct Jobs {
    file: File,
    directory: PathBuf,
}

/// Why a file gives no pictures.
#[derive(Debug, thiserror::Error)]
pub enum JobsError {
    /// It cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is not a file of jobs.
    #[error("{}: {message}", path.display())]
    Invalid {
        /// Which file.
        path: PathBuf,
        /// What is wrong and where.
        message: String,
    },
    /// A job makes no sense.
    #[error("job `{job}`: {message}")]
    Job {
        /// Which job.
        job: String,
        /// What is wrong.
        message: String,
    },
    /// A template gives no name.
    #[error("job `{job}`: {source}")]
    Name {
        /// Which job.
        job: String,
        /// Why.
        source: NameError,
    },
    /// Two pictures have one name.
    #[error("{0}")]
    SameName(String),
}

impl Jobs {
    /// Reads a file of jobs (TOML).
    ///
    /// # Errors
    /// If the file is missing or malformed, or has no job.
    pub fn read(path: &Path) -> Result<Self, JobsError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| JobsError::Read { path: path.to_owned(), source })?;
        let invalid = |message: String| JobsError::Invalid { path: path.to_owned(), message };
        let file: File = toml::from_str(&text).map_err(|e| invalid(e.to_string().trim_end().to_owned()))?;
        if file.jobs.is_empty() {
            return Err(invalid("no [[job]] is in it".into()));
        }
        Ok(Self { file, directory: path.parent().unwrap_or(Path::new("")).to_owned() })
    }

    /// All pictures, in the order of the file. `frames` takes the place of the frames of all jobs that have some, and
    /// `overrides` come on top of the jobs' own.
    ///
    /// # Errors
    /// If a job has no output, a list of frames or a template is malformed, or two pictures have one name.
    pub fn pictures(
        &self,
        frames: Option<&Frames>,
        overrides: &[Override],
    ) -> Result<Vec<Picture>, JobsError> {
        let mut pictures = vec![];
        for job in &self.file.jobs {
            let name = job.name();
            let failed = |message: String| JobsError::Job { job: name.clone(), message };
            let own = job.frames.as_ref().map(|frames| frames.parse::<Frames>()).transpose();
            let own = own.map_err(&failed)?;
            let is_animated = own.is_some() || !job.animate.is_empty();
            let numbers: Vec<Option<u32>> = match frames.filter(|_| is_animated).or(own.as_ref()) {
                Some(frames) => frames.numbers().iter().copied().map(Some).collect(),
                None if is_animated => {
                    return Err(failed("it has keyframes, but no frames = \"1-100\"".into()));
                }
                None => vec![None],
            };
            for frame in numbers {
                let index = pictures.len();
                pictures.push(self.picture(job, frame, index, overrides)?);
            }
        }
        check_names_differ(&pictures).map_err(JobsError::SameName)?;
        Ok(pictures)
    }

    fn picture(
        &self,
        job: &Job,
        frame: Option<u32>,
        index: usize,
        more: &[Override],
    ) -> Result<Picture, JobsError> {
        let name = job.name();
        let set = self.file.set.iter().chain(&job.set).map(|(path, value)| Override::new(path, value));
        let animated = job
            .animate
            .iter()
            .filter_map(|(path, track)| frame.map(|frame| Override::new(path, track.at(frame))));
        let overrides: Vec<Override> = set.chain(animated).chain(more.iter().cloned()).collect();

        let mut variables = Variables::default();
        overrides.iter().for_each(|o| variables.set_path(&o.path, &o.value));
        variables.set("job", &name);
        variables.set("scene", stem(&job.scene));
        variables.set("index", index);
        variables.set_from_scene(&self.directory.join(&job.scene));
        if let Some(frame) = frame {
            variables.set("frame", frame);
        }
        let templates = [&job.output, &self.file.output].map(Outputs::templates);
        let Some(templates) = templates.into_iter().find(|templates| !templates.is_empty()) else {
            let message = "it has no output = \"name.png\", nor has the file".to_owned();
            return Err(JobsError::Job { job: name, message });
        };
        let outputs = templates.iter().map(|template| {
            let filled = variables.fill(template);
            filled.map(|filled| self.directory.join(filled))
        });
        let outputs: Result<Vec<_>, _> = outputs.collect();
        let outputs = outputs.map_err(|source| JobsError::Name { job: name.clone(), source })?;
        let name_of_frame = frame.map_or_else(|| name.clone(), |frame| format!("{name} frame {frame}"));
        Ok(Picture {
            label: name_of_frame.clone(),
            name: name_of_frame,
            job: name,
            scene: self.directory.join(&job.scene),
            overrides,
            frame,
            outputs,
        })
    }
}

impl Job {
    fn name(&self) -> String {
        self.name.clone().unwrap_or_else(|| stem(&self.scene))
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jobs(text: &str) -> Result<Jobs, JobsError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("jobs.toml");
        std::fs::write(&path, text).unwrap();
        let mut jobs = Jobs::read(&path)?;
        jobs.directory = "d".into();
        Ok(jobs)
    }

    const TWO: &str = r#"
output = "out/{job}-{frame:3}.png"
set = { "settings.spp" = 4 }

[[job]]
scene = "lemon.toml"
frames = "1-9x4"
set = { "materials.lemon.exponent" = 10 }
animate = { "camera.eye" = [[1, [0, 0, 4]], [9, [8, 0, 4]]] }

[[job]]
name = "still"
scene = "other.toml"
output = ["{scene}-{spp}.png", "{index}.exr"]
"#;

    #[test]
    fn jobs_become_pictures() {
        let pictures = jobs(TWO).unwrap().pictures(None, &[]).unwrap();
        let names: Vec<_> = pictures.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["lemon frame 1", "lemon frame 5", "lemon frame 9", "still"]);
        let overrides: Vec<_> = pictures[1].overrides.iter().map(ToString::to_string).collect();
        assert_eq!(overrides, ["settings.spp=4", "materials.lemon.exponent=10", "camera.eye=[4, 0, 4]"]);
        assert_eq!(pictures[1].outputs, [Path::new("d/out/lemon-005.png")]);
        assert_eq!(pictures[3].outputs, [Path::new("d/other-4.png"), Path::new("d/3.exr")]);
        assert_eq!((&*pictures[3].scene, pictures[3].frame), (Path::new("d/other.toml"), None));
    }

    #[test]
    fn the_command_line_goes_before_the_file() {
        let frames = "7".parse().unwrap();
        let more = [Override::new("settings.spp", 9)];
        let pictures = jobs(TWO).unwrap().pictures(Some(&frames), &more).unwrap();
        assert_eq!(pictures.len(), 2);
        assert_eq!(pictures[0].overrides.last().unwrap().to_string(), "settings.spp=9");
        assert_eq!(pictures[1].outputs[0], Path::new("d/other-9.png"));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_job() {
        for (text, why) in [
            ("", "no [[job]]"),
            ("[[job]]\nscene = \"a.toml\"", "job `a`: it has no output"),
            ("[[job]]\nscene = \"a.toml\"\noutput = \"x.png\"\nframes = \"3-1\"", "no list of frames"),
            ("[[job]]\nscene = \"a.toml\"\noutput = \"{x}.png\"", "nothing is called {x}"),
            ("[[job]]\nscene = \"a.toml\"\noutput = \"x.png\"\nframes = \"1-2\"", "both for"),
            ("[[job]]\nscene = \"a.toml\"\noutput = \"x.png\"\nanimate = { a = [[1, 2]] }", "no frames"),
            ("[[job]]\nscene = \"a.toml\"\nfarmes = \"1\"", "farmes"),
        ] {
            let found = jobs(text).and_then(|jobs| jobs.pictures(None, &[]));
            let message = found.unwrap_err().to_string();
            assert!(message.contains(why), "{text}: {message}");
        }
    }
}
