//! Mismatches between a segment and the recognition of a class.

/// One condition of a class that a segment does not fulfil, in words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mismatch {
    pub kind: MismatchKind,
    pub reason: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MismatchKind {
    /// Too little of something, as where a maneuver is broken off.
    Shortfall,
    /// Too much of something, or something that the class does not have.
    Contradiction,
}

impl Mismatch {
    pub fn shortfall(reason: String) -> Mismatch {
        Mismatch {
            kind: MismatchKind::Shortfall,
            reason,
        }
    }

    pub fn contradiction(reason: String) -> Mismatch {
        Mismatch {
            kind: MismatchKind::Contradiction,
            reason,
        }
    }

    /// The mismatch with the name of its signal before the reason.
    pub fn of_signal(self, signal: &str) -> Mismatch {
        Mismatch {
            reason: format!("{signal} {}", self.reason),
            ..self
        }
    }

    pub fn is_shortfall(&self) -> bool {
        self.kind == MismatchKind::Shortfall
    }
}
