//! temporary
use std::ops::ControlFlow;
use toposlam::ring::*;
fn main() -> anyhow::Result<()> {
    let mut n = 0u16;
    let mut all: Vec<u8> = vec![];
    let total: u16 = std::env::args().nth(2).unwrap().parse()?;
    let e = toposlam_host::emulator::Emulation::new(std::env::args().nth(1).unwrap());
    let out = e.run(
        || {
            n += 1;
            (n <= total).then(|| RingFrame {
                echoes: std::array::from_fn(|i| {
                    if i == 5 {
                        Echo::Silence
                    } else if i == 7 && n % 16 == 3 {
                        Echo::Dead
                    } else {
                        Echo::Range { range_mm: 100 + n + 17 * i as u16 }
                    }
                }),
            })
        },
        |b| {
            all.extend_from_slice(b);
            ControlFlow::Continue(())
        },
    )?;
    println!("{out:?} {} bytes", all.len());
    let mut bad = 0;
    for (k, f) in all.chunks(34).take(total as usize).enumerate() {
        let n = k as u16 + 1;
        for i in 0..16u16 {
            let v = u16::from_be_bytes([f[2 + 2 * i as usize], f[3 + 2 * i as usize]]);
            let want = if i == 5 {
                0
            } else if i == 7 && n % 16 == 3 {
                65535
            } else {
                100 + n + 17 * i
            };
            bad += (v != want) as u32;
        }
    }
    println!("bad {bad}");
    Ok(())
}
