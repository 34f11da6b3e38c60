//! Ctrl-C and its like: work stops at the next layer, and what was begun is cleared away.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// Whether someone asked to stop.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Returns an interrupt that is raised when the process is asked to end.
    #[must_use]
    pub fn on_signals() -> Self {
        let interrupt = Self::default();
        #[cfg(unix)]
        {
            use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
            for signal in [SIGINT, SIGTERM, SIGHUP] {
                // Without a handler the signal ends the process at once; the target is still safe.
                let _ = signal_hook::flag::register(signal, Arc::clone(&interrupt.0));
            }
        }
        interrupt
    }

    /// Raises it too when standard input ends: whoever started this process is gone then.
    pub fn raise_at_end_of_input(&self) {
        let raised = Arc::clone(&self.0);
        std::thread::spawn(move || {
            // What comes in is of no interest.
            let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
            raised.store(true, Ordering::Relaxed);
        });
    }

    /// Lets a file that grows beyond what the user may write be a failed write, as on a full disk,
    /// and not the end of the process.
    pub fn outlive_limits_of_size() {
        #[cfg(unix)]
        {
            let nobody_asks = Arc::new(AtomicBool::new(false));
            // Without a handler the signal ends the process; the target is still safe.
            let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, nobody_asks);
        }
    }

    /// Goes on, or stops where it was asked to.
    ///
    /// # Errors
    ///
    /// `Interrupted`.
    pub fn check(&self) -> Result<(), Failure> {
        if self.0.load(Ordering::Relaxed) {
            return Err(Failure::new("Interrupted", "stopped on request; nothing was written"));
        }
        Ok(())
    }
}
