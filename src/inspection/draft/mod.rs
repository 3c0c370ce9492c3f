//! Draft of a pipeline from the findings of an inspection: the YAML files of the pipeline's folder.
//! Each value that no recording contains is an open question.

mod aircraft;
mod classes;
mod contents;
mod model;
mod pipeline;

pub use contents::{Draft, DraftFile, OPEN, UNSURE};

/// Files of the pipeline's folder.
#[must_use]
pub fn files(draft: &Draft) -> Vec<DraftFile> {
    let file = |path: &str, text: String| DraftFile {
        path: path.to_owned(),
        text,
    };
    let mut files = vec![
        file("pipeline.yaml", pipeline::text(draft)),
        file("aircraft.yaml", aircraft::text(draft)),
        file("model.yaml", model::text(draft)),
    ];
    let classes = classes::classes(draft).into_iter();
    files.extend(classes.map(|class| {
        let path = format!("maneuvers/{}.yaml", class.name);
        file(&path, classes::text(draft, &class))
    }));
    files
}
