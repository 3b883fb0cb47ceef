//! A share of many assets, for one of several machines.

/// Every `count`-th asset, starting with number `index`, which is from 1 to `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) index: u64,
    pub(crate) count: u64,
}

impl Shard {
    /// Returns whether the asset with this number, counted from 0, belongs to the shard.
    pub(crate) fn has(self, number: u64) -> bool {
        number % self.count == self.index - 1
    }

    /// Parses `I/N`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(index, count)| {
            let shard = Self { index: index.parse().ok()?, count: count.parse().ok()? };
            (1..=shard.count).contains(&shard.index).then_some(shard)
        });
        parsed.ok_or_else(|| "expected I/N with I from 1 to N, such as 1/4".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_numbered_from_one() {
        assert_eq!(Shard::parse("3/16"), Ok(Shard { index: 3, count: 16 }));
        for wrong in ["", "1", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", "1/99999999999999999999"] {
            assert!(Shard::parse(wrong).is_err(), "{wrong}");
        }
        let of = |index| (0..10).filter(move |&number| Shard { index, count: 3 }.has(number));
        assert_eq!(of(1).collect::<Vec<_>>(), [0, 3, 6, 9]);
        assert_eq!((1..=3).map(|index| of(index).count()).sum::<usize>(), 10);
    }
}
