//! `dynvox fixtures`.

use crate::fixtures::{self, Blessing, Verdict};
use crate::run::write_whole;
use anyhow::bail;
use dynvox_core::Serial;
use std::io::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct FixturesArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Replay fixtures and compare every digest with the golden ones
    Verify {
        /// A fixture, or a folder of fixtures
        #[arg(default_value = "fixtures", value_name = "DIR")]
        path: PathBuf,
    },
    /// Rewrite the golden digests, with the reason
    Bless {
        /// A fixture, or a folder of fixtures
        #[arg(default_value = "fixtures", value_name = "DIR")]
        path: PathBuf,
        /// Why the digests are meant to change
        #[arg(long, value_name = "TEXT")]
        reason: String,
    },
    /// Pack a fixture into one file that a firmware can embed
    Pack {
        /// The fixture
        fixture: PathBuf,
        /// File to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

pub fn run(args: &FixturesArgs) -> anyhow::Result<()> {
    match &args.action {
        Action::Verify { path } => {
            let verdicts = fixtures::all(path)?.iter().map(|fixture| fixtures::verify(fixture, &Serial)).collect::<Result<Vec<_>, _>>()?;
            verdicts.iter().for_each(|verdict| outln!("{}", sentence(verdict)));
            if verdicts.iter().any(|verdict| verdict.difference.is_some()) {
                bail!("digests have changed. If that is meant: dynvox fixtures bless --reason \"why\"");
            }
        }
        Action::Bless { path, reason } => {
            for fixture in fixtures::all(path)? {
                let outcome = match fixtures::bless(&fixture, reason, &Serial)? {
                    Blessing::Unchanged => "is unchanged",
                    Blessing::Written => "is blessed",
                };
                outln!("{} {outcome}", fixture.display());
            }
        }
        Action::Pack { fixture, out } => {
            let bytes = fixtures::pack(fixture)?;
            write_whole(out, |file| file.write_all(&bytes))?;
            outln!("{} bytes in {}", bytes.len(), out.display());
        }
    }
    Ok(())
}

fn sentence(verdict: &Verdict) -> String {
    let name = verdict.fixture.display();
    match &verdict.difference {
        None => format!("{name}: {} frames, all digests equal", verdict.frames),
        Some(difference) => format!("{name}: first divergence: frame {}, {}", difference.frame, difference.column),
    }
}
