//! Reads arguments: pointers, lengths, text, numbers and structures with a size.

use crate::status::{Failure, Status};
use std::ffi::{CStr, c_char};
use std::path::PathBuf;
use std::ptr;

/// Types of C that may have any bytes, as all numbers may.
///
/// # Safety
/// Every pattern of bytes is a valid value of the type.
pub(crate) unsafe trait Plain: Copy {
    /// What stands where there is no value: NaN or 0.
    const NONE: Self;
}

macro_rules! plain {
    ($($type:ty: $none:expr),*) => { $(
        // SAFETY: all patterns of bytes are numbers, and pointers are numbers until they are followed.
        unsafe impl Plain for $type {
            const NONE: Self = $none;
        }
    )* };
}
plain!(u8: 0, u32: 0, i32: 0, u64: 0, usize: 0, f64: f64::NAN, *const c_char: ptr::null());
plain!(*const *const c_char: ptr::null());

// SAFETY: there are no bytes between the elements.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {
    const NONE: Self = [T::NONE; N];
}

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

/// Reads an array into memory that is used again and again, and makes something of each element.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn each<'a, T: Plain, R>(
    name: &str,
    pointer: *const T,
    count: usize,
    into: &'a mut Vec<R>,
    make: impl Fn(&T) -> Result<R, Failure>,
) -> Result<&'a [R], Failure> {
    // SAFETY: the caller vouches for it.
    let values = unsafe { array(name, pointer, count) }?;
    into.clear();
    reserve(name, count, into)?;
    for (number, value) in values.iter().enumerate() {
        into.push(make(value).map_err(|failure| failure.at(format_args!("{name}[{number}]")))?);
    }
    Ok(into)
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

/// The most bytes that options may have in any version. A size beyond it is a mistake, such as that of options never set.
const MAX_OPTIONS_BYTES: usize = 4096;

/// Reads options, a structure that starts with its size, so that later versions may have more fields at the end. Fields that
/// an older program does not have are 0, as all fields are where there are no options. A newer program may set none of the
/// fields that this version does not have.
///
/// # Safety
/// The first field of `T` is a `usize`. If the pointer is aligned and not null, as many bytes are there as it says.
pub(crate) unsafe fn options<T: Plain>(name: &str, pointer: *const T) -> Result<T, Failure> {
    // SAFETY: any bytes are a value.
    let mut options = unsafe { std::mem::zeroed::<T>() };
    if pointer.is_null() {
        return Ok(options);
    }
    check_pointer(name, pointer, 1)?;
    // SAFETY: the first field is a size, which every version of the structure has.
    let found = unsafe { pointer.cast::<usize>().read() };
    let known = size_of::<T>();
    // Every version has a field beside its size, and its size is a multiple of the alignment.
    let least = size_of::<usize>() + align_of::<T>();
    if !(least..=MAX_OPTIONS_BYTES).contains(&found) || found % align_of::<T>() != 0 {
        let expected = format!("{known}, the size of the structure, or what it is in another version");
        return Err(Failure::argument(format_args!("{name}.size"), expected, found));
    }
    // SAFETY: so many bytes are there, and any bytes are values of `u8`.
    let given = unsafe { std::slice::from_raw_parts(pointer.cast::<u8>(), found) };
    let shared = found.min(known);
    if let Some((byte, value)) = given.iter().enumerate().skip(shared).find(|(_, value)| **value != 0) {
        let expected =
            format!("0 in all bytes from {known} on, which only newer versions of the library know");
        return Err(Failure::argument(name, expected, format_args!("{value} in byte {byte}")));
    }
    // SAFETY: both have so many bytes, they do not overlap, and any bytes are a value of `T`.
    unsafe { ptr::copy_nonoverlapping(given.as_ptr(), ptr::from_mut(&mut options).cast(), shared) };
    Ok(options)
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

/// Reads an array of pointers, and what each of them leads to, by `read`.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn pointers<R>(
    name: &str,
    pointers: *const *const c_char,
    count: usize,
    read: impl Fn(&str, *const c_char) -> Result<R, Failure>,
) -> Result<Vec<R>, Failure> {
    // SAFETY: the caller vouches for it.
    let addresses = unsafe { array(name, pointers, count) }?;
    let read = |(number, of): (usize, &*const c_char)| read(&format!("{name}[{number}]"), *of);
    addresses.iter().enumerate().map(read).collect()
}

/// Reads something that a pointer leads to, by `read`, or nothing from a null pointer.
pub(crate) fn optional<T, R>(
    pointer: *const T,
    read: impl FnOnce(*const T) -> Result<R, Failure>,
) -> Result<Option<R>, Failure> {
    if pointer.is_null() { Ok(None) } else { read(pointer).map(Some) }
}

/// Reads a choice of no and yes.
pub(crate) fn flag(name: &str, value: i32) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Failure::argument(name, "0 or 1", value)),
    }
}

/// Makes room for as many more elements, or fails where memory runs out.
pub(crate) fn reserve<T>(name: &str, more: usize, of: &mut Vec<T>) -> Result<(), Failure> {
    of.try_reserve(more).map_err(|_| {
        let bytes = more.saturating_mul(size_of::<T>());
        Failure::new(Status::Limit, format!("{name}: expected {bytes} bytes of memory, found less"))
    })
}
