//! Regular files. A pipe or a device may never end, or block the program that opens it.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// It cannot be opened, or is a folder, a pipe or a device.
pub fn open(path: &Path) -> Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    let refused = |what: &str| Err(Error::new(ErrorKind::InvalidInput, what));
    if kind.is_dir() {
        return refused("it is a folder, not a file");
    }
    if !kind.is_file() {
        return refused("it is no regular file but a device or a pipe, which may never end");
    }
    File::open(path)
}

/// Reads a regular file whole.
///
/// # Errors
/// As [`open`], or it cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn what_may_never_end_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [Path::new("/dev/zero"), &pipe] {
            let error = read(path).unwrap_err().to_string();
            assert!(error.contains("which may never end"), "{error}");
        }
        let error = read(folder.path()).unwrap_err().to_string();
        assert_eq!(error, "it is a folder, not a file");
    }
}
