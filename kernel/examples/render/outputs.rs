//! Output files: all of them, or none.
//!
//! Each is written to a temporary name in its target's folder; only when all are complete are they renamed. What
//! a target held before is kept under another name until the last rename has succeeded, and put back otherwise.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempPath};

use crate::failure::{Failure, Outcome};

/// Complete files that wait under temporary names. Dropped without [`Outputs::commit`], they vanish.
#[derive(Default)]
pub struct Outputs {
    written: Vec<(TempPath, PathBuf)>,
}

/// A target that has been renamed into place, and what it held before.
struct Replaced {
    target: PathBuf,
    before: Option<TempPath>,
}

/// Finds out before any work whether the targets can be written, are different from each other and are none of
/// the `inputs`.
pub fn check<'a>(
    targets: impl IntoIterator<Item = &'a Path>,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Outcome<()> {
    let mut taken: Vec<PathBuf> = inputs.into_iter().filter_map(|path| fs::canonicalize(path).ok()).collect();
    for target in targets {
        let real = resolve(target)?;
        if real.exists() && !real.is_file() {
            return Err(unwritable(target, "not a regular file: expected a file name"));
        }
        if taken.contains(&real) {
            return Err(unwritable(target, "is read too, or named as an output twice"));
        }
        temporary(&real).map_err(|e| unwritable(target, e))?;
        taken.push(real);
    }
    Ok(())
}

impl Outputs {
    /// Writes one file in full under a temporary name.
    pub fn write(
        &mut self,
        target: &Path,
        content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Outcome<()> {
        let real = resolve(target)?;
        let write = || {
            let (file, path) = temporary(&real)?.into_parts();
            let mut writer = BufWriter::with_capacity(1 << 16, file);
            content(&mut writer)?;
            writer.flush()?;
            Ok(path)
        };
        let path = write().map_err(|e: io::Error| unwritable(target, e))?;
        self.written.push((path, real));
        Ok(())
    }

    /// Gives all files their names.
    pub fn commit(self) -> Outcome<()> {
        let mut done = Vec::new();
        for (temporary, target) in self.written {
            match replace(temporary, &target) {
                Ok(replaced) => done.push(replaced),
                Err(error) => {
                    done.into_iter().rev().for_each(restore);
                    return Err(unwritable(&target, error));
                }
            }
        }
        Ok(())
    }
}

fn unwritable(target: &Path, why: impl std::fmt::Display) -> Failure {
    Failure::at(target, format_args!("cannot write: {why}"))
}

/// The file a target stands for: links are followed, so that they stay links.
fn resolve(target: &Path) -> Outcome<PathBuf> {
    if let Ok(real) = fs::canonicalize(target) {
        return Ok(real);
    }
    let name = target.file_name().ok_or_else(|| unwritable(target, "expected a file name"))?;
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = fs::canonicalize(folder).map_err(|e| unwritable(target, e))?;
    Ok(folder.join(name))
}

/// A new file beside `target`, removed when dropped.
fn temporary(target: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".render-").suffix(".tmp");
    #[cfg(unix)]
    {
        // As for any new file: what the umask leaves.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(target.parent().unwrap_or(Path::new(".")))
}

fn replace(new: TempPath, target: &Path) -> io::Result<Replaced> {
    let before = if target.exists() {
        let aside = temporary(target)?.into_temp_path();
        fs::remove_file(&aside)?;
        // A link leaves no moment without the file; some file systems have none.
        fs::hard_link(target, &aside).or_else(|_| fs::rename(target, &aside))?;
        Some(aside)
    } else {
        None
    };
    let replaced = Replaced { target: target.to_owned(), before };
    match new.persist(target) {
        Ok(()) => Ok(replaced),
        Err(error) => {
            // Where a link was made, the target still stands; a rename onto its own link would do nothing.
            if !target.exists() {
                restore(replaced);
            }
            Err(error.error)
        }
    }
}

/// Puts back what was there. Where that fails too, the old content stays under its temporary name.
fn restore(replaced: Replaced) {
    match replaced.before.map(|before| before.persist(&replaced.target)) {
        None => drop(fs::remove_file(&replaced.target)),
        Some(Ok(())) => {}
        Some(Err(error)) => drop(error.path.keep()),
    }
}
