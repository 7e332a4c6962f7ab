//! The program `fredholm`: integral equations solved from a file, with an error bar.

use std::process::ExitCode;

fn main() -> ExitCode {
    fredholm_cli::program()
}
