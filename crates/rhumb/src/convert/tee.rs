//! The text on its two ways: to where it is kept, and to who proves it.

use std::io::{self, BufRead, Read, Write};
use std::sync::mpsc::{Receiver, SyncSender};

/// Bytes that go together.
const CHUNK: usize = 1 << 16;

/// Writes to `out`, and sends what was written.
pub(super) struct Tee<'a> {
    out: &'a mut dyn Write,
    to_check: SyncSender<Vec<u8>>,
    chunk: Vec<u8>,
}

impl<'a> Tee<'a> {
    pub(super) fn new(out: &'a mut dyn Write, to_check: SyncSender<Vec<u8>>) -> Self {
        Self { out, to_check, chunk: Vec::with_capacity(CHUNK) }
    }

    fn pass_on(&mut self) -> io::Result<()> {
        let chunk = std::mem::replace(&mut self.chunk, Vec::with_capacity(CHUNK));
        self.out.write_all(&chunk)?;
        // Whoever reads this reads to the end; if it stops, its own result says why.
        let _ = self.to_check.send(chunk);
        Ok(())
    }
}

impl Write for Tee<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.chunk.len() + bytes.len() > CHUNK {
            self.pass_on()?;
        }
        self.chunk.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.pass_on()?;
        self.out.flush()
    }
}

/// Reads what a [`Tee`] sends, until it is dropped.
pub(super) struct Chunks {
    chunks: Receiver<Vec<u8>>,
    chunk: Vec<u8>,
    read: usize,
}

impl Chunks {
    pub(super) fn new(chunks: Receiver<Vec<u8>>) -> Self {
        Self { chunks, chunk: Vec::new(), read: 0 }
    }
}

impl Read for Chunks {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(into)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Chunks {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.read >= self.chunk.len() {
            // An empty slice is the end.
            let Ok(next) = self.chunks.recv() else { return Ok(&[]) };
            (self.chunk, self.read) = (next, 0);
        }
        Ok(&self.chunk[self.read..])
    }

    fn consume(&mut self, count: usize) {
        self.read += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::sync_channel;

    #[test]
    fn what_is_read_is_what_was_written() {
        let text: Vec<u8> =
            (0..400_000_u32).flat_map(|k| format!("G1 X{k}\n").into_bytes()).collect();
        let (sender, receiver) = sync_channel(2);
        let mut kept = Vec::new();
        let seen = std::thread::scope(|scope| {
            let reader = scope.spawn(move || {
                let mut seen = Vec::new();
                Chunks::new(receiver).read_to_end(&mut seen).unwrap();
                seen
            });
            let mut tee = Tee::new(&mut kept, sender);
            for piece in text.chunks(1000) {
                tee.write_all(piece).unwrap();
            }
            tee.flush().unwrap();
            drop(tee);
            reader.join().unwrap()
        });
        assert!(seen == text && kept == text);
    }
}
