//! Required signals without a source: which of them refuse a flight, and the remedies in words.

use super::signal;
use super::stand_in::{LATERAL, LONGITUDINAL, StandIn};

/// Signals that follow from the fuel.
const OF_FUEL: [&str; 7] = [
    signal::MASS,
    signal::IX,
    signal::IY,
    signal::IZ,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Required signals that a flight lacks and that can have no stand-in, in the order of
/// [`signal::REQUIRED`]. `has` is `true` for a signal that is recorded or given as a constant.
pub fn irreplaceable(has: impl Fn(&str) -> bool) -> Vec<&'static str> {
    let required = signal::REQUIRED.iter().copied();
    let lacking = required.filter(|name| !has(name));
    lacking
        .filter(|name| StandIn::of(name, &has).is_none())
        .collect()
}

/// Places where the sources of required signals may stand, in words.
#[must_use]
pub fn remedies(signals: &[&str]) -> String {
    let [first, others @ ..] = signals else {
        return String::new();
    };
    let each = if others.is_empty() { "" } else { "each " };
    if *first == signal::TIME {
        return "give the column that counts time its line under `channels`".to_owned();
    }
    let mut remedies = vec![format!(
        "give {each}a line under `channels` to its column, or to a formula of several (`{{ signal: {first}, formula: … }}`)"
    )];
    let constants = signals.iter().filter_map(|signal| {
        let example = example(signal)?;
        Some(format!("`{signal}: {example}`"))
    });
    let constants: Vec<String> = constants.collect();
    if !constants.is_empty() {
        remedies.push(format!(
            "or its value under `constants` ({})",
            constants.join(", ")
        ));
    }
    if signals.iter().any(|signal| OF_FUEL.contains(signal)) {
        remedies.push("or a table of it over the fuel (`table: …`, docs/recorder.md)".to_owned());
    }
    remedies.extend(signals.iter().filter_map(|signal| {
        let condition = dispensable_where(signal)?;
        let named = format!("`{signal}`");
        let it = if others.is_empty() { "it" } else { &named };
        Some(format!("harvest does without {it} where {condition}"))
    }));
    remedies.join("; ")
}

/// An example of a signal's constant value; `None` for a signal that no constant can be.
fn example(signal: &str) -> Option<&'static str> {
    match signal {
        signal::ALTITUDE => Some("26000"),
        signal::ALPHA_VANE => Some("5"),
        signal::VELOCITY => Some("400"),
        signal::QBAR => Some("90"),
        signal::MASS => Some("1000"),
        signal::IX | signal::IY | signal::IZ => Some("20000"),
        signal::X_CG | signal::Y_CG | signal::Z_CG => Some("0"),
        _ => None,
    }
}

/// Other signals with which a signal has a stand-in, in words.
fn dispensable_where(signal: &str) -> Option<String> {
    let one_of = |first: &str, second: &str, third: &str| {
        Some(format!("`{first}` is given with `{second}` or `{third}`"))
    };
    match signal {
        signal::ALTITUDE => Some(format!(
            "`{}` and `{}` are given",
            signal::VELOCITY,
            signal::QBAR
        )),
        signal::VELOCITY => one_of(signal::ALTITUDE, signal::MACH, signal::QBAR),
        signal::QBAR => one_of(signal::ALTITUDE, signal::VELOCITY, signal::MACH),
        signal::MACH => Some(format!(
            "`{}` or `{}` is given",
            signal::VELOCITY,
            signal::QBAR
        )),
        signal::IX | signal::IZ => Some(format!("none of {} is recorded", list(&LATERAL))),
        signal::IY => Some(format!("none of {} is recorded", list(&LONGITUDINAL))),
        _ if LATERAL.contains(&signal) => Some(format!("all of {} are given", list(&LONGITUDINAL))),
        _ if LONGITUDINAL.contains(&signal) => Some(format!("all of {} are given", list(&LATERAL))),
        _ => None,
    }
}

/// Names of signals in a list.
fn list(signals: &[&str]) -> String {
    let names: Vec<String> = signals.iter().map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_required_signals_without_a_source_are_listed_with_a_remedy_for_each() {
        let lacking = [signal::MASS, signal::IX, signal::PSI, signal::THRUST];
        let listed = irreplaceable(|signal| !lacking.contains(&signal));
        assert_eq!(listed, [signal::MASS, signal::IX]);
        let words = remedies(&listed);
        for part in [
            "give each a line under `channels`",
            "`mass_slug: 1000`, `ix_slug_ft2: 20000`",
            "table of it over the fuel",
        ] {
            assert!(words.contains(part), "{words}");
        }
        let air_data = remedies(&[signal::VELOCITY, signal::QBAR]);
        assert!(air_data.contains("without `qbar_psf` where"), "{air_data}");
        let alone = remedies(&[signal::QBAR]);
        assert!(alone.contains("without it where"), "{alone}");
    }
}
