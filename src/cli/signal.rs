//! Ctrl-C, SIGTERM and a terminal that is gone: stop soon and say so. SIGUSR1: a checkpoint, please.

use super::exit::{Exit, Failure, OrExit};
use super::terminal::note;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Listens for signals while it is alive and after.
///
/// Until [`stops_softly`](Self::stops_softly), and at a second signal, the process ends at once: loading and building
/// look at no flag. After it, a signal raises [`stop`](Self::stop).
pub(super) struct Interrupt {
    stop: Arc<AtomicBool>,
    soft: Arc<AtomicBool>,
    checkpoint: Arc<AtomicBool>,
}

impl Interrupt {
    /// Starts to listen.
    pub(super) fn listen() -> Result<Self, Failure> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1]).or_failed()?;
        if !is_ignored(SIGHUP) {
            signals.add_signal(SIGHUP).or_failed()?;
        }
        let interrupt = Self { stop: Arc::default(), soft: Arc::default(), checkpoint: Arc::default() };
        let (stop, soft) = (Arc::clone(&interrupt.stop), Arc::clone(&interrupt.soft));
        let checkpoint = Arc::clone(&interrupt.checkpoint);
        let listen = move || {
            for signal in signals.forever() {
                if signal == SIGUSR1 {
                    checkpoint.store(true, Ordering::Relaxed);
                    continue;
                }
                let first = !stop.swap(true, Ordering::Relaxed);
                if !(first && soft.load(Ordering::Relaxed)) {
                    note("interrupted before a picture was written");
                    // Not `exit`: other threads are still in the middle of things that its handlers would free.
                    signal_hook::low_level::exit(Exit::Interrupted as i32);
                }
            }
        };
        std::thread::Builder::new().name("signals".to_owned()).spawn(listen).or_failed()?;
        Ok(interrupt)
    }

    /// From now on, somebody looks at [`stop`](Self::stop).
    pub(super) fn stops_softly(&self) {
        self.soft.store(true, Ordering::Relaxed);
    }

    /// Raised by SIGUSR1; whoever writes a checkpoint lowers it.
    pub(super) fn checkpoint_asked(&self) -> &Arc<AtomicBool> {
        &self.checkpoint
    }

    /// Whether to stop.
    pub(super) fn stop(&self) -> &AtomicBool {
        &self.stop
    }
}

/// Whether the process was started with a signal ignored, as `nohup` does with SIGHUP; yes where the system does not tell.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}
