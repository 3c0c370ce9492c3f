//! The page as a whole: complete, well-formed, escaped, and deterministic.

use std::collections::BTreeSet;

use super::campaign_fixture::{Campaign, campaign, problem};
use super::*;
use crate::drawing_cache::DrawingCache;
use crate::pdf;
use crate::tables::Outcome;

fn render(campaign: &Campaign) -> String {
    html(&campaign.contents(), None).expect("a page")
}

/// Elements without content: in HTML only these may be closed in their own tag.
const VOID: [&str; 4] = ["meta", "br", "hr", "input"];
/// Elements of running text: a paragraph can hold nothing else.
const PHRASING: [&str; 9] = ["a", "b", "i", "small", "sub", "span", "code", "svg", "br"];

fn parsed(page: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..Default::default()
    };
    roxmltree::Document::parse_with_options(page, options).unwrap_or_else(|e| panic!("{e}"))
}

/// Checks that the page is well-formed and nested as HTML allows.
fn assert_valid(page: &str) {
    let document = parsed(page);
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        let name = node.tag_name().name();
        let inside = |ancestor: &str| node.ancestors().skip(1).any(|a| a.has_tag_name(ancestor));
        let children: Vec<&str> = node
            .children()
            .filter(roxmltree::Node::is_element)
            .map(|c| c.tag_name().name())
            .collect();
        let only = |allowed: &[&str]| {
            let wrong = children.iter().find(|c| !allowed.contains(c));
            assert!(wrong.is_none(), "<{}> in <{name}>", wrong.unwrap_or(&""));
        };
        let source = &page[node.range()];
        let is_short = source.ends_with("/>") && !source[..source.len() - 2].contains('>');
        assert!(
            !is_short || inside("svg") || name == "svg" || VOID.contains(&name),
            "HTML reads {source} as open"
        );
        match name {
            "p" | "h1" | "h2" | "h3" | "h4" | "summary" | "figcaption" | "th" => only(&PHRASING),
            "ul" => only(&["li"]),
            "dl" => only(&["dt", "dd"]),
            "table" => only(&["thead", "tbody"]),
            "thead" | "tbody" => only(&["tr"]),
            "tr" => only(&["td", "th"]),
            "svg" => {
                let is_hidden = node.attribute("aria-hidden") == Some("true");
                let has_text = |tag| {
                    node.children()
                        .any(|c| c.has_tag_name(tag) && c.text().is_some_and(|t| !t.is_empty()))
                };
                assert!(
                    is_hidden || (has_text("title") && has_text("desc")),
                    "a drawing without alternative text: {}",
                    &source[..120]
                );
            }
            _ => {}
        }
        if name == "table" {
            let widths: BTreeSet<usize> = node
                .descendants()
                .filter(|r| r.has_tag_name("tr"))
                .map(|r| r.children().filter(roxmltree::Node::is_element).count())
                .collect();
            assert!(widths.len() <= 1, "rows of {widths:?} cells");
        }
        if name == "a" {
            assert!(!inside("a"), "a link in a link");
        }
    }
}

/// The values of an attribute through the page.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(&start)
        .skip(1)
        .filter_map(|rest| rest.split_once('"').map(|(value, _)| value))
        .collect()
}

#[test]
fn the_page_is_valid_and_its_numbers_are_numbers() {
    let page = render(&campaign());
    assert_valid(&page);
    assert!(!page.contains("NaN") && !page.contains("inf\""));
}

#[test]
fn ids_are_unique_without_case_and_links_have_targets() {
    let page = render(&campaign());
    let ids: Vec<String> = values(&page, "id")
        .iter()
        .map(|id| id.to_lowercase())
        .collect();
    let unique: BTreeSet<&String> = ids.iter().collect();
    assert_eq!(ids.len(), unique.len());
    for link in values(&page, "href") {
        let target = link.strip_prefix('#').expect("a link within the page");
        assert!(
            ids.iter().any(|id| id == target),
            "#{target} does not exist"
        );
    }
}

#[test]
fn every_derivative_of_the_comparison_is_linked_to_its_figure() {
    let campaign = campaign();
    let page = render(&campaign);
    // A bias has a figure, but no tunnel to be compared with.
    let is_derivative = |name: &&String| notation::coefficient_of(name).is_some();
    for name in campaign
        .comparison
        .iter()
        .map(|c| &c.derivative)
        .filter(is_derivative)
    {
        assert!(
            page.contains(&format!("title=\"{name}\"")),
            "{name} is not in the verdict table"
        );
        assert!(
            page.contains(&format!("</sub>, {name} <a")),
            "{name} has no page"
        );
    }
}

#[test]
fn the_page_loads_nothing_and_needs_no_script() {
    let page = render(&campaign());
    for forbidden in [
        "http:",
        "https:",
        "<link",
        "<img",
        "@import",
        "url(//",
        "javascript:",
        " src=",
        " onclick",
        " onload",
    ] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    assert_eq!(
        page.matches("<script").count(),
        1,
        "one that sorts and hides"
    );
    assert!(
        page.contains("default-src 'none'"),
        "the policy forbids to load anything"
    );
    let (before, _) = page.split_once("<script>").expect("the script");
    assert!(
        before.ends_with("</main>\n"),
        "everything stands before the script"
    );
}

#[test]
fn data_cannot_become_markup() {
    let hostile = "<script>alert('x')</script>&\"";
    let mut campaign = campaign();
    campaign.maneuvers[0].flight_id = hostile.into();
    campaign.maneuvers[1].class = hostile.into();
    campaign.estimates[6].class = hostile.into();
    campaign.problems.push(problem(hostile));
    campaign.order.push(hostile.into());
    campaign.histories[0].class = hostile.into();
    campaign.histories[0].outputs[0].label = hostile.into();
    campaign.histories[0].controls[0].0 = hostile.into();
    for row in campaign.comparison.iter_mut().take(5) {
        (row.derivative, row.unit, row.group) = (hostile.into(), hostile.into(), hostile.into());
    }
    let page = render(&campaign);
    assert_eq!(page.matches("<script").count(), 1, "the page's own");
    assert!(page.contains("&lt;script&gt;"));
    assert_valid(&page);
}

#[test]
fn an_empty_campaign_has_a_page() {
    let page = render(&Campaign::default());
    assert!(page.contains("No maneuver was found"));
    assert!(page.contains("Nothing to draw"));
    assert_valid(&page);
}

#[test]
fn a_campaign_without_a_sound_fit_has_a_page_with_the_reasons() {
    let mut campaign = campaign();
    campaign.estimates.clear();
    campaign.trends.clear();
    campaign.comparison.clear();
    campaign.histories.clear();
    for fit in &mut campaign.fits {
        (fit.outcome, fit.reason) = (Outcome::Rejected, "the vane was stuck".into());
        (fit.initial_cost, fit.final_cost) = (None, Some(f64::NAN));
    }
    let page = render(&campaign);
    assert!(page.contains("20 rejected"));
    assert!(page.contains("the vane was stuck"));
    assert!(page.contains("Nothing to draw"));
    assert_valid(&page);
}

#[test]
fn numbers_that_are_not_finite_do_not_break_the_page() {
    let mut campaign = campaign();
    for (i, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY]
        .into_iter()
        .enumerate()
    {
        (campaign.maneuvers[i].alpha_deg, campaign.maneuvers[i].mach) = (bad, bad);
        (
            campaign.estimates[i].value,
            campaign.estimates[i + 3].alpha_deg,
        ) = (Some(bad), bad);
        (
            campaign.estimates[i + 8].bound,
            campaign.estimates[i + 8].bound_corrected,
        ) = (Some(bad), Some(bad));
        (
            campaign.trends[i].value,
            campaign.trends[i + 3].alpha_deg,
            campaign.trends[i + 6].upper_95,
        ) = (bad, bad, bad);
        (
            campaign.comparison[i].flight,
            campaign.comparison[i].tunnel.difference,
        ) = (bad, Some(bad));
        (
            campaign.comparison[i + 5].tunnel.wind_tunnel,
            campaign.comparison[i + 10].alpha_deg,
        ) = (Some(bad), bad);
        campaign.comparison[i].tunnel.difference_pct = Some(bad);
    }
    for history in &mut campaign.histories {
        history.time_s[0] = f64::NAN;
        history.time_s[599] = f64::INFINITY;
        history.outputs[0].measured.fill(f64::NAN);
        history.outputs[0].computed[3] = f64::INFINITY;
        history.outputs[0].marked.clear();
        history.controls[0].1.truncate(7);
    }
    let page = render(&campaign);
    assert_valid(&page);
    for bad in ["NaN", ">inf<", "\"inf\""] {
        let around = page.find(bad).map(|at| {
            page.chars()
                .skip(page[..at].chars().count().saturating_sub(80))
                .take(160)
        });
        assert_eq!(around.map(String::from_iter), None, "{bad}");
    }
}

#[test]
fn the_same_campaign_is_the_same_bytes() {
    assert_eq!(render(&campaign()), render(&campaign()));
    let printed = |cache: &DrawingCache| pdf::pdf(&render(&campaign()), cache).expect("a PDF");
    let cache = DrawingCache::default();
    let first = printed(&cache);
    assert!(first == printed(&DrawingCache::default()));
    let known = DrawingCache::of_last_report(&cache.to_bytes());
    assert!(first == printed(&known));
    assert!(known.to_bytes() == cache.to_bytes());
}

#[test]
fn every_maneuver_begins_a_page_and_every_derivative_has_a_figure() {
    let campaign = campaign();
    let page = render(&campaign);
    assert_eq!(
        page.matches("class=\"maneuver new-page one-page\"").count(),
        campaign.maneuvers.len()
    );
    assert_eq!(
        page.matches("class=\"derivative\"").count(),
        campaign.order.len()
    );
}

/// Most elements of a maneuver's page beside the rows of its table. A browser reads 300 such pages before it
/// has loaded a report.
const MOST_ELEMENTS: usize = 190;

#[test]
fn a_page_of_a_maneuver_has_few_elements() {
    let mut campaign = campaign();
    let history = &mut campaign.histories[0];
    history.outputs = vec![history.outputs[0].clone(); 5];
    history.controls = vec![history.controls[0].clone(); 3];
    let page = render(&campaign);
    let document = parsed(&page);
    let maneuver = document
        .descendants()
        .find(|node| node.attribute("id") == Some("m1"))
        .expect("the page of the first maneuver");
    let elements = || maneuver.descendants().filter(roxmltree::Node::is_element);
    let of_kind = |name: &str| elements().filter(|e| e.has_tag_name(name)).count();
    let (rows, cells) = (of_kind("tr"), of_kind("td"));
    assert!(rows == 5 && cells == 40, "{rows} rows, {cells} cells");
    let others = elements().count() - rows - cells;
    assert!(others <= MOST_ELEMENTS, "{others} elements");
    let with_attributes = elements()
        .filter(|e| e.has_tag_name("td") && e.attributes().len() > 0)
        .count();
    assert_eq!(with_attributes, 0, "the table aligns its columns");
}

#[test]
fn a_long_table_reserves_its_height_before_it_is_laid_out() {
    let mut campaign = campaign();
    assert!(!render(&campaign).contains("class=\"scroll long\""));
    campaign
        .problems
        .extend((0..60).map(|i| problem(&format!("reason {i}"))));
    let rows = campaign.problems.len();
    let page = render(&campaign);
    let height = format!("auto {}px", 28 * rows + 50);
    let start = "<div class=\"scroll long\" style=\"contain-intrinsic-size: ";
    assert!(page.contains(&format!("{start}{height}\">")), "{rows} rows");
}

#[test]
fn the_page_begins_with_three_answers_of_one_paragraph_and_picture_each() {
    let page = render(&campaign());
    let (start, rest) = page.split_once("<nav").expect("the contents");
    assert!(!start.contains("<table"), "before any table");
    let document = parsed(&page);
    let of_class = |class: &str| {
        let all = document.descendants();
        let own = all.filter(|n| n.attribute("class") == Some(class));
        own.collect::<Vec<_>>()
    };
    let answers = of_class("answer pairs");
    assert_eq!(answers.len(), 3);
    for answer in answers {
        for kind in ["h3", "p", "figure"] {
            let own = answer.descendants().filter(|n| n.has_tag_name(kind));
            assert_eq!(own.count(), 1, "{kind} of {answer:?}");
        }
        let text = answer.descendants().find(|n| n.has_tag_name("p"));
        let text: String = text
            .into_iter()
            .flat_map(|p| p.descendants())
            .filter_map(|n| n.text())
            .collect();
        assert!(text.contains('%') || text.contains("expected"), "{text}");
    }
    assert!(rest.contains("What is new"));
}

#[test]
fn a_maneuver_outside_the_tolerances_is_marked_in_facts_and_table() {
    let page = render(&campaign());
    assert_eq!(
        page.matches("<strong class=\"flagged\">outside the tolerances")
            .count(),
        2,
        "one maneuver, by both models"
    );
    assert!(page.contains("<td class=\"flagged\">outside</td>"));
    assert_eq!(
        page.matches("<td class=\"flagged\">").count(),
        1,
        "the verdict of the first model"
    );
}

#[test]
fn the_summary_comes_first_with_news_failures_and_disagreements() {
    let page = render(&campaign());
    let at = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
    assert!(at("<h3>What is new</h3>") < at("<h3>What failed</h3>"));
    assert!(at("1-OLON-10 (did not converge)") < at("<h3>What disagrees</h3>"));
    assert!(at("Largest in standard errors") < at("id=\"failures\""));
}

#[test]
fn the_report_ends_with_its_provenance() {
    let page = render(&campaign());
    let (_, end) = page.split_once("id=\"provenance\"").expect("the section");
    for words in [
        "harvest 0.0.0, ingest 1",
        "harvest run mine",
        "flight_001.parquet",
        "00ff",
        "  deeper: 1\n",
    ] {
        assert!(end.contains(words), "{words}");
    }
}

#[test]
fn a_template_of_the_user_replaces_the_built_in_one_and_errors_name_the_line() {
    let campaign = campaign();
    let own = html(
        &campaign.contents(),
        Some("{{ title }}: {{ verdicts|length }}"),
    );
    assert_eq!(own.expect("a page"), "A campaign: 2");
    let error = html(&campaign.contents(), Some("one\n{{ title")).expect_err("a broken template");
    assert!(error.contains("report.html:2"), "{error}");
}
