//! Jobs for schedulers: an array of shards, and a merge that waits for all of them.
//!
//! Writes texts and starts nothing. A shard that is terminated has written its checkpoint and ends with code 75; its
//! second attempt goes on from there, and what is finished already ends at once: so every engine may repeat what it
//! likes.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// Who schedules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Engine {
    /// Slurm: an array, and a merge that depends on it
    Slurm,
    /// GNU parallel on this machine
    Parallel,
    /// A job template of the Open Job Description, version 2023-09, as JSON
    Openjd,
}

/// What is to be shared among tasks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Work {
    /// One picture in shards, which are then merged.
    Picture {
        /// The scene file.
        scene: PathBuf,
        /// Files of the picture.
        outputs: Vec<PathBuf>,
        /// Where the shards go.
        directory: PathBuf,
    },
    /// A file of jobs, each task with its share of the pictures.
    Batch {
        /// The file.
        jobs: PathBuf,
    },
}

/// A request to a scheduler.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submission {
    /// This program.
    pub program: PathBuf,
    /// What is done.
    pub work: Work,
    /// Into how many tasks it is cut.
    pub tasks: u32,
    /// Flags of `gloss render` or `gloss batch`.
    pub flags: Vec<String>,
    /// Processors for each task.
    pub cpus: u32,
    /// Time after which a task is broken off, if there is a limit.
    pub time: Option<Duration>,
    /// Lines for the scheduler's own options, such as `--partition=long`.
    pub options: Vec<String>,
}

/// A word of a shell's command line.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

fn quoted_path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// Words, quoted and parted by blanks.
fn line<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    words.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
}

impl Submission {
    /// What the job is called.
    pub fn name(&self) -> String {
        let path = match &self.work {
            Work::Picture { scene, .. } => scene,
            Work::Batch { jobs } => jobs,
        };
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        format!("gloss-{stem}")
    }

    fn directory(&self) -> PathBuf {
        match &self.work {
            Work::Picture { directory, .. } => directory.clone(),
            Work::Batch { jobs } => jobs.parent().unwrap_or(Path::new("")).to_owned(),
        }
    }

    /// The words of one task's command; `index` and `threads` stand for what the engine puts there.
    pub fn task(&self, index: &str, shard: &str, threads: &str) -> Vec<String> {
        let mut words = vec![self.program.display().to_string()];
        match &self.work {
            Work::Picture { scene, directory, .. } => {
                let output = directory.join(format!("shard-{index}.exr"));
                words.extend(["render".into(), scene.display().to_string()]);
                words.extend(["-o".into(), output.display().to_string()]);
            }
            Work::Batch { jobs } => {
                let records = format!("{}.{index}.jsonl", jobs.display());
                words.extend(["batch".into(), jobs.display().to_string()]);
                words.extend(["--records".into(), records, "--resume".into()]);
            }
        }
        words.extend(["--shard".into(), shard.into(), "--threads".into(), threads.into()]);
        words.extend(["--progress".into(), "plain".into()]);
        words.extend(self.flags.iter().cloned());
        words
    }

    /// The words of the merge; nothing where the tasks write their pictures themselves.
    fn merge(&self) -> Option<Vec<String>> {
        let Work::Picture { outputs, directory, .. } = &self.work else { return None };
        let mut words = vec![self.program.display().to_string(), "merge".into()];
        for output in outputs {
            words.extend(["-o".into(), output.display().to_string()]);
        }
        let shards = (0..self.tasks).map(|i| directory.join(format!("shard-{i}.exr")).display().to_string());
        words.extend(shards);
        Some(words)
    }

    /// A shell script that submits both of Slurm's: what `gloss submit` does, to be read or to be run elsewhere.
    pub fn slurm(&self) -> String {
        let array = self.slurm_array();
        let mut script = format!("#!/bin/sh\nset -e\n{}", self.make_directory());
        script += &format!("array=$(sbatch --parsable <<'END_OF_ARRAY'\n{array}END_OF_ARRAY\n)\n");
        if let Some(merge) = self.slurm_merge() {
            script +=
                "sbatch --dependency=afterok:\"${array%%;*}\" --kill-on-invalid-dep=yes <<'END_OF_MERGE'\n";
            script += &format!("{merge}END_OF_MERGE\n");
        }
        script
    }

    /// Slurm's script for the array.
    pub fn slurm_array(&self) -> String {
        let mut head = self.slurm_head(&self.name(), "%a");
        head += &format!("#SBATCH --array=0-{}\n", self.tasks - 1);
        head += &format!("#SBATCH --cpus-per-task={}\n", self.cpus);
        head += "#SBATCH --requeue\n#SBATCH --open-mode=append\n";
        if let Some(time) = self.time {
            // Slurm counts in minutes, and tells a job a minute before, or half-way of a short one.
            let minutes = time.as_secs().div_ceil(60).max(1);
            let seconds_before = 60.min(30 * minutes);
            head += &format!("#SBATCH --time={minutes}\n#SBATCH --signal=B:TERM@{seconds_before}\n");
        }
        let task = self.task("@INDEX@", &format!("auto/{}", self.tasks), "@THREADS@");
        let task = line(task.iter().map(String::as_str))
            .replace("@INDEX@", "\"$SLURM_ARRAY_TASK_ID\"")
            .replace("@THREADS@", "\"${SLURM_CPUS_PER_TASK:-1}\"");
        format!(
            "{head}
{task} &
task=$!
# A shard that is told to end writes its checkpoint and ends with code 75; then it runs again and goes on from there.
trap 'kill -TERM $task' TERM
wait $task
code=$?
if [ $code -gt 128 ]; then
  wait $task
  code=$?
fi
if [ $code -eq 75 ]; then
  scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\"
fi
exit $code
"
        )
    }

    /// Slurm's script for the merge, to be submitted with a dependency on the array.
    pub fn slurm_merge(&self) -> Option<String> {
        let merge = self.merge()?;
        let head = self.slurm_head(&format!("{}-merge", self.name()), "merge");
        Some(format!("{head}\n{}\n", line(merge.iter().map(String::as_str))))
    }

    /// The command that makes the directory of shards and logs, where there may be none yet.
    fn make_directory(&self) -> String {
        match &self.work {
            Work::Picture { directory, .. } => format!("mkdir -p {}\n", quoted_path(directory)),
            Work::Batch { .. } => String::new(),
        }
    }

    fn slurm_head(&self, name: &str, log: &str) -> String {
        let log = self.directory().join(format!("{}-{log}.log", self.name()));
        let mut head =
            format!("#!/bin/bash\n#SBATCH --job-name={name}\n#SBATCH --output={}\n", log.display());
        for option in &self.options {
            head += &format!("#SBATCH {option}\n");
        }
        head
    }

    /// A shell script for GNU parallel. Its exit code is that of the merge, or the number of tasks that failed.
    pub fn parallel(&self) -> String {
        let task = self.task("@INDEX@", &format!("@INDEX@/{}", self.tasks), &self.cpus.to_string());
        // `parallel` hands its command to a shell again, with the task's number in the place of the braces.
        let task = line(task.iter().map(String::as_str)).replace("@INDEX@", "{}");
        let options: String = self.options.iter().map(|option| format!(" {option}")).collect();
        let log = self.directory().join(format!("{}.joblog", self.name()));
        let jobs = format!("\"$(( $(nproc) / {0} > 0 ? $(nproc) / {0} : 1 ))\"", self.cpus.max(1));
        let mut script = format!(
            "#!/bin/sh\nset -e\n{}seq 0 {} | parallel --jobs {jobs} --joblog {} --resume-failed{options} {}\n",
            self.make_directory(),
            self.tasks - 1,
            quoted_path(&log),
            quoted(&task),
        );
        if let Some(merge) = self.merge() {
            script += &format!("{}\n", line(merge.iter().map(String::as_str)));
        }
        script
    }

    /// A job template of the Open Job Description.
    pub fn openjd(&self) -> serde_json::Value {
        use serde_json::json;
        let action = |words: Vec<String>| {
            let mut action = json!({ "command": words[0], "args": words[1..] });
            if let Some(time) = self.time {
                let notify = json!({ "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 60 });
                action["timeout"] = json!(time.as_secs().max(1));
                action["cancelation"] = notify;
            }
            action
        };
        const INDEX: &str = "{{Task.Param.Shard}}";
        let task = self.task(INDEX, &format!("{INDEX}/{}", self.tasks), &self.cpus.to_string());
        let shard = json!({ "name": "Shard", "type": "INT", "range": format!("0-{}", self.tasks - 1) });
        let mut steps = vec![json!({
            "name": "Render",
            "parameterSpace": { "taskParameterDefinitions": [shard] },
            "hostRequirements": { "amounts": [{ "name": "amount.worker.vcpu", "min": self.cpus }] },
            "script": { "actions": { "onRun": action(task) } },
        })];
        if let Some(merge) = self.merge() {
            steps.push(json!({
                "name": "Merge",
                "dependencies": [{ "dependsOn": "Render" }],
                "script": { "actions": { "onRun": action(merge) } },
            }));
        }
        json!({ "specificationVersion": "jobtemplate-2023-09", "name": self.name(), "steps": steps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn submission() -> Submission {
        Submission {
            program: "/opt/gloss".into(),
            work: Work::Picture {
                scene: "my scenes/lemon.toml".into(),
                outputs: vec!["lemon.png".into()],
                directory: "parts".into(),
            },
            tasks: 3,
            flags: vec!["-D".into(), "materials.a.cd=[1, 0, 0]".into()],
            cpus: 4,
            time: Some(Duration::from_secs(3600)),
            options: vec!["--partition=long".into()],
        }
    }

    #[test]
    fn the_array_has_its_shards_threads_signal_and_requeue() {
        let script = submission().slurm_array();
        for part in [
            "#SBATCH --array=0-2\n",
            "#SBATCH --cpus-per-task=4\n",
            "#SBATCH --time=60\n#SBATCH --signal=B:TERM@60\n",
            "#SBATCH --partition=long\n",
            "/opt/gloss render 'my scenes/lemon.toml' -o parts/shard-\"$SLURM_ARRAY_TASK_ID\".exr --shard auto/3 \
             --threads \"${SLURM_CPUS_PER_TASK:-1}\" --progress plain -D 'materials.a.cd=[1, 0, 0]' &\n",
            "scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"",
        ] {
            assert!(script.contains(part), "{part} is not in\n{script}");
        }
        let merge = submission().slurm_merge().unwrap();
        assert!(
            merge.contains("merge -o lemon.png parts/shard-0.exr parts/shard-1.exr parts/shard-2.exr\n"),
            "{merge}"
        );
    }

    #[test]
    fn a_batch_needs_no_merge() {
        let batch = Submission { work: Work::Batch { jobs: "jobs.toml".into() }, ..submission() };
        assert_eq!(batch.slurm_merge(), None);
        assert!(batch.slurm_array().contains("/opt/gloss batch jobs.toml --records jobs.toml.\"$SLURM_ARRAY_TASK_ID\".jsonl --resume --shard auto/3"));
        assert_eq!(batch.openjd()["steps"].as_array().unwrap().len(), 1);
    }

    #[test]
    fn parallel_quotes_for_the_shell_and_for_its_own() {
        let script = submission().parallel();
        assert!(
            script.contains(
                r"'/opt/gloss render '\''my scenes/lemon.toml'\'' -o parts/shard-{}.exr --shard {}/3"
            ),
            "{script}"
        );
    }

    #[test]
    fn openjd_has_two_steps_of_which_one_waits() {
        let template = submission().openjd();
        assert_eq!(template["specificationVersion"], "jobtemplate-2023-09");
        let render = &template["steps"][0];
        assert_eq!(render["parameterSpace"]["taskParameterDefinitions"][0]["range"], "0-2");
        let args = render["script"]["actions"]["onRun"]["args"].as_array().unwrap();
        assert!(args.iter().any(|a| a == "{{Task.Param.Shard}}/3"));
        assert_eq!(template["steps"][1]["dependencies"][0]["dependsOn"], "Render");
    }
}
