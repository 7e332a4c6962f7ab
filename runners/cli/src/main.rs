//! The program `fredholm`: integral equations solved from a file, with an error bar.
//!
//! Results go to stdout, progress and remarks to stderr. Exit status: 0 done, 1 a failure on the
//! way, 2 bad usage or input, 3 the asked error was not reached, 130 interrupted.

mod args;
mod circle;
mod cube;
mod diagnose;
mod export;
mod factors;
mod failure;
#[cfg(test)]
mod hostile;
mod init;
mod numbers;
mod output;
mod paper;
mod problem;
mod progress;
mod rates;
mod render;
mod report;
mod room;
mod solve;
mod split;
mod theory;
mod threads;
mod verify;
mod walks;

use std::process::ExitCode;

use args::{Cli, Command};
use clap::{CommandFactory, Parser};
use failure::{Ended, Failure};
use fredholm_file::{self as file, deck, formula};

fn main() -> ExitCode {
    let status = match run(&Cli::parse().command) {
        Ok(ended) => ended.status(),
        Err(failure) => failure.report(),
    };
    output::remove_unfinished();
    status
}

fn run(command: &Command) -> Result<Ended, Failure> {
    progress::catch_interrupts()?;
    match command {
        Command::Paper(args) => paper::paper(args),
        Command::Solve(args) => solve::solve(args),
        Command::Factors(args) => factors::factors(args),
        Command::Rates(args) => rates::rates(args),
        Command::Diagnose(args) => diagnose::diagnose(args),
        Command::Render(args) => render::render(args),
        Command::Verify(args) => verify::verify(args),
        Command::Check { file } => solve::check(file),
        Command::Export(args) => export::export(args),
        Command::Init { kind } => init::init(*kind),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "fredholm", &mut script);
            std::io::Write::write_all(&mut std::io::stdout().lock(), &script)?;
            Ok(Ended::Done)
        }
    }
}
