//! Tall Parquet (time, name, value) converted to one column per name: by import, or by ingest.
//! Ingest keeps the result beside its records and reads it like any flight.
//!
//! Names whose times are mostly those of the name with the most values form one part; missing
//! values are empty. The other names form further parts, one for each set of times: files with
//! clocks of their own.

mod ordering;
mod parts;
mod source;
mod survey;
mod wide_table;

use std::path::{Path, PathBuf};

use super::imported_contents::{ImportedContents, refused};
use super::naming::Naming;
use crate::error::Result;
use crate::store::atomic::Draft;

pub use source::{Role, Tall};

/// Imports a Parquet file of three or four columns. One of several parts becomes a folder of files.
pub fn import(source: &Path, file: &Path, naming: &Naming) -> Result<ImportedContents> {
    let Some(tall) = Tall::open(source)? else {
        let what = "Parquet with one column a channel is read as it is: name it as the archive, or give it to `harvest \
                    init --from`; the channel map (aircraft.yaml) has the meaning of its columns, whatever their names. \
                    Import takes tall files with the columns time, name, value and perhaps unit";
        return Err(refused(source, what));
    };
    naming.refuse_tall(source)?;
    import_opened(&tall, file)
}

/// Imports an opened file.
pub fn import_opened(tall: &Tall, file: &Path) -> Result<ImportedContents> {
    let survey = tall.survey()?;
    let parts = tall.parts(&survey, file)?;
    let folder = (parts.len() > 1).then(|| folder_of(file));
    let place = |k: usize| match &folder {
        Some(folder) => folder.join(format!("part_{:03}.parquet", k + 1)),
        None => file.to_owned(),
    };
    let tables = tall.tables(&survey, &parts, &place, |_| true)?;
    if tables.is_empty() {
        return Err(refused(&tall.source, "it has no values"));
    }
    let mut contents = ImportedContents::default();
    let mut replaced = 0;
    for (k, table) in tall.filled(&survey, tables, file)?.into_iter().enumerate() {
        replaced += table.replaced;
        contents.rows += table.writer.place()?;
        contents
            .columns
            .extend(table.columns.into_iter().skip(usize::from(k > 0)));
    }
    if replaced > 0 {
        contents.notes.push(format!(
            "{replaced} values came twice for a time and a name; the last one counts"
        ));
    }
    if folder.is_some() {
        contents.notes.push(format!(
            "{} files: the names have values at {} sets of times",
            parts.len(),
            parts.len()
        ));
    }
    Ok(ImportedContents { folder, ..contents })
}

/// Folder whose files are one flight, in the place of a file.
fn folder_of(file: &Path) -> PathBuf {
    let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned());
    file.with_file_name(format!("flight={}", stem.unwrap_or_default()))
}

impl Tall {
    /// Writes a draft beside `place` for each part that has a wanted name, with one column for each
    /// of these names.
    ///
    /// # Errors
    /// [`Error::Archive`] for the file; [`Error::Io`] or [`Error::Store`] for the disk.
    pub fn widened(&self, place: &Path, is_wanted: impl Fn(&str) -> bool) -> Result<Vec<Draft>> {
        let survey = self.survey()?;
        let parts = self.parts(&survey, place)?;
        let tables = self.tables(&survey, &parts, &|_| place.to_owned(), is_wanted)?;
        let filled = self.filled(&survey, tables, place)?.into_iter();
        filled.map(|table| Ok(table.writer.finish()?.0)).collect()
    }
}
