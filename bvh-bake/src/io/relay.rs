//! A stream that is made on one thread while another reads it.
//!
//! A few blocks are under way at any time, and go round: one that has been read is filled again.

use std::io::{self, BufRead, Read};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::Scope;

/// Blocks that may wait to be read.
const WAITING: usize = 4;
/// Bytes of a block.
const BLOCK: usize = 1 << 17;

/// Where the stream comes out.
pub(crate) struct Relay {
    blocks: Receiver<io::Result<Vec<u8>>>,
    emptied: Sender<Vec<u8>>,
    block: Vec<u8>,
    taken: usize,
}

impl Relay {
    /// Starts a thread that reads all that `source` gives, its error included. It ends soon after the relay is gone.
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
                // A reader that has stopped takes nothing more.
                if full.send(filled.map(|_| block)).is_err() || is_last {
                    break;
                }
            }
        });
        Self { blocks, emptied, block: Vec::new(), taken: 0 }
    }
}

/// Replaces a block by what comes next: nothing at the end of the source.
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

    /// Reads on one thread what another makes.
    fn relayed<T>(source: impl Read + Send, read: impl FnOnce(&mut Relay) -> T) -> T {
        std::thread::scope(|scope| read(&mut Relay::start(scope, source)))
    }

    #[test]
    fn all_arrives_in_order() {
        let sent: Vec<u8> = (0..300_000u32).flat_map(u32::to_le_bytes).collect();
        for most in [1000, 1 << 16, 1 << 20] {
            let mut received = Vec::new();
            let source = BufReader::with_capacity(most, &sent[..]);
            relayed(source, |relay| relay.read_to_end(&mut received)).unwrap();
            assert!(received == sent, "{most}");
        }
    }

    #[test]
    fn an_error_arrives_behind_what_came_before() {
        let mut received = Vec::new();
        let error =
            relayed(Broken { left: 1_234_567 }, |relay| relay.read_to_end(&mut received)).unwrap_err();
        assert_eq!((error.kind(), received.len()), (io::ErrorKind::InvalidData, 1_234_567));
    }

    #[test]
    fn a_reader_may_stop_early() {
        let first = relayed(io::repeat(7), |relay| relay.fill_buf().map(<[u8]>::len));
        assert_eq!(first.unwrap(), BLOCK);
    }
}
