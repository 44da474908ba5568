//! Files that several processes read while one replaces them.

use crate::{IoError, write_atomically};
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

/// How often and how long another writer is waited for: 10 s in all.
const ATTEMPTS: u32 = 200;
const PAUSE: Duration = Duration::from_millis(50);

/// The content of the file at `path`; `None` if there is no such file. What is read is never half a file, for
/// [`replace_exclusively`] and [`write_atomically`] put complete ones in its place; so readers take no lock.
///
/// # Errors
/// It cannot be read.
pub fn read_if_present(path: &Path) -> Result<Option<Vec<u8>>, IoError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(source) => Err(IoError::Read { path: path.into(), source }),
    }
}

/// Writes the file at `path` like [`write_atomically`], one process at a time: under the lock of a hidden file beside it,
/// which stays (removing it would let two writers hold different locks).
///
/// # Errors
/// Another process has been writing for 10 s, or the file cannot be written.
pub fn replace_exclusively(path: &Path, content: &[u8]) -> Result<(), IoError> {
    let lock = lock_file(path)?;
    for attempt in 1.. {
        match lock.try_lock() {
            Ok(()) => break,
            Err(TryLockError::WouldBlock) if attempt < ATTEMPTS => sleep(PAUSE),
            Err(TryLockError::WouldBlock) => {
                let busy = io::Error::new(ErrorKind::WouldBlock, "another process is writing it");
                return Err(IoError::write(path, busy));
            }
            // Some network file systems know no locks: the replacement is atomic all the same.
            Err(TryLockError::Error(_)) => break,
        }
    }
    // The lock ends with `lock`.
    write_atomically(path, |out| out.write_all(content).map_err(|e| IoError::write(path, e)))
}

fn lock_file(path: &Path) -> Result<File, IoError> {
    let name = path.file_name().ok_or_else(|| IoError::NotAFile { path: path.into() })?;
    let hidden: PathBuf = path.with_file_name(format!(".{}.lock", name.to_string_lossy()));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(IoError::FolderMissing { path: path.into(), folder: folder.into() });
    }
    File::options().create(true).truncate(false).write(true).open(hidden).map_err(|e| IoError::write(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readers_see_complete_files_while_writers_take_turns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shot.tyc");
        assert_eq!(read_if_present(&path).unwrap(), None);
        let content = |i: u8| vec![i; 100_000];
        replace_exclusively(&path, &content(0)).unwrap();
        std::thread::scope(|scope| {
            for i in 1..4 {
                let path = &path;
                scope.spawn(move || (0..5).for_each(|_| replace_exclusively(path, &content(i)).unwrap()));
            }
            for _ in 0..50 {
                let bytes = read_if_present(&path).unwrap().unwrap();
                assert!(bytes == content(bytes[0]));
            }
        });
    }

    #[test]
    fn what_cannot_be_read_or_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(read_if_present(folder.path()), Err(IoError::Read { .. })));
        let nowhere = folder.path().join("no/such/shot.tyc");
        assert!(matches!(replace_exclusively(&nowhere, b""), Err(IoError::FolderMissing { .. })));
        assert!(matches!(replace_exclusively(Path::new(""), b""), Err(IoError::NotAFile { .. })));
    }
}
