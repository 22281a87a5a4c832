//! Time that a processor has worked, which other programs on the machine do not lengthen.

/// Seconds that the calling thread has worked so far.
///
/// Only differences mean anything. Where the system does not tell, this is wall time.
pub fn thread_seconds() -> f64 {
    imp::seconds(imp::Of::Thread)
}

/// Seconds that all threads of the process have worked so far, added up.
///
/// Only differences mean anything. Where the system does not tell, this is wall time.
pub fn process_seconds() -> f64 {
    imp::seconds(imp::Of::Process)
}

/// What the clocks measure, for people.
pub const CLOCK: &str = if cfg!(unix) { "CPU time" } else { "wall time" };

#[cfg(unix)]
mod imp {
    use rustix::time::{ClockId, clock_gettime};

    pub(super) enum Of {
        Thread,
        Process,
    }

    pub(super) fn seconds(of: Of) -> f64 {
        let now = clock_gettime(match of {
            Of::Thread => ClockId::ThreadCPUTime,
            Of::Process => ClockId::ProcessCPUTime,
        });
        now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
    }
}

#[cfg(not(unix))]
mod imp {
    use std::sync::OnceLock;
    use std::time::Instant;

    pub(super) enum Of {
        Thread,
        Process,
    }

    pub(super) fn seconds(_: Of) -> f64 {
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_time_on_both_clocks() {
        // The process's interval begins before the thread's and ends after it, however near the clocks are read.
        let process = process_seconds();
        let thread = thread_seconds();
        let mut x = 1u64;
        while thread_seconds() - thread < 1e-3 {
            x = std::hint::black_box(x.wrapping_mul(3));
        }
        assert!(process_seconds() - process >= 1e-3, "{x}");
    }
}
