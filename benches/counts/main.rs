//! Instructions of fixed work, counted by valgrind's callgrind and compared with `counts.csv` beside this file.
//!
//! `cargo bench --bench counts` prints the table and fails where a count is more than 3 % above the one stored;
//! `-- --update` stores the counts instead. A count repeats to 0.1 % on whatever machine, since valgrind's processor has
//! AVX2 and no more; it does change with the compiler, so with another one than the file names nothing fails.
//! Work done by way of the C interface may take 1 % more than without.

mod c;
#[path = "../stages/scene.rs"]
#[allow(dead_code)]
mod scene;
mod work;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Largest rise of a count that passes.
const ALLOWED: f64 = 0.03;

/// What work may take by way of the C interface, over what it takes without.
const BY_C: f64 = 1.01;

/// Instructions of each work, by name.
type Counts = BTreeMap<String, u64>;

fn main() -> ExitCode {
    let asked = |name: &str| std::env::args().any(|argument| argument == name);
    if asked("--work") {
        work::run();
        return ExitCode::SUCCESS;
    }
    match compare(asked("--update")) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The stored counts: the compiler in the first line's comment, then name and count.
struct Stored {
    compiler: String,
    counts: Counts,
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/counts/counts.csv")
}

impl Stored {
    fn read() -> Result<Stored, Box<dyn Error>> {
        let text = std::fs::read_to_string(file())?;
        let compiler = text.lines().next().and_then(|line| line.strip_prefix("# ")).unwrap_or_default();
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        let counts = reader.deserialize().collect::<Result<_, _>>()?;
        Ok(Stored { compiler: compiler.into(), counts })
    }

    fn write(&self) -> Result<(), Box<dyn Error>> {
        let rows = self.counts.iter().map(|(name, count)| format!("{name},{count}\n"));
        let text = format!("# {}\nwork,instructions\n{}", self.compiler, rows.collect::<String>());
        Ok(std::fs::write(file(), text)?)
    }
}

/// Version and target of the compiler that cargo uses.
fn compiler() -> Result<String, Box<dyn Error>> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let text = String::from_utf8(Command::new(rustc).arg("-vV").output()?.stdout)?;
    let line = |start: &str| text.lines().find(|l| l.starts_with(start)).unwrap_or_default().to_string();
    Ok(format!("{}, {}", line("rustc"), line("host")))
}

/// Counts, prints and compares; false where a count has risen too far.
fn compare(update: bool) -> Result<bool, Box<dyn Error>> {
    let (counts, compiler) = (count()?, compiler()?);
    let stored = if update { None } else { Some(Stored::read()?) };
    let mut risen = Vec::new();
    for (name, &now) in &counts {
        let before = stored.as_ref().and_then(|s| s.counts.get(name));
        let ratio = before.map(|&b| now as f64 / b as f64);
        let change = ratio.map_or("new".into(), |r| format!("{:+.1} %", 100.0 * (r - 1.0)));
        println!("{name:20} {:10.2} million instructions, {change}", now as f64 * 1e-6);
        if ratio.is_none_or(|r| r > 1.0 + ALLOWED) {
            risen.push(name.as_str());
        }
    }
    let mut dear = Vec::new();
    for (name, plain) in c::PAIRS {
        let ratio = counts[name] as f64 / counts[plain] as f64;
        println!("{name:20} {ratio:10.4} times {plain}");
        if ratio > BY_C {
            dear.push(name);
        }
    }
    if !dear.is_empty() {
        println!("more than 1 % dearer by way of the C interface: {}", dear.join(", "));
        return Ok(false);
    }
    let Some(stored) = stored else {
        Stored { compiler, counts }.write()?;
        return Ok(true);
    };
    if risen.is_empty() {
        return Ok(true);
    }
    println!("above what benches/counts/counts.csv says by more than 3 %: {}", risen.join(", "));
    println!("meant so? `cargo bench --bench counts -- --update`, and commit the file");
    if compiler == stored.compiler {
        return Ok(false);
    }
    println!("warning only: the file was made with {}, this is {compiler}", stored.compiler);
    Ok(true)
}

/// Runs this program's work under callgrind, which writes what was counted since the last time whenever a function of a
/// work ends, all threads together.
fn count() -> Result<Counts, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let profile = folder.path().join("profile");
    let status = Command::new("valgrind")
        .args(["--tool=callgrind", "--quiet", "--dump-after=*counted_*"])
        .arg(format!("--callgrind-out-file={}", profile.display()))
        .arg(std::env::current_exe()?)
        .arg("--work")
        // the C library's memcpy has variants of its own for each processor
        .env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX512F_Usable,-AVX512VL_Usable")
        .status()
        .map_err(|e| format!("valgrind: {e}"))?;
    if !status.success() {
        return Err(format!("valgrind: {status}").into());
    }
    let parts = std::fs::read_dir(&folder)?.map(|entry| entry.map(|e| e.path()));
    let mut counts = Counts::new();
    for part in parts.collect::<Result<Vec<_>, _>>()? {
        counts.extend(counted(&std::fs::read_to_string(part)?));
    }
    if let Some(missing) = names().find(|name| !counts.contains_key(*name)) {
        return Err(format!("{missing} was not counted").into());
    }
    Ok(counts)
}

/// Names of all work.
fn names() -> impl Iterator<Item = &'static str> {
    work::NAMES.into_iter().chain(c::PAIRS.map(|(name, _)| name))
}

/// Work and instructions of one part of a profile, where the part ends with a work.
fn counted(part: &str) -> Option<(String, u64)> {
    let trigger = part.lines().find(|line| line.starts_with("desc: Trigger:"))?;
    let total = part.lines().find_map(|line| line.strip_prefix("summary: "))?;
    let name = names().find(|name| trigger.contains(&format!("counted_{name}")))?;
    Some((name.to_string(), total.trim().parse().ok()?))
}
