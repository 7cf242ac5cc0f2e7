//! Arbitrary answers of buses, pins, clocks and UARTs to the drivers of the rings, the bridge and the address changes.
#![no_main]

#[path = "ring_drivers/address.rs"]
mod address;
#[path = "ring_drivers/bridge.rs"]
mod bridge;
#[path = "ring_drivers/fakes.rs"]
mod fakes;
#[path = "ring_drivers/rings.rs"]
mod rings;

use address::address;
use arbitrary::Arbitrary;
use bridge::{Call, bridge};
use fakes::{Answers, Budget};
use libfuzzer_sys::fuzz_target;
use rings::{HcSr04, MaxBotix, Srf08, Vl53l1x, hc_sr04, max_botix, srf08, vl53l1x};
use toposlam::ring::drivers::{Sc18im700, change_maxbotix_address, change_srf08_address};

#[derive(Arbitrary, Debug)]
enum Input<'a> {
    Srf08 { config: Srf08<'a>, answers: &'a [u8] },
    MaxBotix { config: MaxBotix<'a>, answers: &'a [u8] },
    HcSr04 { config: HcSr04<'a>, clock: &'a [u8], answers: &'a [u8] },
    Bridge { budget: u8, calls: Vec<Call<'a>>, answers: &'a [u8] },
    Srf08OnBridge { config: Srf08<'a>, budget: u8, answers: &'a [u8] },
    MaxBotixOnBridge { config: MaxBotix<'a>, budget: u8, answers: &'a [u8] },
    Srf08Address { from: u8, to: u8, answers: &'a [u8] },
    MaxBotixAddress { from: u8, to: u8, answers: &'a [u8] },
    Vl53l1x { config: Vl53l1x<'a>, pins: &'a [u8], answers: &'a [u8] },
}

fuzz_target!(|input: Input<'_>| match input {
    Input::Srf08 { config, answers } => {
        let budget = Budget::new(u32::MAX);
        srf08(&config, Answers::new(answers, &budget));
    }
    Input::MaxBotix { config, answers } => {
        let budget = Budget::new(u32::MAX);
        max_botix(&config, Answers::new(answers, &budget));
    }
    Input::HcSr04 { config, clock, answers } => hc_sr04(&config, clock, answers),
    Input::Bridge { budget, calls, answers } => bridge(budget.into(), &calls, answers),
    Input::Srf08OnBridge { config, budget, answers } => {
        let calls = Budget::new(u32::MAX);
        srf08(&config, Sc18im700::new(Answers::new(answers, &calls), u32::from(budget % 8)));
    }
    Input::MaxBotixOnBridge { config, budget, answers } => {
        let calls = Budget::new(u32::MAX);
        max_botix(&config, Sc18im700::new(Answers::new(answers, &calls), u32::from(budget % 8)));
    }
    Input::Srf08Address { from, to, answers } => {
        let is_address = |address| (0x70..=0x7F).contains(&address);
        address(from, to, answers, 4, is_address, |bus, delay| change_srf08_address(bus, delay, from, to));
    }
    Input::MaxBotixAddress { from, to, answers } => {
        let is_address = |address| (0x08..=0x7F).contains(&address) && ![0x28, 0x52, 0x55].contains(&address);
        address(from, to, answers, 1, is_address, |bus, delay| change_maxbotix_address(bus, delay, from, to));
    }
    Input::Vl53l1x { config, pins, answers } => {
        let budget = Budget::new(u32::MAX);
        vl53l1x(&config, Answers::new(answers, &budget), pins);
    }
});
