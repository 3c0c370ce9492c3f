//! The report in a browser: a headless Chromium opens it wide and narrow with its script at work,
//! loads nothing, reports no error, and prints it. Skipped without Chromium, but in CI.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{demo, skip};

/// Chromium among the programs of this machine.
fn chromium() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let mut candidates =
        std::env::split_paths(&folders).flat_map(|folder| names.map(|name| folder.join(name)));
    candidates.find(|path| path.is_file())
}

/// Times that a browser is started which makes nothing of the page: on a busy machine one may hang or crash
/// before it has read it.
const STARTS: usize = 3;
/// Longest time of one start.
const LONGEST: Duration = Duration::from_secs(90);

/// Outcome of opening a page: what the browser made of it, and the messages of its console.
struct Opened {
    made: Vec<u8>,
    console: Vec<String>,
}

impl Opened {
    fn page(&self) -> String {
        String::from_utf8_lossy(&self.made).into_owned()
    }
}

/// Opens a file without a network. The browser makes a file of this name, which has this text where it has
/// read the page.
fn open(chromium: &Path, page: &Path, options: &[&str], (makes, text): (&str, &str)) -> Opened {
    let mut said = vec![];
    loop {
        let folder = tempfile::tempdir().unwrap();
        let messages = start(chromium, folder.path(), page, options);
        let made = std::fs::read(folder.path().join(makes)).unwrap_or_default();
        if String::from_utf8_lossy(&made).contains(text) {
            let console = messages.lines().filter(|line| line.contains("CONSOLE"));
            let console = console.map(str::to_owned).collect();
            return Opened { made, console };
        }
        said.push(messages);
        assert!(
            said.len() < STARTS,
            "nothing was made of the page: {said:?}"
        );
    }
}

/// Runs a browser in a folder of its own and returns its messages; one that does not end is ended.
fn start(chromium: &Path, folder: &Path, page: &Path, options: &[&str]) -> String {
    let file = |name: &str| Stdio::from(std::fs::File::create(folder.join(name)).unwrap());
    let mut child = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--no-first-run",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--force-prefers-reduced-motion",
        ])
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .args(options)
        .arg(format!("file://{}", page.display()))
        .current_dir(folder)
        .stdout(file(PAGE))
        .stderr(file("messages"))
        .spawn()
        .unwrap();
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > LONGEST {
            child.kill().unwrap();
            child.wait().unwrap();
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    String::from_utf8_lossy(&std::fs::read(folder.join("messages")).unwrap()).into_owned()
}

/// Name of what the browser writes to its standard output.
const PAGE: &str = "page";

/// Script that checks what is visible on the page and writes the results into its title.
const QUESTIONS: &str = r"
addEventListener('load', function () {
  var all = function (s) { return Array.from(document.querySelectorAll(s)); }, said = [];
  var seen = function (e) { var box = e.getBoundingClientRect(); return box.width !== 0 ? box.height !== 0 : false; };
  said.push('loaded ' + performance.getEntriesByType('resource').length);
  var laidOut = function (e) { return e.checkVisibility({ contentVisibilityAuto: true }); };
  var many = function (e) { return 4 * e.filter(laidOut).length > e.length; };
  said.push('many cells laid out ' + many(all('td')) + ', figures ' + many(all('svg[role=img]')));
  var last = all('.maneuver').pop(); location.hash = last.id;
  said.push('reached ' + (50 > Math.abs(last.getBoundingClientRect().top - 50))); scrollTo(0, 0);
  said.push('wide ' + (document.documentElement.scrollWidth > innerWidth));
  var answers = all('.answer'), ends = answers.map(function (a) { return a.querySelector('figure').getBoundingClientRect().bottom; });
  said.push('answers ' + answers.length + ' on the first screen ' + ends.every(function (end) { return 1000 > end; }));
  var figures = all('svg[role=img]');
  said.push('figures ' + figures.length + ' empty ' + figures.filter(function (f) { return !f.querySelector('path,line'); }).length);
  var first = document.querySelector('.derivative svg'); said.push('drawn ' + seen(first));
  var table = document.querySelector('#maneuvers ~ .scroll table'), head = table.tHead.rows[0].cells[5];
  head.querySelector('button').click(); head.querySelector('button').click();
  var column = Array.from(table.tBodies[0].rows).map(function (r) { return parseFloat(r.cells[5].textContent); });
  var falls = function (v, i) { return Number.isFinite(v) ? (i === 0 ? true : !(v > column[i - 1])) : false; };
  said.push('sorted ' + (column.length > 1 ? column.every(falls) : false));
  var box = document.querySelector('#classes input'), own = all('[data-class=' + box.value + ']');
  said.push('before ' + (own.length > 0 ? own.every(seen) : false));
  box.click(); said.push('after ' + own.some(seen)); box.click();
  var style = document.createElement('style'); style.textContent = '* { content-visibility: visible !important }'; document.head.appendChild(style);
  all('details').forEach(function (d) { d.open = true; });
  var clipped = all('.scroll').filter(function (e) { return e.scrollWidth > e.clientWidth; });
  said.push('clipped ' + clipped.length + ' of ' + (all('.scroll').length > 40 ? 'many' : 'few'));
  document.title = said.join('; ');
});
";

#[test]
fn a_browser_shows_the_report_wide_and_narrow_without_errors() {
    let Some(chromium) = chromium() else {
        return skip("no Chromium among the programs of this machine");
    };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("asked.html");
    let asked = demo()
        .report
        .replace("</body>", &format!("<script>{QUESTIONS}</script></body>"));
    std::fs::write(&page, asked).unwrap();
    // On a wide screen the three answers with their pictures are seen at once, and no table is cut.
    for (size, is_wide) in [
        ("--window-size=1400,1000", true),
        ("--window-size=1200,1000", true),
        ("--window-size=500,900", false),
    ] {
        let seen = open(&chromium, &page, &["--dump-dom", size], (PAGE, "<title>"));
        assert!(seen.console.is_empty(), "{size}: {:?}", seen.console);
        let page = seen.page();
        let title = page
            .split_once("<title>")
            .and_then(|(_, rest)| rest.split_once("</title>"))
            .unwrap()
            .0;
        assert!(
            title.starts_with(
                "loaded 0; many cells laid out false, figures false; reached true; wide false; answers 3 on the first screen "
            ),
            "{size}: {title}"
        );
        let figures = title.split("figures ").nth(2).unwrap();
        let figures: usize = figures.split(' ').next().unwrap().parse().unwrap();
        assert!(figures >= 51, "{size}: {title}");
        let end = " empty 0; drawn true; sorted true; before true; after false; clipped ";
        assert!(title.contains(end), "{size}: {title}");
        if is_wide {
            assert!(
                title.contains("on the first screen true"),
                "{size}: {title}"
            );
            assert!(title.ends_with("clipped 0 of many"), "{size}: {title}");
        }
    }
}

#[test]
fn a_browser_prints_the_report() {
    let Some(chromium) = chromium() else {
        return skip("no Chromium among the programs of this machine");
    };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("report.html");
    std::fs::write(&page, &demo().report).unwrap();
    let printed = "printed.pdf";
    let option = format!("--print-to-pdf={printed}");
    let options = [option.as_str(), "--no-pdf-header-footer"];
    let seen = open(&chromium, &page, &options, (printed, "%PDF"));
    assert!(seen.console.is_empty(), "{:?}", seen.console);
    let document = lopdf::Document::load_mem(&seen.made).unwrap();
    let pages = document.get_pages().len();
    let sheets = demo()
        .report
        .matches("class=\"maneuver new-page one-page\"")
        .count();
    assert!(pages > sheets, "{pages} pages for {sheets} sheets");
}
