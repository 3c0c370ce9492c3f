//! Settings of a batch cluster, `cluster:` in `pipeline.yaml`.

use crate::settings::settings;

settings! {
    /// Resources of a task on the cluster. They decide no result.
    pub struct ClusterSettings {
        /// Shards of a plan, each a task of an array. More: shorter tasks, more of them in the queue.
        pub shards: usize = 24,
        /// Longest time of a task, as the scheduler writes it. The scheduler ends a longer task.
        pub time: String = "01:00:00".into(),
        /// Memory of a task, MB. The scheduler ends a task that needs more.
        pub memory_mb: usize = 2000,
        /// Processors of a task. Shards are cheaper to place than threads.
        pub processors: usize = 1,
        /// Further attempts of a task that asks for one.
        pub retries: usize = 3,
        /// Partition in which tasks run, in place of the scheduler's default.
        pub partition: Option<String> = None,
        /// Account that is charged, in place of the scheduler's default.
        pub account: Option<String> = None,
        /// Further lines for the scheduler, as it writes them after its mark: `--constraint=avx2`.
        pub options: Vec<String> = Vec::new(),
    }
}
