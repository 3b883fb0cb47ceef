//! A stream that is made on one thread while another reads it.
//!
//! A few blocks are under way at any time, and go round: one that has been read is filled again.

use std::io::{self, BufRead, Read};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread;

/// Blocks that may wait to be read.
const WAITING: usize = 4;

/// Calls `read` with all that `source` gives, its error included.
pub(super) fn beside<T>(mut source: impl BufRead + Send, read: impl FnOnce(&mut Relay) -> T) -> T {
    let (full, blocks) = sync_channel(WAITING);
    let (emptied, spare) = channel::<Vec<u8>>();
    thread::scope(|scope| {
        scope.spawn(move || {
            loop {
                let mut block = spare.try_recv().unwrap_or_default();
                let filled = fill(&mut source, &mut block);
                let is_last = !matches!(filled, Ok(1..));
                // A reader that has stopped takes nothing more.
                if full.send(filled.map(|_| block)).is_err() || is_last {
                    break;
                }
            }
        });
        read(&mut Relay { blocks, emptied, block: Vec::new(), taken: 0 })
    })
}

/// Replaces a block by what the source has ready: nothing at its end.
fn fill(source: &mut impl BufRead, block: &mut Vec<u8>) -> io::Result<usize> {
    block.clear();
    let ready = source.fill_buf()?;
    block.extend_from_slice(ready);
    source.consume(block.len());
    Ok(block.len())
}

/// Where the stream comes out.
pub(super) struct Relay {
    blocks: Receiver<io::Result<Vec<u8>>>,
    emptied: Sender<Vec<u8>>,
    block: Vec<u8>,
    taken: usize,
}

impl Read for Relay {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Relay {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.block.len() {
            self.taken = 0;
            // Behind the last block there is nothing.
            let next = self.blocks.recv().unwrap_or_else(|_| Ok(Vec::new()))?;
            // The other thread may have ended, and needs no more.
            let _ = self.emptied.send(std::mem::replace(&mut self.block, next));
        }
        Ok(&self.block[self.taken..])
    }

    fn consume(&mut self, count: usize) {
        self.taken = (self.taken + count).min(self.block.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

    /// Gives `left` bytes, and then an error.
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

    #[test]
    fn all_arrives_in_order() {
        let sent: Vec<u8> = (0..100_000u32).flat_map(u32::to_le_bytes).collect();
        for block in [1000, 1 << 16, 1 << 20] {
            let mut received = Vec::new();
            beside(BufReader::with_capacity(block, &sent[..]), |relay| relay.read_to_end(&mut received))
                .unwrap();
            assert!(received == sent, "{block}");
        }
    }

    #[test]
    fn an_error_arrives_behind_what_came_before() {
        let mut received = Vec::new();
        let source = BufReader::with_capacity(100, Broken { left: 12_345 });
        let error = beside(source, |relay| relay.read_to_end(&mut received)).unwrap_err();
        assert_eq!((error.kind(), received.len()), (io::ErrorKind::InvalidData, 12_345));
    }

    #[test]
    fn a_reader_may_stop_early() {
        let first =
            beside(BufReader::with_capacity(10, io::repeat(7)), |relay| relay.fill_buf().map(<[u8]>::len));
        assert_eq!(first.unwrap(), 10);
    }
}
