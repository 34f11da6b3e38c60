//! The binary, run in a folder of its own.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// The root of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap()
}

/// A bundled model, by its name without ending.
pub(crate) fn model(name: &str) -> PathBuf {
    root().join("models").join(format!("{name}.stl"))
}

/// The program of a bundled model.
pub(crate) fn sliced(name: &str, arguments: &[&str]) -> String {
    let file = model(name);
    let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "-"];
    all.extend(arguments);
    Scratch::new().run(&all).expect(0).out
}

/// A folder that is gone at the end of the test.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("run-{}-{number}", std::process::id());
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn file(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// A cube with this side under some name.
    pub(crate) fn cube(&self, name: impl AsRef<Path>, side: f64) -> PathBuf {
        self.file(name, mesh::stl::write(&mesh::shapes::cube(side)))
    }

    /// The names of all files in the folder, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(&self.0)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// The binary, to be run in this folder, at a fixed time.
    pub(crate) fn rhumb<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rhumb"));
        command
            .current_dir(&self.0)
            .args(arguments)
            .env("SOURCE_DATE_EPOCH", "1700000000")
            .env_remove("RAYON_NUM_THREADS")
            .stdin(Stdio::null());
        command
    }

    /// Runs it to its end.
    pub(crate) fn run<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Ran {
        Ran::from(self.rhumb(arguments).output().unwrap())
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed lies in the build folder and is in nobody's way.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// What came of a run.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }
}

impl Ran {
    /// Expects an exit status, and shows what was said when it is another.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{}\n{}", self.err, self.out);
        self
    }

    /// Expects a failure of this class as the contract has it: its status, one line with class and
    /// words on standard error and at most one more with a hint, nothing on standard output.
    #[track_caller]
    pub(crate) fn refused(self, class: &str, code: i32) -> Self {
        let start = format!("error[{class}]: ");
        assert!(self.err.starts_with(&start), "{start} expected: {}", self.err);
        assert_eq!(self.code, Some(code), "{}", self.err);
        let mut lines = self.err.lines().skip(1);
        assert!(lines.next().is_none_or(|line| line.starts_with("hint: ")), "{}", self.err);
        assert!(lines.next().is_none(), "{}", self.err);
        assert!(self.err.len() <= 4096, "{} bytes are too many to read", self.err.len());
        assert!(self.out.is_empty(), "{}", self.out);
        self
    }
}

/// Waits until something is so; far longer than it takes on a slow machine.
#[track_caller]
pub(crate) fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(60), "never so: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Finds a file or folder below `shared` beside the repository; says so where there is none.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    let found = root().ancestors().map(|dir| dir.join("shared").join(name)).find(|p| p.exists());
    if found.is_none() {
        say(&format!("skipped: there is no shared/{name} beside the repository"));
    }
    found
}

/// Says something in the log of the test.
pub(crate) fn say(text: &str) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// The program of a mesh as it stands.
pub(crate) fn sliced_mesh(mesh: &mesh::mesh::Mesh, more: &[&str]) -> String {
    let scratch = Scratch::new();
    scratch.file("m.stl", mesh::stl::write(mesh));
    let mut all = vec!["slice", "m.stl", "-q", "-o", "x.gcode", "--orient", "keep"];
    all.extend(more);
    scratch.run(&all).expect(0);
    std::fs::read_to_string(scratch.path("x.gcode")).unwrap()
}
