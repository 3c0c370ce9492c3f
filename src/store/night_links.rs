//! Paths of the current night in the folder of reports.

/// Link to the folder of the current night.
pub const CURRENT: &str = "current";

pub use link::{is_placed, place, place_all, target};

/// Symbolic links.
#[cfg(unix)]
mod link {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::Path;

    use super::CURRENT;
    use crate::error::{Error, Result};
    use crate::store::atomic;

    /// Target of a link; `None` for any other file.
    pub fn target(path: &Path) -> Option<String> {
        Some(fs::read_link(path).ok()?.to_string_lossy().into_owned())
    }

    /// Places a link by one rename, replacing any file or link of that name.
    pub fn place(path: &Path, target: &str) -> Result<()> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let beside = folder.join(format!("{}link", atomic::TEMPORARY));
        let _ = fs::remove_file(&beside);
        std::os::unix::fs::symlink(target, &beside)
            .map_err(Error::io(&beside, "cannot create a link"))?;
        fs::rename(&beside, path).map_err(Error::io(path, "cannot put the link in its place"))
    }

    /// `true` if the file of a night in the folder of reports is the link to it.
    pub fn is_placed(reports: &Path, _: &Path, name: &str) -> bool {
        target(&reports.join(name)) == Some(link_to(name))
    }

    fn link_to(name: &str) -> String {
        format!("{CURRENT}/{name}")
    }

    /// Links each file of a night in the folder of reports, and removes the links of other files.
    pub fn place_all<'a>(
        reports: &Path,
        _: &Path,
        names: impl Iterator<Item = &'a String>,
    ) -> Result<()> {
        let wanted: BTreeMap<String, String> =
            names.map(|name| (name.clone(), link_to(name))).collect();
        for (name, to) in &wanted {
            let path = reports.join(name);
            if target(&path).as_ref() != Some(to) {
                place(&path, to)?;
            }
        }
        let entries =
            fs::read_dir(reports).map_err(Error::io(reports, "cannot list the folder"))?;
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = entry.path();
            let is_link = target(&path).is_some_and(|to| to.starts_with(&format!("{CURRENT}/")));
            if is_link && !wanted.contains_key(&name) {
                fs::remove_file(&path).map_err(Error::io(&path, "cannot remove it"))?;
            }
        }
        Ok(())
    }
}

/// Systems without links: the pointer is a text file, the files are copies.
#[cfg(not(unix))]
mod link {
    use std::fs;
    use std::path::Path;

    use crate::error::{Error, Result};
    use crate::store::atomic;

    pub fn target(path: &Path) -> Option<String> {
        Some(fs::read_to_string(path).ok()?.trim().to_owned())
    }

    pub fn place(path: &Path, target: &str) -> Result<()> {
        atomic::place(path, target.as_bytes())
    }

    /// `true` if the file of a night in the folder of reports has the bytes of the night's.
    pub fn is_placed(reports: &Path, night: &Path, name: &str) -> bool {
        let read = |folder: &Path| fs::read(folder.join(name)).ok();
        read(reports) == read(night)
    }

    pub fn place_all<'a>(
        reports: &Path,
        night: &Path,
        names: impl Iterator<Item = &'a String>,
    ) -> Result<()> {
        for name in names {
            let from = night.join(name);
            atomic::place(
                &reports.join(name),
                &fs::read(&from).map_err(Error::io(&from, "cannot read it"))?,
            )?;
        }
        Ok(())
    }
}
