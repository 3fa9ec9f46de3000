//! Runs the built `render` program in a folder of its own.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A square plate of two facets in the plane z = 0, front up.
pub const PLATE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

/// The plate under a uniform sky, seen from above; the corners of the image miss it.
pub const SCENE: &str = r#"tolerance = 2e-3
[mesh]
file = "plate.obj"
[material.default]
diffuse = 0.4
[sky]
model = "uniform"
[camera]
kind = "orthographic"
eye = [0, 0, 5]
target = [0, 0, 0]
up = [0, 1, 0]
height = 4.0
resolution = [8, 8]
"#;

/// The program, built once with the profile of the running test.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // <target>/<profile>/deps/<test>
        let test = std::env::current_exe().unwrap();
        let profile_folder = test.ancestors().nth(2).unwrap();
        let profile = match profile_folder.file_name().and_then(OsStr::to_str).unwrap() {
            "debug" => "dev",
            profile => profile,
        };
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--example", "render", "--profile", profile, "--target-dir"])
            .arg(profile_folder.parent().unwrap())
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .status()
            .unwrap();
        assert!(built.success());
        profile_folder.join("examples").join(format!("render{}", std::env::consts::EXE_SUFFIX))
    })
}

/// What a run of the program gave.
#[derive(Debug)]
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// Asserts that all went well; a missed tolerance is a warning, not a failure.
    pub fn succeeds(self) -> Self {
        let warned = self.stderr.lines().all(|line| line.starts_with("warning: "));
        assert!(self.code == Some(0) && warned, "{self:?}");
        self
    }

    /// Asserts exit status 1 and one line `error: ...` that holds every one of `words`.
    pub fn fails(self, words: &[&str]) -> Self {
        self.refuses(1, words)
    }

    /// Asserts the exit status and one line `error: ...` that holds every one of `words`.
    pub fn refuses(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert!(self.stderr.starts_with("error: ") && self.stderr.ends_with('\n'), "{self:?}");
        assert_eq!(self.stderr.lines().count(), 1, "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "{word:?} is missing: {self:?}");
        }
        self
    }
}

/// A temporary folder in which the program runs.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// A folder with `plate.obj` and the scene `scene.toml`.
    pub fn with_scene(scene: &str) -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        folder.write("plate.obj", PLATE).write("scene.toml", scene);
        folder
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        std::fs::write(self.path(name), content).unwrap();
        self
    }

    /// Reads a file.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Runs the program there.
    pub fn render(&self, arguments: &[&str]) -> Run {
        let mut command = Command::new(program());
        command.args(arguments);
        self.run(command)
    }

    /// Runs a command there.
    pub fn run(&self, mut command: Command) -> Run {
        let output = command.current_dir(self.0.path()).output().unwrap();
        Run {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs the scene to `out.npy` and reads the image: (rows, columns, bands) and its values.
    pub fn image(&self) -> (Vec<u64>, Vec<f32>) {
        self.render(&["scene.toml", "--out", "out.npy"]).succeeds();
        read_npy(&self.read("out.npy"))
    }

    /// All files with their contents, hidden and temporary ones too.
    pub fn contents(&self) -> BTreeMap<String, Vec<u8>> {
        std::fs::read_dir(self.0.path())
            .unwrap()
            .map(|entry| entry.unwrap())
            .filter(|entry| entry.file_type().unwrap().is_file())
            .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
            .collect()
    }

    /// Runs the program, which must fail with `words`, and asserts that no file came, went or changed.
    pub fn fails_without_trace(&self, arguments: &[&str], words: &[&str]) {
        let before = self.contents();
        self.render(arguments).fails(words);
        assert!(before == self.contents(), "files changed: {:?}", self.contents().keys());
    }
}

/// The shape and the little-endian f32 values of a `.npy` file.
pub fn read_npy(bytes: &[u8]) -> (Vec<u64>, Vec<f32>) {
    let file = npyz::NpyFile::new(bytes).unwrap();
    assert_eq!(file.dtype().descr(), "'<f4'");
    assert_eq!(file.order(), npyz::Order::C);
    (file.shape().to_vec(), file.into_vec().unwrap())
}

/// A `.npy` file of f32 values.
pub fn npy(shape: &[u64], values: &[f32]) -> Vec<u8> {
    use npyz::WriterBuilder;
    let mut bytes = Vec::new();
    let mut writer =
        npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd().unwrap();
    writer.extend(values).unwrap();
    writer.finish().unwrap();
    bytes
}
