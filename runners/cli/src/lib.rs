//! The program `fredholm`: integral equations solved from a file, with an error bar. It is a library for programs that give
//! it more than this process to walk with.
//!
//! Results go to stdout, progress and remarks to stderr. Exit status: 0 done, 1 a failure on the
//! way, 2 bad usage or input, 3 the requested error was not reached, 130 interrupted.

mod args;
mod certify;
mod diagnose;
mod drawing;
mod exchange;
mod export;
mod faces;
mod factors;
mod failure;
mod fit;
mod global;
mod init;
mod merge;
mod paper;
mod progress;
mod rates;
mod ray_factors;
mod render;
mod results;
mod scene;
mod solve;
mod sparse;
mod table;
mod threads;
mod times;
mod verify;

use std::process::ExitCode;

use args::{Cli, Command};
use clap::{CommandFactory, Parser};
use failure::Ended;
use fredholm::numbers;
use fredholm_file::{self as file, deck};
use fredholm_rayon::Crew;
use progress::Signals;

pub use failure::Failure;

/// One of several processes that follow the same command: each of them reads the file and sets up, and they share the walks.
#[derive(Clone, Copy)]
pub struct Process<'a> {
    /// The crew that all of them are.
    pub crew: &'a dyn Crew,
    /// Whether this one prints and writes.
    pub leads: bool,
}

impl core::fmt::Debug for Process<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Process")
            .field("leads", &self.leads)
            .finish_non_exhaustive()
    }
}

/// Runs the command of this process' command line.
pub fn program() -> ExitCode {
    command(None).unwrap_or_else(|failure| failure.report())
}

/// Runs the command of this process' command line, which must be `solve`, as one of several processes.
///
/// # Errors
/// [`Failure`], which is not yet said: the others wait for this process.
pub fn program_of(process: Process<'_>) -> Result<ExitCode, Failure> {
    failure::be_quiet(!process.leads);
    command(Some(process))
}

fn command(process: Option<Process<'_>>) -> Result<ExitCode, Failure> {
    let ended = Cli::try_parse().map_or_else(not_parsed, |cli| run(&cli.command, process));
    fredholm_file::parts::output::remove_unfinished();
    ended.map(Ended::status)
}

/// Prints what is asked for instead of a command, such as help, or says what is wrong with the command line.
fn not_parsed(error: clap::Error) -> Result<Ended, Failure> {
    if error.use_stderr() {
        error.exit();
    }
    error.print()?;
    std::io::Write::flush(&mut std::io::stdout())?;
    Ok(Ended::Done)
}

fn run(command: &Command, process: Option<Process<'_>>) -> Result<Ended, Failure> {
    let signals = &Signals::catch(stop_at_once)?;
    match command {
        Command::Solve(args) => solve::solve(args, signals, process),
        _ if process.is_some() => Err(Failure::input(
            "several processes have the command `solve` only: give this one to `fredholm`",
        )),
        Command::Paper(args) => paper::paper(args, signals),
        Command::Times(args) => times::times(args, signals),
        Command::Faces(args) => faces::faces(args, signals),
        Command::Merge(args) => merge::merge(args),
        Command::Factors(args) => factors::factors(args, signals),
        Command::Rates(args) => rates::rates(args, signals),
        Command::Certify(args) => certify::certify(args, signals),
        Command::Fit(args) => fit::fit(args, signals),
        Command::Diagnose(args) => diagnose::diagnose(args),
        Command::Render(args) => render::render(args, signals),
        Command::Verify(args) => verify::verify(args, signals),
        Command::Check { file, out } => solve::check(file, out.as_deref(), signals),
        Command::Export(args) => export::export(args),
        Command::Init { name } => init::init(name),
        Command::Man {
            folder: Some(folder),
        } => {
            clap_mangen::generate_to(Cli::command(), folder)
                .map_err(|error| Failure::run(format_args!("{}: {error}", folder.display())))?;
            Ok(Ended::Done)
        }
        Command::Man { folder: None } => {
            let mut page = Vec::new();
            clap_mangen::Man::new(Cli::command()).render(&mut page)?;
            failure::print(page)?;
            Ok(Ended::Done)
        }
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "fredholm", &mut script);
            failure::print(script)?;
            Ok(Ended::Done)
        }
    }
}

/// Ends the program where there is nothing to print: leaves nothing behind, and makes nothing new in between.
fn stop_at_once() {
    let _held = fredholm_file::parts::output::give_up();
    failure::say("warning: interrupted");
    std::process::exit(130)
}
