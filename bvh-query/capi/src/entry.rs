//! The boundary: runs a function in the default state of floating-point arithmetic, catches panics, and keeps the message
//! of the last failure of each thread. Functions of the caller run in the caller's state, which is kept meanwhile.

use crate::input::Plain;
use crate::output::One;
use crate::status::{Failure, Status};
use crate::table::Table;
use bvh_query::floats::{FloatState, with_default_floats};
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// The last message of this thread, which ends with a zero byte.
    static MESSAGE: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// The state of floating-point arithmetic that the caller of the innermost function of this thread is in.
    static CALLER_FLOATS: Cell<FloatState> = const { Cell::new(FloatState::DEFAULT) };
}

/// The state that the caller of this function of the interface computes in, for its own functions to run in.
pub(crate) fn caller_floats() -> FloatState {
    CALLER_FLOATS.get()
}

/// Takes back the state of the caller of an outer function while it is dropped: a callback may call the library.
struct OuterFloats(FloatState);

impl Drop for OuterFloats {
    fn drop(&mut self) {
        CALLER_FLOATS.set(self.0);
    }
}

/// Keeps panics off standard error: their text is in the message that the caller gets. The library has a standard library
/// of its own, so that this is about no other panics than its own.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    // Tests of this crate say by a panic what fails.
    if !cfg!(test) {
        ONCE.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    }
}

/// Runs the body of a function of the interface, in the default state of floating-point arithmetic. Nothing unwinds out of
/// it.
pub(crate) fn entry(body: impl FnOnce() -> Result<(), Failure>) -> i32 {
    with_default_floats(|floats| {
        let _outer = OuterFloats(CALLER_FLOATS.replace(floats));
        caught(body)
    })
}

fn caught(body: impl FnOnce() -> Result<(), Failure>) -> i32 {
    let run = || {
        quiet_panics();
        body()
    };
    // What a panic leaves behind is not used again: a handle that was in use is refused from then on.
    let failure = match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => return Status::Ok as i32,
        Ok(Err(failure)) => failure,
        Err(panic) => Failure::new(Status::Internal, describe(panic)),
    };
    let status = failure.status as i32;
    // Not even a failure to allocate the message may leave.
    let _ = catch_unwind(AssertUnwindSafe(|| keep(failure.message)));
    status
}

/// Describes what a panic was about, and drops what it carried where a panic of that is caught, too.
fn describe(panic: Box<dyn Any + Send>) -> String {
    let text = match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
        (Some(text), _) => (*text).to_owned(),
        (_, Some(text)) => text.clone(),
        _ => "an unknown panic".to_owned(),
    };
    let _ = catch_unwind(AssertUnwindSafe(|| drop(panic)));
    format!("a defect of cbvh, please report it: {text}")
}

fn keep(message: String) {
    // A zero byte would end the message early.
    let mut bytes: Vec<u8> = message.into_bytes().into_iter().filter(|&byte| byte != 0).collect();
    bytes.push(0);
    // Within a thread that is ending there is no message to keep.
    let _ = MESSAGE.try_with(|last| *last.borrow_mut() = bytes);
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_last_message() -> *const c_char {
    let kept = MESSAGE.try_with(|last| {
        let last = last.borrow();
        if last.is_empty() { c"".as_ptr() } else { last.as_ptr().cast() }
    });
    kept.unwrap_or(c"".as_ptr())
}

/// The number of the binary interface, which is part of the name of the shared library: `build.rs` has it, too.
pub const ABI: u32 = 1;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_abi(abi: *mut u32) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe { write("abi", abi, || Ok(ABI)) })
}

/// Writes one value, which is made after its place was checked.
///
/// # Safety
/// As for `One::new`.
pub(crate) unsafe fn write<T: Copy>(
    name: &str,
    to: *mut T,
    make: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let mut out = unsafe { One::new(name, to) }?;
    out.set(make()?);
    Ok(())
}

/// Makes a value, and writes a handle of it, which is 0 until then.
///
/// # Safety
/// As for `One::new`.
pub(crate) unsafe fn hand_out<T: Clone, H: Plain + From<u64>>(
    (name, handle): (&str, *mut H),
    table: &Table<T>,
    make: impl FnOnce() -> Result<T, Failure>,
) -> i32 {
    entry(|| {
        // SAFETY: the caller vouches for it.
        let mut out = unsafe { One::new(name, handle) }?;
        out.set(H::NONE);
        out.set(table.insert(make()?).into());
        Ok(())
    })
}

/// Defines functions about what a handle stands for: `see` looks it up, and within an expression it has the name of the handle.
/// Each entry has a kind, a name, its own arguments, the place of what it finds, unless that is a text, and an expression. `one`
/// writes a value, `list` a list, and `text` a text; `change` makes a change, and drops what the expression returns.
macro_rules! about {
    ($handle:ident: $type:ty, $see:path;
        $($kind:ident $name:ident($($own:tt)*) $(-> $to:ident: $row:ty)? = $found:expr;)*
    ) => { $(
        crate::entry::about_one! { $kind $name ($handle: $type, $see) ($($own)*) ($($to: $row)?) $found }
    )* };
}
macro_rules! about_one {
    (one $name:ident ($handle:ident: $type:ty, $see:path) ($($own:tt)*) ($to:ident: $row:ty) $found:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($handle: $type, $($own)* $to: *mut $row) -> i32 {
            // SAFETY: the header asks for it.
            $see($handle, |$handle| unsafe { crate::entry::write(stringify!($to), $to, || Ok($found)) })
        }
    };
    (list $name:ident ($handle:ident: $type:ty, $see:path) ($($own:tt)*) ($to:ident: $row:ty) $found:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            $handle: $type,
            $($own)*
            $to: *mut $row,
            capacity: usize,
            count: *mut usize,
        ) -> i32 {
            // SAFETY: the header asks for it.
            $see($handle, |$handle| unsafe {
                let mut list = crate::output::List::new(stringify!($to), $to, capacity, count)?;
                list.add($found);
                list.finish()
            })
        }
    };
    (text $name:ident ($handle:ident: $type:ty, $see:path) ($($own:tt)*) () $found:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            $handle: $type,
            $($own)*
            buffer: *mut std::ffi::c_char,
            capacity: usize,
            length: *mut usize,
        ) -> i32 {
            // SAFETY: the header asks for it.
            $see($handle, |$handle| unsafe { crate::output::text($found, buffer, capacity, length) })
        }
    };
    (change $name:ident ($handle:ident: $type:ty, $see:path) ($($own:tt)*) () $found:expr) => {
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($handle: $type, $($own)*) -> i32 {
            $see($handle, |$handle| Ok($found))
        }
    };
}

/// Defines a family of functions. First come the arguments that all of them start with, and the question that is made of
/// these: it has a method `each`. Each entry then defines a function: its name, its own arguments, the type of its answers,
/// and what it passes to `each` after the pointer to the answers.
macro_rules! questions {
    ($common:tt => $asked:expr; $($name:ident $own:tt -> $row:ty: $($how:expr),+;)*) => { $(
        crate::entry::question! { $name $common $own $row, $asked, $($how),+ }
    )* };
}
macro_rules! question {
    ($name:ident ($($common:tt)*) ($($own:tt)*) $row:ty, $asked:expr, $($how:expr),+) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($common)* $($own)* answers: *mut $row) -> i32 {
            // SAFETY: the header asks for it.
            unsafe { $asked.each(answers, $($how),+) }
        }
    };
}
pub(crate) use {about, about_one, question, questions};

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    fn last() -> String {
        // SAFETY: the message ends with a zero byte and stays until the next failure.
        unsafe { CStr::from_ptr(cbvh_last_message()) }.to_string_lossy().into_owned()
    }

    #[test]
    #[allow(clippy::panic, reason = "panics are what is tested")]
    fn panics_become_a_status_and_a_message() {
        assert_eq!(entry(|| panic!("of {}", 7)), Status::Internal as i32);
        assert_eq!(last(), "a defect of cbvh, please report it: of 7");
        assert_eq!(entry(|| std::panic::panic_any(7)), Status::Internal as i32);
        assert!(last().ends_with("an unknown panic"));
        assert_eq!(entry(|| Ok(())), 0);
        assert_eq!(entry(|| Err(Failure::argument("x\0y", "one", 2))), Status::InvalidArgument as i32);
        assert_eq!(last(), "xy: expected one, found 2");
        std::thread::spawn(|| assert_eq!(last(), ""))
            .join()
            .unwrap_or_else(|_| panic!("another thread's message"));
    }
}
