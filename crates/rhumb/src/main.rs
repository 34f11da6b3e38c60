//! The command line.

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use rhumb::args::{Arguments, Color, ErrorFormat};
use rhumb::commands;
use rhumb::failure::Failure;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // A closed pipe after --help is nobody's fault.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    std::panic::set_hook(Box::new(|_| {}));
    let manner = arguments.manner.clone();
    let threads = manner.threads.map_or(0, usize::from);
    let result = std::panic::catch_unwind(|| with_threads(threads, || commands::run(&arguments)))
        .unwrap_or_else(|panic| Err(bug(&*panic)));
    match result {
        Ok(status) => ExitCode::from(status),
        Err(failure) => {
            complain(&failure, manner.error_format, manner.color);
            ExitCode::from(failure.exit_status())
        }
    }
}

/// Runs `work` on a pool of threads; on the present one alone where none can be started.
fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let alone = || rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    match pool.or_else(|_| alone()) {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

fn bug(panic: &(dyn std::any::Any + Send)) -> Failure {
    let what = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("unknown");
    Failure::new("Bug", format!("rhumb has a bug: {what}"))
        .hint("please report it with the model and the command; nothing was written")
}

fn complain(failure: &Failure, format: ErrorFormat, color: Color) {
    let mut err = std::io::stderr().lock();
    let text = match format {
        ErrorFormat::Json => failure.to_json(),
        ErrorFormat::Text => {
            let colored = match color {
                Color::Always => true,
                Color::Never => false,
                Color::Auto => err.is_terminal() && std::env::var_os("NO_COLOR").is_none(),
            };
            let text = failure.to_string();
            if colored { text.replacen("error[", "\u{1b}[1;31merror\u{1b}[0m[", 1) } else { text }
        }
    };
    // Where even that cannot be said, the exit status says it.
    let _ = writeln!(err, "{text}");
}
