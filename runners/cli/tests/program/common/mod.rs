//! What the tests of the program share: a folder to work in, and a run with what came of it. Holds
//! no test of its own.

use core::time::Duration;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{sleep, spawn};
use std::time::Instant;

use serde_json::Value;
use tempfile::TempDir;

/// A problem file with every key that has a default, and every kind of target.
pub(crate) const CIRCLE: &str = r#"[problem]
kind = "circle"
reflectance = [0.3, 0.7]
emission = { constant = 5.0, amplitude = 1.0, frequency = 5 }

[galerkin]
cells = 20
degree = 0
pairs = "default"

[walk]
walks = 20000
absorption = 0.2
estimator = "absorption"
scalar = "f64"
seed = 1
batch = 512

[[target]]
name = "point"
at = 0.3

[[target]]
name = "mean"
over = "all"

[[target]]
name = "half"
over = [1.0, 4.0]

[[target]]
name = "profile"
grid = 3
"#;

/// The path of an example of the repository.
pub(crate) fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    folder.join(name).to_str().unwrap().to_owned()
}

/// Whether `FREDHOLM_LONG` asks for all cases of a test, and not for a day's share of them.
pub(crate) fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// `diagnose` in a sixth of the default's nodes by day: a small part of its work, and accuracy within some per cent needs no
/// more. In all of them with `FREDHOLM_LONG=1`.
pub(crate) fn diagnose() -> &'static [&'static str] {
    if is_long() {
        &["diagnose"]
    } else {
        &["diagnose", "--nodes", "400"]
    }
}

/// Longer than any run of these tests takes on a busy machine: `verify` has two minutes of processor time.
fn patience() -> Duration {
    Duration::from_secs(if is_long() { 1200 } else { 120 })
}

/// A folder that is removed at the end of a test.
pub(crate) struct Folder(TempDir);

impl Folder {
    /// A new one, empty.
    pub(crate) fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Writes a file and returns its path.
    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        fs::write(self.path().join(name), content).unwrap();
        self.at(name)
    }

    /// The path of something in it.
    pub(crate) fn at(&self, name: &str) -> String {
        self.path().join(name).to_str().unwrap().to_owned()
    }

    /// The names of what is in it, hidden files too, in order.
    pub(crate) fn names(&self) -> Vec<String> {
        names(self.path())
    }

    /// Runs the program on this problem file with these arguments behind it.
    pub(crate) fn solve(&self, problem: &str, args: &[&str]) -> Ran {
        let file = self.file("problem.toml", problem);
        fredholm(&[&["solve", &file], args].concat())
    }
}

/// The names of what is in a folder, hidden files too, in order.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// What a run of the program left.
#[derive(Debug)]
pub(crate) struct Ran {
    /// The exit status; `None` if a signal ended it.
    pub(crate) status: Option<i32>,
    /// What it printed.
    pub(crate) stdout: String,
    /// What it said besides.
    pub(crate) stderr: String,
    /// How long it took.
    pub(crate) time: Duration,
}

impl Ran {
    /// Asserts the status, and that nothing was said besides the output.
    pub(crate) fn quietly(self, status: i32) -> Self {
        assert_eq!(self.status, Some(status), "{self:?}");
        assert_eq!(self.stderr, "", "{self:?}");
        self
    }

    /// Asserts the status, and that nothing was said besides but what the tail of the scores leaves of an error bar.
    pub(crate) fn but_for_doubts(self, status: i32) -> Self {
        assert_eq!(self.status, Some(status), "{self:?}");
        let is_doubt = |line: &str| line.starts_with("warning: ") && line.contains("the error bar");
        assert!(self.stderr.lines().all(is_doubt), "{self:?}");
        self
    }

    /// Asserts the status, and that all that was said is warnings with these words in them.
    pub(crate) fn warning(self, status: i32, words: &[&str]) -> Self {
        assert_eq!(self.status, Some(status), "{self:?}");
        let mut lines = self.stderr.lines();
        assert!(lines.all(|line| line.starts_with("warning: ")), "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "no {word:?}: {self:?}");
        }
        self
    }

    /// The output as one JSON document.
    pub(crate) fn json(&self) -> Value {
        let parsed = serde_json::from_str(&self.stdout);
        parsed.unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// The lines of the output but for those that say how long something took.
    pub(crate) fn timeless(&self) -> String {
        let lines = self.stdout.lines();
        lines
            .filter(|line| !line.contains("seconds\":"))
            .map(|line| format!("{line}\n"))
            .collect()
    }
}

/// The program, about to be started.
pub(crate) fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fredholm"));
    command
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs the program.
pub(crate) fn fredholm(args: &[&str]) -> Ran {
    wait(command(args).spawn().unwrap())
}

/// Runs the program, which must end with this status.
pub(crate) fn ended(status: i32, args: &[&str]) -> Ran {
    let ran = fredholm(args);
    assert_eq!(ran.status, Some(status), "{ran:?}");
    ran
}

/// The report of a run that succeeds.
pub(crate) fn json(args: &[&str]) -> Value {
    ended(0, &[args, &["--json"]].concat()).json()
}

/// The estimate of this kind of a target and its standard error.
pub(crate) fn estimate(target: &Value, kind: &str) -> [f64; 2] {
    ["estimate", "std_error"].map(|name| number(&target[kind], name))
}

/// Starts the program in a shell behind these commands: `ulimit -f` with a number of KiB stands for a full disk. With
/// `trap '' XFSZ` a write fails then, and without it the system kills who writes.
pub(crate) fn limited(limits: &str, args: &[&str]) -> Child {
    let mut command = Command::new("bash");
    command
        .args(["-c", &format!("{limits} exec \"$@\""), "bash"])
        .arg(env!("CARGO_BIN_EXE_fredholm"))
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Asserts that the input was refused, and with these words.
pub(crate) fn refused(ran: &Ran, words: &[&str]) {
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "{word}: {ran:?}");
    }
}

/// Reads what a started program says until it ends; one that does not end is a failure.
pub(crate) fn wait(mut child: Child) -> Ran {
    let start = Instant::now();
    let stdout = spawn(text_of(child.stdout.take()));
    let stderr = spawn(text_of(child.stderr.take()));
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > patience() {
            child.kill().unwrap();
            panic!("still running after {:?}", patience());
        }
        sleep(Duration::from_millis(2));
    };
    Ran {
        status: status.code(),
        stdout: stdout.join().unwrap(),
        stderr: stderr.join().unwrap(),
        time: start.elapsed(),
    }
}

/// Reads a pipe to its end; no pipe has no text.
fn text_of<R: Read>(pipe: Option<R>) -> impl FnOnce() -> String {
    move || {
        let mut text = String::new();
        if let Some(mut pipe) = pipe {
            pipe.read_to_string(&mut text).unwrap();
        }
        text
    }
}

/// Sends a signal, such as "INT".
#[cfg(unix)]
pub(crate) fn signal(name: &str, id: u32) {
    let sent = Command::new("kill")
        .args([format!("-{name}"), id.to_string()])
        .status();
    assert!(sent.unwrap().success());
}

/// `CIRCLE` with one part replaced by another; the part is there once.
pub(crate) fn circle_with(part: &str, other: &str) -> String {
    assert_eq!(CIRCLE.matches(part).count(), 1, "{part:?}");
    CIRCLE.replacen(part, other, 1)
}

/// The number under a key.
pub(crate) fn number(value: &Value, key: &str) -> f64 {
    let number = value[key].as_f64();
    number.unwrap_or_else(|| panic!("no number {key:?} in {value}"))
}

/// The elements of the array under a key.
pub(crate) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    let list = value[key].as_array();
    list.unwrap_or_else(|| panic!("no array {key:?} in {value}"))
}

/// The keys of a table.
pub(crate) fn keys(value: &Value) -> Vec<&str> {
    let table = value.as_object();
    table.unwrap().keys().map(String::as_str).collect()
}

/// Asserts that a file is a whole SVG document: its tags are closed in order, and no coordinate is
/// without a number.
pub(crate) fn assert_svg(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.trim_start().starts_with("<svg "), "{}", text);
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("a tag has an end");
        let name = tag.split_whitespace().next().unwrap();
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !tag.starts_with('?') && !tag.starts_with('!') {
            open.push(name);
        }
    }
    assert_eq!(open, Vec::<&str>::new());
    assert!(text.contains("<path "), "a figure has lines");
    // The letters of an embedded picture may be any.
    let mut parts = text.split("base64,");
    let first = parts.next();
    let others = parts.filter_map(|part| part.split_once('"').map(|(_, rest)| rest));
    for part in first.into_iter().chain(others) {
        assert!(!part.contains("NaN") && !part.contains("inf"));
    }
}

/// The rows of a CSV file, each as long as the header, which comes first.
pub(crate) fn csv_rows(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_path(path)
        .unwrap();
    let rows = reader.records();
    rows.map(|row| row.unwrap().iter().map(str::to_owned).collect())
        .collect()
}

/// An estimate and its standard error.
pub(crate) fn pair(of: &Value) -> [f64; 2] {
    [number(of, "estimate"), number(of, "std_error")]
}

/// What was asked for of every target.
pub(crate) fn asked(folder: &Folder, text: &str, options: &[&str]) -> Vec<[f64; 2]> {
    let json = folder
        .solve(text, &[&["--json"], options].concat())
        .quietly(0)
        .json();
    let targets = list(&json, "targets").iter();
    targets.map(|own| pair(&own["preconditioned"])).collect()
}
