//! Who writes checkpoints while a render runs.

use super::file::{Checkpoint, write};
use super::header::Header;
use crate::image_io::ImageError;
use crate::render::{Decisions, Outcome, State, Tally};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Writes a checkpoint every so often, and when it is asked to, on a thread of its own: the render waits no longer
/// than it takes to copy its film.
pub struct Keeper {
    path: PathBuf,
    every: Duration,
    /// What was known when the render began: its tally and seconds are those of the runs before.
    before: Header,
    started: Instant,
    last: Mutex<Instant>,
    asked: Arc<AtomicBool>,
    /// Whether the thread is writing.
    busy: Arc<AtomicBool>,
    writer: Option<(SyncSender<Checkpoint>, JoinHandle<()>)>,
}

impl Keeper {
    /// Starts the thread that writes to `path`. `before` says which picture it is and what the runs before have
    /// counted; whoever raises `asked` wants a checkpoint now; `told` hears of each that was written or could not be.
    ///
    /// # Errors
    /// If the operating system gives no thread.
    pub fn start(
        path: PathBuf,
        every: Duration,
        before: Header,
        asked: Arc<AtomicBool>,
        told: impl Fn(Result<(), ImageError>) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (sender, receiver): (_, Receiver<Checkpoint>) = sync_channel(1);
        let busy = Arc::new(AtomicBool::new(false));
        let (to, is_busy) = (path.clone(), Arc::clone(&busy));
        let work = move || {
            for checkpoint in receiver {
                told(checkpoint.write(&to));
                is_busy.store(false, Ordering::Release);
            }
        };
        let thread = std::thread::Builder::new().name("checkpoints".into()).spawn(work)?;
        let now = Instant::now();
        let writer = Some((sender, thread));
        Ok(Self { path, every, before, started: now, last: Mutex::new(now), asked, busy, writer })
    }

    /// Takes a copy of the state if it is time; to be called from [`Progress::state`](crate::render::Progress::state).
    pub fn offer(&self, state: &State) {
        // Whoever finds the clock taken leaves the matter to its holder.
        let Ok(mut last) = self.last.try_lock() else { return };
        let asked = self.asked.load(Ordering::Relaxed);
        if !asked && last.elapsed() < self.every {
            return;
        }
        // While one is being written, the next tile offers again.
        if self.busy.swap(true, Ordering::Acquire) {
            return;
        }
        let header = self.header(&state.tally, &state.decisions, false);
        let checkpoint = Checkpoint::new(header, state.film.clone());
        if self.writer.as_ref().is_some_and(|(sender, _)| sender.send(checkpoint).is_ok()) {
            *last = Instant::now();
            self.asked.store(false, Ordering::Relaxed);
        }
    }

    fn header(&self, tally: &Tally, decisions: &Decisions, finished: bool) -> Header {
        let mut header = self.before.clone();
        header.parts.iter_mut().for_each(|part| part.finished = finished);
        header.tally.merge(tally);
        header.seconds += self.started.elapsed().as_secs_f64();
        header.decisions = decisions.clone();
        header
    }

    /// Waits for the thread and writes what the render has left: to its own path, or a finished part to another.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self, outcome: &Outcome, finished: bool, to: Option<&Path>) -> Result<(), ImageError> {
        self.stop();
        let header = self.header(&outcome.tally, &outcome.decisions, finished);
        write(to.unwrap_or(&self.path), header, &outcome.film)
    }

    fn stop(&mut self) {
        if let Some((sender, thread)) = self.writer.take() {
            drop(sender);
            // A thread that panicked has said so; the last checkpoint is written all the same.
            let _ = thread.join();
        }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.stop();
    }
}
