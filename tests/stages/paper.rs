//! The report on paper, read back by another program's reader: text, table of contents, outline,
//! links.

use std::collections::BTreeMap;

use lopdf::Document;

use crate::support::demo;

fn printed() -> Document {
    Document::load_mem(&demo().printed).unwrap()
}

/// The text of every page, with spaces as single ones.
fn texts(document: &Document) -> Vec<String> {
    let pages = document.get_pages();
    let text = |page: u32| {
        document
            .extract_text(&[page])
            .unwrap()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
    };
    pages.keys().map(|page| text(*page)).collect()
}

#[test]
fn the_summary_can_be_read_and_every_page_has_its_number() {
    let texts = texts(&printed());
    let all = texts.join(" ");
    for words in [
        "What is new",
        "What failed",
        "What disagrees",
        "Flight against wind tunnel, derivative by derivative",
    ] {
        assert!(all.contains(words), "{words}");
    }
    let maneuvers = demo().tables["maneuvers"].len();
    assert!(
        all.contains(&format!("{maneuvers} maneuvers in ")),
        "the first line of the summary"
    );
    for (i, text) in texts.iter().enumerate() {
        assert!(
            text.contains(&format!("page {} of {}", i + 1, texts.len())),
            "page {}: {text}",
            i + 1
        );
    }
}

#[test]
fn the_first_page_has_the_three_answers_and_few_pages_follow_for_each_maneuver() {
    let texts = texts(&printed());
    for question in [
        "Is it good enough to fly?",
        "Does the simulator still match?",
        "What do we fly next?",
    ] {
        assert!(texts[0].contains(question), "{question}: {}", texts[0]);
    }
    assert!(texts[1].contains("Contents"), "{}", texts[1]);
    let begins = |text: &&String| text.contains("Flight condition");
    let (first, last) = (
        texts.iter().position(|text| begins(&text)).unwrap(),
        texts.iter().rposition(|text| begins(&text)).unwrap(),
    );
    let maneuvers = demo().tables["maneuvers"].len();
    let pages = last + 1 - first;
    assert!(
        8 * pages <= 9 * maneuvers,
        "{pages} pages of {maneuvers} maneuvers"
    );
}

#[test]
fn every_derivative_and_maneuver_is_on_a_page_of_its_own_that_the_outline_names() {
    let document = printed();
    let texts = texts(&document);
    let outline: BTreeMap<String, usize> = document
        .get_toc()
        .unwrap()
        .toc
        .into_iter()
        .map(|entry| (entry.title, entry.page))
        .collect();
    let page_of = |words: &str| {
        outline
            .iter()
            .find(|(title, _)| title.contains(words))
            .map(|(_, page)| *page)
    };
    let mut pages = Vec::new();
    for row in &demo().tables["maneuvers"] {
        let page = page_of(&row["maneuver_id"])
            .unwrap_or_else(|| panic!("{} is not in the outline", row["maneuver_id"]));
        assert!(
            texts[page - 1].contains(&row["maneuver_id"])
                && texts[page - 1].contains("Flight condition")
        );
        pages.push(page);
    }
    let every = pages.len();
    pages.dedup();
    assert_eq!(pages.len(), every, "no two on one page");
    for row in &demo().tables["comparison"] {
        let name = format!(", {}", row["derivative"]);
        let page = outline
            .iter()
            .find(|(title, _)| title.ends_with(&name))
            .map(|(_, page)| *page);
        assert!(
            page.is_some_and(|page| texts[page - 1].contains(&row["derivative"])),
            "{name}"
        );
    }
}

#[test]
fn the_contents_list_the_pages_of_the_chapters() {
    let document = printed();
    let texts = texts(&document);
    let toc = document.get_toc().unwrap().toc;
    let chapters: Vec<_> = toc.iter().filter(|entry| entry.level == 1).collect();
    assert!(chapters.len() > 8, "{toc:?}");
    let contents = texts[..3].join(" ");
    for chapter in chapters {
        assert!(
            contents.contains(&format!("{} {}", chapter.title, chapter.page)),
            "{} {}",
            chapter.title,
            chapter.page
        );
        assert!(
            texts[chapter.page - 1].contains(&chapter.title),
            "{}",
            chapter.title
        );
    }
}

#[test]
fn the_paper_carries_its_fonts_and_no_date() {
    let document = printed();
    let bytes = &demo().printed;
    let has = |word: &[u8]| bytes.windows(word.len()).any(|w| w == word);
    assert!(has(b"/FontFile2") && !has(b"CreationDate") && !has(b"ModDate"));
    assert!(document.get_pages().len() > 50);
}
