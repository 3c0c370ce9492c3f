//! Scripts for a batch scheduler: an array over flights, the plan of their maneuvers, an array over
//! maneuvers, and the merge. Each job waits for the one before.
//!
//! Slurm cancels a dependency on an array (`afterok`) if `RequeueExit` requeues one of its tasks. A
//! task that needs another try therefore requeues itself (`scontrol requeue`), which the dependency
//! survives. PBS has no such command: there the task repeats its command within its own time.

use crate::config::ClusterSettings;

/// Batch scheduler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheduler {
    Slurm,
    Pbs,
}

/// The campaign that the scripts compute.
#[derive(Clone, Debug)]
pub struct CampaignCommands {
    /// Path of the program.
    pub program: String,
    /// Pipeline and options, as typed after a command.
    pub arguments: Vec<String>,
    /// Working folder of the commands.
    pub folder: String,
    /// Files of the plans.
    pub flights: String,
    pub maneuvers: String,
    /// Folder of the scripts and of the tasks' logs.
    pub out: String,
}

/// One script of the chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Script {
    pub name: String,
    pub text: String,
}

/// Job of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Job {
    /// Array over the shards of flights.
    Flights,
    /// Plan of the maneuvers found in the flights.
    Plan,
    /// Array over the shards of maneuvers.
    Maneuvers,
    /// Merge of all shards.
    Merge,
}

impl Job {
    /// The jobs in order.
    const ALL: [Job; 4] = [Job::Flights, Job::Plan, Job::Maneuvers, Job::Merge];

    fn name(self) -> &'static str {
        match self {
            Job::Flights => "flights",
            Job::Plan => "plan",
            Job::Maneuvers => "maneuvers",
            Job::Merge => "merge",
        }
    }

    fn is_array(self) -> bool {
        matches!(self, Job::Flights | Job::Maneuvers)
    }
}

/// Largest array under Slurm's default `MaxArraySize` of 1001, which is exclusive.
pub const LARGEST_ARRAY: usize = 1000;

/// Quotes a word for the shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Writes all scripts; the last submits the others.
#[must_use]
pub fn scripts(
    engine: Scheduler,
    settings: &ClusterSettings,
    campaign: &CampaignCommands,
) -> Vec<Script> {
    let jobs = Job::ALL.into_iter();
    let mut scripts: Vec<Script> = jobs
        .map(|job| Script {
            name: format!("{}.sh", job.name()),
            text: script(engine, settings, campaign, job),
        })
        .collect();
    scripts.push(Script {
        name: "submit.sh".to_owned(),
        text: submit(engine, campaign),
    });
    scripts
}

fn script(
    engine: Scheduler,
    settings: &ClusterSettings,
    campaign: &CampaignCommands,
    job: Job,
) -> String {
    let mut lines = vec!["#!/bin/bash".to_owned()];
    lines.extend(directives(engine, settings, campaign, job));
    lines.push(format!("cd {} || exit 1", quoted(&campaign.folder)));
    let program = quoted(&campaign.program);
    lines.push(format!("harvest=${{HARVEST:-{program}}}"));
    let command = command(engine, settings, campaign, job);
    lines.push(retried(engine, settings, job, &command));
    if job == Job::Merge {
        let comment =
            "# Something was rejected, and the rest is published: see the table problems.";
        lines.push(comment.to_owned());
        lines.push("[ $code -eq 2 ] && code=0".to_owned());
    }
    lines.push("exit $code\n".to_owned());
    lines.join("\n")
}

/// The command of a job, without the program.
fn command(
    engine: Scheduler,
    settings: &ClusterSettings,
    campaign: &CampaignCommands,
    job: Job,
) -> String {
    let (shards, threads) = (settings.shards, settings.processors);
    let arguments: Vec<String> = campaign.arguments.iter().map(|a| quoted(a)).collect();
    let arguments = arguments.join(" ");
    let (flights, maneuvers) = (quoted(&campaign.flights), quoted(&campaign.maneuvers));
    let task = match engine {
        Scheduler::Slurm => "$SLURM_ARRAY_TASK_ID",
        Scheduler::Pbs => "$PBS_ARRAY_INDEX",
    };
    let shard = format!("--shard \"{task}/{shards}\" --threads {threads}");
    match job {
        Job::Flights => format!("segment {arguments} --plan {flights} {shard}"),
        Job::Plan => format!("plan {arguments} --of maneuvers --shards {shards} --out {maneuvers}"),
        Job::Maneuvers => format!("estimate {arguments} --plan {maneuvers} {shard}"),
        Job::Merge => format!("merge {arguments} --plan {maneuvers} --threads {threads}"),
    }
}

/// First lines of a job's script, which request its resources: `#SBATCH …` or `#PBS …`.
fn directives(
    engine: Scheduler,
    settings: &ClusterSettings,
    campaign: &CampaignCommands,
    job: Job,
) -> Vec<String> {
    let (mark, mut options) = match engine {
        Scheduler::Slurm => ("#SBATCH", slurm_options(settings, campaign, job)),
        Scheduler::Pbs => ("#PBS", pbs_options(settings, campaign, job)),
    };
    options.extend(settings.options.iter().cloned());
    let lines = options.into_iter();
    lines.map(|option| format!("{mark} {option}")).collect()
}

fn slurm_options(s: &ClusterSettings, campaign: &CampaignCommands, job: Job) -> Vec<String> {
    let log = format!("{}/{}", campaign.out, job.name());
    let task = if job.is_array() { "-%a" } else { "" };
    let mut options = vec![
        format!("--job-name=harvest-{}", job.name()),
        format!("--output={log}{task}.log"),
        // A repeated task appends to its log; the tasks of a dead node start again.
        "--open-mode=append".to_owned(),
        "--requeue".to_owned(),
        format!("--time={}", s.time),
        format!("--mem={}M", s.memory_mb),
        "--ntasks=1".to_owned(),
        format!("--cpus-per-task={}", s.processors),
    ];
    options.extend(job.is_array().then(|| format!("--array=1-{}", s.shards)));
    options.extend(s.partition.iter().map(|p| format!("--partition={p}")));
    options.extend(s.account.iter().map(|a| format!("--account={a}")));
    options
}

fn pbs_options(s: &ClusterSettings, campaign: &CampaignCommands, job: Job) -> Vec<String> {
    let mut options = vec![
        format!("-N harvest-{}", job.name()),
        "-j oe".to_owned(),
        format!("-o {}/", campaign.out),
        "-r y".to_owned(),
        format!("-l select=1:ncpus={}:mem={}mb", s.processors, s.memory_mb),
        format!("-l walltime={}", s.time),
    ];
    options.extend(job.is_array().then(|| format!("-J 1-{}", s.shards)));
    options.extend(s.partition.iter().map(|p| format!("-q {p}")));
    options.extend(s.account.iter().map(|a| format!("-A {a}")));
    options
}

/// The command, repeated after exit code 75.
fn retried(engine: Scheduler, settings: &ClusterSettings, job: Job, command: &str) -> String {
    let retries = settings.retries;
    match engine {
        Scheduler::Slurm => {
            let task = if job.is_array() {
                "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
            } else {
                "$SLURM_JOB_ID"
            };
            format!(
                "\"$harvest\" {command} --quiet\ncode=$?\n\
                 # RequeueExit would end the jobs that wait for this one: a task that wants another try requeues itself.\n\
                 if [ $code -eq 75 ] && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt {retries} ]; then\n  \
                 scontrol requeue \"{task}\" && sleep 300\nfi"
            )
        }
        Scheduler::Pbs => format!(
            "code=75\nfor try in $(seq 0 {retries}); do\n  \"$harvest\" {command} --quiet\n  code=$?\n  \
             [ $code -eq 75 ] || break\n  sleep 60\ndone"
        ),
    }
}

/// Script that submits the jobs, each after the one before, and prints their numbers.
fn submit(engine: Scheduler, campaign: &CampaignCommands) -> String {
    let out = quoted(&campaign.out);
    let (first, next) = match engine {
        Scheduler::Slurm => (
            "sbatch --parsable",
            "sbatch --parsable --dependency=afterok:$job --kill-on-invalid-dep=yes",
        ),
        Scheduler::Pbs => ("qsub", "qsub -W depend=afterok:$job"),
    };
    let line = |job: Job| {
        let command = if job == Job::Flights { first } else { next };
        let job = job.name();
        format!("job=$({command} {out}/{job}.sh) || exit 1\necho \"{job} $job\"")
    };
    let jobs: Vec<String> = Job::ALL.into_iter().map(line).collect();
    format!("#!/bin/bash\n{}\n", jobs.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn campaign() -> CampaignCommands {
        CampaignCommands {
            program: "/opt/harvest".into(),
            arguments: vec![
                "harv".into(),
                "--archive".into(),
                "flights of '97/*.parquet".into(),
            ],
            folder: "/data".into(),
            flights: "store/flights.plan.json".into(),
            maneuvers: "store/maneuvers.plan.json".into(),
            out: "store/cluster".into(),
        }
    }

    fn text(engine: Scheduler, name: &str) -> String {
        let settings = ClusterSettings {
            shards: 7,
            partition: Some("flight".into()),
            ..ClusterSettings::default()
        };
        let script = scripts(engine, &settings, &campaign())
            .into_iter()
            .find(|s| s.name == name);
        script.expect("a script of this name").text
    }

    #[test]
    fn a_slurm_task_has_its_shard_and_requeues_itself_for_another_try() {
        let flights = text(Scheduler::Slurm, "flights.sh");
        assert!(
            flights.starts_with("#!/bin/bash\n#SBATCH --job-name=harvest-flights\n"),
            "{flights}"
        );
        for line in [
            "#SBATCH --array=1-7",
            "#SBATCH --partition=flight",
            "#SBATCH --requeue",
            "--archive 'flights of '\\''97/*.parquet' --plan store/flights.plan.json --shard \"$SLURM_ARRAY_TASK_ID/7\"",
            "scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"",
        ] {
            assert!(flights.contains(line), "{line}\n{flights}");
        }
        assert!(!flights.contains("RequeueExit="));
        let merge = text(Scheduler::Slurm, "merge.sh");
        assert!(
            !merge.contains("--array") && merge.contains("[ $code -eq 2 ] && code=0"),
            "{merge}"
        );
    }

    #[test]
    fn each_job_waits_for_the_one_before() {
        let submit = text(Scheduler::Slurm, "submit.sh");
        assert_eq!(submit.matches("--dependency=afterok:$job").count(), 3);
        let places: Vec<usize> = Job::ALL
            .iter()
            .map(|job| {
                submit
                    .find(&format!("/{}.sh", job.name()))
                    .expect("the job")
            })
            .collect();
        assert!(places.is_sorted());
        assert_eq!(
            text(Scheduler::Pbs, "submit.sh")
                .matches("depend=afterok:$job")
                .count(),
            3
        );
    }

    #[test]
    fn words_with_spaces_and_quotes_stay_one_word() {
        for (word, expected) in [
            ("a-b_1/c.d", "a-b_1/c.d"),
            ("a b", "'a b'"),
            ("it's", "'it'\\''s'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }
}
