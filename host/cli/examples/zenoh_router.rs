//! A Zenoh router, for trying and measuring `toposlam publish` without `zenohd`. It prints what arrives at a key.
//!
//! ```sh
//! cargo run --release -p toposlam-cli --features zenoh --example zenoh_router -- 127.0.0.1:7447 'toposlam/*/map'
//! ```

use std::env::args;

use anyhow::{Context, anyhow};
use zenoh::{Config, Wait};

fn main() -> anyhow::Result<()> {
    let address = args().nth(1).context("the first argument is HOST:PORT")?;
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"router\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", format!("[{:?}]", format!("tcp/{address}"))),
    ] {
        config.insert_json5(key, &value).map_err(|error| anyhow!("{key}: {error}"))?;
    }
    let router = zenoh::open(config).wait().map_err(|error| anyhow!("{address}: {error}"))?;
    let Some(key) = args().nth(2) else {
        loop {
            std::thread::park()
        }
    };
    let samples = router.declare_subscriber(&key).wait().map_err(|error| anyhow!("{key}: {error}"))?;
    while let Ok(sample) = samples.recv() {
        println!("{} {}", sample.key_expr(), String::from_utf8_lossy(&sample.payload().to_bytes()));
    }
    Ok(())
}
