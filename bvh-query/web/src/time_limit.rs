//! The time that calls may take. A call keeps its thread busy, so that nobody could set a flag meanwhile.

use bvh_query::Stop;
use std::cell::Cell;
use std::sync::Arc;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// The time in milliseconds, from some moment on.
    #[wasm_bindgen(js_namespace = performance)]
    fn now() -> f64;
}

thread_local! {
    /// In milliseconds.
    static LIMIT: Cell<f64> = const { Cell::new(f64::INFINITY) };
}

/// Limits each call from now on.
#[wasm_bindgen(js_name = setTimeLimit)]
pub fn set_time_limit(milliseconds: f64) -> Result<(), JsError> {
    if milliseconds.is_nan() || milliseconds < 0.0 {
        let found = format!("milliseconds: expected a time of at least 0, found {milliseconds}");
        return Err(JsError::new(&found));
    }
    LIMIT.set(milliseconds);
    Ok(())
}

/// Returns what stops the queries of a call that begins now.
pub(crate) fn start() -> Option<Arc<dyn Stop>> {
    let limit = LIMIT.get();
    if limit == f64::INFINITY {
        return None;
    }
    let end = now() + limit;
    Some(Arc::new(move || now() >= end))
}
