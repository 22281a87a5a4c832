//! Ctrl-C and SIGTERM: stop soon, say so, write nothing.

use super::exit::{Exit, Failure, OrExit};
use super::terminal::note;
use signal_hook::consts::{SIGINT, SIGTERM};
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
}

impl Interrupt {
    /// Starts to listen.
    pub(super) fn listen() -> Result<Self, Failure> {
        let mut signals = Signals::new([SIGINT, SIGTERM]).or_failed()?;
        let interrupt = Self { stop: Arc::default(), soft: Arc::default() };
        let (stop, soft) = (Arc::clone(&interrupt.stop), Arc::clone(&interrupt.soft));
        let listen = move || {
            for _ in signals.forever() {
                let first = !stop.swap(true, Ordering::Relaxed);
                if !(first && soft.load(Ordering::Relaxed)) {
                    note("interrupted: nothing is written");
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

    /// Whether to stop.
    pub(super) fn stop(&self) -> &AtomicBool {
        &self.stop
    }
}
