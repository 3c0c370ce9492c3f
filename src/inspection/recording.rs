//! A recording as found: columns by name, with the unit that the file states where it states one.

/// One column of a recording, on the rows of the file; a null is a NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    pub name: String,
    /// Unit in the metadata of the file, as written there.
    pub stated: Option<String>,
    pub values: Vec<f64>,
}

/// Columns of one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    pub name: String,
    pub columns: Vec<Column>,
}

impl Recording {
    /// Column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }
}

/// Names of all columns, in the order of the files.
#[must_use]
pub fn column_names(recordings: &[Recording]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for column in recordings.iter().flat_map(|r| &r.columns) {
        if !names.contains(&column.name.as_str()) {
            names.push(&column.name);
        }
    }
    names
}
