//! Candidates of each quantity: columns whose name, unit and range allow it.

use super::assignment::{Candidate, Candidates};
use crate::inspection::clock::ClockColumn;
use crate::inspection::names::vocabulary::{input, is_one_side, meanings};
use crate::inspection::names::words::Spelling;
use crate::inspection::quantity::Quantity;
use crate::inspection::recording::{Recording, column_names};
use crate::numerics::statistics::order_statistics::quantile;
use crate::units::Unit;

/// Shares of a column's values that are ignored at each end of its range, as spikes.
const ENDS: f64 = 0.01;

/// Facts about one column.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnFacts {
    pub name: String,
    pub spelling: Spelling,
    /// Unit that the file or the name states, where harvest has it.
    pub unit: Option<Unit>,
    /// `true` if that unit is only the end of a name, which may mean something else.
    pub has_ambiguous_unit: bool,
    /// Unit that the file states and harvest does not have.
    pub unknown_unit: Option<String>,
    /// Range without spikes; `None` without a number.
    pub range: Option<(f64, f64)>,
    /// `true` for a column with at most two values, such as a flag.
    pub is_switch: bool,
}

impl ColumnFacts {
    /// `true` if the column has a single value.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.range
            .is_some_and(|(low, high)| high - low <= 1e-9 * high.abs().max(low.abs()))
    }
}

/// Facts about each column.
#[must_use]
pub fn facts(recordings: &[Recording]) -> Vec<ColumnFacts> {
    let names = column_names(recordings);
    names
        .into_iter()
        .map(|name| column_facts(recordings, name))
        .collect()
}

fn column_facts(recordings: &[Recording], name: &str) -> ColumnFacts {
    let columns = || recordings.iter().filter_map(|r| r.column(name));
    let spelling = Spelling::of(name);
    let stated = columns().find_map(|c| c.stated.clone().filter(|unit| !unit.trim().is_empty()));
    let parsed = stated.as_deref().and_then(|unit| Unit::parse(unit).ok());
    let values = || columns().flat_map(|c| c.values.iter().copied());
    let range = quantile(values(), ENDS).zip(quantile(values(), 1.0 - ENDS));
    let spelled = spelled_unit(&spelling).filter(|_| stated.is_none());
    ColumnFacts {
        name: name.to_owned(),
        unit: parsed.or(spelled),
        has_ambiguous_unit: spelled.is_some() && spelling.may_be_measured,
        unknown_unit: stated.filter(|_| parsed.is_none()),
        spelling,
        range,
        is_switch: is_switch(values()),
    }
}

/// `true` for a series of at most two values. No motion has so few.
fn is_switch(values: impl Iterator<Item = f64>) -> bool {
    let mut finite = values.filter(|value| value.is_finite());
    let Some(first) = finite.next() else {
        return true;
    };
    #[expect(clippy::float_cmp, reason = "a switch has exactly its two values")]
    let mut others = finite.filter(|value| *value != first);
    let Some(second) = others.next() else {
        return true;
    };
    #[expect(clippy::float_cmp, reason = "a switch has exactly its two values")]
    let is_second = |value: f64| value == second;
    others.all(is_second)
}

/// Unit that a name ends with, unless the rest of the name means quantities that have other units: the `m` of `alpha_m`
/// means measured.
fn spelled_unit(spelling: &Spelling) -> Option<Unit> {
    let unit = spelling.unit?;
    let meanings = meanings(spelling);
    let fits = |signal: &str| unit.factor_to(Unit::of_signal(signal)).is_some();
    (meanings.is_empty() || meanings.iter().any(|(signal, _)| fits(signal))).then_some(unit)
}

/// Candidates of all quantities.
#[must_use]
pub fn candidates(facts: &[ColumnFacts], clock: &ClockColumn) -> Candidates {
    let is_usable = |c: &&ColumnFacts| c.name != clock.name && !c.is_constant() && !c.is_switch;
    let columns: Vec<&ColumnFacts> = facts.iter().filter(is_usable).collect();
    let candidates_of = |quantity: Quantity| {
        let by_name = candidates_by_name(quantity, &columns);
        if by_name.is_empty() {
            candidates_without_name(quantity, &columns)
        } else {
            by_name
        }
    };
    Quantity::ALL
        .into_iter()
        .map(|quantity| (quantity, candidates_of(quantity)))
        .collect()
}

/// Columns whose name is that of a quantity, then those with the name of the same kind of quantity
/// on another axis. Empty without the former. Recorders differ in the order of the axes: the rate
/// about z may be that of pitch.
fn candidates_by_name(quantity: Quantity, columns: &[&ColumnFacts]) -> Vec<Candidate> {
    let mut candidates: Vec<Candidate> =
        columns.iter().filter_map(|c| named(quantity, c)).collect();
    if candidates.is_empty() {
        return candidates;
    }
    let is_other = |c: &&&ColumnFacts| candidates.iter().all(|other| other.column != c.name);
    let is_akin = |c: &&&ColumnFacts| quantity.akin().iter().any(|akin| named(*akin, c).is_some());
    let akin = columns.iter().filter(is_other).filter(is_akin);
    let akin: Vec<Candidate> = akin.filter_map(|c| candidate(quantity, c, 0.0)).collect();
    candidates.extend(akin);
    candidates
}

/// Columns whose name means nothing, and whose unit and range allow a quantity.
fn candidates_without_name(quantity: Quantity, columns: &[&ColumnFacts]) -> Vec<Candidate> {
    let is_nameless = |c: &&&ColumnFacts| {
        meanings(&c.spelling).is_empty()
            && input(&c.spelling).is_none()
            && !is_one_side(&c.spelling)
    };
    let nameless = columns.iter().filter(is_nameless);
    nameless
        .filter_map(|c| candidate(quantity, c, 0.0))
        .collect()
}

fn named(quantity: Quantity, facts: &ColumnFacts) -> Option<Candidate> {
    let meanings = meanings(&facts.spelling);
    let (_, weight) = meanings.into_iter().find(|m| m.0 == quantity.signal())?;
    candidate(quantity, facts, weight)
}

/// A column as a quantity, where unit and range allow it.
fn candidate(quantity: Quantity, facts: &ColumnFacts, weight: f64) -> Option<Candidate> {
    let (low, high) = facts.range?;
    let fits = |unit: &&'static str| {
        let factor = quantity.factor(unit);
        factor.is_some_and(|factor| {
            !plausible_signs(quantity, low * factor, high * factor).is_empty()
        })
    };
    let stated = facts.unit.map(|unit| stated_unit(quantity, unit));
    let usual = quantity.units().iter().copied();
    let usual = usual.filter(|unit| match stated {
        Some(stated) => facts.has_ambiguous_unit && *unit != stated,
        None => true,
    });
    let units: Vec<&'static str> = stated.into_iter().chain(usual).filter(fits).collect();
    let signs = |unit: &&'static str| {
        let factor = quantity.factor(unit).unwrap_or(f64::NAN);
        plausible_signs(quantity, low * factor, high * factor)
    };
    units.first().map(signs).map(|signs| Candidate {
        column: facts.name.clone(),
        weight,
        units,
        signs,
    })
}

/// Unit that a file states for a quantity. A load factor is a pure number in multiples of g.
fn stated_unit(quantity: Quantity, unit: Unit) -> &'static str {
    let kept = Unit::of_signal(quantity.signal());
    if unit.is_load_factor_of(kept) {
        kept.name
    } else {
        unit.name
    }
}

/// Signs for which an aircraft's quantity can have this range, in rad, ft, s and slug; the usual
/// sign first.
fn plausible_signs(quantity: Quantity, low: f64, high: f64) -> Vec<f64> {
    let (least, most) = limits(quantity);
    let signs: &[f64] = if quantity.is_signed() {
        &[1.0, -1.0]
    } else {
        &[1.0]
    };
    let fits = |sign: &f64| {
        let (a, b) = (sign * low, sign * high);
        a.min(b) >= least && a.max(b) <= most
    };
    signs.iter().copied().filter(fits).collect()
}

/// Least and largest value of an aircraft's quantity.
fn limits(quantity: Quantity) -> (f64, f64) {
    match quantity {
        Quantity::Alpha | Quantity::Beta => (-2.0, 2.0),
        Quantity::Velocity => (0.0, 4000.0),
        Quantity::Mach => (0.0, 5.0),
        // Pressure altitudes may lie below the sea's level, by the weather and the land.
        Quantity::Altitude => (-3_000.0, 130_000.0),
        Quantity::P | Quantity::Q | Quantity::R => (-12.0, 12.0),
        Quantity::Theta => (-1.6, 1.6),
        Quantity::Phi => (-3.2, 3.2),
        Quantity::Psi => (-6.3, 6.3),
        Quantity::An | Quantity::Ax | Quantity::Ay => (-650.0, 650.0),
        Quantity::Qbar => (0.0, 6000.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::test_flight::{TestFlight, searched, test_column, times};

    #[test]
    fn a_switch_is_no_motion() {
        let mut recording = TestFlight::default().recording(&[("x1", Quantity::An, "g")]);
        let switch = |t: &f64| if t.sin() > 0.5 { 1.0 } else { 0.0 };
        let values: Vec<f64> = times().iter().map(switch).collect();
        recording.columns.push(test_column("x2", values));
        let (_, candidates) = searched(&recording);
        let of_an = candidates[&Quantity::An].iter().map(|c| c.column.as_str());
        assert_eq!(of_an.collect::<Vec<_>>(), ["x1"]);
    }

    #[test]
    fn a_load_factor_without_a_unit_is_in_g() {
        let mut recording = TestFlight::default().recording(&[("nz", Quantity::An, "g")]);
        for column in &mut recording.columns {
            column.stated = (column.name == "nz").then(|| "-".to_owned());
        }
        let (_, candidates) = searched(&recording);
        assert_eq!(candidates[&Quantity::An][0].units, ["g"]);
    }

    #[test]
    fn an_altitude_with_the_end_m_may_be_measured_in_feet() {
        for (name, units) in [
            ("altitude_m", &["m", "ft"][..]),
            ("altitude [m]", &["m"]),
            ("altitude", &["ft", "m"]),
        ] {
            let recording = TestFlight::default().recording(&[(name, Quantity::Altitude, "ft")]);
            let (_, candidates) = searched(&recording);
            assert_eq!(candidates[&Quantity::Altitude][0].units, units, "{name}");
        }
    }
}
