//! The next flight: its cards, goals and page, from the demonstration's posterior.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{Campaign, Row, both_axes, demo, number, run, table};

/// Cards of the shipped campaign with few candidates and a limit that one of them breaks.
fn cards(campaign: &Campaign) -> std::path::PathBuf {
    let shipped = fs::read_to_string("pipelines/harv/cards.yaml").unwrap();
    let (head, rest) = shipped.split_once("\nnext:").unwrap();
    let (_, tail) = rest.split_once("\nstudy:").unwrap();
    let next = "
next:
  settle_s: 20
  repeats: 1
  limits: { an_g: [-2, 4], alpha_deg: [0, 42] }
  candidates:
    - { class: OLAT, alpha_deg: [15, 25] }
    - { class: \"3211\", alpha_deg: [15, 40] }
";
    let file = campaign.path("cards.yaml");
    fs::write(&file, format!("{head}{next}\nstudy:{tail}")).unwrap();
    file
}

fn next(campaign: &Campaign, cards: &Path) -> Command {
    let mut command = campaign.command("next");
    command.args(["--minutes", "1.6", "--cards"]).arg(cards);
    command
}

fn rows(campaign: &Campaign, name: &str) -> Vec<Row> {
    table(&campaign.path(&format!("reports/next/{name}.csv")))
}

#[test]
fn the_cards_of_the_next_flight_are_chosen_priced_and_limited() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    let file = cards(&campaign);
    let outcome = run(next(&campaign, &file).args(["--threads", "1"]));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let planned = rows(&campaign, "next_cards");
    assert_eq!(planned.len(), 4, "{planned:?}");
    // Programs of 17 and 22 s and 20 s to settle: two of them and their way of 10° take 1.6 min at most.
    let flown: Vec<&Row> = planned
        .iter()
        .filter(|row| !row["place"].is_empty())
        .collect();
    assert_eq!(flown.len(), 2, "{planned:?}");
    for row in &planned {
        let program_s = if row["class"] == "OLAT" { 22.0 } else { 17.0 };
        approx::assert_relative_eq!(number(row, "minutes"), (program_s + 20.0) / 60.0);
    }
    let refused: Vec<&Row> = planned
        .iter()
        .filter(|row| !row["refused"].is_empty())
        .collect();
    assert_eq!(refused.len(), 1, "{planned:?}");
    assert_eq!(refused[0]["alpha_deg"], "40.0");
    assert!(
        refused[0]["refused"].contains("the limit is 42 deg"),
        "{refused:?}"
    );
    let goals = rows(&campaign, "next_goals");
    assert!(goals.len() > 100, "{}", goals.len());
    for row in &goals {
        assert!(
            number(row, "after") <= number(row, "before") * (1.0 + 1e-9),
            "{row:?}"
        );
    }
    // Before: the deviations of the published posterior.
    let posterior = &demo().tables["posterior"];
    let same = |goal: &Row, row: &&Row| {
        row["derivative"] == goal["goal"] && row["alpha_deg"] == goal["alpha_deg"]
    };
    for goal in &goals {
        let own = posterior.iter().find(|row| same(goal, row)).unwrap();
        let published = number(own, "standard_deviation");
        approx::assert_relative_eq!(number(goal, "before"), published, max_relative = 1e-6);
    }
    let page = fs::read_to_string(campaign.path("reports/next/kneeboard.html")).unwrap();
    assert!(
        page.contains("OLAT") && page.contains("Limits kept: alpha 0"),
        "{page}"
    );
    // What the pilot flies: speed, amplitude and length of the inputs.
    for flown in [
        "KCAS",
        "da ±5° 4.9 s, dr ±10° 6.3 s",
        "da 5° from 3 s for 0.8, 1.2, 0.6 s",
    ] {
        assert!(page.contains(flown), "{flown}: {page}");
    }
    assert!(!page.contains("bound reached"), "{page}");
    let is_power = |w: &[u8]| w[0].is_ascii_digit() && &w[1..] == b"e-";
    assert!(!page.as_bytes().windows(3).any(is_power), "{page}");
    for row in &flown {
        let (mach, speed) = (number(row, "mach"), number(row, "calibrated_airspeed_kt"));
        assert!((0.1..0.6).contains(&mach), "{row:?}");
        assert!((80.0..300.0).contains(&speed), "{row:?}");
    }
    let printed = fs::read(campaign.path("reports/next/kneeboard.pdf")).unwrap();
    let printed = lopdf::Document::load_mem(&printed).unwrap();
    assert_eq!(printed.get_pages().len(), 1);

    let before = campaign.bytes("reports/next");
    let outcome = run(next(&campaign, &file).args(["--threads", "2"]));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    assert!(
        campaign.bytes("reports/next") == before,
        "threads change the plan"
    );
}

#[test]
fn goals_decide_what_is_flown() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    let (file, goals) = (cards(&campaign), campaign.path("goals.yaml"));
    let plan = |text: &str| {
        fs::write(&goals, text).unwrap();
        let outcome = run(next(&campaign, &file).arg("--goal").arg(&goals));
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
    };
    plan("goals: [{ derivative: Cm_de, alpha_deg: [10, 20] }]");
    let planned = rows(&campaign, "next_cards");
    let flown: Vec<&Row> = planned
        .iter()
        .filter(|row| !row["place"].is_empty())
        .collect();
    assert!(
        flown.len() == 1 && flown[0]["class"] == "3211",
        "{planned:?}"
    );
    let asked = rows(&campaign, "next_goals");
    assert!(asked.iter().all(|row| row["goal"] == "Cm_de"), "{asked:?}");
    // A bound that tonight's posterior has already needs no flight.
    plan("goals: [{ derivative: Cm_de, alpha_deg: [10, 20], bound: 1 }]");
    assert!(
        rows(&campaign, "next_cards")
            .iter()
            .all(|row| row["place"].is_empty())
    );
}

#[test]
fn wrong_goals_are_refused_in_words() {
    let small = Campaign::of_both_axes();
    both_axes().fill_store(&small);
    let (file, goals) = (cards(&small), small.path("goals.yaml"));
    for (wrong, said) in [
        ("goals: [{ derivative: Cm_dee }]", "did you mean `Cm_de`?"),
        (
            "goals: [{ derivative: Cm_de, bound: -1 }]",
            "`bound` must be a positive",
        ),
        (
            "goals: [{ derivative: Cm_de, bond: 1 }]",
            "did you mean `bound`?",
        ),
        ("goals: []", "goals.yaml:1: `goals` lists no goal"),
        ("# none yet\n", "goals.yaml:1: the file is empty"),
        (
            "goals: [{ derivative: Cm_de, alpha_deg: [200] }]",
            "goals.yaml:1: goals[0].alpha_deg must be a list of two numbers, such as [10, 40]",
        ),
        (
            "goals: [{ derivative: Cm_de, alpha_deg: [10, 200] }]",
            "`alpha_deg` must lie between -180 and 180",
        ),
        (
            "goals: [{ derivative: Cm_de, quantity: phugoid_damping }]",
            "one of `derivative`, `quantity` and `match`",
        ),
        (
            "goals: [{ quantity: phi_beta }]",
            "has no limit of `phi_beta`",
        ),
        ("goals: [{ quantity: phugoid_dampin }]", "phugoid_damping"),
        (
            "goals: [{ quantity: phugoid_damping, airframe: augmented }]",
            "needs the feedback of qualities.yaml",
        ),
        (
            "goals: [{ quantity: phugoid_damping, decided: 95 }]",
            "`decided` must be a probability",
        ),
        (
            "goals: [{ quantity: phugoid_damping, alpha_deg: [1, 2] }]",
            "was not flown",
        ),
        ("goals: [{ match: OLATT }]", "did you mean `OLAT`?"),
        (
            "goals: [{ match: OLAT, model: trend }]",
            "trends are no model of a plan",
        ),
        (
            "goals: [{ match: OLAT, alpha_deg: [1, 2] }]",
            "no flown maneuver of class `OLAT`",
        ),
    ] {
        fs::write(&goals, wrong).unwrap();
        let outcome = run(next(&small, &file).arg("--goal").arg(&goals));
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(outcome.stderr.contains(said), "{wrong}: {outcome:?}");
    }
}

/// Number in a cell that has one.
fn known(row: &Row, column: &str) -> f64 {
    assert!(!row[column].is_empty(), "{column}: {row:?}");
    number(row, column)
}

#[test]
fn levels_and_matches_are_goals() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    let (file, goals) = (cards(&campaign), campaign.path("goals.yaml"));
    let text = "goals:
  - { quantity: dutch_roll_damping, decided: 0.9 }
  - { match: OLAT, alpha_deg: [5, 35], model: tunnel }
  - { match: OLAT, alpha_deg: [5, 35], model: posterior }
";
    fs::write(&goals, text).unwrap();
    let outcome = run(next(&campaign, &file).arg("--goal").arg(&goals));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let asked = rows(&campaign, "next_goals");
    let of = |kind: &str| -> Vec<&Row> { asked.iter().filter(|r| r["kind"] == kind).collect() };
    // Before: the deviations and values of the published flying qualities.
    let qualities = &demo().tables["qualities"];
    assert!(!of("level").is_empty(), "{asked:?}");
    for goal in of("level") {
        let own = qualities.iter().find(|row| {
            row["quantity"] == "dutch_roll_damping"
                && row["airframe"] == goal["of"]
                && row["alpha_deg"] == goal["alpha_deg"]
        });
        let own = own.unwrap();
        let (before, value) = (known(goal, "before"), known(goal, "value"));
        approx::assert_relative_eq!(value, number(own, "value"), max_relative = 1e-9);
        if own["basis"] == "slopes" {
            let published = number(own, "standard_deviation");
            approx::assert_relative_eq!(before, published, max_relative = 1e-6);
        }
    }
    let matches = of("match");
    for model in ["tunnel", "posterior"] {
        let own: Vec<&&Row> = matches.iter().filter(|row| row["of"] == model).collect();
        assert_eq!(own.len(), 3, "{matches:?}");
        for row in own {
            assert!(known(row, "before") > 0.0 && !row["decided_by"].is_empty());
        }
    }
    for row in &asked {
        let (before, after) = (number(row, "before"), number(row, "after"));
        assert!(after <= before * (1.0 + 1e-9), "{row:?}");
        for column in ["probability_pct", "decided_pct"] {
            assert!((0.0..=100.0).contains(&known(row, column)), "{row:?}");
        }
    }
    let page = fs::read_to_string(campaign.path("reports/next/kneeboard.html")).unwrap();
    assert!(
        page.contains("dutch roll damping, bare") && page.contains("OLAT, tunnel"),
        "{page}"
    );
    assert!(page.contains("of 3 maneuvers"), "{page}");
}

#[test]
fn conditions_and_limits_that_no_card_can_have_are_named_with_their_line() {
    let campaign = Campaign::of_pitch_steps();
    let file = cards(&campaign);
    let text = fs::read_to_string(&file).unwrap();
    let limits = "limits: { an_g: [-2, 4], alpha_deg: [0, 42] }";
    for (right, wrong, said) in [
        (
            limits,
            "limits: { surface_rates_deg_s: { der_deg: 1 } }",
            "the aircraft of the cards has no surface `der_deg`; did you mean `de_deg`?",
        ),
        (
            limits,
            "limits: { surface_rates_deg_s: { elev: 1 } }",
            "the aircraft of the cards has no surface `elev`",
        ),
        (
            limits,
            "limits: { surface_rates_deg_s: { de_deg: 0 } }",
            "the highest rate of `de_deg` must be above 0, not 0",
        ),
        (
            limits,
            "limits: { an_g: [4, -1] }",
            "`an_g` must be a lowest and a higher value, not 4 and -1",
        ),
        (
            limits,
            "limits: { an_g: [4] }",
            "next.limits.an_g must be a list of two numbers",
        ),
        (
            "settle_s: 20",
            "settle_s: -5",
            "`settle_s` must lie between 0 and 3600, not -5",
        ),
        (
            "settle_s: 20",
            "change_s_per_deg: -1",
            "`change_s_per_deg` must lie between 0 and 3600, not -1",
        ),
        (
            "repeats: 1",
            "repeats: 0",
            "`repeats` must lie between 1 and 100, not 0",
        ),
        (
            "repeats: 1",
            "altitude_ft: 250000",
            "`altitude_ft` must lie between -2000 and 100000, not 250000",
        ),
        (
            "repeats: 1",
            "mass_slug: 0",
            "`mass_slug` must lie between 0.001 and",
        ),
        (
            "repeats: 1",
            "mass_slug: 34000",
            "`mass_slug` is 34000, but the loadings are of 982.7 to 1067.6 slug: is it in another unit?",
        ),
        (
            "class: OLAT, alpha_deg: [15, 25]",
            "class: OLAT, alpha_deg: []",
            "OLAT: `alpha_deg` lists no angle of attack",
        ),
        (
            "\"3211\", alpha_deg: [15, 40]",
            "\"3211\", scale: 1000, alpha_deg: [15, 40]",
            "3211: `scale` must lie between 0.01 and 10, or with the other sign, not 1000",
        ),
    ] {
        let (head, tail) = text.split_once("\nnext:").unwrap();
        assert!(tail.contains(right), "{right}");
        let changed = tail.replacen(right, wrong, 1);
        let before = changed.split(wrong).next().unwrap();
        let line = head.matches('\n').count() + 2 + before.matches('\n').count();
        fs::write(&file, format!("{head}\nnext:{changed}")).unwrap();
        let outcome = run(&mut next(&campaign, &file));
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        let place = format!("cards.yaml:{line}: ");
        let is_said = outcome.stderr.contains(said) && outcome.stderr.contains(&place);
        assert!(is_said, "{wrong}: {place}: {}", outcome.stderr);
    }
}

#[test]
fn what_is_missing_is_named() {
    let campaign = Campaign::of_demo();
    let missing = campaign.path("none.yaml");
    let outcome = run(&mut next(&campaign, &missing));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(
        outcome
            .stderr
            .contains("there is no such file of test cards"),
        "{outcome:?}"
    );
    let mut command = campaign.command("next");
    let outcome = run(command.args(["--minutes", "0"]));
    assert_eq!(outcome.code, Some(64), "{outcome:?}");
}
