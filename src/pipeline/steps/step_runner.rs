//! Loading, making and saving of artefacts, and the list of missing ones, for every kind of step.

use std::collections::BTreeSet;
use std::sync::Mutex;

use rayon::prelude::*;

use super::step::{Companion, ComputedArtefact, LoadedOrMade, Step};
use crate::config::Config;
use crate::error::Result;
use crate::pipeline::progress::Progress;
use crate::store::{ArtefactName, InWorkEntry, InputDigests, Store};

/// Treatment of an artefact that is absent from the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbsentArtefacts {
    /// It is made and saved.
    Make,
    /// It is reported missing; nothing is written.
    Report,
}

/// Loads artefacts from the store, and makes those that are missing unless it only reports them.
pub struct StepRunner<'a> {
    pub config: &'a Config,
    pub store: Store,
    /// Digests of input files.
    pub contents: InputDigests,
    pub absent: AbsentArtefacts,
    progress: &'a dyn Progress,
    /// Artefacts that were found missing.
    missing: Mutex<BTreeSet<ArtefactName>>,
}

impl<'a> StepRunner<'a> {
    pub fn new(
        config: &'a Config,
        store: Store,
        contents: InputDigests,
        absent: AbsentArtefacts,
        progress: &'a dyn Progress,
    ) -> StepRunner<'a> {
        StepRunner {
            config,
            store,
            contents,
            absent,
            progress,
            missing: Mutex::default(),
        }
    }

    /// Returns a step's artefact, made if necessary; `None` for a missing one if nothing is made.
    ///
    /// # Errors
    /// As [`Step::make`]; an artefact that cannot be saved.
    pub fn load_or_make<S: Step>(&self, step: &S) -> Result<Option<LoadedOrMade<S::Artefact>>> {
        let name = step.name();
        match self.load_as(step, &name) {
            Some(loaded) => Ok(Some(loaded)),
            None => self.make_or_note(step, name),
        }
    }

    /// Loads a step's artefact; `None` unless it and its companions are unchanged.
    pub fn load<S: Step>(&self, step: &S) -> Option<LoadedOrMade<S::Artefact>> {
        self.load_as(step, &step.name())
    }

    /// Makes a step's artefact that [`StepRunner::load`] did not find; `None` if nothing is made.
    ///
    /// # Errors
    /// As [`StepRunner::load_or_make`].
    pub fn make_missing<S: Step>(&self, step: &S) -> Result<Option<LoadedOrMade<S::Artefact>>> {
        self.make_or_note(step, step.name())
    }

    fn load_as<S: Step>(&self, step: &S, name: &ArtefactName) -> Option<LoadedOrMade<S::Artefact>> {
        let loaded = LoadedOrMade {
            artefact: self.store.load(name)?,
            name: name.clone(),
            is_stored: true,
        };
        let companions = step.companions(name, &loaded.artefact);
        if !companions.iter().all(|companion| self.has(companion)) {
            return None;
        }
        self.require(name, &companions);
        Some(loaded)
    }

    fn make_or_note<S: Step>(
        &self,
        step: &S,
        name: ArtefactName,
    ) -> Result<Option<LoadedOrMade<S::Artefact>>> {
        if self.absent == AbsentArtefacts::Report {
            self.note_missing(name);
            return Ok(None);
        }
        let made = self.make(step, name)?;
        if made.is_stored {
            self.require(&made.name, &step.companions(&made.name, &made.artefact));
        }
        Ok(Some(made))
    }

    /// Notes that the run needs an artefact and its companions.
    fn require(&self, name: &ArtefactName, companions: &[Companion]) {
        self.store.require(name);
        for companion in companions {
            self.store.require(&companion.name);
        }
    }

    fn make<S: Step>(&self, step: &S, name: ArtefactName) -> Result<LoadedOrMade<S::Artefact>> {
        let (artefact, is_stored) = match step.make(&name)? {
            ComputedArtefact::Final(artefact) => {
                self.store.save(&name, &artefact)?;
                (artefact, true)
            }
            ComputedArtefact::Temporary(artefact) => (artefact, false),
        };
        Ok(LoadedOrMade {
            name,
            artefact,
            is_stored,
        })
    }

    fn note_missing(&self, name: ArtefactName) {
        if let Ok(mut missing) = self.missing.lock() {
            missing.insert(name);
        }
    }

    /// Names of the artefacts that were found missing.
    pub fn missing(&self) -> BTreeSet<ArtefactName> {
        self.missing
            .lock()
            .map(|missing| missing.clone())
            .unwrap_or_default()
    }

    /// `true` if the store has a companion unchanged.
    fn has(&self, companion: &Companion) -> bool {
        let Companion { name, digest } = companion;
        match digest {
            Some(digest) => self.store.has_record(name, digest, &self.contents),
            None => self.store.has_sealed(name),
        }
    }

    /// Loads or makes the artefacts of several steps in parallel, in their order.
    ///
    /// # Errors
    /// As [`StepRunner::load_or_make`].
    pub fn load_or_make_all<S: Step>(
        &self,
        steps: &[S],
    ) -> Result<Vec<Option<LoadedOrMade<S::Artefact>>>>
    where
        S::Artefact: Send,
    {
        steps
            .par_iter()
            .map(|step| {
                let result = self.load_or_make(step);
                self.advance(step.item());
                result
            })
            .collect()
    }

    /// Calls `work` with a progress display of this number of items, unless nothing is made.
    pub fn with_progress<T>(&self, stage: &str, items: usize, work: impl FnOnce() -> T) -> T {
        if self.absent == AbsentArtefacts::Report {
            return work();
        }
        self.progress.begin(stage, items);
        let result = work();
        self.progress.end();
        result
    }

    /// Reports a flight as being processed, to the progress display and in the store, until the
    /// returned value is dropped.
    pub fn start_flight<'b>(&'b self, flight_id: &'b str) -> Option<InWorkEntry<'b>> {
        self.progress.start(flight_id);
        self.store.list_in_work(flight_id)
    }

    pub fn advance(&self, item: &str) {
        if self.absent == AbsentArtefacts::Make {
            self.progress.advance(item);
        }
    }
}
