//! The SC18IM700 bridge: every call ends within its poll budget.

use arbitrary::Arbitrary;
use embedded_hal::i2c::{I2c, Operation};
use toposlam::ring::drivers::{BridgeError, Sc18im700};

use super::fakes::{Answers, Budget};

#[derive(Arbitrary, Debug)]
pub(crate) enum Call<'a> {
    Start,
    SetBaudRate(u32),
    Transaction { address: u8, operations: Vec<Asked<'a>> },
}

#[derive(Arbitrary, Debug)]
pub(crate) enum Asked<'a> {
    Read(u8),
    Write(&'a [u8]),
}

pub(crate) fn bridge(poll_budget: u32, calls: &[Call<'_>], answers: &[u8]) {
    let budget = Budget::new(0);
    let mut bridge = Sc18im700::new(Answers::new(answers, &budget), poll_budget);
    for call in calls.iter().take(8) {
        budget.calls.set(0);
        match call {
            Call::Start => {
                budget.most.set(32 + 7 * 2 * poll_budget);
                let _ = bridge.start();
            }
            Call::SetBaudRate(baud) => {
                budget.most.set(7 * 2 * poll_budget);
                let divides = (113..=460_800).contains(baud);
                assert_eq!(bridge.set_baud_rate(*baud) == Err(BridgeError::BaudRate), !divides, "{baud}");
            }
            Call::Transaction { address, operations } => {
                transaction(&mut bridge, &budget, poll_budget, *address, &operations[..operations.len().min(6)]);
            }
        }
    }
}

fn transaction(
    bridge: &mut Sc18im700<Answers<'_>>,
    budget: &Budget,
    poll_budget: u32,
    address: u8,
    asked: &[Asked<'_>],
) {
    let (mut to_read, mut to_write) = (0, 0);
    let mut buffers: Vec<Vec<u8>> = Vec::new();
    for operation in asked {
        match operation {
            Asked::Read(count) => {
                to_read += usize::from(*count);
                buffers.push(vec![0; usize::from(*count)]);
            }
            Asked::Write(bytes) => to_write += bytes.len(),
        }
    }
    let mut buffers = buffers.iter_mut();
    let mut operations: Vec<Operation<'_>> = asked
        .iter()
        .map(|operation| match operation {
            Asked::Read(_) => Operation::Read(buffers.next().unwrap()),
            Asked::Write(bytes) => Operation::Write(bytes),
        })
        .collect();
    // Each byte to send polls twice; up to 19 bytes come back.
    let sent = 3 * asked.len() as u32 + 16 + 4 + 4;
    budget.most.set(32 + 2 * poll_budget * sent + 19 * poll_budget);
    let result = bridge.transaction(address, &mut operations);
    let is_too_long = to_read > 16 || to_write > 16;
    assert_eq!(result == Err(BridgeError::TooLong), is_too_long, "{to_read} to read, {to_write} to write");
    if is_too_long || asked.is_empty() {
        assert_eq!(budget.calls.get(), 0, "nothing was sent");
    }
}
