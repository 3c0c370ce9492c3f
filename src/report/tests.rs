//! The page as a whole: complete, well-formed, safe against what stands in the data, and the same bytes every time.

use std::collections::BTreeSet;

use super::samples::{Campaign, campaign, problem};
use super::*;

fn render(campaign: &Campaign) -> String {
    html(&campaign.contents(), None).expect("a page")
}

/// The tags of a page in order: name, and whether it opens, closes or does both.
fn tags(page: &str) -> Vec<(String, bool, bool)> {
    let mut tags = Vec::new();
    for (at, _) in page.match_indices('<') {
        let tag = &page[at + 1..at + page[at..].find('>').expect("an end of the tag")];
        let name = tag.trim_start_matches('/').split([' ', '/']).next().expect("a name").to_lowercase();
        tags.push((name, !tag.starts_with('/'), tag.starts_with('/') || tag.ends_with('/')));
    }
    tags
}

fn assert_balanced(page: &str) {
    let mut open: Vec<String> = Vec::new();
    for (name, opens, closes) in tags(page) {
        match (opens, closes) {
            _ if ["!doctype", "meta"].contains(&name.as_str()) => {}
            (true, false) => open.push(name),
            (false, _) => assert_eq!(open.pop().as_deref(), Some(name.as_str()), "closes what is not open"),
            (true, true) => {}
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
}

/// The values of an attribute through the page.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(&start).skip(1).filter_map(|rest| rest.split_once('"').map(|(value, _)| value)).collect()
}

#[test]
fn tags_are_balanced_and_numbers_are_numbers() {
    let page = render(&campaign());
    assert_balanced(&page);
    assert!(!page.contains("NaN") && !page.contains("inf\""));
}

#[test]
fn ids_are_unique_whatever_their_case_and_links_lead_somewhere() {
    let page = render(&campaign());
    let ids: Vec<String> = values(&page, "id").iter().map(|id| id.to_lowercase()).collect();
    let unique: BTreeSet<&String> = ids.iter().collect();
    assert_eq!(ids.len(), unique.len());
    for link in values(&page, "href") {
        let target = link.strip_prefix('#').expect("a link within the page");
        assert!(ids.iter().any(|id| id == target), "#{target} leads nowhere");
    }
}

#[test]
fn every_derivative_of_the_comparison_is_linked_to_its_figure() {
    let campaign = campaign();
    let page = render(&campaign);
    // A bias has a figure, but no tunnel to be compared with.
    let is_derivative = |name: &&String| notation::coefficient_of(name).is_some();
    for name in campaign.comparison.iter().map(|c| &c.derivative).filter(is_derivative) {
        assert!(page.contains(&format!("title=\"{name}\"")), "{name} is not in the verdict table");
        assert!(page.contains(&format!("({name})")), "{name} has no figure");
    }
}

#[test]
fn the_page_loads_nothing_and_runs_nothing() {
    let page = render(&campaign());
    for forbidden in ["http", "<script", "<link", "<img", "@import", "url(//", "javascript:", " src="] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn what_stands_in_the_data_cannot_become_markup() {
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
        row.verdict = hostile.into();
    }
    let page = render(&campaign);
    assert!(!page.contains("<script") && page.contains("&lt;script&gt;"));
    assert_balanced(&page);
}

#[test]
fn an_empty_campaign_has_a_page_that_says_so() {
    let page = render(&Campaign::default());
    assert!(page.contains("No maneuver was found"));
    assert!(page.contains("Nothing to draw"));
    assert_balanced(&page);
}

#[test]
fn a_campaign_where_everything_failed_has_a_page_that_says_why() {
    let mut campaign = campaign();
    campaign.estimates.clear();
    campaign.trends.clear();
    campaign.comparison.clear();
    campaign.histories.clear();
    for fit in &mut campaign.fits {
        (fit.outcome, fit.reason) = ("rejected".into(), "the vane was stuck".into());
        (fit.initial_cost, fit.final_cost) = (None, Some(f64::NAN));
    }
    let page = render(&campaign);
    assert!(page.contains("20 rejected"));
    assert!(page.contains("the vane was stuck"));
    assert!(page.contains("Nothing to draw"));
    assert_balanced(&page);
}

#[test]
fn numbers_that_are_none_do_not_break_the_page() {
    let mut campaign = campaign();
    for (i, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().enumerate() {
        (campaign.maneuvers[i].alpha_deg, campaign.maneuvers[i].mach) = (bad, bad);
        (campaign.estimates[i].value, campaign.estimates[i + 3].alpha_deg) = (Some(bad), bad);
        (campaign.estimates[i + 8].bound, campaign.estimates[i + 8].bound_corrected) = (Some(bad), Some(bad));
        (campaign.trends[i].value, campaign.trends[i + 3].alpha_deg, campaign.trends[i + 6].upper_95) = (bad, bad, bad);
        (campaign.comparison[i].flight, campaign.comparison[i].difference) = (bad, Some(bad));
        (campaign.comparison[i + 5].wind_tunnel, campaign.comparison[i + 10].alpha_deg) = (Some(bad), bad);
        campaign.comparison[i].difference_pct = Some(bad);
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
    assert_balanced(&page);
    assert!(!page.contains("NaN") && !page.contains(">inf") && !page.contains("\"inf"));
}

#[test]
fn the_same_campaign_is_the_same_bytes() {
    assert_eq!(render(&campaign()), render(&campaign()));
}

#[test]
fn a_template_of_the_user_replaces_the_built_in_one_and_its_error_names_the_line() {
    let campaign = campaign();
    let own = html(&campaign.contents(), Some("{{ title }}: {{ verdicts|length }}"));
    assert_eq!(own.expect("a page"), "A campaign: 2");
    let error = html(&campaign.contents(), Some("one\n{{ title")).expect_err("a broken template");
    assert!(error.contains("report.html:2"), "{error}");
}
