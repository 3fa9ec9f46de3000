//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;

use crate::image_file::Format;

/// What `--help` prints.
pub const HELP: &str = "\
Photometric images of faceted diffuse-mirror objects.

usage: render [SCENE.toml] [options]
       render --check SCENE.toml
       render --list MESH

With no scene it renders the built-in aircraft with a diffuse-dominated and a mirror-dominated finish and writes
aircraft_diffuse and aircraft_mirror as PNG and EXR into the current folder.

  --out FILE           image; .png, .exr, .npy or .pfm by its ending; may be repeated
                       (default: the scene's stem as .png and .exr in the current folder)
  --report FILE.json   error estimate, work done and skipped, signature
  --facets FILE.csv    irradiance and diffuse radiance of every facet
  --components PREFIX  the three terms of the image: PREFIX_diffuse.npy, PREFIX_mirror_sky.npy,
                       PREFIX_mirror_diffuse.npy
  --threads N          0 (default): all cores
  --exposure X         factor of the PNG's linear values (default 1)
  --bands A,B,C        bands shown as red, green and blue in the PNG; one number: that band in grey
  --check SCENE.toml   reads the scene and all that it names, says what it found, and renders nothing
  --list MESH          materials, facet counts, size, open edges and fronts of a mesh file, as comments of a scene
                       file to start from; an OBJ's material library gives the reflectances
  --manual             the manual of the scene file: kernel/examples/render/SCENE.md
  --help, --version

Exit status: 0 done, 2 wrong usage, 1 anything else (nothing written).
";

/// What the command line asks for.
pub enum Command {
    /// Print [`HELP`].
    Help,
    /// Print the version.
    Version,
    /// Print the manual of the scene file.
    Manual,
    /// Read a scene file and all that it names.
    Check(PathBuf),
    /// Say what is in a mesh file.
    List(PathBuf),
    /// Render.
    Render(Options),
}

/// The options as given.
#[derive(Default)]
pub struct Options {
    /// The scene file; `None`: the built-in aircraft.
    pub scene: Option<PathBuf>,
    /// `--out`: image files with their formats.
    pub images: Vec<(PathBuf, Format)>,
    /// `--report`.
    pub report: Option<PathBuf>,
    /// `--facets`.
    pub facets: Option<PathBuf>,
    /// `--components`.
    pub components: Option<OsString>,
    /// `--threads`; `None` or 0: all cores.
    pub threads: Option<usize>,
    /// `--exposure`, finite and > 0; `None`: 1.
    pub exposure: Option<f64>,
    /// `--bands`: one or three band numbers.
    pub bands: Option<Vec<usize>>,
}

impl Options {
    /// Whether nothing but a scene is given.
    fn is_plain(&self) -> bool {
        self.images.is_empty()
            && self.report.is_none()
            && self.facets.is_none()
            && self.components.is_none()
            && self.threads.is_none()
            && self.exposure.is_none()
            && self.bands.is_none()
    }
}

/// Reads the command line (without the program's name). The error is a sentence about wrong usage.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Command, String> {
    use lexopt::prelude::*;
    let mut options = Options::default();
    let (mut check_only, mut list) = (false, None);
    let mut parser = lexopt::Parser::from_args(arguments);
    while let Some(argument) = parser.next().map_err(|e| e.to_string())? {
        match argument {
            Long("help") | Short('h') => return Ok(Command::Help),
            Long("version") | Short('V') => return Ok(Command::Version),
            Long("manual") => return Ok(Command::Manual),
            Long("check") => check_only = true,
            Long("list") => once("--list", &mut list, value(&mut parser)?.into())?,
            Long("out") => {
                let path = PathBuf::from(value(&mut parser)?);
                let format = Format::of(&path)?;
                options.images.push((path, format));
            }
            Long("report") => once("--report", &mut options.report, value(&mut parser)?.into())?,
            Long("facets") => once("--facets", &mut options.facets, value(&mut parser)?.into())?,
            Long("components") => once("--components", &mut options.components, value(&mut parser)?)?,
            Long("threads") => {
                let n = number(&mut parser, "--threads", "a whole number", |text| text.parse().ok())?;
                once("--threads", &mut options.threads, n)?;
            }
            Long("exposure") => {
                let x = number(&mut parser, "--exposure", "a finite number above 0", |text| {
                    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0)
                })?;
                once("--exposure", &mut options.exposure, x)?;
            }
            Long("bands") => {
                let bands = number(&mut parser, "--bands", "one band number or three, as in 0,1,2", bands)?;
                once("--bands", &mut options.bands, bands)?;
            }
            Value(path) => once("a scene file", &mut options.scene, path.into())?,
            other => return Err(other.unexpected().to_string()),
        }
    }
    if let Some(mesh) = list {
        let alone = options.scene.is_none() && options.is_plain() && !check_only;
        return if alone {
            Ok(Command::List(mesh))
        } else {
            Err("--list stands alone: expected a mesh file".into())
        };
    }
    if check_only {
        let plain = options.is_plain();
        let scene = options.scene.filter(|_| plain);
        return scene.map(Command::Check).ok_or("--check takes a scene file and no other option".into());
    }
    check(options).map(Command::Render)
}

/// What holds of the options together.
fn check(options: Options) -> Result<Options, String> {
    let named = !options.images.is_empty()
        || options.report.is_some()
        || options.facets.is_some()
        || options.components.is_some();
    if options.scene.is_none() && named {
        return Err("--out, --report, --facets and --components need a scene file".into());
    }
    Ok(options)
}

fn value(parser: &mut lexopt::Parser) -> Result<OsString, String> {
    let value = parser.value().map_err(|e| e.to_string())?;
    if value.is_empty() { Err("an option's value is empty: expected a file name".into()) } else { Ok(value) }
}

fn once<T>(name: &str, slot: &mut Option<T>, value: T) -> Result<(), String> {
    match slot.replace(value) {
        None => Ok(()),
        Some(_) => Err(format!("{name} is given twice")),
    }
}

fn number<T>(
    parser: &mut lexopt::Parser,
    name: &str,
    expected: &str,
    read: impl Fn(&str) -> Option<T>,
) -> Result<T, String> {
    let text = parser.value().map_err(|e| e.to_string())?;
    text.to_str()
        .and_then(read)
        .ok_or_else(|| format!("{name}: expected {expected}, got {:?}", text.to_string_lossy()))
}

fn bands(text: &str) -> Option<Vec<usize>> {
    let bands: Vec<usize> = text.split(',').map(|band| band.trim().parse().ok()).collect::<Option<_>>()?;
    (bands.len() == 1 || bands.len() == 3).then_some(bands)
}
