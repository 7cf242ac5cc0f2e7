//! `toposlam simulate`.

use clap::Args;

/// Arguments of `toposlam simulate`.
#[derive(Args)]
pub(crate) struct Arguments {}

pub(crate) fn run(_arguments: &Arguments) -> anyhow::Result<()> {
    anyhow::bail!("not built yet")
}
