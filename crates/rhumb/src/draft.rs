//! A file in the making, in the folder where it will stand.
//!
//! On Linux it has no name until it is whole, so that not even a killed process leaves anything; where the
//! file system cannot do that, and elsewhere, it has a name of its own and is removed when it is dropped.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// A file in the making.
#[derive(Debug)]
pub(crate) struct Draft {
    file: File,
    folder: PathBuf,
    /// What it will be called.
    stem: OsString,
    /// Its name while it is in the making, where it has one.
    name: Option<PathBuf>,
}

impl Draft {
    /// Opens a new file in `folder` that will be called like `target`.
    pub(crate) fn create(folder: &Path, target: &Path) -> io::Result<Self> {
        let stem = target.file_name().unwrap_or_default().to_owned();
        let (name, file) = match nameless::create(folder) {
            Some(file) => (None, file),
            None => {
                let (name, file) = named(folder, &stem)?;
                (Some(name), file)
            }
        };
        Ok(Self { file, folder: folder.to_owned(), stem, name })
    }

    /// The file to write to.
    pub(crate) fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Opens what was written, from its begin.
    pub(crate) fn reread(&self) -> io::Result<File> {
        match &self.name {
            Some(name) => File::open(name),
            None => nameless::reopen(&self.file),
        }
    }

    /// Puts the file, with what was written, in the place of `target`, which is in its folder and keeps the
    /// mode that it had.
    pub(crate) fn replace(mut self, target: &Path) -> io::Result<()> {
        let old = fs::metadata(target).map(|old| old.permissions());
        let settle = |file: &File| {
            if let Ok(mode) = &old {
                // A mode that cannot be kept is no reason to lose the result.
                let _ = file.set_permissions(mode.clone());
            }
            file.sync_all()
        };
        settle(&self.file)?;
        // As late as can be: from here until it stands in its place the file has a name that a killed process
        // would leave.
        if self.name.is_none() && self.take_name().is_err() {
            self.copy()?;
            settle(&self.file)?;
        }
        if let Some(name) = &self.name {
            fs::rename(name, target)?;
            self.name = None;
        }
        // The name, too, should outlast a power cut; folders that cannot be synchronised do without.
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
        Ok(())
    }

    /// Takes a name that no other run uses.
    fn take_name(&mut self) -> io::Result<()> {
        let link = |name: &Path| nameless::link(&self.file, name);
        let (name, ()) = free_name(&self.folder, &self.stem, link)?;
        self.name = Some(name);
        Ok(())
    }

    /// Goes on as a copy with a name, where the system allows none to the file itself.
    fn copy(&mut self) -> io::Result<()> {
        let mut from = self.reread()?;
        let (name, file) = named(&self.folder, &self.stem)?;
        (self.name, self.file) = (Some(name), file);
        io::copy(&mut from, &mut self.file).map(|_| ())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(name) = &self.name {
            // Nothing more can be done about a file that does not go.
            let _ = fs::remove_file(name);
        }
    }
}

fn named(folder: &Path, stem: &OsStr) -> io::Result<(PathBuf, File)> {
    let mut new = OpenOptions::new();
    new.read(true).write(true).create_new(true);
    free_name(folder, stem, |name| new.open(name))
}

/// Tries names until `make` finds one that is free.
fn free_name<T>(
    folder: &Path,
    stem: &OsStr,
    make: impl Fn(&Path) -> io::Result<T>,
) -> io::Result<(PathBuf, T)> {
    for attempt in 0..1000_u32 {
        let mut name = OsString::from(".");
        // Long names are cut by the system; the number alone tells runs apart.
        name.push(if stem.len() <= 200 { stem } else { "long".as_ref() });
        name.push(format!(".{}-{attempt}.tmp", std::process::id()));
        let path = folder.join(name);
        match make(&path) {
            Ok(made) => return Ok((path, made)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::AlreadyExists, "no free temporary name"))
}

/// Files without a name (`O_TMPFILE` of open(2)).
#[cfg(target_os = "linux")]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::{Path, PathBuf};

    use rustix::fs::{AtFlags, CWD, Mode, OFlags};

    /// Opens one in `folder`; `None` where that cannot be done.
    pub(super) fn create(folder: &Path) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = File::from(rustix::fs::open(folder, flags, Mode::from_raw_mode(0o666)).ok()?);
        // All that is done with it later goes by its place here.
        reopen(&file).ok().map(|_| file)
    }

    /// Opens the file again, at its begin.
    pub(super) fn reopen(file: &File) -> io::Result<File> {
        File::open(place(file))
    }

    /// Gives it a name.
    pub(super) fn link(file: &File, name: &Path) -> io::Result<()> {
        rustix::fs::linkat(CWD, place(file), CWD, name, AtFlags::SYMLINK_FOLLOW)?;
        Ok(())
    }

    fn place(file: &File) -> PathBuf {
        PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
    }
}

/// Only Linux has files without a name.
#[cfg(not(target_os = "linux"))]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub(super) fn create(_: &Path) -> Option<File> {
        None
    }

    pub(super) fn reopen(_: &File) -> io::Result<File> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(super) fn link(_: &File, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    /// A new folder, removed at the end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("rhumb-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn names(&self) -> Vec<OsString> {
            fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().file_name()).collect()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// With a name and without, a draft is read again, takes its place, and leaves nothing when it is given
    /// up.
    #[test]
    fn drafts_replace_their_target_or_leave_nothing() {
        for is_named in [false, true] {
            let folder = Folder::new(if is_named { "named" } else { "nameless" });
            let target = folder.0.join("part.gcode");
            let draft = || {
                let mut draft = Draft::create(&folder.0, &target).unwrap();
                draft.file().write_all(b"G28\n").unwrap();
                if is_named && draft.name.is_none() {
                    draft.copy().unwrap();
                }
                draft
            };
            drop(draft());
            assert!(folder.names().is_empty());
            let whole = draft();
            let mut text = String::new();
            whole.reread().unwrap().read_to_string(&mut text).unwrap();
            assert_eq!(text, "G28\n");
            fs::write(&target, "old").unwrap();
            whole.replace(&target).unwrap();
            assert_eq!(folder.names(), ["part.gcode"]);
            assert_eq!(fs::read(&target).unwrap(), b"G28\n");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn drafts_have_no_name_on_linux() {
        let folder = Folder::new("hidden");
        let draft = Draft::create(&folder.0, Path::new("part.gcode")).unwrap();
        // A file system that has no such files is no fault of rhumb.
        assert!(draft.name.is_some() || folder.names().is_empty());
    }
}
