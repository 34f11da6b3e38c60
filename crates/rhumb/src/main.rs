//! The command line.

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use rhumb::args::{Arguments, Color, ErrorFormat};
use rhumb::commands;
use rhumb::failure::Failure;
use rhumb::interrupt::Interrupt;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if error.use_stderr() => return misused(&error),
        Err(help) => {
            // A closed pipe after --help is nobody's fault.
            let _ = help.print();
            return ExitCode::SUCCESS;
        }
    };
    Interrupt::outlive_limits_of_size();
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

/// Says what is wrong with the command line, in the form that it asks for as far as it can be told.
fn misused(error: &clap::Error) -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    let wants_json = arguments.windows(2).any(|pair| pair == ["--error-format", "json"])
        || arguments.iter().any(|argument| argument == "--error-format=json");
    let plain = error.render().to_string();
    let said = plain.strip_prefix("error: ");
    let mut err = std::io::stderr().lock();
    if wants_json {
        let message =
            said.map_or("a command is missing", |said| said.split("\n\n").next().unwrap_or(said));
        let message: Vec<&str> = message.split_whitespace().collect();
        let failure = Failure::new("Usage", message.join(" ")).hint("for more, try --help");
        let _ = writeln!(err, "{}", failure.to_json());
        return ExitCode::from(failure.exit_status());
    }
    let text = match (err.is_terminal(), said) {
        (true, _) => error.render().ansi().to_string().replacen("error:", "error[Usage]:", 1),
        (false, Some(said)) => format!("error[Usage]: {said}"),
        (false, None) => plain,
    };
    let _ = write!(err, "{text}");
    ExitCode::from(2)
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
