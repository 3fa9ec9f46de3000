//! Damaged scene, mesh and sky files are read or refused in one line that names the file; nothing panics, hangs or
//! takes memory that the file's size does not explain.
//!
//! `BLIK_FUZZ_SECONDS` makes each target run for so long.

#[allow(dead_code)]
#[path = "../kernel/examples/render/failure.rs"]
mod failure;
#[allow(dead_code)]
#[path = "../kernel/examples/render/mesh_file/mod.rs"]
mod mesh_file;
#[allow(dead_code)]
#[path = "../kernel/examples/render/scene_file/mod.rs"]
mod scene_file;
#[allow(dead_code)]
#[path = "../kernel/examples/render/sky_table/mod.rs"]
mod sky_table;
mod support;
#[path = "../kernel/examples/render/text_file.rs"]
mod text_file;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use support::twin::Rng;

/// A reader: whether it took the file, or what it said.
type Reader = fn(&Path) -> Result<(), String>;

/// Tokens that programs trip over.
const TOKENS: [&str; 20] = [
    "nan",
    "-inf",
    "1e999",
    "-1",
    "0",
    "4294967295",
    "18446744073709551616",
    "2147483648",
    "1e-320",
    "\"",
    "[",
    "]]",
    "{",
    "=",
    "\n",
    "\\",
    "\u{feff}",
    "f 1 2 3\n",
    "element face 999999999\n",
    "../../../../etc",
];

fn seeds(extensions: &[&str]) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = support::data("fuzz");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)));
    paths.sort();
    paths.into_iter().map(|p| (p.clone(), std::fs::read(p).unwrap())).collect()
}

/// Changes some of `bytes`; `other` is a file of the same kind.
fn damage(bytes: &mut Vec<u8>, other: &[u8], rng: &mut Rng) {
    for _ in 0..1 + rng.bits() % 4 {
        if bytes.is_empty() {
            return;
        }
        let below = |rng: &mut Rng, n: usize| (rng.bits() >> 16) as usize % n.max(1);
        let at = below(rng, bytes.len());
        match rng.bits() % 8 {
            0 => bytes[at] ^= 1 << (rng.bits() % 8),
            1 => bytes[at] = rng.bits() as u8,
            2 => bytes.truncate(at),
            3 => {
                let token = TOKENS[below(rng, TOKENS.len())];
                bytes.splice(at..at, token.bytes());
            }
            4 => {
                let end = (at + 1 + below(rng, 40)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => {
                let end = (at + 1 + below(rng, 12)).min(bytes.len());
                bytes.drain(at..end);
            }
            6 => {
                let from = below(rng, other.len());
                let end = (from + 1 + below(rng, 60)).min(other.len());
                bytes.splice(at..at, other[from..end].iter().copied());
            }
            _ => {
                // another number in a number's place
                let digits = bytes[at..].iter().take_while(|b| b.is_ascii_digit()).count();
                let token = TOKENS[below(rng, 9)];
                bytes.splice(at..at + digits, token.bytes());
            }
        }
    }
}

/// Reads damaged seeds of these kinds, at least `count` of them.
fn fuzz(name: &str, extensions: &[&str], count: u64, read: Reader) {
    let seconds = std::env::var("BLIK_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    let (start, end) = (Instant::now(), Instant::now() + Duration::from_secs(seconds));
    let seeds = seeds(extensions);
    // what a scene file names is beside it
    // files in memory where there is such a place
    let memory = Path::new("/dev/shm");
    let place = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
    let folder = tempfile::tempdir_in(place).unwrap();
    for entry in std::fs::read_dir(support::data("fuzz")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    let (mut tries, mut taken) = (0u64, 0u64);
    let check = |path: &Path, what: &str| {
        let before = Instant::now();
        let result = read(path);
        let time = before.elapsed();
        // files of a few hundred bytes; a shared machine may pause a thread
        assert!(time < Duration::from_secs(5), "{name} {what}: {time:?}");
        if let Err(said) = &result {
            assert!(!said.is_empty() && said.lines().count() == 1, "{name} {what}: {said:?}");
        }
        result.is_ok()
    };
    for (path, bytes) in &seeds {
        check(path, "undamaged");
        // a file that shrinks while it is written or read
        let cut = folder.path().join("cut").with_extension(path.extension().unwrap());
        for length in 0..bytes.len() {
            std::fs::write(&cut, &bytes[..length]).unwrap();
            check(&cut, "cut");
        }
    }
    while tries < count || Instant::now() < end {
        let mut rng = Rng(tries);
        let pick = |rng: &mut Rng| (rng.bits() >> 20) as usize % seeds.len();
        let (path, bytes) = &seeds[pick(&mut rng)];
        let mut bytes = bytes.clone();
        damage(&mut bytes, &seeds[pick(&mut rng)].1, &mut rng);
        let damaged = folder.path().join("damaged").with_extension(path.extension().unwrap());
        std::fs::write(&damaged, &bytes).unwrap();
        taken += u64::from(check(&damaged, &format!("seed {tries} of {}", path.display())));
        tries += 1;
    }
    println!("{name}: {tries} files in {:.1} s, {taken} of them read", start.elapsed().as_secs_f64());
    assert!(taken > 0 && taken < tries, "{name}: {taken} of {tries}");
}

#[test]
fn damaged_scene_files_are_read_or_refused() {
    fuzz("scene files", &["toml"], 12_000, |path| {
        scene_file::read(path).map(drop).map_err(|e| e.to_string())
    });
}

#[test]
fn damaged_mesh_files_are_read_or_refused() {
    fuzz("mesh files", &["obj", "ply", "stl", "gltf", "glb"], 36_000, |path| {
        let mesh = mesh_file::read(path).map_err(|e| e.to_string())?;
        // what was read fits together
        let corners = mesh.facets.iter().flatten();
        assert!(corners.clone().all(|&v| (v as usize) < mesh.vertices.len()), "{}", path.display());
        assert!(mesh.vertices.iter().flatten().all(|x| x.is_finite()), "{}", path.display());
        Ok(())
    });
}

#[test]
fn damaged_sky_tables_are_read_or_refused() {
    fuzz("sky tables", &["npy", "pfm", "hdr"], 12_000, |path| {
        sky_table::read(path, 3, None).map(drop).map_err(|e| e.to_string())
    });
}
