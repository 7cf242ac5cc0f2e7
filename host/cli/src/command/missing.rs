//! Stand-ins for commands that this build omits: each fails and names the required feature.

macro_rules! missing {
    ($command:ident, $feature:literal) => {
        pub(crate) mod $command {
            /// Whatever follows the command.
            #[derive(clap::Args)]
            // The help of the omitted command is an error, too, which says how to get the command.
            #[command(disable_help_flag = true)]
            pub(crate) struct Arguments {
                #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
                rest: Vec<std::ffi::OsString>,
            }

            pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
                let command = [&[stringify!($command).into()], &arguments.rest[..]].concat().join(" ".as_ref());
                anyhow::bail!(
                    "this build leaves out `{}`; run\n  cargo run --release --features {} -- {command}",
                    stringify!($command),
                    $feature,
                    command = command.display(),
                )
            }
        }
    };
}

#[cfg(not(feature = "recording"))]
missing!(play, "recording");
#[cfg(not(any(feature = "mqtt", feature = "zenoh")))]
missing!(publish, "mqtt");
#[cfg(not(feature = "recording"))]
missing!(record, "recording");

/// A FILE.mcap was given to a command that reads other sources, too.
#[cfg(not(feature = "recording"))]
pub(crate) fn no_recordings() -> anyhow::Error {
    anyhow::anyhow!("this build reads no recordings; add --features recording to `cargo run --release`")
}
