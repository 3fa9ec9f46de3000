//! Progress on a terminal, for what takes more than a second.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Shows the running stage and the seconds so far on standard error, where that is a terminal.
pub struct Progress {
    ticker: Option<(Sender<&'static str>, JoinHandle<()>)>,
}

impl Progress {
    /// Starts the clock.
    pub fn start() -> Self {
        let ticker = std::io::stderr().is_terminal().then(|| {
            let (sender, stages) = mpsc::channel();
            (sender, std::thread::spawn(move || show(&stages)))
        });
        Progress { ticker }
    }

    /// Names the stage that begins.
    pub fn stage(&self, name: &'static str) {
        if let Some((sender, _)) = &self.ticker {
            // The other end lives as long as this one.
            let _ = sender.send(name);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.ticker.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

fn show(stages: &mpsc::Receiver<&'static str>) {
    let start = Instant::now();
    let mut stage = "reading";
    let mut shown = false;
    loop {
        match stages.recv_timeout(Duration::from_millis(200)) {
            Ok(next) => stage = next,
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if start.elapsed() > Duration::from_secs(1) {
            shown = true;
            // \x1b[K clears what a longer line left.
            let _ = write!(std::io::stderr(), "\r{stage}, {:.1} s\x1b[K", start.elapsed().as_secs_f64());
        }
    }
    if shown {
        let _ = write!(std::io::stderr(), "\r\x1b[K");
    }
}
