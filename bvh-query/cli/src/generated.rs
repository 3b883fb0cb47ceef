//! Writes what follows from the options of the command, and compares it with the files of the repository: pages for `man`,
//! completions for shells, and the reference in the book.
//!
//! The files are committed, so that packages contain them without a tool that runs while they are built. If a test here fails after
//! options, help or the version changed, write them anew:
//!
//! ```sh
//! CBVH_GENERATE=1 cargo test --bin cbvh generated::
//! ```

use crate::Arguments;
use clap::{Arg, ArgAction, Command, CommandFactory};
use clap_complete::{Generator, Shell, generate};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// A file of the repository, and what it is to contain.
type Files = BTreeMap<PathBuf, String>;

fn command() -> Command {
    Arguments::command().disable_help_subcommand(true)
}

/// The command as it is built for a page: with the whole names of its commands.
fn built() -> Command {
    let mut command = command();
    command.build();
    command
}

/// Calls `each` for a command and for all commands below it, in their order.
fn walk(command: &Command, each: &mut impl FnMut(&Command)) {
    each(command);
    for below in command.get_subcommands() {
        walk(below, each);
    }
}

/// The name as on the command line, such as `cbvh bake`.
fn whole_name(command: &Command) -> &str {
    command.get_bin_name().unwrap_or(command.get_name())
}

/// Pages for `man`, one per command.
fn man() -> Files {
    let mut files = Files::new();
    walk(&built(), &mut |command| {
        let name = whole_name(command).replace(' ', "-");
        let mut page = Vec::new();
        let source = concat!("cbvh ", env!("CARGO_PKG_VERSION"));
        let man =
            clap_mangen::Man::new(command.clone()).title(name.to_uppercase()).source(source).manual("cbvh");
        man.render(&mut page).expect("memory takes every write");
        let text = String::from_utf8(page).expect("help is text");
        files.insert(format!("man/{name}.1").into(), text);
    });
    files
}

/// Completions for the shells of the systems that packages are made for.
fn completions() -> Files {
    let shells = [Shell::Bash, Shell::Fish, Shell::PowerShell, Shell::Zsh];
    let texts = shells.map(|shell| {
        let mut text = Vec::new();
        generate(shell, &mut command(), "cbvh", &mut text);
        (
            Path::new("completions").join(shell.file_name("cbvh")),
            String::from_utf8(text).expect("help is text"),
        )
    });
    texts.into()
}

/// The page of the book about all commands and options.
fn reference() -> String {
    let mut page = String::from(
        "# Commands and options\n\nThis page is generated from the help of the command: `cbvh help COMMAND` prints the same. \
         [The command in detail](command.md) explains files, output and exit codes.\n",
    );
    walk(&built(), &mut |command| section(&mut page, command));
    page
}

fn section(page: &mut String, command: &Command) {
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.strip_prefix("Usage: ").unwrap_or(&usage);
    let name = whole_name(command);
    write!(page, "\n## `{name}`\n\n{}\n\n```text\n{usage}\n```\n", escaped(&about))
        .expect("a string takes every write");
    let shown = |argument: &&Arg| {
        !argument.is_hide_set() && !matches!(argument.get_action(), ArgAction::Help | ArgAction::Version)
    };
    let mut arguments = command.get_arguments().filter(shown).peekable();
    if arguments.peek().is_some() {
        page.push('\n');
    }
    for argument in arguments {
        item(page, argument);
    }
    for below in command.get_subcommands() {
        let about = below.get_about().map(ToString::to_string).unwrap_or_default();
        let place = whole_name(below).replace(' ', "-");
        if command.get_subcommands().next().is_some_and(|first| first.get_name() == below.get_name()) {
            page.push('\n');
        }
        writeln!(page, "- [`{}`](#{place}): {}", whole_name(below), escaped(&about))
            .expect("a string takes every write");
    }
    if let Some(after) = command.get_after_long_help().or(command.get_after_help()) {
        write!(page, "\n{}\n", escaped(&after.to_string())).expect("a string takes every write");
    }
}

/// An argument or an option, its help and its default value, as an item of a list.
fn item(page: &mut String, argument: &Arg) {
    let help = argument.get_long_help().or(argument.get_help()).map(ToString::to_string).unwrap_or_default();
    write!(page, "- `{argument}`").expect("a string takes every write");
    if let (Some(short), Some(_)) = (argument.get_short(), argument.get_long()) {
        write!(page, ", `-{short}`").expect("a string takes every write");
    }
    write!(page, ": {}", escaped(&help).replace("\n\n", "\n\n  ")).expect("a string takes every write");
    let defaults: Vec<_> =
        argument.get_default_values().iter().map(|value| format!("`{}`", value.display())).collect();
    if !defaults.is_empty() && argument.get_action().takes_values() {
        write!(page, " (default: {})", defaults.join(" ")).expect("a string takes every write");
    }
    page.push('\n');
}

/// A text as Markdown shows it. Line breaks stay.
fn escaped(text: &str) -> String {
    let mut said = String::new();
    for letter in text.trim_end().chars() {
        if "\\`*_<>[]|#".contains(letter) {
            said.push('\\');
        }
        said.push(letter);
    }
    said
}

/// All files by their paths in the repository.
fn files() -> Files {
    let mut all: Files = [man(), completions()]
        .into_iter()
        .flatten()
        .map(|(path, text)| (Path::new("bvh-query/cli/generated").join(path), text))
        .collect();
    all.insert("spec/book/src/reference/options.md".into(), reference());
    all
}

#[test]
fn files_are_current() {
    let root =
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the crate lies in the repository");
    let files = files();
    if env::var_os("CBVH_GENERATE").is_some() {
        for (path, text) in &files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().expect("a file lies in a folder"))
                .expect("a folder that can be made");
            fs::write(path, text).expect("a file that can be written");
        }
    }
    let remedy = "write it anew: CBVH_GENERATE=1 cargo test --bin cbvh generated::";
    for (path, text) in &files {
        let found = fs::read_to_string(root.join(path)).unwrap_or_default().replace("\r\n", "\n");
        assert!(
            found == *text,
            "{}: expected the text that follows from the options, found another one; {remedy}",
            path.display()
        );
    }
    // Nothing is left of a command that is gone.
    for folder in ["man", "completions"] {
        let folder = Path::new("bvh-query/cli/generated").join(folder);
        for entry in fs::read_dir(root.join(&folder)).expect("a folder of files") {
            let path = folder.join(entry.expect("an entry of a folder").file_name());
            assert!(files.contains_key(&path), "{}: expected no such file; remove it", path.display());
        }
    }
}

#[test]
fn every_option_is_in_every_file() {
    let (man, completions, reference) = (man(), completions(), reference());
    walk(&built(), &mut |command| {
        let name = whole_name(command);
        let page = &man[Path::new(&format!("man/{}.1", name.replace(' ', "-")))];
        let section = reference
            .split("\n## `")
            .find(|text| text.starts_with(&format!("{name}`")))
            .expect("a section per command");
        for argument in command.get_arguments().filter(|argument| !argument.is_hide_set()) {
            let Some(long) = argument.get_long() else { continue };
            // roff writes a hyphen as `\-`.
            assert!(page.replace("\\-", "-").contains(&format!("--{long}")), "man: {name} --{long}");
            let is_clap_s = matches!(long, "help" | "version");
            assert!(is_clap_s || section.contains(&format!("`--{long}")), "reference: {name} --{long}");
            for (path, text) in &completions {
                assert!(text.contains(long), "{}: --{long}", path.display());
            }
        }
    });
}
