//! Settings of a batch cluster, `cluster:` in `pipeline.yaml`.

use serde::{Deserialize, Serialize};

/// What a task may use of the cluster, of `cluster:` in `pipeline.yaml`. It decides no result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClusterSettings {
    /// Shards of a plan, each a task of an array. Default 24.
    pub shards: usize,
    /// Longest time of a task, as the scheduler writes it. Default one hour.
    pub time: String,
    /// Memory of a task, MB. Default 2000.
    pub memory_mb: usize,
    /// Processors of a task. Default 1: shards are cheaper to place than threads.
    pub processors: usize,
    /// How often a task that asks for it is tried again. Default 3.
    pub retries: usize,
    /// Where tasks run; the scheduler's default where none is given.
    pub partition: Option<String>,
    /// Who pays; the scheduler's default where none is given.
    pub account: Option<String>,
    /// Further lines for the scheduler, as it writes them after its mark: `--constraint=avx2`.
    pub options: Vec<String>,
}

impl Default for ClusterSettings {
    fn default() -> ClusterSettings {
        ClusterSettings {
            shards: 24,
            time: "01:00:00".into(),
            memory_mb: 2000,
            processors: 1,
            retries: 3,
            partition: None,
            account: None,
            options: Vec::new(),
        }
    }
}
