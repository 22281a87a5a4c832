//! Holds the sources against the layers of the design: data flows down the layers, imports point up them.

use std::fs;
use std::path::Path;

/// What each module may import, besides itself.
const MAY_IMPORT: [(&str, &[&str]); 19] = [
    ("core", &[]),
    ("geometry", &["core"]),
    ("bxdf", &["core"]),
    ("film", &["core"]),
    ("image_io", &["core"]),
    ("accel", &["core", "geometry"]),
    ("scene", &["core", "geometry", "bxdf", "image_io"]),
    ("guiding", &["core", "geometry", "bxdf", "scene", "accel"]),
    ("integrator", &["core", "bxdf", "scene", "film", "accel", "guiding"]),
    ("render", &["core", "film", "accel", "scene", "guiding", "integrator"]),
    ("trace", WORK),
    ("farm", WORK),
    ("report", &["core", "image_io"]),
    (
        "compare",
        &[
            "core",
            "geometry",
            "bxdf",
            "film",
            "accel",
            "scene",
            "integrator",
            "render",
            "image_io",
            "trace",
            "report",
        ],
    ),
    (
        "trade",
        &["core", "geometry", "bxdf", "accel", "scene", "render", "image_io", "trace", "report", "compare"],
    ),
    ("figures", &["core", "bxdf", "accel", "scene", "render", "image_io", "compare"]),
    ("batch", WORK),
    // A sweep makes its pictures in the workshop of `batch`.
    ("sweep", &["scene", "batch"]),
    (
        "cli",
        &[
            "core",
            "geometry",
            "bxdf",
            "film",
            "accel",
            "scene",
            "integrator",
            "render",
            "image_io",
            "trace",
            "report",
            "compare",
            "farm",
            "figures",
            "batch",
            "sweep",
            "trade",
        ],
    ),
];

/// What whole jobs are built from.
const WORK: &[&str] =
    &["core", "geometry", "bxdf", "film", "accel", "scene", "integrator", "render", "image_io"];

/// The crate's modules that a source text names, `use` or not: what follows `crate::`, and each of what follows in
/// braces. Comments do not count, nor does `$crate`.
fn imports(source: &str) -> Vec<String> {
    let code: String =
        source.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join(" ");
    let mut found = Vec::new();
    for (at, word) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let rest = code[at + word.len()..].trim_start();
        match rest.strip_prefix('{') {
            Some(group) => found.extend(heads_of_group(group)),
            None => found.push(head(rest)),
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

/// `accel::{A, B}, core::C }` gives `accel` and `core`.
fn heads_of_group(group: &str) -> Vec<String> {
    let (mut depth, mut start, mut heads) = (1, 0, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if (c == ',' && depth == 1) || depth == 0 {
            heads.push(head(group[start..at].trim_start()));
            start = at + 1;
        }
        if depth == 0 {
            break;
        }
    }
    heads
}

fn head(path: &str) -> String {
    path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// What is wrong with a file of `module`.
fn violations(module: &str, source: &str) -> Vec<String> {
    let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| *name == module) else {
        return vec![format!("the module `{module}` is in no layer")];
    };
    let is_module = |name: &str| MAY_IMPORT.iter().any(|(module, _)| *module == name);
    imports(source)
        .into_iter()
        .filter(|name| name != module && !allowed.contains(&name.as_str()))
        .map(|name| match is_module(&name) {
            true => format!("`{module}` imports `{name}`"),
            false => format!("`{module}` imports `{name}`, which is in no layer"),
        })
        .collect()
}

/// Every source file below a path, with the module that it belongs to.
fn sources(path: &Path, module: Option<&str>, into: &mut Vec<(String, std::path::PathBuf)>) {
    for entry in fs::read_dir(path).expect("the sources are there") {
        let path = entry.expect("the sources are readable").path();
        let name = path.file_stem().expect("files have names").to_string_lossy().into_owned();
        if path.is_dir() {
            sources(&path, Some(module.unwrap_or(&name)), into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push((module.unwrap_or(&name).to_owned(), path));
        }
    }
}

#[test]
fn no_module_imports_what_is_above_it() {
    let mut files = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), None, &mut files);
    files.retain(|(module, _)| module != "lib" && module != "main");
    assert!(files.len() > 20, "the sources are found");
    let mut wrong = Vec::new();
    for (module, path) in files {
        let source = fs::read_to_string(&path).expect("the sources are readable");
        wrong.extend(
            violations(&module, &source).into_iter().map(|what| format!("{}: {what}", path.display())),
        );
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_layers_have_no_cycle() {
    // Each module may import only modules that come before it in the table.
    for (at, (module, allowed)) in MAY_IMPORT.iter().enumerate() {
        for name in *allowed {
            let place = MAY_IMPORT.iter().position(|(other, _)| other == name);
            assert!(place.is_some_and(|place| place < at), "{module} -> {name}");
        }
    }
}

#[test]
fn a_bad_import_is_found_however_it_is_written() {
    for bad in [
        "use crate::scene::Scene;",
        "pub use crate :: scene;".replace(" ::", "::").as_str(),
        "fn f() -> crate::scene::Scene { todo!() }",
        "use crate::{core::Ray, scene::{Scene, Camera}};",
        "use crate::{\n    core::{Hit, Ray},\n    scene,\n};",
        "pub(in crate::scene) struct X;",
        "use crate::core::Ray; // crate::core\nuse crate::scene;",
    ] {
        assert_eq!(violations("accel", bad), ["`accel` imports `scene`"], "{bad}");
    }
    assert_eq!(violations("core", "use crate::nonsense::X;").len(), 1);
    assert_eq!(violations("helpers", ""), ["the module `helpers` is in no layer"]);
}

#[test]
fn good_imports_and_words_in_comments_pass() {
    let good = "//! See [`Scene`](crate::scene::Scene).\nuse crate::{core::{Hit, Ray}, geometry::Shape};\n\
                /// crate::cli\nuse super::brute; macro_rules! m { () => { $crate::scene::X } }\nuse crate::accel::Hit;";
    assert_eq!(violations("accel", good), Vec::<String>::new());
}
