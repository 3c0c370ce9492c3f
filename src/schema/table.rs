//! Tables declared once: the row's struct, its columns, their units and their explanations.

use super::words::{Entry, Words};

/// Declaration of a column.
#[derive(Clone, Copy, Debug)]
pub struct Declared {
    pub name: &'static str,
    /// Empty for text, and for numbers whose unit the column `unit` states.
    pub unit: &'static str,
    pub meaning: &'static str,
}

/// A column with its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Column<'a> {
    pub name: String,
    pub unit: &'static str,
    pub meaning: &'static str,
    /// Words that the column holds; empty for numbers and free text.
    pub words: &'static [Entry],
    pub cells: Cells<'a>,
}

impl Column<'_> {
    /// Explanation of the column on one line.
    #[must_use]
    pub fn explanation(&self) -> String {
        one_line(self.meaning)
    }
}

/// Joins the lines of a doc comment.
#[must_use]
pub fn one_line(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Cells of a column, by type. A value that does not exist is `None`.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells<'a> {
    Text(Vec<Option<&'a str>>),
    Number(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
}

/// A struct declared with [`table!`].
pub trait Row: Sized {
    /// One column per field, in the order of declaration.
    fn columns<'a>(rows: &[&'a Self]) -> Vec<Column<'a>>;
}

/// A row type with a table of its own.
pub trait Table: Row {
    const NAME: &'static str;
    /// Subject of a row: `derivative and angle of attack`.
    const PER: &'static str;
    const MEANING: &'static str;
}

/// A type of field: a cell of one column, or a struct or map with a column per member.
pub trait Field: Sized {
    fn columns<'a>(declared: Declared, fields: &[&'a Self]) -> Vec<Column<'a>>;
}

/// A type of field that is one cell.
pub trait Cell: Sized {
    const WORDS: &'static [Entry] = &[];

    /// Cells from fields, where an absent field is an absent cell.
    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a>
    where
        Self: 'a;
}

impl<C: Cell> Field for C {
    fn columns<'a>(declared: Declared, fields: &[&'a Self]) -> Vec<Column<'a>> {
        let column = Column {
            name: declared.name.to_owned(),
            unit: declared.unit,
            meaning: declared.meaning,
            words: C::WORDS,
            cells: C::cells(fields.iter().map(|field| Some(*field))),
        };
        vec![column]
    }
}

impl<C: Cell> Cell for Option<C> {
    const WORDS: &'static [Entry] = C::WORDS;

    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a>
    where
        Self: 'a,
    {
        C::cells(fields.map(|field| field.and_then(Option::as_ref)))
    }
}

/// An empty text is absent: CSV cannot distinguish the two.
impl Cell for String {
    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a> {
        let texts = fields.map(|text| text.map(String::as_str).filter(|text| !text.is_empty()));
        Cells::Text(texts.collect())
    }
}

impl<W: Words> Cell for W {
    const WORDS: &'static [Entry] = W::ENTRIES;

    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a>
    where
        Self: 'a,
    {
        Cells::Text(fields.map(|field| field.map(Words::word)).collect())
    }
}

/// A number that is not finite is absent.
impl Cell for f64 {
    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a> {
        let numbers = fields.map(|number| number.copied().filter(|number| number.is_finite()));
        Cells::Number(numbers.collect())
    }
}

impl Cell for usize {
    fn cells<'a>(fields: impl Iterator<Item = Option<&'a Self>>) -> Cells<'a> {
        let whole = |number: &usize| i64::try_from(*number).unwrap_or(i64::MAX);
        Cells::Whole(fields.map(|number| number.map(whole)).collect())
    }
}

/// Declares the row of a table: the struct, its columns, their units and their explanations.
///
/// ```ignore
/// table! {
///     /// Trends across angle of attack.
///     pub struct TrendRow in "trends" per "derivative and angle of attack" {
///         /// Name of the derivative in the model.
///         pub derivative: String,
///         /// Angle of attack.
///         pub alpha_deg: f64 ["deg"],
///         /// Value of the trend, in the column `unit`.
///         pub value: f64,
///     }
/// }
/// ```
///
/// Every field is a column of its name, in this order. Parquet, CSV, the metadata of the Parquet
/// files and `docs/tables.md` are made from the declaration; a field without a doc comment does not
/// compile. A struct without `in … per …` is a part of another row, and its fields are columns of
/// that row's table. `#[derive(Default)]` may stand above the struct.
macro_rules! table {
    (
        $(#[doc = $meaning:literal])+
        $(#[derive($($derive:ident),+)])?
        pub struct $name:ident in $table:literal per $per:literal {
            $($(#[doc = $column:literal])+ pub $field:ident: $type:ty $([$unit:literal])?,)+
        }
    ) => {
        $crate::schema::table! {
            $(#[doc = $meaning])+
            $(#[derive($($derive),+)])?
            pub struct $name {
                $($(#[doc = $column])+ pub $field: $type $([$unit])?,)+
            }
        }

        impl $crate::schema::Table for $name {
            const NAME: &'static str = $table;
            const PER: &'static str = $per;
            const MEANING: &'static str = concat!($($meaning, "\n"),+);
        }
    };
    (
        $(#[doc = $meaning:literal])+
        $(#[derive($($derive:ident),+)])?
        pub struct $name:ident {
            $($(#[doc = $column:literal])+ pub $field:ident: $type:ty $([$unit:literal])?,)+
        }
    ) => {
        $(#[doc = $meaning])+
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        $(#[derive($($derive),+)])?
        pub struct $name {
            $($(#[doc = $column])+ pub $field: $type,)+
        }

        impl $crate::schema::Row for $name {
            fn columns<'a>(rows: &[&'a Self]) -> Vec<$crate::schema::Column<'a>> {
                let mut columns = Vec::new();
                $(
                    let declared = $crate::schema::Declared {
                        name: stringify!($field),
                        unit: concat!($($unit)?),
                        meaning: concat!($($column, "\n"),+),
                    };
                    let fields: Vec<&'a $type> = rows.iter().map(|row| &row.$field).collect();
                    columns.extend(<$type as $crate::schema::Field>::columns(declared, &fields));
                )+
                columns
            }
        }

        impl $crate::schema::Field for $name {
            fn columns<'a>(
                _: $crate::schema::Declared,
                fields: &[&'a Self],
            ) -> Vec<$crate::schema::Column<'a>> {
                <Self as $crate::schema::Row>::columns(fields)
            }
        }
    };
}

pub(crate) use table;

#[cfg(test)]
mod tests {
    use super::*;

    table! {
        /// Part of a row.
        pub struct Part {
            /// Share.
            pub share: f64 ["1"],
        }
    }

    table! {
        /// Table of the test.
        pub struct TestRow in "test" per "test" {
            /// Name.
            pub name: String,
            /// Angle.
            pub alpha_deg: Option<f64> ["deg"],
            /// Part of the row.
            pub part: Part,
            /// Number of samples.
            pub samples: usize ["samples"],
        }
    }

    #[test]
    fn columns_are_the_fields_in_order_with_parts_in_their_place() {
        let row = TestRow {
            name: String::new(),
            alpha_deg: Some(f64::NAN),
            part: Part { share: 0.5 },
            samples: 3,
        };
        let columns = <TestRow as Row>::columns(&[&row]);
        let names: Vec<(&str, &str)> = columns.iter().map(|c| (&*c.name, c.unit)).collect();
        assert_eq!(
            names,
            [
                ("name", ""),
                ("alpha_deg", "deg"),
                ("share", "1"),
                ("samples", "samples")
            ]
        );
        assert_eq!(
            columns[0].cells,
            Cells::Text(vec![None]),
            "an empty text is absent"
        );
        assert_eq!(
            columns[1].cells,
            Cells::Number(vec![None]),
            "a NaN is absent"
        );
        assert_eq!(columns[2].cells, Cells::Number(vec![Some(0.5)]));
        assert_eq!(columns[3].cells, Cells::Whole(vec![Some(3)]));
    }
}
