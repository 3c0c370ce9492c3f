//! The changes of a night on the terminal.

use crate::lineage::{
    Changes, Contradiction, InformationGain, InstrumentChange, ManeuverChange, Moved, VerdictChange,
};
use crate::numerics::digits::rounded;

/// Largest number of lines of one kind that are printed.
pub const MOST_LISTED: usize = 10;

/// Prints what a night changed since the one before.
pub fn print(night: &str, changes: &Changes) {
    let Some(since) = &changes.since else {
        out!("night {night} is the first complete one: there is none to compare it with");
        print_list(
            "instruments that changed over its flights",
            &changes.instruments,
            instrument,
        );
        return;
    };
    if let Some(why) = &changes.not_compared {
        out!("night {night} cannot be compared with night {since}: {why}");
        return;
    }
    out!("night {night} since night {since}");
    print_list("because", &changes.causes, |c| c.words.clone());
    print_list("maneuvers", &changes.maneuvers, maneuver);
    print_list(
        "estimates that moved by more than their uncertainty",
        &changes.estimates,
        moved,
    );
    print_list(
        "trends that moved by more than their uncertainty",
        &changes.trends,
        moved,
    );
    print_list("new trends", &changes.new_trends, Clone::clone);
    print_list("trends gone", &changes.gone_trends, Clone::clone);
    print_list("verdicts", &changes.verdicts, verdict);
    print_list(
        "contradicted by the rest of the campaign",
        &changes.contradictions,
        contradiction,
    );
    print_list("instruments that changed", &changes.instruments, instrument);
    print_list("learnt", &changes.learnt, learnt);
    if changes.is_empty() {
        out!("nothing that was published moved by more than its uncertainty");
    }
}

fn maneuver(m: &ManeuverChange) -> String {
    let words = if m.words.is_empty() {
        String::new()
    } else {
        format!(": {}", m.words)
    };
    format!(
        "{} {} ({}){words} [{}]",
        m.what.name(),
        m.maneuver_id,
        m.class,
        m.because
    )
}

fn moved(m: &Moved) -> String {
    let (of, alpha, because) = (&m.of, m.alpha_deg, &m.because);
    format!(
        "{} of {of} at {alpha:.1} deg: {} became {}, ±{} [{because}]",
        m.derivative, m.before, m.now, m.uncertainty
    )
}

fn verdict(v: &VerdictChange) -> String {
    format!(
        "{} at {} deg: {} became {} [{}]",
        v.derivative, v.alpha_deg, v.before, v.now, v.because
    )
}

fn contradiction(c: &Contradiction) -> String {
    format!(
        "{} in {}: {:.0} % of {} estimates inside their 95 % intervals",
        c.item, c.coefficient, c.inside_95_pct, c.estimates
    )
}

fn instrument(i: &InstrumentChange) -> String {
    format!(
        "{} of `{}`: {} since {}: {} ± {} {}",
        i.error,
        i.channel,
        i.what,
        i.since,
        rounded(i.change),
        rounded(i.bound),
        i.unit
    )
}

fn learnt(l: &InformationGain) -> String {
    format!(
        "{}: {:.1} nats; at {:.1} deg {} ± {} became {} ± {}",
        l.derivative,
        l.nats,
        l.alpha_deg,
        rounded(l.before),
        rounded(l.before_deviation),
        rounded(l.now),
        rounded(l.now_deviation)
    )
}

fn print_list<T>(title: &str, items: &[T], words: impl Fn(&T) -> String) {
    if items.is_empty() {
        return;
    }
    out!("{title}: {}", items.len());
    for item in items.iter().take(MOST_LISTED) {
        out!("  {}", words(item));
    }
    if items.len() > MOST_LISTED {
        out!(
            "  and {} more (all of them: --json)",
            items.len() - MOST_LISTED
        );
    }
}
