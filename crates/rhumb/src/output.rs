//! Files that go out: whole or not at all.
//!
//! What is written goes to a draft (`draft.rs`) beside the target and takes the target's place only
//! when it is complete and checked. Whatever stops rhumb before, the target keeps its old content
//! and nothing is left behind. Devices and standard output are written at the very end.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::draft::Draft;
use crate::failure::Failure;

/// An output under way.
#[derive(Debug)]
pub struct Output {
    destination: Destination,
    draft: Draft,
}

#[derive(Debug)]
enum Destination {
    StandardOutput,
    /// A device or pipe: written in place.
    InPlace(PathBuf),
    /// An ordinary file, replaced at the end.
    File(PathBuf),
}

impl Output {
    /// Opens an output; `-` is standard output. All that can be found out is found out here, before
    /// any work is done.
    ///
    /// # Errors
    ///
    /// `OutputIsInput`, `OutputIsDirectory` or `OutputDenied`.
    pub fn create(target: &Path, inputs: &[&Path]) -> Result<Self, Failure> {
        let destination = if target == Path::new("-") {
            Destination::StandardOutput
        } else {
            destination(target, inputs)?
        };
        let folder = match &destination {
            Destination::File(path) => match path.parent() {
                Some(parent) if parent != Path::new("") => parent.to_owned(),
                _ => PathBuf::from("."),
            },
            _ => std::env::temp_dir(),
        };
        let draft = Draft::create(&folder, target).map_err(|error| denied(target, &error))?;
        Ok(Self { destination, draft })
    }

    /// The file to write to.
    pub fn file(&mut self) -> &mut File {
        self.draft.file()
    }

    /// Opens what was written for reading it again.
    ///
    /// # Errors
    ///
    /// `OutputDenied`, when the file cannot be read.
    pub fn reread(&self) -> Result<File, Failure> {
        self.draft.reread().map_err(|error| match &self.destination {
            Destination::StandardOutput => denied(Path::new("standard output"), &error),
            Destination::InPlace(path) | Destination::File(path) => denied(path, &error),
        })
    }

    /// Puts what was written in its place.
    ///
    /// # Errors
    ///
    /// `OutputFull` or `OutputDenied`; the target is then as it was.
    pub fn commit(mut self) -> Result<(), Failure> {
        match self.destination {
            Destination::StandardOutput => {
                let mut out = io::stdout().lock();
                copy(self.draft.file(), &mut out, Path::new("standard output"))
            }
            Destination::InPlace(path) => {
                let mut device = OpenOptions::new()
                    .write(true)
                    .open(&path)
                    .map_err(|error| denied(&path, &error))?;
                copy(self.draft.file(), &mut device, &path)
            }
            Destination::File(path) => {
                self.draft.replace(&path).map_err(|error| failed(&path, &error))
            }
        }
    }
}

/// Refuses outputs that are an input, or one file twice. `-` and devices may be named twice, as far as
/// that goes: standard output takes one output only.
///
/// # Errors
///
/// `OutputIsInput`, `OutputTwice`, `OutputIsDirectory` or `OutputDenied`.
pub fn keep_apart(inputs: &[&Path], outputs: &[&Path]) -> Result<(), Failure> {
    let mut taken: Vec<(PathBuf, &Path)> = Vec::new();
    for &output in outputs {
        let place = if output == Path::new("-") {
            output.to_owned()
        } else {
            match destination(output, inputs)? {
                Destination::File(path) => absolute(&path),
                Destination::InPlace(_) | Destination::StandardOutput => continue,
            }
        };
        let is_same = |(other, _): &&(PathBuf, &Path)| *other == place || is_linked(other, &place);
        if let Some((_, first)) = taken.iter().find(is_same) {
            let what = if output == Path::new("-") {
                "two outputs cannot both go to standard output".to_owned()
            } else {
                format!("{} and {} are one file", first.display(), output.display())
            };
            return Err(Failure::new("OutputTwice", what).hint("give every output its own name"));
        }
        taken.push((place, output));
    }
    Ok(())
}

/// Whether two paths are names of one file that is there.
fn is_linked(a: &Path, b: &Path) -> bool {
    fs::metadata(b).is_ok_and(|b_metadata| is_same_file(a, &b_metadata, b))
}

/// A path in one form only, whether or not its file is there yet.
fn absolute(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|parent| *parent != Path::new(""));
    let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")));
    match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// Says what went wrong while writing.
#[must_use]
pub fn failed(target: &Path, error: &io::Error) -> Failure {
    let class = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::FileTooLarge | io::ErrorKind::QuotaExceeded => {
            "OutputFull"
        }
        io::ErrorKind::BrokenPipe => "BrokenPipe",
        _ => "OutputDenied",
    };
    Failure::new(class, format!("{}: {error}", target.display()))
}

fn denied(target: &Path, error: &io::Error) -> Failure {
    let failure = failed(target, error);
    if error.kind() == io::ErrorKind::NotFound {
        failure.hint("the folder must exist already")
    } else {
        failure
    }
}

fn copy(from: &mut File, to: &mut impl Write, target: &Path) -> Result<(), Failure> {
    let run = |from: &mut File, to: &mut dyn Write| -> io::Result<()> {
        from.rewind()?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let count = from.read(&mut buffer)?;
            if count == 0 {
                return to.flush();
            }
            to.write_all(&buffer[..count])?;
        }
    };
    run(from, to).map_err(|error| failed(target, &error))
}

/// Follows links, so that a link is written through and not replaced.
fn destination(target: &Path, inputs: &[&Path]) -> Result<Destination, Failure> {
    let resolved = match fs::symlink_metadata(target) {
        Ok(metadata) if metadata.is_symlink() => match fs::canonicalize(target) {
            Ok(path) => path,
            // A link to a file that is not there yet.
            Err(_) => {
                let link = fs::read_link(target).map_err(|error| denied(target, &error))?;
                target.parent().map_or(link.clone(), |parent| parent.join(&link))
            }
        },
        _ => target.to_owned(),
    };
    let Ok(metadata) = fs::metadata(&resolved) else { return Ok(Destination::File(resolved)) };
    if metadata.is_dir() {
        return Err(Failure::new("OutputIsDirectory", format!("{} is a folder", target.display()))
            .hint("name the file in it"));
    }
    if inputs.iter().any(|input| is_same_file(input, &metadata, &resolved)) {
        return Err(Failure::new(
            "OutputIsInput",
            format!("{} is the input itself", target.display()),
        )
        .hint("choose another name with -o"));
    }
    if !metadata.is_file() {
        return Ok(Destination::InPlace(resolved));
    }
    if metadata.permissions().readonly() {
        return Err(Failure::new("OutputDenied", format!("{} is read-only", target.display())));
    }
    Ok(Destination::File(resolved))
}

#[cfg(unix)]
fn is_same_file(input: &Path, target: &fs::Metadata, _: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(input)
        .is_ok_and(|input| input.dev() == target.dev() && input.ino() == target.ino())
}

#[cfg(not(unix))]
fn is_same_file(input: &Path, _: &fs::Metadata, target: &Path) -> bool {
    match (fs::canonicalize(input), fs::canonicalize(target)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
