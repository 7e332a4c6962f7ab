//! Work on all cores.

use core::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

/// The results of `one` for 0, 1, …, `count` − 1, in this order, computed on all cores.
///
/// It is an object, so that what distributes the work is compiled once, and not for every equation that tests walk on.
///
/// # Panics
/// If `one` does.
pub fn on_all_cores<T: Send>(count: usize, one: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    each(count, &|i| {
        let result = one(i);
        *results[i].lock().unwrap() = Some(result);
    });
    let results = results.into_iter();
    results
        .map(|result| result.into_inner().unwrap().expect("every number is taken"))
        .collect()
}

fn each(count: usize, one: &(dyn Fn(usize) + Sync)) {
    let next = AtomicUsize::new(0);
    rayon::broadcast(|_| {
        while let Some(i) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count) {
            one(i);
        }
    });
}
