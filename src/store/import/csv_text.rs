//! Delimited text: any delimiter, a row of units, decimal commas, comments before the header.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::csv_layout::{HEAD_BYTES, Layout, whole_lines};
use super::delimited::{Failures, next_line};
use super::flight_file::batch_rows;
use super::imported_contents::{ImportedColumn, ImportedContents, refused};
use super::naming::{NamedWriter, Naming, note_on_nameless};
use super::tall_text::TallLayout;
use crate::error::{Error, Result};

/// Imports a delimited text.
pub fn import(source: &Path, file: &Path, naming: &Naming) -> Result<ImportedContents> {
    let head = beginning(source)?;
    if let Some(tall) = TallLayout::of(&whole_lines(&head)) {
        naming.refuse_tall(source)?;
        return tall.import(source, file);
    }
    let layout = Layout::of(&head).map_err(|message| refused(source, &message))?;
    let columns = layout.columns.iter().map(|column| column.head.clone());
    let columns: Vec<ImportedColumn> = columns.collect();
    let writer = naming.writer(source, file, &columns)?;
    let heads = writer.heads.clone();
    let (rows, failures) = write_rows(source, &layout, writer)?;
    let mut notes = failures.notes();
    if !layout.has_names && !naming.has_names() {
        notes.push(note_on_nameless(&columns));
    }
    if !layout.dropped.is_empty() {
        notes.push(format!(
            "columns of text are left out: {}",
            layout.dropped.join(", ")
        ));
    }
    notes.extend(layout.notes_on_times());
    notes.extend(naming.note_on_time(&columns));
    Ok(ImportedContents {
        rows,
        columns: heads,
        notes,
        folder: None,
    })
}

/// Beginning of a text, from which its layout follows.
fn beginning(source: &Path) -> Result<String> {
    let mut head = Vec::new();
    opened(source)?
        .take(HEAD_BYTES)
        .read_to_end(&mut head)
        .map_err(Error::io(source, "cannot read it"))?;
    if let Some(message) = other_text(&head) {
        return Err(refused(source, message));
    }
    Ok(String::from_utf8_lossy(&head).into_owned())
}

fn opened(source: &Path) -> Result<File> {
    File::open(source).map_err(Error::io(source, "cannot open it"))
}

/// Writes the rows of a text batch by batch; returns their number and the fields that are no numbers.
fn write_rows(
    source: &Path,
    layout: &Layout,
    mut writer: NamedWriter,
) -> Result<(usize, Failures)> {
    let mut reader = BufReader::new(opened(source)?);
    let mut failures = Failures::default();
    let mut batch = vec![Vec::new(); layout.columns.len()];
    let at_once = batch_rows(layout.columns.len());
    let (mut line, mut number) = (Vec::new(), 0);
    while next_line(&mut reader, &mut line).map_err(Error::io(source, "cannot read it"))? {
        number += 1;
        let text = String::from_utf8_lossy(&line);
        if number > layout.skipped && !text.trim().is_empty() {
            layout.append(&text, number, &mut batch, &mut failures);
        }
        if batch.first().is_some_and(|column| column.len() == at_once) {
            writer.write(&batch)?;
            batch.iter_mut().for_each(Vec::clear);
        }
    }
    writer.write(&batch)?;
    if writer.rows < 2 {
        return Err(refused(
            source,
            "it has a single row of numbers: a recording has more",
        ));
    }
    Ok((writer.place()?, failures))
}

/// Kind of a text whose lines cannot be read, in words.
fn other_text(head: &[u8]) -> Option<&'static str> {
    let has = |byte: u8| head.contains(&byte);
    (has(b'\r') && !has(b'\n'))
        .then_some("its lines end with carriage returns alone; save it with line feeds")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_line_ends_are_named() {
        let message = |head: &[u8]| other_text(head).unwrap_or_default();
        assert!(message(b"time,q\r0,1\r1,2\r").contains("carriage returns"));
        assert_eq!(message(b"time,q\r\n0,1\r\n"), "");
    }
}
