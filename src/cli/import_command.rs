//! The command `import`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::store::import;

/// Help below the options.
pub const IMPORT_HELP: &str = "\
Formats, known by their content:
  text      one row a sample: any delimiter, decimal commas, units in brackets or in a row of their own, comments above
  MATLAB    version 5 (-v6, -v7) and 7.3: vectors, matrices and structs; other HDF5 alike
  Parquet   tall: columns time, name, value and perhaps unit; runs and init also read it as it is. A Parquet file with one \
column a channel needs no import

Numbers keep every bit; fields that are not numbers become missing values. import.json beside the files names each source with its \
fingerprint, the columns with their units, and what was left out.

Examples:
  harvest import recordings/*.csv --to data/mine/flights
  harvest import runs/*.asc --to data/mine/flights --step 0.04 --names 'p [rad/s], q [rad/s], r [rad/s], phi [rad]'
  harvest init mine --from data/mine/flights

Exit codes: 0 written; 1 not written, the message says why.";

#[derive(Args, Debug)]
pub struct ImportOptions {
    /// Recordings: files, or folders of files
    #[arg(value_name = "FILE_OR_FOLDER", required = true)]
    from: Vec<PathBuf>,
    /// Folder of the archive to write into
    #[arg(long, value_name = "FOLDER")]
    to: PathBuf,
    /// Names of the columns in the order of the source, with their units: 'time [s], de [rad], -, V [m/s]'; - leaves one out
    #[arg(long, value_name = "LIST")]
    names: Option<String>,
    /// Time from row to row in s, of recordings without a clock
    #[arg(long, value_name = "SECONDS")]
    step: Option<f64>,
}

/// Imports recordings and prints what was written.
pub fn import(options: &ImportOptions) -> anyhow::Result<ExitCode> {
    let naming =
        import::Naming::of(options.names.as_deref(), options.step).map_err(anyhow::Error::msg)?;
    let mut imported: Vec<import::Imported> = Vec::new();
    for place in &options.from {
        for source in import::sources(place)? {
            let file = import::target(&source, &options.to);
            anyhow::ensure!(
                imported.iter().all(|other| other.file != file),
                "{}: another source has this name too; import it into another folder",
                source.display()
            );
            let one = match import::import(&source, &options.to, &naming) {
                // Folders of recordings have notes and lists of the flights in them.
                Err(error) if import::is_note_in(place, &error) => {
                    out!("{}: left out, it has no table of numbers", source.display());
                    continue;
                }
                other => other?,
            };
            let (columns, rows) = (one.columns.len(), one.rows);
            out!(
                "{}: {columns} columns, {rows} rows from {}",
                one.file.display(),
                source.display()
            );
            // A note that many files share is printed once; the manifest has it with each.
            let is_new = |note: &&String| imported.iter().all(|other| !other.notes.contains(note));
            for note in one.notes.iter().filter(is_new) {
                out!("  {note}");
            }
            imported.push(one);
        }
    }
    anyhow::ensure!(
        !imported.is_empty(),
        "none of the files has a table of numbers"
    );
    let manifest = import::write_manifest(&options.to, &imported)?;
    out!("manifest: {}", manifest.display());
    Ok(ExitCode::SUCCESS)
}
