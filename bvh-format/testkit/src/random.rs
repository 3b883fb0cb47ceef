//! Generates random numbers that are the same everywhere, by Marsaglia's xorshift64*.

/// A generator of random numbers.
pub struct Random(u64);

impl Random {
    /// Starts the sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Returns an integer from 0 to `count` - 1.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// Returns a number from 0 up to but not including 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number from -1 to 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Returns a point with coordinates from -1 to 1.
    pub fn point(&mut self) -> [f64; 3] {
        [(); 3].map(|()| self.signed())
    }

    /// Returns a unit quaternion (x, y, z, w), up to rounding.
    pub fn quaternion(&mut self) -> [f64; 4] {
        loop {
            let q = [(); 4].map(|()| self.signed());
            let squared: f64 = q.iter().map(|x| x * x).sum();
            if (0.1..1.0).contains(&squared) {
                return q.map(|x| x / squared.sqrt());
            }
        }
    }
}
