//! Reader of the independent reference values in `tests/data/cases/cases.csv`.

use std::collections::HashMap;
use std::sync::OnceLock;

/// One row of the file, as far as tests use it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The value: a closed form where there is one.
    pub value: f64,
    /// What it is the value of.
    pub description: String,
}

/// All rows by their id.
pub fn all() -> &'static HashMap<String, Case> {
    static CASES: OnceLock<HashMap<String, Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let path = super::data("cases/cases.csv");
        let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let header = reader.headers().expect("a header line").clone();
        let column =
            |name| header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"));
        let (id, value, description) = (column("id"), column("value"), column("description"));
        reader
            .records()
            .map(|record| {
                let record = record.expect("a row of the header's length");
                let value = record[value].parse().unwrap_or_else(|_| panic!("value of {}", &record[id]));
                (record[id].to_string(), Case { value, description: record[description].to_string() })
            })
            .collect()
    })
}

/// The value of the case `id`; panics with the id when there is none.
pub fn value(id: &str) -> f64 {
    all().get(id).unwrap_or_else(|| panic!("no case {id}")).value
}
