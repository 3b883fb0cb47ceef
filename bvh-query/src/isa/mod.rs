//! Defines the vector operations that kernels are written in, and chooses a backend at run time.
//!
//! The token of a backend has size zero and can be created only on a CPU with the backend's features. Kernels are
//! generic over the token and `#[inline(always)]`. They are inlined into tasks, each of which is a separate function
//! with the features of the backend enabled. A walk consists of a few tasks: in a single function of 64 KB, compilers
//! allocate registers badly. A register has 16 lanes (`V`: four children of A against four of B), 4 lanes (`H`: four
//! children or triangles of one side), or 3 or 4 numbers in `f64` (`C`: the corners of a triangle, or four triangles).
//!
//! Decoding gives the same bits on every backend, because it uses exact products only, and so do operations on corners,
//! which are not fused. Other operations may round differently (`mul_add` is fused where the CPU supports it), so their
//! results are used only in filters with derived error bounds.

/// Computes with registers by intrinsics, given a proof that the target or the CPU has their features: a value of a type that
/// implements the `Proof` of the file. The intrinsics in `$body` access no memory; those that do are in `loads!` and `stores!`.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! with_features {
    ($proof:expr, $body:expr) => {{
        #[inline(always)]
        fn given(_: impl Proof) {}
        given($proof);
        // SAFETY: there is a proof of the features that these intrinsics need, and they need nothing else.
        unsafe { $body }
    }};
}

/// Defines functions that load a register from an array of exactly its size, by an intrinsic that needs no alignment.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! loads {
    ($($name:ident($array:ty) -> $register:ty = $intrinsic:ident;)+) => {
        $(#[inline(always)]
        fn $name(_proof: impl Proof, from: &$array) -> $register {
            const { assert!(size_of::<$array>() == size_of::<$register>()) };
            // SAFETY: there is a proof of the feature that the intrinsic needs. It reads as many bytes as a register has, which
            // are those of the array.
            unsafe { $intrinsic(std::ptr::from_ref(from).cast()) }
        })+
    };
}

/// Defines functions that store a register to an array of exactly its size, by an intrinsic that needs no alignment.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! stores {
    ($($name:ident($register:ty) -> $array:ty = $intrinsic:ident;)+) => {
        $(#[inline(always)]
        fn $name(_proof: impl Proof, value: $register, to: &mut $array) {
            const { assert!(size_of::<$array>() == size_of::<$register>()) };
            // SAFETY: there is a proof of the feature that the intrinsic needs. It writes as many bytes as a register has, to
            // those of the array, where any bytes are numbers.
            unsafe { $intrinsic(std::ptr::from_mut(to).cast(), value) }
        })+
    };
}

/// Returns the halves of an array.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn halves<T, const N: usize>(from: &[T]) -> [&[T; N]; 2] {
    let (halves, []) = from.as_chunks() else { unreachable!("two halves") };
    [&halves[0], &halves[1]]
}

/// Defines methods of `Lanes` by an intrinsic each, for lanes in one register, `(0)`, or in two, `(0, 1)`.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! by_intrinsics {
    ($registers:tt $($name:ident($($other:ident),*) $intrinsic:ident;)+) => {
        $(by_intrinsics!(@ $registers $name($($other),*) $intrinsic);)+
    };
    (@ (0) $name:ident($($other:ident),*) $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, $($other: Self),*) -> Self {
            Self(with_features!(self, $intrinsic(self.0, $($other.0),*)))
        }
    };
    (@ (0, 1) $name:ident($($other:ident),*) $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, $($other: Self),*) -> Self {
            with_features!(self, Self($intrinsic(self.0, $($other.0),*), $intrinsic(self.1, $($other.1),*)))
        }
    };
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "vector intrinsics; each file says why its use is sound")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "vector intrinsics; each file says why its use is sound")]
pub(crate) mod avx512;
#[allow(unsafe_code, reason = "asks the CPU")]
pub(crate) mod cache;
pub(crate) mod corners;
pub(crate) mod doubles;
#[allow(unsafe_code, reason = "registers of the CPU; each block says why it is sound")]
pub mod floats;
#[cfg(target_arch = "aarch64")]
#[allow(unsafe_code, reason = "loads, stores and two instructions; each says why it is sound")]
mod neon;
#[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
mod quads;
pub(crate) mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
#[allow(unsafe_code, reason = "loads and stores; each says why it is sound")]
mod simd128;

use bvh_format::slabs::Group;
use corners::Corners;
use doubles::Doubles;
use std::fmt;
use std::sync::OnceLock;

/// A register of `f32` lanes.
pub(crate) trait Lanes: Copy {
    /// A truth value per lane.
    type Mask: Copy;

    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self * factor + term`, rounded once or twice.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term - self * factor`, rounded once or twice.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// Returns the smaller operand of each lane; the second operand if either is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns the larger operand of each lane; the second operand if either is NaN.
    fn max(self, other: Self) -> Self;
    /// Returns the larger operand of each lane; either operand if either is NaN. Backends where `max` takes
    /// longer override it.
    #[inline(always)]
    fn max_of_numbers(self, other: Self) -> Self {
        self.max(other)
    }
    /// `self <= other`, false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self < other`, false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Returns `yes` in lanes where the mask is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Returns the mask as bits; bit i is lane i.
    fn bits(mask: Self::Mask) -> u16;
}

/// The rows of a group that one call of `pick` picks from. Places 0 to 3 of a part are the lower ends of four slabs,
/// places 4 to 7 the upper ends of the same slabs. If the part has four more slabs, their places are 8 higher.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// Rows 0 to 3.
    Axes,
    /// Rows 3 to 6.
    Cube,
    /// Rows 8 to 15.
    Faces,
}

/// Returns four rows of a group, which start at the first four places, and the opposite ends of the same slabs.
#[inline(always)]
fn rows_at<'a>(group: &'a Group, [a, b, c, d, ..]: &[u32; 16]) -> [[&'a [f32; 4]; 4]; 2] {
    let numbers = group.rows().as_flattened();
    let row = |start: u32| numbers[(start & 124) as usize..].first_chunk().unwrap_or(&[0.0; 4]);
    // Not by `map`, which is not always compiled in place.
    [[row(*a), row(*b), row(*c), row(*d)], [row(a ^ 64), row(b ^ 64), row(c ^ 64), row(d ^ 64)]]
}

/// Returns an integer that is smaller for smaller numbers; none is NaN.
#[inline(always)]
pub(crate) fn in_order(number: f32) -> i32 {
    let bits = number.to_bits() as i32;
    bits ^ (bits >> 31 & i32::MAX)
}

/// The token of a backend, and the operations that its CPU features allow.
pub(crate) trait Isa: Copy {
    /// A register of sixteen lanes.
    type F32x16: Lanes;
    /// A register of four lanes.
    type F32x4: Lanes;
    /// A register of `f64` for three corners.
    type F64x3: Corners;
    /// A register of `f64` for four triangles.
    type F64x4: Doubles;
    /// The rows of a group, in the form that `pick` reads.
    type Rows<'a>: Copy;

    fn corners(self, from: [f64; 3]) -> Self::F64x3;
    /// Four `f32` as `f64`.
    fn widen(self, from: &[f32; 4]) -> Self::F64x4;
    fn splat_wide(self, value: f64) -> Self::F64x4;

    fn splat(self, value: f32) -> Self::F32x16;
    fn load(self, from: &[f32; 16]) -> Self::F32x16;
    fn store(self, value: Self::F32x16, to: &mut [f32; 16]);
    /// The first eight lanes are `low`, the others `high`.
    fn halves(self, low: &[f32; 8], high: &[f32; 8]) -> Self::F32x16;
    /// The last eight lanes, followed by the first eight.
    fn swap_halves(self, value: Self::F32x16) -> Self::F32x16;
    /// Lane `4 * i + j` is `from[i]`.
    fn repeat(self, from: &[f32; 4]) -> Self::F32x16;
    /// Lane `4 * i + j` is `from[j]`.
    fn tile(self, from: &[f32; 4]) -> Self::F32x16;
    /// Lane `4 * i + j` is `from[i][j]`.
    fn quads(self, from: [&[f32; 4]; 4]) -> Self::F32x16;
    /// Lane `4 * i + j` is lane `4 * i + column`.
    fn quad_splat(self, value: Self::F32x16, column: usize) -> Self::F32x16;
    /// Prepares a group for `pick`.
    fn rows<'a>(self, group: &'a Group) -> Self::Rows<'a>;
    /// Prepares four calls of `pick`, for four of 16 rows each. The lowest five bits of a word are the row, 16 more for upper
    /// ends; the next four are its place in its part.
    ///
    /// By default, `pick` loads rows: the first four elements are where they start among the 128 numbers of a group.
    #[inline(always)]
    fn places(self, rows: &[u32; 16], to: &mut [[u32; 16]; 4]) {
        for (rows, to) in rows.as_chunks::<4>().0.iter().zip(to) {
            for (row, start) in rows.iter().zip(to) {
                *start = 4 * (row & 31);
            }
        }
    }
    /// Returns four rows of a group, all of one part, and the opposite ends of the same slabs.
    fn pick(self, rows: &Self::Rows<'_>, part: Part, places: &[u32; 16]) -> (Self::F32x16, Self::F32x16);

    /// Applies `bvh_format::quantize::round_step_up` to each lane.
    fn round_step_up(self, step: Self::F32x16) -> Self::F32x16;

    /// Reads 16 codes of one byte each.
    fn codes_u8(self, from: &[u8; 16]) -> Self::F32x16;
    /// Reads the low nibbles of 16 bytes.
    fn codes_low(self, from: &[u8; 16]) -> Self::F32x16;
    /// Reads the high nibbles of 16 bytes.
    fn codes_high(self, from: &[u8; 16]) -> Self::F32x16;
    /// Reads the codes for which the low nibbles of 16 bytes of a short treelet stand.
    fn short_codes_low(self, from: &[u8; 16]) -> Self::F32x16;
    /// Reads the codes for which the high nibbles of 16 bytes of a short treelet stand.
    fn short_codes_high(self, from: &[u8; 16]) -> Self::F32x16;
    /// Reads 16 little-endian `f16`.
    fn codes_f16(self, from: &[u8; 32]) -> Self::F32x16;
    /// Reads 16 little-endian `f32`.
    fn codes_f32(self, from: &[u8; 64]) -> Self::F32x16;

    /// The offsets for which the integers of a packed leaf block stand: divided by this number, or as the bits of ordered
    /// `f32`.
    fn coordinates(self, integers: &[i32; 16], divisor: Option<f64>) -> Self::F32x16;
    /// Lane i is lane `places[i]`, modulo 16, of `value`.
    fn permute(self, value: Self::F32x16, places: &[u8; 16]) -> Self::F32x16;

    fn splat4(self, value: f32) -> Self::F32x4;
    fn load4(self, from: &[f32; 4]) -> Self::F32x4;
    fn store4(self, value: Self::F32x4, to: &mut [f32; 4]);

    /// The lane of the least of the elements whose bits are set, none of which is NaN; of equal ones, the first. Without any
    /// bit set, no lane: 16 or more.
    #[inline(always)]
    fn least(self, of: &[f32; 16], mask: u16) -> u32 {
        let (mut mask, mut least) = (mask, mask.trailing_zeros());
        while mask != 0 {
            let lane = mask.trailing_zeros();
            mask &= mask - 1;
            if of[lane as usize & 15] < of[least as usize & 15] {
                least = lane;
            }
        }
        least
    }

    /// The least of the keys of the elements whose bits are set: `in_order`, with the number of the lane in the lowest four
    /// bits. None of them is NaN.
    #[inline(always)]
    fn nearest(self, of: &[f32; 16], mask: u16) -> i32 {
        let (mut mask, mut least) = (mask, i32::MAX);
        while mask != 0 {
            let lane = mask.trailing_zeros();
            mask &= mask - 1;
            least = least.min(in_order(of[lane as usize & 15]) & !15 | lane as i32);
        }
        least
    }

    /// Prefetches the cache line of a byte that will soon be read.
    fn prefetch_line(self, byte: &u8);

    /// Prefetches the first `LINES` cache lines of bytes that will soon be read. Where there are fewer, the last one is
    /// prefetched again, which takes less time than a branch that nothing can predict.
    #[inline(always)]
    fn prefetch<const LINES: usize>(self, bytes: &[u8]) {
        let Some(last) = bytes.len().checked_sub(1) else { return };
        for line in 0..LINES {
            self.prefetch_line(&bytes[(64 * line).min(last)]);
        }
    }

    /// Runs a task with the features of the backend enabled.
    fn run<T: Task>(self, task: T) -> T::Output;
}

/// Work that is compiled once per backend. `run` and all generic functions that it calls must be
/// `#[inline(always)]`.
pub(crate) trait Task {
    type Output;
    fn run<I: Isa>(self, isa: I) -> Self::Output;
}

/// A vector backend.
///
/// ```
/// use bvh_query::{Backend, Querier};
///
/// let available = Backend::ALL.into_iter().filter(|backend| backend.is_available());
/// for backend in available {
///     println!("{backend}"); // scalar, avx2
///     assert_eq!(Querier::with_backend(backend).backend(), backend);
/// }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Backend {
    /// Portable code. On `wasm32-unknown-unknown` with SIMD128, this runs SIMD128 instead: no user chooses a backend there, and a
    /// page would have to load the code of both.
    Scalar,
    /// AVX2, FMA, F16C, BMI1, BMI2, LZCNT and POPCNT.
    Avx2,
    /// AVX-512 F, VL, DQ and BW, and everything that [`Backend::Avx2`] requires.
    Avx512,
    /// NEON, which every CPU of AArch64 has.
    Neon,
    /// SIMD128 of WebAssembly, if the library was compiled with it.
    Simd128,
}

impl Backend {
    /// All backends: of those that a CPU may have, the slowest first.
    pub const ALL: [Self; 5] = [Self::Scalar, Self::Avx2, Self::Avx512, Self::Neon, Self::Simd128];

    /// Returns the fastest backend of this CPU, or the one that the environment variable `CBVH_ISA` names. This is decided
    /// once per process.
    ///
    /// # Errors
    /// [`BackendError`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn detect() -> Result<Self, BackendError> {
        static CHOICE: OnceLock<Result<Backend, BackendError>> = OnceLock::new();
        let choose = || match std::env::var("CBVH_ISA") {
            Ok(name) if !name.is_empty() && name != "auto" => Self::from_name(&name),
            _ => Ok(Self::ALL.into_iter().rev().find(|b| b.is_available()).unwrap_or(Self::Scalar)),
        };
        CHOICE.get_or_init(choose).clone()
    }

    /// Returns the backend called `scalar`, `avx2`, `avx512`, `neon` or `simd128`, if the CPU has it.
    ///
    /// # Errors
    /// [`BackendError`] if there is no backend of this name, or if the CPU lacks its features.
    pub fn from_name(name: &str) -> Result<Self, BackendError> {
        let backend = Self::ALL.into_iter().find(|backend| backend.name() == name);
        let backend = backend.ok_or_else(|| BackendError::Unknown(name.to_owned()))?;
        if backend.is_available() { Ok(backend) } else { Err(BackendError::Missing(backend)) }
    }

    /// Returns the name on the command line and in `CBVH_ISA`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
            Self::Simd128 => "simd128",
        }
    }

    /// Returns whether this CPU can run the backend.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::Avx2::detect().is_some(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::Avx512::detect().is_some(),
            // What the target has, no CPU lacks.
            Self::Neon => cfg!(target_arch = "aarch64"),
            Self::Simd128 => cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// Runs a task on this backend, or on the scalar one if the CPU lacks the features.
    pub(crate) fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                if let Some(isa) = avx512::Avx512::detect() {
                    return isa.run(task);
                }
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                if let Some(isa) = avx2::Avx2::detect() {
                    return isa.run(task);
                }
            }
            #[cfg(target_arch = "aarch64")]
            Self::Neon => return quads::Quads::<neon::Neon>::NEW.run(task),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            _ if self == Self::Simd128 || cfg!(target_os = "unknown") => {
                return quads::Quads::<simd128::Simd128>::NEW.run(task);
            }
            _ => {}
        }
        scalar::Scalar.run(task)
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a backend is not available.
///
/// ```
/// use bvh_query::{Backend, BackendError};
///
/// assert_eq!(Backend::from_name("sse9"), Err(BackendError::Unknown("sse9".to_owned())));
/// for backend in Backend::ALL.into_iter().filter(|backend| !backend.is_available()) {
///     assert_eq!(Backend::from_name(backend.name()), Err(BackendError::Missing(backend)));
/// }
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// No backend has this name.
    #[error("expected a backend scalar, avx2, avx512, neon or simd128, found {0:?}")]
    Unknown(String),
    /// The CPU lacks its features.
    #[error(
        "this CPU lacks the instructions of the backend {0}; choose scalar, or leave the choice to the program"
    )]
    Missing(Backend),
}

#[cfg(test)]
mod tests;
