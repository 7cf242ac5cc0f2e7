//! The bench image (`src/bin/bench/main.rs`). On a host it is a program that names its board and fails, so that
//! `cargo build --all-features` works there.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../bench/main.rs"]
mod image;

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this image runs on the reference board only; build it with `cargo firmware --bin bench`");
    std::process::ExitCode::FAILURE
}
