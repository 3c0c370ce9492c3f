//! Channels of a table that stay at one of its ends: their variable is outside the table, probably in
//! another unit.

use super::checks::BlockMeans;
use super::refusal::Refusal;
use crate::flight::Channel;
use crate::units::Unit;

/// Report of a channel whose table holds the value of an end throughout a flight; `None` for others.
pub fn held_throughout(name: &str, channel: &Channel, blocks: &BlockMeans) -> Option<Refusal> {
    let formula = channel.formula.as_ref()?;
    let means = blocks.means_of(&channel.signal);
    let first = (0..blocks.count)
        .map(|block| means.mean(block))
        .find(|mean| mean.is_finite())?;
    if !blocks.is_constant(&channel.signal) {
        return None;
    }
    let own = Unit::parse(&channel.unit).ok()?;
    let value = Unit::of_signal(&channel.signal)
        .conversion_to(own)?
        .of(first);
    let outside = formula.held_at_end(value)?;
    let reason = format!(
        "it has the value of an end of its table throughout: {outside}. Is a column in another unit, or the table too \
         short?"
    );
    Some(Refusal::of_channel(name, reason))
}
