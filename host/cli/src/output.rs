//! The standard output and the standard error of the commands: an output that fails ends a command, and does not panic.
//!
//! A reader that closes the output, as `head` does, ends the command quietly and with success. Any other failure, such as a full
//! device, is an error.
//!
//! ```
//! # fn run() -> Result<(), toposlam_cli::output::OutputError> {
//! toposlam_cli::outln!("{} places", 3)?;
//! # Ok(())
//! # }
//! ```

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use anyhow::Context;

/// The standard output failed.
#[derive(Debug)]
pub struct OutputError(io::Error);

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("writing the standard output")
    }
}

impl std::error::Error for OutputError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.0)
    }
}

/// An error with an exit status of its own.
#[derive(Debug)]
pub struct ExitError {
    /// The exit status.
    pub code: u8,
    text: String,
}

impl ExitError {
    /// An error with this exit status and text.
    pub const fn new(code: u8, text: String) -> Self {
        Self { code, text }
    }
}

impl fmt::Display for ExitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for ExitError {}

/// Writes a formatted line to the standard output; a `Result` with an [`OutputError`](crate::output::OutputError).
#[macro_export]
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::output::write_line(::core::format_args!($($text)*))
    };
}

/// Writes a formatted line to the standard error. If that fails, there is nobody to report it to.
#[macro_export]
macro_rules! errln {
    ($($text:tt)*) => {
        $crate::output::write_error_line(::core::format_args!($($text)*))
    };
}

/// The function of [`outln!`](crate::outln).
///
/// # Errors
/// If the standard output fails.
pub fn write_line(text: fmt::Arguments<'_>) -> Result<(), OutputError> {
    let mut output = io::stdout().lock();
    writeln!(output, "{text}").map_err(OutputError)
}

/// The function of [`errln!`](crate::errln).
pub fn write_error_line(text: fmt::Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Writes bytes to the standard output at once.
///
/// # Errors
/// If the standard output fails.
pub fn write_bytes(bytes: &[u8]) -> Result<(), OutputError> {
    let mut output = io::stdout().lock();
    output.write_all(bytes).and_then(|()| output.flush()).map_err(OutputError)
}

/// Whether a command ended because the reader of its standard output has closed it.
pub fn is_closed(error: &anyhow::Error) -> bool {
    let failed = error.chain().find_map(|cause| cause.downcast_ref::<OutputError>());
    failed.is_some_and(|OutputError(error)| error.kind() == ErrorKind::BrokenPipe)
}

/// Fails if a file exists and is not to be replaced.
///
/// # Errors
/// Names the file.
pub fn check(path: &Path, force: bool) -> anyhow::Result<()> {
    // A device is not replaced.
    anyhow::ensure!(force || !path.is_file(), "{} exists; --force replaces it", path.display());
    Ok(())
}

/// Fails if a directory for results has files that are not to be replaced.
///
/// # Errors
/// Names the directory.
pub fn check_directory(path: &Path, force: bool) -> anyhow::Result<()> {
    let is_empty = path.read_dir().map_or(true, |mut files| files.next().is_none());
    anyhow::ensure!(force || is_empty, "{} is not empty; --force replaces its files", path.display());
    Ok(())
}

/// Creates a file. An existing file is replaced only with `force`.
///
/// # Errors
/// If the file exists, or cannot be created.
pub fn create(path: &Path, force: bool) -> anyhow::Result<File> {
    check(path, force)?;
    File::create(path).with_context(|| format!("creating {}", path.display()))
}

/// Writes a whole file. An existing file is replaced only with `force`.
///
/// # Errors
/// If the file exists, or cannot be written.
pub fn write_file(path: &Path, bytes: impl AsRef<[u8]>, force: bool) -> anyhow::Result<()> {
    create(path, force)?.write_all(bytes.as_ref()).with_context(|| format!("writing {}", path.display()))
}

/// Writes to a file as [`write_file`], or without one to the standard output.
///
/// # Errors
/// If the file exists, or the output cannot be written.
pub fn write(file: Option<&Path>, bytes: &[u8], force: bool) -> anyhow::Result<()> {
    match file {
        Some(path) => write_file(path, bytes, force),
        None => Ok(write_bytes(bytes)?),
    }
}
