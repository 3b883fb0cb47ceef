//! The threads of a bake: those of rayon or, without the feature `parallel`, only the caller's. Then rayon's names stand for
//! loops over iterators of the standard library.

#[cfg(feature = "parallel")]
pub(crate) use rayon::{current_num_threads, current_thread_index, join, prelude, scope};
#[cfg(not(feature = "parallel"))]
pub(crate) use sequential::{current_num_threads, current_thread_index, join, prelude, scope};

#[cfg(not(feature = "parallel"))]
mod sequential {
    pub(crate) fn current_num_threads() -> usize {
        1
    }

    pub(crate) fn current_thread_index() -> Option<usize> {
        None
    }

    pub(crate) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }

    pub(crate) struct Scope;

    impl Scope {
        pub(crate) fn spawn(&self, work: impl FnOnce(&Self)) {
            work(self);
        }
    }

    pub(crate) fn scope<R>(work: impl FnOnce(&Scope) -> R) -> R {
        work(&Scope)
    }

    pub(crate) mod prelude {
        use std::slice;

        pub(crate) trait IntoParallelIterator: IntoIterator + Sized {
            fn into_par_iter(self) -> Self::IntoIter {
                self.into_iter()
            }
        }

        impl<T: IntoIterator> IntoParallelIterator for T {}

        pub(crate) trait IndexedParallelIterator: Iterator + Sized {
            fn position_first(mut self, found: impl FnMut(Self::Item) -> bool) -> Option<usize> {
                self.position(found)
            }

            fn with_min_len(self, _: usize) -> Self {
                self
            }
        }

        impl<T: Iterator> IndexedParallelIterator for T {}

        pub(crate) trait ParallelSlice<T> {
            fn par_iter(&self) -> slice::Iter<'_, T>;
            fn par_iter_mut(&mut self) -> slice::IterMut<'_, T>;
            fn par_chunks(&self, length: usize) -> slice::Chunks<'_, T>;
            fn par_chunks_mut(&mut self, length: usize) -> slice::ChunksMut<'_, T>;
            fn par_windows(&self, length: usize) -> slice::Windows<'_, T>;
            fn par_sort_unstable(&mut self)
            where
                T: Ord;
            fn par_sort_by_key<K: Ord>(&mut self, key: impl FnMut(&T) -> K);
        }

        impl<T> ParallelSlice<T> for [T] {
            fn par_iter(&self) -> slice::Iter<'_, T> {
                self.iter()
            }

            fn par_iter_mut(&mut self) -> slice::IterMut<'_, T> {
                self.iter_mut()
            }

            fn par_chunks(&self, length: usize) -> slice::Chunks<'_, T> {
                self.chunks(length)
            }

            fn par_chunks_mut(&mut self, length: usize) -> slice::ChunksMut<'_, T> {
                self.chunks_mut(length)
            }

            fn par_windows(&self, length: usize) -> slice::Windows<'_, T> {
                self.windows(length)
            }

            fn par_sort_unstable(&mut self)
            where
                T: Ord,
            {
                self.sort_unstable();
            }

            fn par_sort_by_key<K: Ord>(&mut self, key: impl FnMut(&T) -> K) {
                self.sort_by_key(key);
            }
        }
    }
}
