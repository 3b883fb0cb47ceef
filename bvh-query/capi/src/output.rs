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

    /// Writes the first values. Beyond the room nothing is written.
    pub(crate) fn fill(&self, values: &[T]) {
        let count = values.len().min(self.count);
        // SAFETY: that many values are there and fit; the memory may overlap with anything.
        unsafe { std::ptr::copy(values.as_ptr(), self.start, count) };
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

    pub(crate) fn push(&mut self, value: T) {
        self.room.set(self.written, value);
        self.written += 1;
    }

    /// Writes how many values there are, and fails if there was too little room.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        self.count.set(self.written);
        if self.written <= self.room.count {
            return Ok(());
        }
        let (name, written, count) = (self.name, self.written, self.room.count);
        let message = format!("{name}: expected room for {written} elements, found room for {count}");
        Err(Failure::new(Status::BufferTooSmall, message))
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
    pub(crate) fn add(&mut self, question: usize, values: impl IntoIterator<Item = T>, count: usize) {
        self.counts.set(question, count);
        let before = self.list.written;
        values.into_iter().take(self.room()).for_each(|value| self.list.push(value));
        self.list.written = before + count;
    }

    /// Writes how many values there are, and fails if there was too little room.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        self.list.finish()
    }
}

/// Writes text into a caller's buffer: its bytes, and a zero byte that is not counted.
///
/// # Safety
/// As for `List::new`.
pub(crate) unsafe fn text(
    name: &'static str,
    of: &str,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let (mut count, mut room) =
        unsafe { (One::new("length", length)?, Room::new(name, buffer.cast::<u8>(), capacity)?) };
    count.set(of.len());
    // What does not fit is cut between characters, so that text ends in the buffer whatever its size.
    let most = of.len().min(capacity.saturating_sub(1));
    let fits = (0..=most).rev().find(|&end| of.is_char_boundary(end)).unwrap_or(0);
    of.bytes().take(fits).enumerate().for_each(|(at, byte)| room.set(at, byte));
    room.set(fits, 0);
    if of.len() < capacity {
        return Ok(());
    }
    let needed = of.len() + 1;
    let message = format!("{name}: expected room for {needed} bytes, found room for {capacity}");
    Err(Failure::new(Status::BufferTooSmall, message))
}
