//! Times of a flight's rows, read from the channels that are mapped to the recorder's clock.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::flight::{Channel, signal::TIME};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::refusal::Refusal;
use crate::units::Unit;

/// The time channels of a flight's files.
pub struct TimeChannels<'a, S: ColumnSource + ?Sized> {
    pub source: &'a S,
    channels: Vec<(&'a str, &'a Channel)>,
}

impl<'a, S: ColumnSource + ?Sized> TimeChannels<'a, S> {
    /// Time channels of a channel map; a flight whose files have clocks of their own has several.
    pub fn of(source: &'a S, channel_map: &'a BTreeMap<String, Channel>) -> Self {
        let channels = channel_map
            .iter()
            .filter(|(_, channel)| channel.signal == TIME)
            .map(|(name, channel)| (name.as_str(), channel))
            .collect();
        TimeChannels { source, channels }
    }

    /// Refusal at the first time channel.
    pub fn refusal(&self, reason: String) -> Refusal {
        let name = self.channels.first().map_or("", |(name, _)| name);
        Refusal::of_channel(name, reason)
    }

    /// Unit in which the first time channel probably is, given the rate that its stated unit makes, Hz.
    pub fn probable_unit(&self, rate_hz: f64, typical_rate_hz: f64) -> Option<&'static str> {
        let (_, channel) = self.channels.first()?;
        let stated = Unit::parse(&channel.unit).ok()?;
        let units = stated
            .alike()
            .filter_map(|unit| Some((unit.name, unit.factor_to(stated)?)));
        let longer = [("min", 60.0), ("h", 3600.0)];
        let to_stated = Unit::of_signal(TIME).factor_to(stated)?;
        let longer = longer.map(|(name, seconds)| (name, seconds * to_stated));
        let distance = |factor: f64| (rate_hz / factor / typical_rate_hz).ln().abs();
        units
            .chain(longer)
            .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))
            .filter(|(name, _)| *name != stated.name)
            .map(|(name, _)| name)
    }

    /// Passes the times of some rows of a file to `sink`, s.
    pub fn read(
        &self,
        file: usize,
        rows: Range<usize>,
        sink: &mut dyn FnMut(&[f64]),
    ) -> Result<(), Refusal> {
        let (name, factor) = self.of_file(file)?;
        let mut times = Vec::new();
        let mut scale = |values: &[f64]| {
            times.clear();
            times.extend(values.iter().map(|t| t * factor));
            sink(&times);
        };
        self.source
            .read(file, name, rows, &mut scale)
            .map_err(|reason| Refusal {
                place: self.source.name(file),
                reason,
            })
    }

    /// Checks that each file has a time channel.
    pub fn check(&self) -> Result<(), Refusal> {
        let mut files = 0..self.source.files();
        files.try_for_each(|file| self.of_file(file).map(|_| ()))
    }

    /// The time channel of a file with its factor to seconds.
    fn of_file(&self, file: usize) -> Result<(&str, f64), Refusal> {
        if self.channels.is_empty() {
            return Err(Refusal {
                place: "channel map".to_owned(),
                reason: format!("no channel is mapped to `{TIME}`; the record has no clock"),
            });
        }
        let mut own = self.channels.iter();
        let Some((name, channel)) = own.find(|(name, _)| self.source.has(file, name)) else {
            let names = self.channels.iter().map(|(name, _)| format!("`{name}`"));
            let names: Vec<String> = names.collect();
            return Err(self.refusal(format!(
                "the time channel {} is not in the file",
                names.join(", ")
            )));
        };
        let unit = Unit::parse(&channel.unit).ok();
        let factor = unit
            .and_then(|u| u.factor_to(Unit::of_signal(TIME)))
            .ok_or_else(|| self.refusal(format!("`{}` is not a unit of time", channel.unit)))?;
        Ok((name, factor * channel.sign * channel.scale))
    }
}
