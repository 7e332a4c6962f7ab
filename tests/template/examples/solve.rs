// My equation at a point and in the mean, to a standard error of 10⁻⁴.
use fredholm::{CustomModel, SolveError, Solver};
use fredholm_my_equation::MyEquation;

fn main() -> Result<(), SolveError> {
    let u = CustomModel::from_kernel(MyEquation::<f64>::new(1).expect("one cell"));
    println!("{}", Solver::new(&u).at(0.5).mean().solve_to(1e-4)?);
    Ok(())
}
