//! Comparison of a flight value with another value of the same derivative, and its verdict.

use super::settings::Settings;
use crate::tables::{ChangeVerdict, TunnelVerdict};

/// Verdict of comparing a flight value with another value of the same derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Agreement {
    /// There is no other value.
    NoValue,
    Agrees,
    Higher,
    Lower,
    SignDiffers,
}

impl From<Agreement> for TunnelVerdict {
    fn from(agreement: Agreement) -> TunnelVerdict {
        match agreement {
            Agreement::NoValue => TunnelVerdict::NoTunnelValue,
            Agreement::Agrees => TunnelVerdict::Agrees,
            Agreement::Higher => TunnelVerdict::FlightHigher,
            Agreement::Lower => TunnelVerdict::FlightLower,
            Agreement::SignDiffers => TunnelVerdict::SignDiffers,
        }
    }
}

impl From<TunnelVerdict> for Agreement {
    fn from(verdict: TunnelVerdict) -> Agreement {
        match verdict {
            TunnelVerdict::NoTunnelValue | TunnelVerdict::NothingLearnt => Agreement::NoValue,
            TunnelVerdict::Agrees => Agreement::Agrees,
            TunnelVerdict::FlightHigher => Agreement::Higher,
            TunnelVerdict::FlightLower => Agreement::Lower,
            TunnelVerdict::SignDiffers => Agreement::SignDiffers,
        }
    }
}

impl From<Agreement> for ChangeVerdict {
    fn from(agreement: Agreement) -> ChangeVerdict {
        match agreement {
            Agreement::NoValue => ChangeVerdict::NotThereBefore,
            Agreement::Agrees => ChangeVerdict::Agrees,
            Agreement::Higher => ChangeVerdict::Higher,
            Agreement::Lower => ChangeVerdict::Lower,
            Agreement::SignDiffers => ChangeVerdict::SignDiffers,
        }
    }
}

impl From<ChangeVerdict> for Agreement {
    fn from(verdict: ChangeVerdict) -> Agreement {
        match verdict {
            ChangeVerdict::NotThereBefore => Agreement::NoValue,
            ChangeVerdict::Agrees => Agreement::Agrees,
            ChangeVerdict::Higher => Agreement::Higher,
            ChangeVerdict::Lower => Agreement::Lower,
            ChangeVerdict::SignDiffers => Agreement::SignDiffers,
        }
    }
}

/// Difference between a flight value and another value, with its verdict.
pub(super) struct Judgement {
    pub difference: Option<f64>,
    /// Standard error of the difference.
    pub uncertainty: Option<f64>,
    /// Difference in percent of the other value's magnitude.
    pub difference_pct: Option<f64>,
    pub z: Option<f64>,
    pub agreement: Agreement,
}

/// Compares a value that has a standard error with another value, whose standard error may be
/// unknown.
pub(super) fn judge(
    flight: f64,
    error: f64,
    other: Option<(f64, Option<f64>)>,
    settings: &Settings,
) -> Judgement {
    let Some((other, stated)) = other else {
        return Judgement {
            difference: None,
            uncertainty: None,
            difference_pct: None,
            z: None,
            agreement: Agreement::NoValue,
        };
    };
    let other_error = stated.unwrap_or(0.0);
    let (difference, uncertainty) = (flight - other, error.hypot(other_error));
    let is_nonzero = |value: f64, error: f64| value.abs() > settings.agreement_z * error;
    let agreement =
        if flight * other < 0.0 && is_nonzero(flight, error) && is_nonzero(other, other_error) {
            Agreement::SignDiffers
        } else if difference.abs() <= settings.agreement_z * uncertainty
            || difference.abs() <= settings.agreement_pct / 100.0 * other.abs()
        {
            Agreement::Agrees
        } else if difference > 0.0 {
            Agreement::Higher
        } else {
            Agreement::Lower
        };
    let finite = |v: f64| v.is_finite().then_some(v);
    Judgement {
        difference: Some(difference),
        uncertainty: Some(uncertainty),
        difference_pct: finite(100.0 * difference / other.abs()),
        z: finite(difference / uncertainty),
        agreement,
    }
}
