//! Files that come in.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use crate::failure::Failure;

/// Largest input, bytes. A mesh of 80 million facets; anything above is a mistake.
const MOST_BYTES: u64 = 4 << 30;

/// Reads a whole file; `-` is standard input.
///
/// # Errors
///
/// Classes with exit status 3, or `LimitExceeded`.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    if path == Path::new("-") {
        return read_to_limit(io::stdin().lock(), path);
    }
    let metadata = fs::metadata(path).map_err(|error| unreadable(path, &error))?;
    if metadata.is_dir() {
        return Err(Failure::new("IsDirectory", format!("{} is a folder", path.display())));
    }
    if is_endless(&metadata) {
        return Err(Failure::new(
            "NotRegularFile",
            format!("{} is a device, not a file", path.display()),
        ));
    }
    if metadata.len() > MOST_BYTES {
        return Err(too_large(path));
    }
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    read_to_limit(file, path)
}

fn read_to_limit(source: impl Read, path: &Path) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    // One byte over the limit tells a file at the limit from one beyond it.
    source
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| unreadable(path, &error))?;
    if bytes.len() as u64 > MOST_BYTES { Err(too_large(path)) } else { Ok(bytes) }
}

fn too_large(path: &Path) -> Failure {
    Failure::new(
        "LimitExceeded",
        format!("{} holds more than {} GiB", path.display(), MOST_BYTES >> 30),
    )
}

/// Says why a file cannot be read.
#[must_use]
pub fn unreadable(path: &Path, error: &io::Error) -> Failure {
    let class = match error.kind() {
        io::ErrorKind::PermissionDenied => "PermissionDenied",
        io::ErrorKind::IsADirectory => "IsDirectory",
        io::ErrorKind::OutOfMemory => "LimitExceeded",
        _ if fs::metadata(path).is_err() => "NotFound",
        _ => "Unreadable",
    };
    Failure::new(class, format!("{}: {error}", path.display()))
}

#[cfg(unix)]
fn is_endless(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    kind.is_char_device() || kind.is_block_device() || kind.is_socket()
}

#[cfg(not(unix))]
fn is_endless(_: &fs::Metadata) -> bool {
    false
}
