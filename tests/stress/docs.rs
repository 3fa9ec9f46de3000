//! The tables of tests/stress.md.

use std::path::PathBuf;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/stress.md")
}

/// Writes a table between its marks, where `UPDATE_STRESS` is set.
pub fn keep(name: &str, table: &str) {
    if std::env::var_os("UPDATE_STRESS").is_none() {
        return;
    }
    let text = text();
    let [start, end] = ["start", "end"].map(|side| format!("<!-- {name}: {side} -->\n"));
    let (before, rest) = text.split_once(&start).expect("the table's start");
    let (_, after) = rest.split_once(&end).expect("the table's end");
    std::fs::write(path(), format!("{before}{start}\n{table}\n{end}{after}")).expect("tests/stress.md");
}

/// All of tests/stress.md.
pub fn text() -> String {
    std::fs::read_to_string(path()).expect("tests/stress.md")
}
