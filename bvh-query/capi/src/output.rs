//! Writes answers into memory of the caller, which may hold no values yet.

use crate::input::check_pointer;
use crate::status::{Failure, Status};
use std::ffi::c_char;
use std::marker::PhantomData;

/// Room for a number of values. It is only ever written, value by value, so that it may overlap with anything.
pub(crate) struct Room<'a, T> {
    start: *mut T,
    count: usize,
    caller: PhantomData<&'a mut T>,
}

impl<T: Copy> Room<'_, T> {
    /// Takes room for `count` values.
    ///
    /// # Safety
    /// If the pointer is aligned and not null, `count` values may be written there during the lifetime, and the caller
    /// does not use the memory meanwhile.
    pub(crate) unsafe fn new(name: &str, start: *mut T, count: usize) -> Result<Self, Failure> {
        check_pointer(name, start, count)?;
        Ok(Self { start, count, caller: PhantomData })
    }

    /// Writes a value. Beyond the room nothing is written.
    pub(crate) fn set(&mut self, index: usize, value: T) {
        if index < self.count {
            // SAFETY: the index is within the room, which may be written.
            unsafe { self.start.add(index).write(value) };
        }
    }

    /// Writes what `row` makes of values, from the first on, up to a failure. Beyond the room nothing is written.
    pub(crate) fn fill<V, E: Into<Failure>>(
        &mut self,
        values: impl IntoIterator<Item = Result<V, E>>,
        row: impl Fn(V) -> T,
    ) -> Result<(), Failure> {
        for (index, value) in values.into_iter().enumerate() {
            self.set(index, row(value.map_err(Into::into)?));
        }
        Ok(())
    }

    /// Writes the first values, all at once. Beyond the room nothing is written.
    fn copy(&mut self, values: &[T]) {
        let count = values.len().min(self.count);
        // SAFETY: that many values are there and fit; the memory may overlap with anything.
        unsafe { std::ptr::copy(values.as_ptr(), self.start, count) };
    }

    fn too_small(&self, name: &str, needed: usize, unit: &str) -> Failure {
        let message = format!("{name}: expected room for {needed} {unit}, found room for {}", self.count);
        Failure::new(Status::BufferTooSmall, message)
    }
}

/// Room for one value.
pub(crate) struct One<'a, T>(Room<'a, T>);

impl<T: Copy> One<'_, T> {
    /// Takes room for a value.
    ///
    /// # Safety
    /// As for `Room::new`.
    pub(crate) unsafe fn new(name: &str, start: *mut T) -> Result<Self, Failure> {
        // SAFETY: the caller vouches for it.
        unsafe { Room::new(name, start, 1) }.map(Self)
    }

    pub(crate) fn set(&mut self, value: T) {
        self.0.set(0, value);
    }
}

/// Room for at most so many values, and for the number of values that there are.
pub(crate) struct List<'a, T> {
    name: &'static str,
    room: Room<'a, T>,
    count: One<'a, usize>,
    written: usize,
}

impl<T: Copy> List<'_, T> {
    /// Takes room for a list. The number is 0 until the list is finished.
    ///
    /// # Safety
    /// As for `Room::new`, for `capacity` values and for one number.
    pub(crate) unsafe fn new(
        name: &'static str,
        start: *mut T,
        capacity: usize,
        count: *mut usize,
    ) -> Result<Self, Failure> {
        // SAFETY: the caller vouches for it.
        let (mut count, room) = unsafe { (One::new("count", count)?, Room::new(name, start, capacity)) };
        count.set(0);
        Ok(Self { name, room: room?, count, written: 0 })
    }

    /// Adds values, of which there are as many as the list says in the end.
    pub(crate) fn add(&mut self, values: impl IntoIterator<Item = impl Into<T>>) {
        for value in values {
            self.room.set(self.written, value.into());
            self.written += 1;
        }
    }

    /// Writes how many values there are, and fails if there was too little room.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        self.count.set(self.written);
        let fits = self.written <= self.room.count;
        if fits { Ok(()) } else { Err(self.room.too_small(self.name, self.written, "elements")) }
    }
}

/// Room for the lists of many questions, one after the other, and for the length of each.
pub(crate) struct Lists<'a, T> {
    list: List<'a, T>,
    counts: Room<'a, usize>,
}

impl<T: Copy> Lists<'_, T> {
    /// Takes room for the lists of `questions`. Nobody may want their lengths: then `counts` is null.
    ///
    /// # Safety
    /// As for `List::new`, and for `Room::new` unless `counts` is null.
    pub(crate) unsafe fn new(
        (name, start, capacity, count): (&'static str, *mut T, usize, *mut usize),
        counts: *mut usize,
        questions: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: the caller vouches for it.
        unsafe {
            let list = List::new(name, start, capacity, count)?;
            let counts = Room::new("counts", counts, if counts.is_null() { 0 } else { questions })?;
            Ok(Self { list, counts })
        }
    }

    /// Returns how many more values there is room for.
    pub(crate) fn room(&self) -> usize {
        self.list.room.count.saturating_sub(self.list.written)
    }

    /// Adds the list of a question, of which there are `count` values and no fewer of them here than fit.
    pub(crate) fn add(&mut self, question: usize, values: Vec<impl Into<T>>, count: usize) {
        self.counts.set(question, count);
        let before = self.list.written;
        self.list.add(values.into_iter().take(self.room()));
        self.list.written = before + count;
    }

    /// Adds the lists of all questions, and finishes.
    pub(crate) fn finish_with<V: Into<T>, E: Into<Failure>>(
        mut self,
        lists: impl IntoIterator<Item = Result<Vec<V>, E>>,
    ) -> Result<(), Failure> {
        for (question, values) in lists.into_iter().enumerate() {
            let values = values.map_err(Into::into)?;
            let count = values.len();
            self.add(question, values, count);
        }
        self.finish()
    }

    /// Writes how many values there are, and fails if there was too little room.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        self.list.finish()
    }
}

/// Writes bytes into a caller's buffer, and how many there are.
///
/// # Safety
/// As for `List::new`.
pub(crate) unsafe fn bytes(
    of: &[u8],
    buffer: *mut u8,
    capacity: usize,
    size: *mut usize,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let (mut size, mut room) = unsafe { (One::new("size", size)?, Room::new("buffer", buffer, capacity)?) };
    size.set(of.len());
    room.copy(of);
    if of.len() <= capacity { Ok(()) } else { Err(room.too_small("buffer", of.len(), "bytes")) }
}

/// Writes text into a caller's buffer: its bytes, and a zero byte that is not counted.
///
/// # Safety
/// As for `List::new`.
pub(crate) unsafe fn text(
    of: &str,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let (mut count, mut room) =
        unsafe { (One::new("length", length)?, Room::new("buffer", buffer.cast::<u8>(), capacity)?) };
    count.set(of.len());
    // What does not fit is cut between characters, so that text ends in the buffer whatever its size.
    let most = of.len().min(capacity.saturating_sub(1));
    let fits = (0..=most).rev().find(|&end| of.is_char_boundary(end)).unwrap_or(0);
    room.copy(&of.as_bytes()[..fits]);
    room.set(fits, 0);
    if of.len() < capacity { Ok(()) } else { Err(room.too_small("buffer", of.len() + 1, "bytes")) }
}
