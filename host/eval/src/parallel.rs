//! Runs one task for each of many numbers on several threads.

use std::io;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Filters and priors are constructed on the stack, in builds without optimisation more than once.
const STACK_BYTES: usize = 64 << 20;

/// Returns the result of `task` for every number below `count`, in order. `threads` 0 uses as many threads as there are
/// processors. Each thread takes the next number when it has finished one.
///
/// # Errors
/// When a thread does not start.
///
/// # Panics
/// When a task panics.
pub fn map<T: Send>(count: usize, threads: usize, task: impl Fn(usize) -> T + Sync) -> io::Result<Vec<T>> {
    let threads = match threads {
        0 => thread::available_parallelism().map_or(1, NonZeroUsize::get),
        threads => threads,
    };
    let (next, task) = (AtomicUsize::new(0), &task);
    let work = || {
        let mut results = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return results;
            }
            results.push((number, task(number)));
        }
    };
    let mut results: Vec<(usize, T)> = thread::scope(|scope| {
        let spawn = |_| thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work);
        let workers: io::Result<Vec<_>> = (0..threads.min(count)).map(spawn).collect();
        let join = |worker: thread::ScopedJoinHandle<'_, _>| {
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        Ok::<_, io::Error>(workers?.into_iter().flat_map(join).collect())
    })?;
    results.sort_unstable_by_key(|&(number, _)| number);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        let expected: Vec<usize> = (0..1000).map(|number| number * number).collect();
        for threads in [0, 1, 3, 2000] {
            assert_eq!(map(1000, threads, |number| number * number).unwrap(), expected);
        }
        assert!(map(0, 4, |number| number).unwrap().is_empty());
    }
}
