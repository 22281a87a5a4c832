//! CPU time, which other work on the machine does not lengthen much.

use rustix::time::{ClockId, clock_gettime};

fn seconds(clock: ClockId) -> f64 {
    let t = clock_gettime(clock);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

/// CPU seconds of this thread during the call.
pub fn thread_seconds(work: impl FnOnce()) -> f64 {
    let start = seconds(ClockId::ThreadCPUTime);
    work();
    seconds(ClockId::ThreadCPUTime) - start
}

/// CPU seconds of all threads of the process during the call, with its result.
pub fn process_seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = seconds(ClockId::ProcessCPUTime);
    let result = work();
    (seconds(ClockId::ProcessCPUTime) - start, result)
}
