//! Shows a page at once: writes it to a new folder in the system's temporary folder, and asks the system to open it.

use super::output;
use crate::console::Failure;
use cbvh_view::Page;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The name of the page in its folder.
const NAME: &str = "view.html";
/// How long the system's program may take to say that it cannot open the page. Some such programs end with the browser.
const PATIENCE: Duration = Duration::from_secs(5);
/// The time between two looks at whether the program has ended.
const PAUSE: Duration = Duration::from_millis(20);

/// Writes the page and opens it. Returns where it is. Only the user may read the folder, because meshes may be confidential.
pub(super) fn show(page: &Page) -> Result<PathBuf, Failure> {
    let all = std::env::temp_dir();
    let failed = |error| {
        Failure::system(&all, format_args!("cannot make a folder for the page: {error}; give -o PAGE.html"))
    };
    let all_absolute = std::path::absolute(&all).map_err(failed)?;
    // The folder is removed unless the page is whole.
    let mut builder = tempfile::Builder::new();
    builder.prefix("cbvh-view-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    let folder = builder.tempdir_in(all_absolute).map_err(failed)?;
    let path = folder.path().join(NAME);
    output::write(page, &path)?;
    let _ = folder.keep();
    match open(&path) {
        Ok(()) => Ok(path),
        Err(why) => {
            let what = format_args!(
                "the page is here, but no browser opened it: {why}; open it yourself, or give -o PAGE.html"
            );
            Err(Failure::system(&path, what))
        }
    }
}

/// Returns the program that opens files in the program that the user prefers for them, with its first arguments. No shell takes
/// part, which might read something into a path.
fn opener() -> Option<(&'static str, &'static [&'static str])> {
    if cfg!(target_os = "macos") {
        Some(("open", &[]))
    } else if cfg!(windows) {
        Some(("rundll32", &["url.dll,FileProtocolHandler"]))
    } else if cfg!(unix) {
        Some(("xdg-open", &[]))
    } else {
        None
    }
}

/// Asks the system to open a file, or says why that failed.
fn open(path: &Path) -> Result<(), String> {
    let Some((program, arguments)) = opener() else {
        return Err("this system has no program for that".to_owned());
    };
    let started = Command::new(program)
        .args(arguments)
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let mut child = started.map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => format!("expected the program {program}, found none"),
        _ => format!("cannot start {program}: {error}"),
    })?;
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        match child.try_wait() {
            Ok(Some(status)) if !status.success() => return Err(format!("{program} failed with {status}")),
            Ok(None) => std::thread::sleep(PAUSE),
            _ => return Ok(()),
        }
    }
    Ok(())
}
