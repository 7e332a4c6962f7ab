//! Polynomials of degree 0 to 4 on the cells of the cube.

use fredholm_core::galerkin::{Coefficients, Dense, Partition};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Neighbour, Real, STEP_LIMIT, Statistics, Stream, Task,
    rounding_floor,
};
use fredholm_cube::model::{self, Model};
use fredholm_cube::{
    Cube, CubeError, Function, KernelFactors, Mean, Product, ProductTables, Rule, Weighted,
    functions, table,
};
use fredholm_tests::check::{means, run};
use fredholm_tests::cube::{ABSORPTION, Gauss, Ramp, examined_at, with_degree};

#[test]
fn kit_trial() {
    for seed in 1..=1 {
        let t = std::time::Instant::now();
        let r = examined_at::<1, 2>(model::rational(0.9), 10, 12, 1e-7, seed);
        println!("{r} {:?}", t.elapsed());
        let r = examined_at::<1, 5>(model::rational(0.9), 10, 12, 1e-7, seed);
        println!("{r} {:?}", t.elapsed());
        let r = examined_at::<2, 15>(model::rational(0.9), 3, 10, 1e-5, seed);
        println!("{r} {:?}", t.elapsed());
        let r = examined_at::<3, 4>(model::quadratic(0.6), 2, 5, 1e-7, seed);
        println!("{r} {:?}", t.elapsed());
        let r = examined_at::<3, 35>(model::quadratic(0.6), 2, 5, 1e-7, seed);
        println!("{r} {:?}", t.elapsed());
    }
}
