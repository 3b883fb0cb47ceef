//! Counts the distinct vertices that runs of faces use.

/// The most numbers that wait to be counted. More are marked in a bit field, and so are those of which the field takes no
/// more memory than they do.
const WAITING: usize = 1 << 20;

/// Counts the distinct numbers of one run after another.
#[derive(Default)]
pub(super) struct Counter {
    waiting: Vec<u32>,
    /// One bit per number if there are many numbers, otherwise empty.
    marked: Vec<u64>,
    count: u64,
}

impl Counter {
    /// Adds a number below `numbers` to the run.
    pub(super) fn add(&mut self, number: u32, numbers: u64) {
        if !self.marked.is_empty() {
            self.mark(number);
            return;
        }
        self.waiting.push(number);
        if self.waiting.len() == WAITING || self.waiting.len() as u64 * 32 >= numbers {
            self.marked.resize(numbers.div_ceil(64) as usize, 0);
            std::mem::take(&mut self.waiting).into_iter().for_each(|number| self.mark(number));
        }
    }

    fn mark(&mut self, number: u32) {
        let (word, bit) = (&mut self.marked[number as usize / 64], 1 << (number % 64));
        self.count += u64::from(*word & bit == 0);
        *word |= bit;
    }

    /// Ends the run, and returns the count of its distinct numbers.
    pub(super) fn end_run(&mut self) -> u64 {
        self.waiting.sort_unstable();
        self.waiting.dedup();
        let count = self.waiting.len() as u64 + self.count;
        self.waiting.clear();
        (self.marked, self.count) = (Vec::new(), 0);
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_are_counted_alike() {
        let mut counter = Counter::default();
        for (numbers, repeats) in [(10u32, 3), (700_000, 3), (5, 1)] {
            (0..repeats).for_each(|_| (0..numbers).for_each(|number| counter.add(number, numbers.into())));
            assert_eq!(counter.end_run(), u64::from(numbers));
        }
    }
}
