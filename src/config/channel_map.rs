//! The channel map: its lines, checked, become channels of columns, of formulas and of tables.

use std::collections::{BTreeMap, BTreeSet};

use super::channel_table::checked_table;
use super::source::Source;
use super::written::{ChannelLine, TableLine};
use crate::error::{Error, Result, did_you_mean};
use crate::flight::formula::Operand;
use crate::flight::{Channel, Formula, signal};
use crate::units::Unit;

/// Channels of a map: the lines that give a signal. Formulas and tables are parsed and checked for units.
///
/// # Errors
/// [`Error::Config`] with the line of the first mistake.
pub fn channels(
    lines: &BTreeMap<String, ChannelLine>,
    source: &Source,
) -> Result<BTreeMap<String, Channel>> {
    let map = ChannelMap { lines, source };
    let mut channels = BTreeMap::new();
    for (name, line) in lines {
        if let Some(channel) = map.channel(name, line)? {
            channels.insert(name.clone(), channel);
        }
    }
    Ok(channels)
}

struct ChannelMap<'a> {
    lines: &'a BTreeMap<String, ChannelLine>,
    source: &'a Source,
}

impl ChannelMap<'_> {
    fn error(&self, name: &str, what: &str) -> Error {
        let what = format!("channel `{name}`: {what}");
        self.source.error_under("channels", name, what)
    }

    /// An error at a key of a channel's table.
    fn table_error(&self, name: &str, key: &str, what: &str) -> Error {
        let path = ["channels", name, "table", key].map(str::to_owned);
        let what = format!("channel `{name}`: {what}");
        self.source.error_at(&path, what)
    }

    /// Channel of a line; `None` for a column that only formulas use.
    fn channel(&self, name: &str, line: &ChannelLine) -> Result<Option<Channel>> {
        if let Some(table) = &line.table {
            return self.of_table(name, line, table).map(Some);
        }
        if let Some(text) = &line.formula {
            return self.computed(name, line, text).map(Some);
        }
        let Some(unit) = &line.unit else {
            return Err(self.error(name, "it has no `unit`"));
        };
        let parsed = match &line.signal {
            Some(signal) => Unit::parse_for(unit, Unit::of_signal(signal)),
            None => Unit::parse(unit),
        };
        parsed.map_err(|what| self.error(name, &what))?;
        Ok(line.signal.as_ref().map(|signal| Channel {
            sign: line.sign.unwrap_or(1.0),
            scale: line.scale.unwrap_or(1.0),
            wraps_at: line.wraps_at,
            ..Channel::plain(signal, unit)
        }))
    }

    /// Channel of a formula, in its signal's unit.
    fn computed(&self, name: &str, line: &ChannelLine, text: &str) -> Result<Channel> {
        let Some(signal) = &line.signal else {
            return Err(self.error(name, "a formula needs a `signal`"));
        };
        let key = line.unit.as_ref().map(|_| "unit");
        if let Some(key) = key.or_else(|| key_of_column(line)) {
            let what = format!(
                "a formula has no `{key}`: its units follow from its columns, factors stand in it"
            );
            return Err(self.error(name, &what));
        }
        if signal == signal::TIME {
            return Err(self.error(name, "the clock is a column, not a formula"));
        }
        let target = Unit::of_signal(signal);
        let formula = Formula::parse(text, target, |column| self.operand(column));
        let formula =
            formula.map_err(|what| self.error(name, &format!("formula `{text}`: {what}")))?;
        Ok(Channel {
            formula: Some(formula),
            ..Channel::plain(signal, target.name)
        })
    }

    /// Channel of a table, in the unit of its values.
    fn of_table(&self, name: &str, line: &ChannelLine, table: &TableLine) -> Result<Channel> {
        let (Some(signal), Some(unit)) = (&line.signal, &line.unit) else {
            let what = "a table needs a `signal`, and a `unit`, which is that of `value`";
            return Err(self.error(name, what));
        };
        let key = line.formula.as_ref().map(|_| "formula");
        if let Some(key) = key.or_else(|| key_of_column(line)) {
            let what = format!("a channel with a table has no `{key}`");
            return Err(self.error(name, &what));
        }
        if signal == signal::TIME {
            return Err(self.error(name, "the clock is a column, not a table"));
        }
        let parsed = Unit::parse_for(unit, Unit::of_signal(signal));
        parsed.map_err(|what| self.error(name, &what))?;
        let values = checked_table(signal, table)
            .map_err(|(key, what)| self.table_error(name, key, &what))?;
        let over = Formula::over(&table.over, &table.at_unit, values, |column| {
            self.operand(column)
        });
        let formula = over.map_err(|what| {
            self.table_error(name, "over", &format!("`over: {}`: {what}", table.over))
        })?;
        Ok(Channel {
            formula: Some(formula),
            ..Channel::plain(signal, unit)
        })
    }

    /// Column of a formula with its unit.
    fn operand(&self, column: &str) -> std::result::Result<Operand, String> {
        let Some(line) = self.lines.get(column) else {
            let names = self.lines.keys().map(String::as_str);
            let near = did_you_mean(column, names);
            return Err(format!(
                "no column `{column}`{near}; each column of a formula has a line with its unit under \
                 `channels`"
            ));
        };
        if line.formula.is_some() {
            return Err(format!("`{column}` is a formula itself: write it out"));
        }
        if line.table.is_some() {
            return Err(format!(
                "`{column}` is a table itself: a formula has columns"
            ));
        }
        if line.wraps_at.is_some() {
            return Err(format!("`{column}` wraps around: a formula cannot have it"));
        }
        let (sign, scale) = (line.sign.unwrap_or(1.0), line.scale.unwrap_or(1.0));
        if !([1.0, -1.0].contains(&sign) && scale.is_finite() && scale > 0.0) {
            return Err(format!(
                "`{column}`: sign is 1 or -1, and scale is greater than zero"
            ));
        }
        let unit = line.unit.clone();
        Ok(Operand {
            column: column.to_owned(),
            unit: unit.ok_or_else(|| format!("`{column}` has no unit"))?,
            factor: sign * scale,
        })
    }
}

/// Key of a line that only a column can have.
fn key_of_column(line: &ChannelLine) -> Option<&'static str> {
    let given = [
        ("sign", line.sign.is_some()),
        ("scale", line.scale.is_some()),
        ("wraps_at", line.wraps_at.is_some()),
    ];
    given
        .iter()
        .find(|(_, is_given)| *is_given)
        .map(|(key, _)| *key)
}

/// Columns without a signal that no formula or table of the channels uses.
pub fn unused(
    lines: &BTreeMap<String, ChannelLine>,
    channels: &BTreeMap<String, Channel>,
) -> Vec<String> {
    let formulas = channels.values().filter_map(|c| c.formula.as_ref());
    let operands = formulas.flat_map(Formula::operands);
    let used: BTreeSet<&str> = operands.map(|operand| operand.column.as_str()).collect();
    let is_unused = |(name, line): &(&String, &ChannelLine)| {
        line.signal.is_none() && !used.contains(name.as_str())
    };
    let unused = lines.iter().filter(is_unused);
    unused.map(|(name, _)| name.clone()).collect()
}
