//! A complete new file or the untouched old one.

use crate::IoError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes the file at `path` through a temporary file in the same folder and a rename, so that an interrupted or failed
/// write never damages an existing file and no reader sees half of one. Links are followed; the temporary file is
/// removed on any error.
///
/// # Errors
/// The folder is missing, `path` is not a regular file, the disk refused, or `write` failed.
pub fn write_atomically<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<T, IoError>,
) -> Result<T, IoError> {
    let target = resolve_target(path)?;
    let folder = parent_folder(&target);
    if !folder.is_dir() {
        return Err(IoError::FolderMissing { path: path.into(), folder: folder.into() });
    }
    let io_error = |source: io::Error| IoError::write(path, source);

    let mut temporary = builder().tempfile_in(folder).map_err(io_error)?;
    let mut writer = BufWriter::new(temporary.as_file_mut());
    let result = write(&mut writer)?;
    writer.flush().map_err(io_error)?;
    drop(writer);
    // The content must be on disk before the name is: a power cut between them would leave an empty file.
    temporary.as_file().sync_all().map_err(io_error)?;
    temporary.persist(&target).map_err(|e| io_error(e.error))?;
    Ok(result)
}

/// The file to replace: what `path` links to if it is a link, else `path`.
fn resolve_target(path: &Path) -> Result<PathBuf, IoError> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => Err(IoError::NotAFile { path: path.into() }),
        Ok(_) => fs::canonicalize(path).map_err(|e| IoError::write(path, e)),
        Err(_) if path.file_name().is_none() => Err(IoError::NotAFile { path: path.into() }),
        Err(_) => Ok(path.into()),
    }
}

fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tyndall-").suffix(".tmp");
    // Temporary files are private by default; a finished image is as readable as any other file of its user.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn write_text(path: &Path, text: &str) -> Result<(), IoError> {
        write_atomically(path, |w| w.write_all(text.as_bytes()).map_err(|e| IoError::write(path, e)))
    }

    #[test]
    fn replaces_the_file_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_text(&path, "old").unwrap();
        write_text(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn an_error_or_a_panic_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_text(&path, "old").unwrap();
        let failed = write_atomically(&path, |w| {
            w.write_all(b"half").unwrap();
            Err::<(), _>(IoError::invalid_image(&path, "stop"))
        });
        assert!(failed.is_err());
        let panicked = std::panic::catch_unwind(|| write_atomically::<()>(&path, |_| panic!("stop")));
        assert!(panicked.is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_text(&folder.path().join("no/such/a.exr"), "").unwrap_err();
        assert!(matches!(&error, IoError::FolderMissing { .. }));
        assert!(error.to_string().contains("no/such\" does not exist"), "{error}");
    }

    #[test]
    fn folders_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path(), Path::new("/"), Path::new("")] {
            assert!(matches!(write_text(path, ""), Err(IoError::NotAFile { .. })), "{path:?}");
        }
        #[cfg(unix)]
        assert!(matches!(write_text(Path::new("/dev/null"), ""), Err(IoError::NotAFile { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_others_may_read() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        write_text(&real, "old").unwrap();
        symlink(&real, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

        let ordinary = folder.path().join("ordinary");
        fs::write(&ordinary, "").unwrap();
        let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&real), mode(&ordinary));
    }
}
