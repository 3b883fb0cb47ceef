//! Produces a stream on one thread while another thread reads it.
//!
//! A few blocks are in flight at any time. A block that has been read is filled again.

use std::io::{self, Read};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::Scope;

/// The most blocks that wait to be read.
const WAITING: usize = 4;
/// The number of bytes in a block.
pub(crate) const BLOCK: usize = 1 << 17;

/// The end of the stream from which bytes are read.
pub(crate) struct ReadAhead {
    blocks: Receiver<io::Result<Vec<u8>>>,
    emptied: Sender<Vec<u8>>,
    block: Vec<u8>,
    taken: usize,
}

impl ReadAhead {
    /// Starts a thread that reads everything from `source`, including its error. The thread ends soon after the
    /// `ReadAhead` is dropped.
    pub(crate) fn start<'scope>(
        scope: &'scope Scope<'scope, '_>,
        mut source: impl Read + Send + 'scope,
    ) -> Self {
        let (full, blocks) = sync_channel(WAITING);
        let (emptied, spare) = channel::<Vec<u8>>();
        scope.spawn(move || {
            loop {
                let mut block = spare.try_recv().unwrap_or_default();
                let filled = fill(&mut source, &mut block);
                let is_last = !matches!(filled, Ok(1..));
                // A reader that has stopped takes no more blocks.
                if full.send(filled.map(|_| block)).is_err() || is_last {
                    break;
                }
            }
        });
        Self { blocks, emptied, block: Vec::new(), taken: 0 }
    }
}

/// Replaces the content of a block by the next bytes, or by nothing at the end of the source.
fn fill(source: &mut impl Read, block: &mut Vec<u8>) -> io::Result<usize> {
    block.resize(BLOCK, 0);
    let count = loop {
        match source.read(block) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => break other?,
        }
    };
    block.truncate(count);
    Ok(count)
}

impl Read for ReadAhead {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.taken == self.block.len() {
            self.taken = 0;
            // After the last block, the stream is empty.
            let next = self.blocks.recv().unwrap_or_else(|_| Ok(Vec::new()))?;
            // The other thread may have ended, and then it needs no more blocks.
            let _ = self.emptied.send(std::mem::replace(&mut self.block, next));
        }
        let count = (&self.block[self.taken..]).read(buffer)?;
        self.taken += count;
        Ok(count)
    }
}

// WebAssembly has no threads.
#[cfg(all(test, not(target_family = "wasm")))]
mod tests {
    use super::*;
    use std::io::BufReader;

    /// Returns `left` bytes, and then an error.
    struct Broken {
        left: usize,
    }

    impl Read for Broken {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.left.min(buffer.len());
            self.left -= count;
            buffer[..count].fill(b'x');
            if count == 0 { Err(io::ErrorKind::InvalidData.into()) } else { Ok(count) }
        }
    }

    /// Reads on one thread what another thread produces.
    fn read_ahead<T>(source: impl Read + Send, read: impl FnOnce(&mut ReadAhead) -> T) -> T {
        std::thread::scope(|scope| read(&mut ReadAhead::start(scope, source)))
    }

    #[test]
    fn all_arrives_in_order() {
        let sent: Vec<u8> = (0..300_000u32).flat_map(u32::to_le_bytes).collect();
        for most in [1000, 1 << 16, 1 << 20] {
            let mut received = Vec::new();
            let source = BufReader::with_capacity(most, &sent[..]);
            read_ahead(source, |ahead| ahead.read_to_end(&mut received)).unwrap();
            assert!(received == sent, "{most}");
        }
    }

    #[test]
    fn an_error_arrives_behind_what_came_before() {
        let mut received = Vec::new();
        let error =
            read_ahead(Broken { left: 1_234_567 }, |ahead| ahead.read_to_end(&mut received)).unwrap_err();
        assert_eq!((error.kind(), received.len()), (io::ErrorKind::InvalidData, 1_234_567));
    }

    #[test]
    fn a_reader_may_stop_early() {
        let first = read_ahead(io::repeat(7), |ahead| ahead.read(&mut [0; 2 * BLOCK]));
        assert_eq!(first.unwrap(), BLOCK);
    }
}
