//! The stack depth of the emulated firmware, read from its RAM.

use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};

use anyhow::Context;

/// RAM of the STM32F405 that contains the stack, which grows downwards.
const RAM_START: u32 = 0x2000_0000;
const RAM_BYTES: usize = 128 * 1024;
/// Pattern with which `cortex-m-rt` fills the stack before `main`.
const STACK_PAINT: [u8; 4] = 0xCCCC_CCCC_u32.to_le_bytes();

/// Reads the machine's RAM through QEMU's monitor and returns the maximum stack depth.
pub(super) fn stack_high_water(mut monitor: TcpStream) -> anyhow::Result<usize> {
    monitor.set_read_timeout(Some(Duration::from_secs(10)))?;
    let dump =
        std::env::temp_dir().join(format!("toposlam-ram-{}-{}", std::process::id(), monitor.local_addr()?.port()));
    writeln!(monitor, "stop")?;
    writeln!(monitor, "pmemsave {RAM_START:#x} {RAM_BYTES} \"{}\"", dump.display())?;
    writeln!(monitor, "quit")?;
    // The monitor closes the line after it has executed all commands.
    let mut reply = Vec::new();
    let _ = monitor.read_to_end(&mut reply);
    let ram = fs::read(&dump).context("reading the machine's memory")?;
    let _ = fs::remove_file(&dump);
    painted_stack(&ram).context("the stack is not painted")
}

/// Number of bytes above the longest run of the fill pattern in an image of the RAM: the used part of the stack.
fn painted_stack(ram: &[u8]) -> Option<usize> {
    let (mut longest, mut end_of_longest, mut run) = (0, 0, 0);
    for (index, word) in ram.chunks_exact(4).enumerate() {
        run = if word == STACK_PAINT { run + 1 } else { 0 };
        if run > longest {
            (longest, end_of_longest) = (run, (index + 1) * 4);
        }
    }
    (longest > 0).then(|| ram.len() - end_of_longest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_used_stack_ends_at_the_longest_run_of_the_fill_pattern() {
        let mut ram = vec![0; 64];
        ram[4..8].copy_from_slice(&STACK_PAINT);
        for word in ram[16..40].chunks_exact_mut(4) {
            word.copy_from_slice(&STACK_PAINT);
        }
        assert_eq!(painted_stack(&ram), Some(24));
        assert_eq!(painted_stack(&[0; 64]), None);
    }
}
