//! Finds Embree, binds the header that is installed and links its library.
//!
//! Debian ships no pkg-config file for Embree, and its versions 3 and 4 differ in calls and in the size of their
//! structs: so the bindings are made from the header that belongs to the library, and the source asks
//! `cfg(embree3)` or `cfg(embree4)`. Without the feature `embree` this does nothing.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(embree3)");
    println!("cargo::rustc-check-cfg=cfg(embree4)");
    #[cfg(feature = "embree")]
    embree::bind_and_link();
}

#[cfg(feature = "embree")]
mod embree {
    use std::env;
    use std::path::{Path, PathBuf};
    use std::process::exit;

    /// Where a C compiler looks without being told.
    const INCLUDE_DIRS: [&str; 3] = ["/usr/local/include", "/usr/include", "/opt/homebrew/include"];

    /// An installed Embree.
    struct Installation {
        /// 3 or 4.
        major: u32,
        /// Holds `embree3` or `embree4`.
        include_dir: PathBuf,
        /// Holds the library, where that is not for the linker to know.
        lib_dir: Option<PathBuf>,
    }

    pub(super) fn bind_and_link() {
        for name in ["EMBREE_DIR", "LIBCLANG_PATH", "LLVM_CONFIG_PATH", "BINDGEN_EXTRA_CLANG_ARGS"] {
            println!("cargo::rerun-if-env-changed={name}");
        }
        let found = find().unwrap_or_else(|| stop("finds no embree4/rtcore.h and no embree3/rtcore.h"));
        if !libclang_loads() {
            stop("finds no libclang to read Embree's header with");
        }
        bind(&found);
        println!("cargo::rustc-cfg=embree{}", found.major);
        println!("cargo::rustc-link-lib=embree{}", found.major);
        if let Some(dir) = &found.lib_dir {
            println!("cargo::rustc-link-search=native={}", dir.display());
            println!("cargo::rustc-link-arg=-Wl,-rpath,{}", dir.display());
        }
    }

    /// Below `EMBREE_DIR`, else in the usual places; Embree 4 before Embree 3.
    fn find() -> Option<Installation> {
        let own = env::var_os("EMBREE_DIR").filter(|dir| !dir.is_empty()).map(PathBuf::from);
        if let Some(own) = own {
            let lib_dir = ["lib", "lib64"].map(|lib| own.join(lib)).into_iter().find(|lib| lib.is_dir());
            let include_dir = own.join("include");
            return [4, 3]
                .into_iter()
                .find(|&major| header(&include_dir, major).is_file())
                .map(|major| Installation { major, include_dir, lib_dir });
        }
        [4, 3].into_iter().find_map(|major| {
            let include_dir =
                INCLUDE_DIRS.map(PathBuf::from).into_iter().find(|d| header(d, major).is_file())?;
            Some(Installation { major, include_dir, lib_dir: None })
        })
    }

    fn header(include_dir: &Path, major: u32) -> PathBuf {
        include_dir.join(format!("embree{major}/rtcore.h"))
    }

    /// Writes `embree.rs` to `OUT_DIR`. Enums stay plain numbers with names, since C may return one that this
    /// header does not know; bindgen's layout tests hold every struct's size against the header at compile time.
    fn bind(found: &Installation) {
        let builder = bindgen::builder()
            .header(header(&found.include_dir, found.major).display().to_string())
            .clang_arg(format!("-I{}", found.include_dir.display()))
            .allowlist_item("(rtc|RTC).*")
            .default_enum_style(bindgen::EnumVariation::NewType { is_bitfield: false, is_global: false })
            .bitfield_enum("RTC.*Flags")
            .derive_default(true)
            .generate_cstr(true)
            .layout_tests(true)
            .rust_edition(bindgen::RustEdition::Edition2024)
            .formatter(bindgen::Formatter::None)
            .parse_callbacks(Box::new(bindgen::CargoCallbacks::new()));
        let bindings = builder.generate().unwrap_or_else(|error| {
            let reason = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
            stop(&format!("cannot read Embree's header: {reason}"))
        });
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("embree.rs");
        if let Err(error) = bindings.write_to_file(&out) {
            stop(&format!("cannot write {}: {error}", out.display()));
        }
    }

    /// Bindgen panics where it finds no libclang.
    fn libclang_loads() -> bool {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let loads = std::panic::catch_unwind(bindgen::clang_version).is_ok();
        std::panic::set_hook(hook);
        loads
    }

    /// Ends the build with the one message that says what mends it. Cargo fails a build whose script logs an error,
    /// and adds the script's whole output where it also exits with another code than 0.
    fn stop(problem: &str) -> ! {
        let place = env::var("EMBREE_DIR").map_or(String::new(), |dir| format!(" (below EMBREE_DIR={dir})"));
        println!(
            "cargo::error=gloss {problem}{place}: run `apt-get install libembree-dev libclang-dev`, or build \
             without Embree by `--no-default-features`"
        );
        exit(0)
    }
}
