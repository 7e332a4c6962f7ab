//! The compiled part of the Python package `fredholm`: texts of problem files, functions and options go in, reports come
//! out as JSON. Classes, arrays and pictures are Python's, in `python/fredholm`.

mod blocks;
mod failure;
mod functions;
mod options;
mod run;
mod scene;
mod task;

/// The module `fredholm._fredholm`.
#[pyo3::pymodule(gil_used = false)]
mod _fredholm {
    #[pymodule_export]
    use super::functions::Functions;
    #[pymodule_export]
    use super::scene::{FaceArrays, Mesh, SparseArrays};
    #[pymodule_export]
    use super::task::{Field, Task, is_scene, scene_factors};
}
