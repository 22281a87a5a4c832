//! Which shard a scheduler means: the variables by which it tells a task its number.

/// Why the environment names no shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SchedulerError {
    /// No scheduler is known by its variables.
    #[error("no scheduler tells this task its number: --shard auto looks for {}", known())]
    None,
    /// The scheduler does not say how many tasks there are.
    #[error("{variable} says which task this is, but nothing says of how many: write --shard auto/N")]
    NoCount {
        /// The variable that was found.
        variable: &'static str,
    },
    /// The tasks are not all of an unbroken row, so that their number is not that of the shards.
    #[error(
        "the array of {scheduler} has gaps (a part of it runs again?): say how many shards there are, --shard auto/N"
    )]
    Gaps {
        /// Whose array.
        scheduler: &'static str,
    },
    /// A variable does not hold a number.
    #[error("{variable} is `{value}`: not a number that a task can have")]
    Malformed {
        /// Which variable.
        variable: &'static str,
        /// What it holds.
        value: String,
    },
}

/// How one scheduler tells.
struct Scheduler {
    name: &'static str,
    index: &'static str,
    /// First number, where the scheduler does not say it.
    first: u32,
    /// Variables of the first and last number and of the step between them.
    range: Option<[&'static str; 3]>,
    /// Variable of the number of tasks.
    count: Option<&'static str>,
}

/// In the order in which they are asked: those that run within others come first.
const SCHEDULERS: [Scheduler; 9] = [
    Scheduler { name: "GNU parallel", index: "PARALLEL_SEQ", first: 1, range: None, count: None },
    Scheduler { name: "HyperQueue", index: "HQ_TASK_ID", first: 0, range: None, count: None },
    Scheduler {
        name: "Slurm",
        index: "SLURM_ARRAY_TASK_ID",
        first: 0,
        range: Some(["SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX", "SLURM_ARRAY_TASK_STEP"]),
        count: Some("SLURM_ARRAY_TASK_COUNT"),
    },
    Scheduler { name: "PBS", index: "PBS_ARRAY_INDEX", first: 0, range: None, count: None },
    Scheduler { name: "Torque", index: "PBS_ARRAYID", first: 0, range: None, count: None },
    Scheduler {
        name: "Grid Engine",
        index: "SGE_TASK_ID",
        first: 1,
        range: Some(["SGE_TASK_FIRST", "SGE_TASK_LAST", "SGE_TASK_STEPSIZE"]),
        count: None,
    },
    Scheduler {
        name: "LSF",
        index: "LSB_JOBINDEX",
        first: 1,
        range: Some(["", "LSB_JOBINDEX_END", "LSB_JOBINDEX_STEP"]),
        count: None,
    },
    Scheduler {
        name: "AWS Batch",
        index: "AWS_BATCH_JOB_ARRAY_INDEX",
        first: 0,
        range: None,
        count: Some("AWS_BATCH_JOB_ARRAY_SIZE"),
    },
    Scheduler { name: "Kubernetes", index: "JOB_COMPLETION_INDEX", first: 0, range: None, count: None },
];

fn known() -> String {
    let all = SCHEDULERS.map(|s| format!("{} ({})", s.index, s.name));
    all.join(", ")
}

/// The task's index from 0 and the number of tasks, from the environment's variables.
///
/// With `count` given, the index is the scheduler's number less the first that it counts by habit (1 for Grid Engine,
/// LSF and GNU parallel, else 0), or less the array's own first number where the whole array is as long.
///
/// # Errors
/// If no scheduler is found, or it does not say all that is needed.
pub fn find_index(
    variable: &dyn Fn(&str) -> Option<String>,
    count: Option<u32>,
) -> Result<(u32, u32), SchedulerError> {
    // Grid Engine says `undefined` and LSF 0 where there is no array.
    let is_array = |s: &&Scheduler| match variable(s.index).as_deref() {
        None | Some("" | "undefined") => false,
        Some("0") => s.first == 0,
        Some(_) => true,
    };
    let scheduler = SCHEDULERS.iter().find(is_array).ok_or(SchedulerError::None)?;
    let number = |name: &'static str| match variable(name).filter(|_| !name.is_empty()) {
        None => Ok(None),
        Some(value) => match value.parse::<u32>() {
            Ok(n) => Ok(Some(n)),
            Err(_) => Err(SchedulerError::Malformed { variable: name, value }),
        },
    };
    let index = number(scheduler.index)?.ok_or(SchedulerError::None)?;
    let malformed = || SchedulerError::Malformed { variable: scheduler.index, value: index.to_string() };

    let said = scheduler.count.map_or(Ok(None), number)?;
    let range = match scheduler.range {
        None => None,
        Some([first, last, step]) => {
            let (first, last) = (number(first)?.unwrap_or(scheduler.first), number(last)?);
            let step = number(step)?.unwrap_or(1).max(1);
            last.filter(|last| *last >= first).map(|last| (first, step, (last - first) / step + 1))
        }
    };
    match (range, said, count) {
        (Some((first, step, long)), said, count)
            if said.is_none_or(|said| said == long) && count.is_none_or(|count| count == long) =>
        {
            Ok((index.checked_sub(first).ok_or_else(malformed)? / step, long))
        }
        (_, _, Some(count)) => Ok((index.checked_sub(scheduler.first).ok_or_else(malformed)?, count)),
        (Some(_), Some(_), None) => Err(SchedulerError::Gaps { scheduler: scheduler.name }),
        (_, Some(said), None) => Ok((index.checked_sub(scheduler.first).ok_or_else(malformed)?, said)),
        (_, None, None) => Err(SchedulerError::NoCount { variable: scheduler.index }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(variables: &[(&str, &str)], count: Option<u32>) -> Result<(u32, u32), SchedulerError> {
        let look = |name: &str| variables.iter().find(|v| v.0 == name).map(|v| v.1.to_owned());
        find_index(&look, count)
    }

    fn slurm<'a>(id: &'a str, min: &'a str, max: &'a str, count: &'a str) -> [(&'static str, &'a str); 4] {
        [
            ("SLURM_ARRAY_TASK_ID", id),
            ("SLURM_ARRAY_TASK_MIN", min),
            ("SLURM_ARRAY_TASK_MAX", max),
            ("SLURM_ARRAY_TASK_COUNT", count),
        ]
    }

    #[test]
    fn every_scheduler_is_understood() {
        assert_eq!(find(&slurm("3", "0", "7", "8"), None), Ok((3, 8)));
        assert_eq!(find(&slurm("3", "1", "8", "8"), None), Ok((2, 8)));
        let lsf = [("LSB_JOBINDEX", "2"), ("LSB_JOBINDEX_END", "4"), ("LSB_JOBINDEX_STEP", "1")];
        assert_eq!(find(&lsf, None), Ok((1, 4)));
        let sge = [
            ("SGE_TASK_ID", "5"),
            ("SGE_TASK_FIRST", "1"),
            ("SGE_TASK_LAST", "9"),
            ("SGE_TASK_STEPSIZE", "2"),
        ];
        assert_eq!(find(&sge, None), Ok((2, 5)));
        let aws = [("AWS_BATCH_JOB_ARRAY_INDEX", "0"), ("AWS_BATCH_JOB_ARRAY_SIZE", "10")];
        assert_eq!(find(&aws, None), Ok((0, 10)));
        for name in ["PBS_ARRAY_INDEX", "PBS_ARRAYID", "HQ_TASK_ID", "JOB_COMPLETION_INDEX"] {
            assert_eq!(find(&[(name, "6")], Some(8)), Ok((6, 8)), "{name}");
        }
        assert_eq!(find(&[("PARALLEL_SEQ", "8")], Some(8)), Ok((7, 8)));
    }

    #[test]
    fn a_part_of_an_array_that_runs_again_is_not_taken_for_the_whole() {
        let again = slurm("5", "3", "5", "2");
        assert!(matches!(find(&again, None), Err(SchedulerError::Gaps { .. })));
        assert_eq!(find(&again, Some(8)), Ok((5, 8)));
        assert_eq!(find(&slurm("5", "5", "5", "1"), Some(8)), Ok((5, 8)));
    }

    #[test]
    fn what_is_missing_is_said() {
        let message = find(&[], None).unwrap_err().to_string();
        assert!(message.contains("SLURM_ARRAY_TASK_ID (Slurm)"), "{message}");
        assert_eq!(find(&[("SGE_TASK_ID", "undefined")], Some(4)), Err(SchedulerError::None));
        assert_eq!(find(&[("LSB_JOBINDEX", "0")], Some(4)), Err(SchedulerError::None));
        let message = find(&[("JOB_COMPLETION_INDEX", "1")], None).unwrap_err().to_string();
        assert!(message.contains("--shard auto/N"), "{message}");
        assert!(find(&[("HQ_TASK_ID", "x")], Some(4)).unwrap_err().to_string().contains("`x`"));
    }
}
