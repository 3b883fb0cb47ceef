//! Reads arguments: pointers, lengths, text, numbers and structures with a size.

use crate::status::{Failure, Status};
use std::ffi::{CStr, c_char};
use std::path::PathBuf;

/// Structures of C that may have any bytes, as all numbers may.
///
/// # Safety
/// Every pattern of bytes is a valid value of the type.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: all patterns of bytes are numbers.
unsafe impl Plain for u8 {}
// SAFETY: as above.
unsafe impl Plain for u32 {}
// SAFETY: as above.
unsafe impl Plain for u64 {}
// SAFETY: as above.
unsafe impl Plain for f64 {}
// SAFETY: as above.
unsafe impl Plain for [f64; 3] {}
// SAFETY: as above.
unsafe impl Plain for [u32; 3] {}

/// Refuses a pointer that `count` values of `T` cannot be at. No values may be anywhere.
pub(crate) fn check_pointer<T>(name: &str, pointer: *const T, count: usize) -> Result<(), Failure> {
    if count == 0 {
        return Ok(());
    }
    if pointer.is_null() {
        return Err(Failure::argument(name, "a pointer", "NULL"));
    }
    if !pointer.is_aligned() {
        let expected = format!("an address that is a multiple of {}", align_of::<T>());
        return Err(Failure::argument(name, expected, format_args!("{pointer:?}")));
    }
    // No object in memory is larger, so that a length beyond this is a mistake.
    let most = isize::MAX as usize / size_of::<T>().max(1);
    if count > most {
        return Err(Failure::argument(name, format_args!("at most {most} elements"), count));
    }
    Ok(())
}

/// Reads an array.
///
/// # Safety
/// If the pointer is aligned and not null, `count` values are there and do not change during `'a`.
pub(crate) unsafe fn array<'a, T: Plain>(
    name: &str,
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], Failure> {
    check_pointer(name, pointer, count)?;
    if count == 0 {
        return Ok(&[]);
    }
    // SAFETY: the pointer is aligned, not null, and the caller vouches for what is there; any bytes are values.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Reads one value.
///
/// # Safety
/// If the pointer is aligned and not null, a value is there.
pub(crate) unsafe fn value<T: Plain>(name: &str, pointer: *const T) -> Result<T, Failure> {
    check_pointer(name, pointer, 1)?;
    // SAFETY: the pointer is aligned and not null; any bytes are a value.
    Ok(unsafe { pointer.read() })
}

/// Structures that start with their size, so that later versions may have more fields.
///
/// # Safety
/// As for `Plain`, and the first field is a `usize`.
pub(crate) unsafe trait Options: Plain {
    /// What a null pointer stands for.
    const DEFAULT: Self;
}

/// Reads options, which are the defaults where there are none.
///
/// # Safety
/// If the pointer is aligned and not null, as many bytes are there as its first field says.
pub(crate) unsafe fn options<T: Options>(name: &str, pointer: *const T) -> Result<T, Failure> {
    if pointer.is_null() {
        return Ok(T::DEFAULT);
    }
    check_pointer(name, pointer, 1)?;
    // SAFETY: the first field is a size, which every version of the structure has.
    let found = unsafe { pointer.cast::<usize>().read() };
    let expected = size_of::<T>();
    if found != expected {
        let expected =
            format!("{expected}, the size of the structure that this version of the library knows");
        return Err(Failure::argument(format_args!("{name}.size"), expected, found));
    }
    // SAFETY: all bytes of the structure are there, and any bytes are a value.
    Ok(unsafe { pointer.read() })
}

/// Reads text that ends with a zero byte.
///
/// # Safety
/// If the pointer is not null, a zero byte follows, and nothing up to it changes during `'a`.
pub(crate) unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, Failure> {
    check_pointer(name, pointer, 1)?;
    // SAFETY: the pointer is not null, and a zero byte follows.
    let bytes = unsafe { CStr::from_ptr(pointer) };
    bytes.to_str().map_err(|error| {
        Failure::argument(name, "text in UTF-8", format_args!("other bytes after {}", error.valid_up_to()))
    })
}

/// Reads text, or nothing from a null pointer.
///
/// # Safety
/// As for `text`.
pub(crate) unsafe fn optional_text<'a>(
    name: &str,
    pointer: *const c_char,
) -> Result<Option<&'a str>, Failure> {
    // SAFETY: the caller vouches for it.
    if pointer.is_null() { Ok(None) } else { unsafe { text(name, pointer) }.map(Some) }
}

/// Reads the path of a file: any bytes where the system has such paths, else UTF-8.
///
/// # Safety
/// As for `text`.
pub(crate) unsafe fn path(name: &str, pointer: *const c_char) -> Result<PathBuf, Failure> {
    check_pointer(name, pointer, 1)?;
    #[cfg(unix)]
    {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        // SAFETY: the pointer is not null, and a zero byte follows.
        let bytes = unsafe { CStr::from_ptr(pointer) };
        Ok(OsStr::from_bytes(bytes.to_bytes()).into())
    }
    #[cfg(not(unix))]
    {
        // SAFETY: the caller vouches for it.
        unsafe { text(name, pointer) }.map(PathBuf::from)
    }
}

/// Reads a choice of no and yes.
pub(crate) fn flag(name: &str, value: i32) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Failure::argument(name, "0 or 1", value)),
    }
}

/// Reads three numbers.
///
/// # Safety
/// As for `array`, of three numbers.
pub(crate) unsafe fn triple(name: &str, pointer: *const f64) -> Result<[f64; 3], Failure> {
    // SAFETY: the caller vouches for it.
    let found = unsafe { array(name, pointer, 3) }?;
    Ok([found[0], found[1], found[2]])
}

/// Makes room for as many more elements, or fails where memory runs out.
pub(crate) fn reserve<T>(name: &str, more: usize, of: &mut Vec<T>) -> Result<(), Failure> {
    of.try_reserve(more).map_err(|_| {
        let bytes = more.saturating_mul(size_of::<T>());
        Failure::new(Status::Limit, format!("{name}: expected {bytes} bytes of memory, found less"))
    })
}

/// Reads points, of which something is asked within a distance, into memory that is used again and again.
///
/// # Safety
/// As for `rows_of_three`.
pub(crate) unsafe fn points_within(
    points: *const f64,
    count: usize,
    within: f64,
    into: &mut Vec<[f64; 3]>,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    unsafe { rows_of_three("points", points, count, into) }?;
    // Up to infinity.
    if within >= 0.0 { Ok(()) } else { Err(Failure::argument("within", "a distance of at least 0", within)) }
}

/// Reads rows of three values each into memory that is used again and again.
///
/// # Safety
/// As for `array`, of three times as many values.
pub(crate) unsafe fn rows_of_three<T: Plain>(
    name: &str,
    pointer: *const T,
    count: usize,
    into: &mut Vec<[T; 3]>,
) -> Result<(), Failure>
where
    [T; 3]: Plain,
{
    // SAFETY: the caller vouches for it; three values in an array are aligned as one is.
    let rows = unsafe { array(name, pointer.cast::<[T; 3]>(), count) }?;
    into.clear();
    reserve(name, count, into)?;
    into.extend_from_slice(rows);
    Ok(())
}
