//! One channel read from its files as a conditioned signal, piece by piece.

use super::channel_plan::ChannelPlan;
use super::channel_statistics::ChannelStatistics;
use super::column_samples::ColumnSamples;
use super::conditioner::Conditioner;
use super::signature::SignatureSamples;
use crate::flight::{Channel, Mark};
use crate::ingest::checks::BlockAverager;
use crate::ingest::clock::{Clock, Stretch};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::refusal::Refusal;
use crate::ingest::settings::Settings;

/// Receiver of conditioned samples: values and marks.
pub type SampleSink<'s> = dyn FnMut(&[f64], &[Mark]) -> Result<(), String> + 's;

/// Reader of one channel over a stretch; its samples leave in order.
#[derive(Clone, Debug)]
pub struct ChannelReader<'a> {
    /// The column of the files.
    name: &'a str,
    channel: &'a Channel,
    stretch: &'a Stretch,
    output: Output,
}

/// Results of a channel that has been read.
#[derive(Clone, Debug)]
pub struct ConditionedChannel<'a> {
    pub name: &'a str,
    pub channel: &'a Channel,
    pub statistics: ChannelStatistics,
    /// Block means, where a relation uses the signal.
    pub block_means: Option<BlockAverager>,
    pub signature_samples: SignatureSamples,
}

impl<'a> ChannelReader<'a> {
    /// Reader of a planned channel over a stretch.
    #[must_use]
    pub fn new(
        plan: &ChannelPlan<'a>,
        stretch: &'a Stretch,
        settings: &Settings,
    ) -> ChannelReader<'a> {
        let ChannelPlan {
            name,
            channel,
            conversion,
        } = *plan;
        let (step_s, samples) = (stretch.clock.step_s, stretch.clock.samples);
        ChannelReader {
            name,
            channel,
            stretch,
            output: Output {
                conditioner: Conditioner::new(channel, conversion, step_s, samples, settings),
                block_means: BlockAverager::of(&channel.signal, step_s, &settings.checks),
                signature_samples: SignatureSamples::of(&stretch.clock),
            },
        }
    }

    #[must_use]
    pub fn signal(&self) -> &'a str {
        &self.channel.signal
    }

    /// Reads the channel and passes its conditioned samples up to `until` to `sink`, in order and
    /// in pieces of `piece` samples or little more.
    ///
    /// # Errors
    /// A file that cannot be read, or an error of `sink`.
    pub fn read_until(
        &mut self,
        source: &(impl ColumnSource + ?Sized),
        until: usize,
        piece: usize,
        sink: &mut SampleSink,
    ) -> Result<(), Refusal> {
        let (clock, name) = (&self.stretch.clock, self.name);
        let output = &mut self.output;
        let pushed = output.conditioner.pushed();
        let range = pushed..output.conditioner.wanted(until).max(pushed);
        let column = ColumnSamples { source, name };
        let mut written = Ok(());
        let mut pass = |values: &[f64]| {
            output.conditioner.push(values);
            if written.is_ok() {
                written = output.pass_settled(until, piece, sink);
            }
        };
        if column.is_on(clock) {
            column.read(clock, range, &mut pass)?;
        } else {
            let own_clocks = self.stretch.other_clocks.iter();
            let own_clocks: Vec<&Clock> = own_clocks.filter(|c| column.is_on(c)).collect();
            column.interpolate(clock, &own_clocks, range, piece, &mut pass)?;
        }
        // Samples pushed by an earlier call may be all that is wanted.
        pass(&[]);
        output.conditioner.free();
        written.map_err(|reason| Refusal::of_channel(name, reason))
    }

    /// Ends the channel.
    #[must_use]
    pub fn finish(self) -> ConditionedChannel<'a> {
        let Output {
            conditioner,
            block_means,
            signature_samples,
        } = self.output;
        ConditionedChannel {
            name: self.name,
            channel: self.channel,
            statistics: conditioner.finish(),
            block_means,
            signature_samples,
        }
    }
}

/// The conditioner and the accumulators that take the samples that leave it.
#[derive(Clone, Debug)]
struct Output {
    conditioner: Conditioner,
    block_means: Option<BlockAverager>,
    signature_samples: SignatureSamples,
}

impl Output {
    /// Passes the settled samples before `until` to `sink` once they are `piece` or reach `until`.
    fn pass_settled(
        &mut self,
        until: usize,
        piece: usize,
        sink: &mut SampleSink,
    ) -> Result<(), String> {
        let ready = self.conditioner.ready().min(until);
        let least = if ready == until { 1 } else { piece };
        if ready < self.conditioner.settled() + least {
            return Ok(());
        }
        let (values, marks) = self.conditioner.settle(ready);
        if let Some(means) = &mut self.block_means {
            means.push(values);
        }
        self.signature_samples.push(values, marks);
        sink(values, marks)
    }
}
