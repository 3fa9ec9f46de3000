//! The `render` program: options, files, exit status.
#![cfg(feature = "std")]

#[path = "support/render.rs"]
mod render;

use std::process::Command;

use render::{Folder, SCENE, program};

#[test]
fn help_and_version_are_printed() {
    let folder = Folder::with_scene(SCENE);
    let help = folder.render(&["--help"]).succeeds().stdout;
    for option in ["--out", "--report", "--facets", "--components", "--threads", "--exposure", "--bands"] {
        assert!(help.contains(option), "{option}");
    }
    let version = folder.render(&["--version"]).succeeds().stdout;
    assert_eq!(version, concat!("render ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn wrong_usage_is_told_apart() {
    let folder = Folder::with_scene(SCENE);
    let before = folder.contents();
    let wrong: &[(&[&str], &[&str])] = &[
        (&["--outt", "a.png"], &["--outt"]),
        (&["scene.toml", "--out"], &["--out"]),
        (&["scene.toml", "--out", ""], &["file name"]),
        (&["scene.toml", "--out", "a.jpg"], &["a.jpg", ".png, .exr, .npy or .pfm"]),
        (&["scene.toml", "--out", "a"], &["a:", ".png"]),
        (&["scene.toml", "other.toml"], &["scene file", "twice"]),
        (&["scene.toml", "--report", "a", "--report", "b"], &["--report", "twice"]),
        (&["scene.toml", "--threads", "-1"], &["--threads", "whole number"]),
        (&["scene.toml", "--threads", "many"], &["--threads", "many"]),
        (&["scene.toml", "--exposure", "0"], &["--exposure", "above 0"]),
        (&["scene.toml", "--exposure", "nan"], &["--exposure", "finite"]),
        (&["scene.toml", "--bands", "0,1"], &["--bands", "three"]),
        (&["scene.toml", "--bands", "a,b,c"], &["--bands", "a,b,c"]),
        (&["--out", "a.png"], &["--out", "scene file"]),
        (&["--report", "a.json"], &["--report", "scene file"]),
    ];
    for (arguments, words) in wrong {
        folder.render(arguments).refuses(2, words);
    }
    assert!(before == folder.contents());
}

#[test]
fn the_default_is_the_stem_as_png_and_exr_in_the_current_folder() {
    let folder = Folder::with_scene(SCENE);
    std::fs::create_dir(folder.path("sub")).unwrap();
    folder.write("sub/view.2.toml", SCENE.replace("plate.obj", "../plate.obj"));
    let run = folder.render(&["sub/view.2.toml"]).succeeds();
    let contents = folder.contents();
    let names: Vec<&str> = contents.keys().map(String::as_str).collect();
    assert_eq!(names, ["plate.obj", "scene.toml", "view.2.exr", "view.2.png"]);
    for word in ["2 facets", "8 x 8", "coupling", "total", "error estimate", "view.2.png", "view.2.exr"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
}

#[test]
fn all_outputs_are_written_together() {
    let folder = Folder::with_scene(SCENE);
    let arguments = ["scene.toml", "--out", "a.npy", "--out", "b.EXR", "--out", "c.pfm", "--out", "d.png"];
    let more = ["--report", "r.json", "--facets", "f.csv", "--components", "part", "--threads", "2"];
    // An existing file is replaced.
    folder.write("a.npy", "old");
    folder.render(&[&arguments[..], &more].concat()).succeeds();
    let contents = folder.contents();
    let names: Vec<&str> = contents.keys().map(String::as_str).collect();
    let components = ["part_diffuse.npy", "part_mirror_diffuse.npy", "part_mirror_sky.npy"];
    let expected = [
        &["a.npy", "b.EXR", "c.pfm", "d.png", "f.csv"],
        &components[..],
        &["plate.obj", "r.json", "scene.toml"],
    ];
    assert_eq!(names, expected.concat());
    assert_eq!(render::read_npy(&contents["a.npy"]).0, [8, 8, 1]);
}

#[test]
fn exactly_the_scene_file_may_be_read_from_elsewhere() {
    let folder = Folder::with_scene(SCENE);
    // The mesh is relative to the scene, the outputs to the current folder.
    let scene = folder.path("scene.toml");
    let other = tempfile::tempdir().unwrap();
    let mut command = Command::new(program());
    command.arg(&scene).current_dir(other.path());
    assert!(command.output().unwrap().status.success());
    assert!(other.path().join("scene.png").is_file() && !folder.path("scene.png").exists());
}

#[test]
fn no_file_changes_when_one_cannot_be_written() {
    let folder = Folder::with_scene(SCENE);
    std::fs::create_dir(folder.path("folder.exr")).unwrap();
    folder.write("a.npy", "old").write("blocker", "");
    for (bad, word) in [
        ("missing/b.exr", "missing/b.exr"),
        ("folder.exr", "not a regular file"),
        ("blocker/b.exr", "blocker/b.exr"),
        ("a.npy", "twice"),
    ] {
        folder.fails_without_trace(&["scene.toml", "--out", "a.npy", "--out", bad], &["cannot write", word]);
    }
    for input in ["scene.toml", "plate.obj"] {
        folder.fails_without_trace(&["scene.toml", "--report", input], &[input, "is read too"]);
    }
    for option in ["--report", "--facets", "--components"] {
        folder.fails_without_trace(&["scene.toml", "--out", "a.npy", option, "no/x"], &["no/x"]);
    }
}

#[cfg(unix)]
#[test]
fn no_file_changes_when_the_disk_is_full() {
    // A limit on the size of files stands for a full disk: writing fails halfway in the same way. The signal
    // must be ignored, else it ends the program.
    let folder = Folder::with_scene(&SCENE.replace("[8, 8]", "[64, 64]"));
    folder.write("a.npy", "old");
    let before = folder.contents();
    for outputs in ["--out a.npy", "--out a.png --components c", "--out b.npy --out d.pfm --report r.json"] {
        let mut command = Command::new("sh");
        let script = format!("trap '' XFSZ; ulimit -f 1; exec \"$0\" scene.toml {outputs}");
        command.args(["-c", &script]).arg(program());
        folder.run(command).fails(&["cannot write"]);
        assert!(before == folder.contents(), "{outputs}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn devices_are_refused_and_links_are_followed() {
    let folder = Folder::with_scene(SCENE);
    std::os::unix::fs::symlink("/dev/full", folder.path("full.npy")).unwrap();
    folder.fails_without_trace(&["scene.toml", "--out", "full.npy"], &["full.npy", "not a regular file"]);
    folder.write("real.npy", "old");
    std::os::unix::fs::symlink("real.npy", folder.path("link.npy")).unwrap();
    folder.render(&["scene.toml", "--out", "link.npy"]).succeeds();
    assert!(folder.path("link.npy").is_symlink());
    assert_eq!(render::read_npy(&folder.read("real.npy")).0, [8, 8, 1]);
}

#[test]
fn bands_and_formats_must_fit_the_scene() {
    let two = SCENE.replace("tolerance", "bands = 2\ntolerance");
    let folder = Folder::with_scene(&two);
    let words = ["--bands", "band 2", "0 to 1"];
    folder.fails_without_trace(&["scene.toml", "--bands", "0,1,2"], &words);
    folder.fails_without_trace(&["scene.toml", "--out", "a.pfm"], &["a.pfm", "1 or 3 bands"]);
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = Folder::with_scene(SCENE);
    let mut child = Command::new(program())
        .args(["scene.toml", "--out", "a.npy"])
        .current_dir(folder.path(""))
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
}

#[test]
fn the_built_in_aircraft_is_the_default_scene() {
    let folder = Folder::with_scene(SCENE);
    let run = folder.render(&[]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for name in ["aircraft_diffuse", "aircraft_mirror"] {
        let decoder = png::Decoder::new(std::io::Cursor::new(folder.read(&format!("{name}.png"))));
        let reader = decoder.read_info().unwrap();
        assert_eq!(reader.info().size(), (512, 512));
        assert!(folder.read(&format!("{name}.exr")).starts_with(&[0x76, 0x2f, 0x31, 0x01]));
        assert!(run.stdout.contains(name));
    }
    assert_eq!(folder.contents().len(), 6);
}
