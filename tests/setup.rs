//! The set-up of a fresh machine: what it takes for installed, and what not.

use std::fs;
use std::path::Path;
use std::process::Command;

/// The packages that `tests/setup.sh` would install on a machine that has `files`, and a C compiler.
fn missing(files: &[&str]) -> String {
    let root = tempfile::tempdir().unwrap();
    for file in files {
        let path = root.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/setup.sh");
    let output = Command::new("bash").arg(script).arg("--list").env("ROOT", root.path()).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

const HEADER: &str = "usr/include/embree3/rtcore.h";

#[test]
fn a_bare_machine_gets_all() {
    assert_eq!(missing(&[]), "libembree-dev libclang-dev");
}

#[test]
fn the_library_of_llvm_dev_is_not_the_one_that_bindgen_loads() {
    assert_eq!(missing(&[HEADER, "usr/lib/llvm-14/lib/libclang-cpp.so.14"]), "libclang-dev");
}

#[test]
fn a_machine_that_has_all_gets_nothing() {
    assert_eq!(missing(&[HEADER, "usr/lib/llvm-19/lib/libclang.so"]), "");
}
