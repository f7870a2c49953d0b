//! A browser without a window: for tests that have `#[dynvox_needs::browser]`.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;
use tempfile::TempDir;

/// The longest that a page may take, on a machine that does other work too.
const PATIENCE: Duration = Duration::from_secs(120);

/// Width and height of the page, px.
#[derive(Clone, Copy)]
pub struct Window(u32, u32);

impl Window {
    pub const DESKTOP: Self = Self(1200, 800);
    pub const PHONE: Self = Self(500, 800);
}

/// A page, and what is done there.
pub struct Visit<'a> {
    pub page: &'a Path,
    /// The part of the address that begins with `#`; empty for none.
    pub part: &'a str,
    pub window: Window,
    /// Runs before the page's own scripts.
    pub before: &'a str,
    /// Runs when the page is loaded, and calls `report` with its result.
    pub script: &'a str,
}

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Visit<'_> {
    /// Opens a page from disk and returns what the visit's script hands to `report`. An error on
    /// the console fails the test.
    pub fn report(&self) -> Value {
        let Window(width, height) = self.window;
        // A profile of its own, so that no earlier visit matters.
        let profile = TempDir::new().unwrap();
        let url = format!("file://{}{}", self.page().display(), self.part);
        let mut command = Command::new(dynvox_needs::browser_program!());
        command.args([
            "--headless=new",
            "--no-sandbox",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
        ]);
        command.args([
            "--hide-scrollbars",
            "--enable-logging=stderr",
            "--v=0",
            &format!("--window-size={width},{height}"),
        ]);
        command.arg(format!("--user-data-dir={}", profile.path().display())).arg(url);
        let mut running =
            Running(command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap());
        let lines = BufReader::new(running.0.stderr.take().unwrap());
        let (sender, receiver) = mpsc::channel();
        // A thread reads the console, so that waiting can end.
        std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok).filter(|line| is_of_the_page(line)) {
                // The test may have ended.
                let _ = sender.send(line);
            }
        });
        let line = receiver.recv_timeout(PATIENCE).expect("the page reports in time");
        let text = line
            .split_once("\"RESULT ")
            .unwrap_or_else(|| panic!("an error on the console: {line}"))
            .1;
        serde_json::from_str(text.rsplit_once("\", source:").expect("a line of the console").0)
            .unwrap()
    }

    /// A copy of the page, next to it, that runs the scripts.
    fn page(&self) -> PathBuf {
        let html = std::fs::read_to_string(self.page).unwrap();
        let (head, body) = html.split_once("<body>").expect("a page");
        let report = "const report = (value) => console.log(`RESULT ${JSON.stringify(value)}`);";
        let late = format!(
            "window.addEventListener(\"load\", async () => {{ {report} {} }});",
            self.script
        );
        let copy = self.page.with_file_name("tested.html");
        std::fs::write(&copy, format!("{head}<body><script>{}{late}</script>{body}", self.before))
            .unwrap();
        std::fs::canonicalize(copy).unwrap()
    }
}

/// Returns true if a line of the log comes from the page: remarks of the driver about speed do not.
fn is_of_the_page(line: &str) -> bool {
    line.contains(":CONSOLE:") && !line.contains("GL Driver Message")
}
