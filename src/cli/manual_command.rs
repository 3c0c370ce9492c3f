//! The command `manual`: man pages and shell completions, from the definition of the command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::{Shell, generate};
use clap_mangen::Man;

use crate::store::atomic;

#[derive(Args, Debug)]
pub struct ManualOptions {
    /// Folder that receives share/man/man1 and the completions of bash, zsh and fish
    #[arg(long, value_name = "FOLDER")]
    to: PathBuf,
}

/// Shells with the place of their completions below an installation's folder.
const COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "share/bash-completion/completions/harvest"),
    (Shell::Zsh, "share/zsh/site-functions/_harvest"),
    (Shell::Fish, "share/fish/vendor_completions.d/harvest.fish"),
];

/// Writes the pages and completions of a command line.
pub fn manual(mut command: Command, options: &ManualOptions) -> anyhow::Result<ExitCode> {
    for (shell, place) in COMPLETIONS {
        let mut script = Vec::new();
        generate(shell, &mut command, "harvest", &mut script);
        atomic::place(&options.to.join(place), &script)?;
    }
    command.build();
    write_pages(&command, options)?;
    out!("manual: {}", options.to.display());
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of a command, and those of its subcommands: `harvest-show-flight.1`.
fn write_pages(command: &Command, options: &ManualOptions) -> anyhow::Result<()> {
    let name = command
        .get_display_name()
        .unwrap_or_else(|| command.get_name());
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page)?;
    let place = options.to.join(format!("share/man/man1/{name}.1"));
    atomic::place(&place, &page)?;
    let visible = command.get_subcommands().filter(|sub| !sub.is_hide_set());
    for sub in visible.filter(|sub| sub.get_name() != "help") {
        write_pages(sub, options)?;
    }
    Ok(())
}
