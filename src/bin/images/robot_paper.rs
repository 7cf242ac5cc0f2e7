//! The robot image with the paper's particle filter (`src/bin/robot/main.rs`). On a host it is a program that names its board and fails, so
//! that `cargo build --all-features` works there.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../robot/main.rs"]
mod image;

/// The robot of the image.
#[cfg(target_os = "none")]
use toposlam::reference::paper as robot;

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("this image runs on the reference board only; build it with `cargo firmware --bin robot_paper`");
    std::process::ExitCode::FAILURE
}
