//! Scripts for a batch scheduler: an array over flights, the plan of their maneuvers, an array over
//! maneuvers, the merge; each waits for the one before.
//!
//! Slurm cancels a dependency on an array (`afterok`) if `RequeueExit` requeues one of its tasks. A
//! task that needs another try therefore requeues itself (`scontrol requeue`), which the dependency
//! survives. PBS has no such command: there the task repeats its command within its own time.

use crate::config::ClusterSettings as Settings;

/// Batch scheduler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    Slurm,
    Pbs,
}

/// The campaign that the scripts compute.
#[derive(Clone, Debug)]
pub struct Campaign {
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
    pub name: &'static str,
    pub text: String,
}

/// Jobs of the chain in order.
const JOBS: [&str; 4] = ["flights", "plan", "maneuvers", "merge"];

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
pub fn scripts(engine: Engine, settings: &Settings, campaign: &Campaign) -> Vec<Script> {
    let names = ["flights.sh", "plan.sh", "maneuvers.sh", "merge.sh"];
    let job = |(name, job): (&'static str, &&str)| Script {
        name,
        text: script(engine, settings, campaign, job),
    };
    let mut scripts: Vec<Script> = names.into_iter().zip(&JOBS).map(job).collect();
    scripts.push(Script {
        name: "submit.sh",
        text: submit(engine, campaign),
    });
    scripts
}

fn script(engine: Engine, settings: &Settings, campaign: &Campaign, job: &str) -> String {
    let is_array = job == "flights" || job == "maneuvers";
    let (shards, threads) = (settings.shards, settings.processors);
    let arguments: Vec<String> = campaign.arguments.iter().map(|a| quoted(a)).collect();
    let arguments = arguments.join(" ");
    let (flights, maneuvers) = (quoted(&campaign.flights), quoted(&campaign.maneuvers));
    let task = match engine {
        Engine::Slurm => "$SLURM_ARRAY_TASK_ID",
        Engine::Pbs => "$PBS_ARRAY_INDEX",
    };
    let shard = format!("--shard \"{task}/{shards}\" --threads {threads}");
    let command = match job {
        "flights" => format!("segment {arguments} --plan {flights} {shard}"),
        "plan" => format!("plan {arguments} --of maneuvers --shards {shards} --out {maneuvers}"),
        "maneuvers" => format!("estimate {arguments} --plan {maneuvers} {shard}"),
        _ => format!("merge {arguments} --plan {maneuvers} --threads {threads}"),
    };
    let mut lines = vec!["#!/bin/bash".to_owned()];
    lines.extend(directives(engine, settings, campaign, job, is_array));
    lines.push(format!("cd {} || exit 1", quoted(&campaign.folder)));
    lines.push(format!(
        "harvest=${{HARVEST:-{}}}",
        quoted(&campaign.program)
    ));
    lines.push(retried(engine, settings, is_array, &command));
    if job == "merge" {
        lines.push(
            "# Something was rejected, and the rest is published: the table problems says what."
                .to_owned(),
        );
        lines.push("[ $code -eq 2 ] && code=0".to_owned());
    }
    lines.push("exit $code\n".to_owned());
    lines.join("\n")
}

/// Directives for the scheduler.
fn directives(
    engine: Engine,
    s: &Settings,
    campaign: &Campaign,
    job: &str,
    is_array: bool,
) -> Vec<String> {
    let (name, log) = (format!("harvest-{job}"), format!("{}/{job}", campaign.out));
    let mut lines = match engine {
        Engine::Slurm => {
            let output = if is_array {
                format!("{log}-%a.log")
            } else {
                format!("{log}.log")
            };
            let mut lines = vec![
                format!("--job-name={name}"),
                format!("--output={output}"),
                // A repeated task appends to its log; the tasks of a dead node start again.
                "--open-mode=append".to_owned(),
                "--requeue".to_owned(),
                format!("--time={}", s.time),
                format!("--mem={}M", s.memory_mb),
                "--ntasks=1".to_owned(),
                format!("--cpus-per-task={}", s.processors),
            ];
            lines.extend(is_array.then(|| format!("--array=1-{}", s.shards)));
            lines.extend(s.partition.iter().map(|p| format!("--partition={p}")));
            lines.extend(s.account.iter().map(|a| format!("--account={a}")));
            lines
        }
        Engine::Pbs => {
            let mut lines = vec![
                format!("-N {name}"),
                "-j oe".to_owned(),
                format!("-o {}/", campaign.out),
                "-r y".to_owned(),
                format!("-l select=1:ncpus={}:mem={}mb", s.processors, s.memory_mb),
                format!("-l walltime={}", s.time),
            ];
            lines.extend(is_array.then(|| format!("-J 1-{}", s.shards)));
            lines.extend(s.partition.iter().map(|p| format!("-q {p}")));
            lines.extend(s.account.iter().map(|a| format!("-A {a}")));
            lines
        }
    };
    lines.extend(s.options.iter().cloned());
    let mark = if engine == Engine::Slurm {
        "#SBATCH"
    } else {
        "#PBS"
    };
    lines
        .into_iter()
        .map(|line| format!("{mark} {line}"))
        .collect()
}

/// The command, repeated after exit code 75.
fn retried(engine: Engine, settings: &Settings, is_array: bool, command: &str) -> String {
    let retries = settings.retries;
    match engine {
        Engine::Slurm => {
            let task = if is_array {
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
        Engine::Pbs => format!(
            "code=75\nfor try in $(seq 0 {retries}); do\n  \"$harvest\" {command} --quiet\n  code=$?\n  \
             [ $code -eq 75 ] || break\n  sleep 60\ndone"
        ),
    }
}

/// Script that submits the jobs, each after the one before, and prints their numbers.
fn submit(engine: Engine, campaign: &Campaign) -> String {
    let out = quoted(&campaign.out);
    let (first, next) = match engine {
        Engine::Slurm => (
            "sbatch --parsable",
            "sbatch --parsable --dependency=afterok:$job --kill-on-invalid-dep=yes",
        ),
        Engine::Pbs => ("qsub", "qsub -W depend=afterok:$job"),
    };
    let line = |(i, job): (usize, &&str)| {
        let command = if i == 0 { first } else { next };
        format!("job=$({command} {out}/{job}.sh) || exit 1\necho \"{job} $job\"")
    };
    let jobs: Vec<String> = JOBS.iter().enumerate().map(line).collect();
    format!("#!/bin/bash\n{}\n", jobs.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn campaign() -> Campaign {
        Campaign {
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

    fn text(engine: Engine, name: &str) -> String {
        let settings = Settings {
            shards: 7,
            partition: Some("flight".into()),
            ..Settings::default()
        };
        let script = scripts(engine, &settings, &campaign())
            .into_iter()
            .find(|s| s.name == name);
        script.expect("a script of this name").text
    }

    #[test]
    fn a_slurm_task_knows_its_shard_and_requeues_itself_when_it_wants_another_try() {
        let flights = text(Engine::Slurm, "flights.sh");
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
        let merge = text(Engine::Slurm, "merge.sh");
        assert!(
            !merge.contains("--array") && merge.contains("[ $code -eq 2 ] && code=0"),
            "{merge}"
        );
    }

    #[test]
    fn each_job_waits_for_the_one_before() {
        let submit = text(Engine::Slurm, "submit.sh");
        assert_eq!(submit.matches("--dependency=afterok:$job").count(), 3);
        let places: Vec<usize> = JOBS
            .iter()
            .map(|job| submit.find(&format!("/{job}.sh")).expect("the job"))
            .collect();
        assert!(places.is_sorted());
        assert_eq!(
            text(Engine::Pbs, "submit.sh")
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
