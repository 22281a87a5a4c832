//! Who writes checkpoints while a render runs.

use super::file::Checkpoint;
use super::header::Header;
use crate::image_io::ImageError;
use crate::render::State;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
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
        let (sender, receiver): (_, Receiver<Checkpoint>) = sync_channel(0);
        let to = path.clone();
        let write = move || receiver.iter().for_each(|checkpoint| told(checkpoint.write(&to)));
        let thread = std::thread::Builder::new().name("checkpoints".into()).spawn(write)?;
        let now = Instant::now();
        let writer = Some((sender, thread));
        Ok(Self { path, every, before, started: now, last: Mutex::new(now), asked, writer })
    }

    /// Takes a copy of the state if it is time; to be called from [`Progress::state`](crate::render::Progress::state).
    pub fn offer(&self, state: &State) {
        // Whoever finds the clock taken leaves the matter to its holder.
        let Ok(mut last) = self.last.try_lock() else { return };
        let asked = self.asked.load(Ordering::Relaxed);
        if !asked && last.elapsed() < self.every {
            return;
        }
        let Some((sender, _)) = &self.writer else { return };
        // The thread may still be busy with the one before: then the next tile offers again.
        match sender.try_send(self.checkpoint(state, false)) {
            Ok(()) => {
                *last = Instant::now();
                self.asked.store(false, Ordering::Relaxed);
            }
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
        }
    }

    /// What would be written of a state.
    pub fn checkpoint(&self, state: &State, finished: bool) -> Checkpoint {
        let mut header = self.before.clone();
        header.parts.iter_mut().for_each(|part| part.finished = finished);
        header.dropped = state.film.dropped;
        header.tally.merge(&state.tally);
        header.seconds += self.started.elapsed().as_secs_f64();
        header.decisions = state.decisions.clone();
        Checkpoint { header, film: state.film.clone() }
    }

    /// Waits for the thread and writes the last state.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self, state: &State, finished: bool) -> Result<Checkpoint, ImageError> {
        self.stop();
        let checkpoint = self.checkpoint(state, finished);
        checkpoint.write(&self.path)?;
        Ok(checkpoint)
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
