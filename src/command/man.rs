//! `rtutap man`: prints the manual page, with a section for each command.

use std::io;

use clap::CommandFactory;
use clap_mangen::Man;

use super::failure::Failure;
use super::output::Output;
use crate::cli::Cli;

/// Runs the command.
pub(super) fn run() -> Result<(), Failure> {
    let mut output = Output::stdout();
    page(&mut output.buffer).map_err(|error| Failure::writing("standard output", &error))?;
    output.flush()
}

fn page(out: &mut Vec<u8>) -> io::Result<()> {
    let mut command = Cli::command();
    command.build();
    let man = Man::new(command.clone()).manual("User commands");
    man.render_title(out)?;
    man.render_name_section(out)?;
    man.render_synopsis_section(out)?;
    man.render_description_section(out)?;
    man.render_options_section(out)?;
    for command in command.get_subcommands().filter(|command| command.get_name() != "help") {
        section(command, out)?;
    }
    man.render_extra_section(out)?;
    man.render_version_section(out)
}

/// Writes a command: what would be sections of its own page are sub-sections here.
fn section(command: &clap::Command, out: &mut Vec<u8>) -> io::Result<()> {
    let man = Man::new(command.clone());
    let mut page = Vec::new();
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut page)?;
    }
    if command.get_after_help().is_some() {
        man.render_extra_section(&mut page)?;
    }
    let title = command.get_bin_name().unwrap_or_else(|| command.get_name()).to_uppercase();
    out.extend_from_slice(format!(".SH \"{title}\"\n").as_bytes());
    for line in page.split_inclusive(|&c| c == b'\n') {
        match line.strip_prefix(b".SH ") {
            Some(heading) => {
                out.extend_from_slice(b".SS ");
                out.extend_from_slice(heading);
            }
            None => out.extend_from_slice(line),
        }
    }
    Ok(())
}
