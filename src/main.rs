//! The `gloss` program: see `gloss::cli`.

fn main() -> std::process::ExitCode {
    gloss::cli::main()
}
