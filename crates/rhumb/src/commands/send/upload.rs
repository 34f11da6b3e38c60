//! A file as one part of a form, read while it is sent.

use std::fs::File;
use std::io::{self, Read};

use super::servers::PrintServer;
use crate::failure::Failure;
use crate::http::Body;
use crate::interrupt::Interrupt;
use crate::progress::Progress;

/// What stands between the parts. No line of G-code begins like that.
const BOUNDARY: &str = "----rhumb-7c1f0f5d2b6e4f0c9a83";

/// Bytes of a step of the progress bar.
const STEP: u64 = 1024;

/// A form (RFC 7578) with a file.
pub(super) struct Upload {
    head: Vec<u8>,
    file: File,
    length: u64,
    tail: Vec<u8>,
}

impl Upload {
    /// Returns the form: the fields first, then the file under this name.
    pub(super) fn new(file: File, length: u64, name: &str, fields: &[(&str, &str)]) -> Self {
        let mut head = String::new();
        for (field, value) in fields {
            head.push_str(&format!(
                "--{BOUNDARY}\r\nContent-Disposition: form-data; name=\"{field}\"\r\n\r\n{value}\r\n"
            ));
        }
        // As browsers write it: the name in UTF-8, quotes escaped.
        let name = name.replace('"', "%22");
        head.push_str(&format!(
            "--{BOUNDARY}\r\nContent-Disposition: form-data; name=\"file\"; filename=\"{name}\"\r\n\
             Content-Type: application/octet-stream\r\n\r\n"
        ));
        let tail = format!("\r\n--{BOUNDARY}--\r\n");
        Self { head: head.into_bytes(), file, length, tail: tail.into_bytes() }
    }

    /// Sends it; returns whether the print was begun, and `None` when the server does not know
    /// what to do with it.
    pub(super) fn send(
        &mut self,
        target: &PrintServer<'_>,
        progress: &mut dyn Progress,
        interrupt: &Interrupt,
    ) -> Result<Option<bool>, Failure> {
        progress.stage("send", self.length.div_ceil(STEP));
        let length = self.head.len() as u64 + self.length + self.tail.len() as u64;
        let mut watched = Watched { from: &mut self.file, read: 0, progress, interrupt };
        let mut bytes = self
            .head
            .as_slice()
            .chain((&mut watched).take(self.length))
            .chain(self.tail.as_slice());
        let kind = format!("multipart/form-data; boundary={BOUNDARY}");
        target.upload(Body { kind: &kind, length, bytes: &mut bytes })
    }
}

/// Tells how much was read, and stops when it is told to.
struct Watched<'a> {
    from: &'a mut File,
    read: u64,
    progress: &'a mut dyn Progress,
    interrupt: &'a Interrupt,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.interrupt.check().is_err() {
            return Err(io::Error::new(io::ErrorKind::Interrupted, "interrupted"));
        }
        let count = self.from.read(buffer)?;
        let before = self.read / STEP;
        self.read += count as u64;
        self.progress.advance(self.read / STEP - before);
        Ok(count)
    }
}
