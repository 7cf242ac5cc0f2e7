//! A model of the SC18IM700 UART-to-I2C bridge: one byte in, the answer bytes out.
//!
//! It follows the message format of the data sheet (see the driver in `toposlam::ring::drivers`), not any driver.
//! Messages may be split anywhere, registers hold the values written to them, and unknown commands are ignored as on
//! the chip.

use std::mem;

use super::{BusAnswer, I2cDevices};

/// The chip, with the devices on its bus.
#[derive(Debug)]
pub struct Sc18im700<DEVICES> {
    /// The devices behind the bridge.
    pub devices: DEVICES,
    registers: [u8; 11],
    state: State,
    /// A transfer failed: the rest of its message up to the stop does not reach the bus.
    failed: bool,
    replies: Vec<u8>,
}

#[derive(Debug)]
enum State {
    Idle,
    Address,
    Count { address: u8 },
    Data { address: u8, missing: usize, bytes: Vec<u8> },
    AfterTransfer,
    ReadRegisters,
    WriteRegister,
    WriteValue { register: u8 },
    ReadPort,
    WritePort,
    PowerDown,
}

const STATUS: usize = 0x0A;

impl<DEVICES: I2cDevices> Sc18im700<DEVICES> {
    /// The chip after a reset.
    pub fn new(devices: DEVICES) -> Self {
        let registers = [0xF0, 0x02, 0x55, 0x55, 0x0F, 0x00, 0x26, 0x13, 0x00, 0x66, 0xF0];
        Self { devices, registers, state: State::Idle, failed: false, replies: Vec::new() }
    }

    /// Takes one byte from the UART and returns the chip's answer, which is mostly empty.
    pub fn byte(&mut self, byte: u8) -> Vec<u8> {
        self.state = self.next(byte);
        if matches!(self.state, State::Idle) { mem::take(&mut self.replies) } else { Vec::new() }
    }

    /// The baud rate that the registers select.
    pub fn baud_rate(&self) -> u32 {
        7_372_800 / (16 + u32::from(u16::from_le_bytes([self.registers[0], self.registers[1]])))
    }

    fn next(&mut self, byte: u8) -> State {
        match mem::replace(&mut self.state, State::Idle) {
            State::Idle => self.command(byte),
            State::Address => State::Count { address: byte },
            State::Count { address } if address & 1 == 1 => self.read(address >> 1, byte.into()),
            State::Count { address } if byte == 0 => self.write(address >> 1, &[]),
            State::Count { address } => State::Data { address: address >> 1, missing: byte.into(), bytes: Vec::new() },
            State::Data { address, missing, mut bytes } => {
                bytes.push(byte);
                if bytes.len() < missing {
                    State::Data { address, missing, bytes }
                } else {
                    self.write(address, &bytes)
                }
            }
            State::AfterTransfer => match byte {
                b'S' => State::Address,
                b'P' => State::Idle,
                _ => State::AfterTransfer,
            },
            State::ReadRegisters if byte == b'P' => State::Idle,
            State::ReadRegisters => {
                self.replies.push(self.registers.get(usize::from(byte)).copied().unwrap_or(0xFF));
                State::ReadRegisters
            }
            State::WriteRegister if byte == b'P' => State::Idle,
            State::WriteRegister => State::WriteValue { register: byte },
            State::WriteValue { register } => {
                // The status is read-only.
                if let Some(cell) = self.registers[..STATUS].get_mut(usize::from(register)) {
                    *cell = byte;
                }
                State::WriteRegister
            }
            State::ReadPort => {
                self.replies.push(self.registers[4]);
                State::Idle
            }
            State::WritePort if byte == b'P' => State::Idle,
            State::WritePort => {
                self.registers[4] = byte;
                State::WritePort
            }
            State::PowerDown if byte == b'P' => State::Idle,
            State::PowerDown => State::PowerDown,
        }
    }

    fn command(&mut self, byte: u8) -> State {
        match byte {
            b'S' => {
                self.failed = false;
                State::Address
            }
            b'R' => State::ReadRegisters,
            b'W' => State::WriteRegister,
            b'I' => State::ReadPort,
            b'O' => State::WritePort,
            b'Z' => State::PowerDown,
            _ => State::Idle,
        }
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> State {
        if !self.failed {
            let answer = self.devices.write(address, bytes);
            self.settle(&answer);
        }
        State::AfterTransfer
    }

    fn read(&mut self, address: u8, count: usize) -> State {
        if !self.failed {
            let answer = self.devices.read(address, count);
            self.settle(&answer);
            if let BusAnswer::Acknowledged(data) = answer {
                self.replies.extend(data);
            }
        }
        State::AfterTransfer
    }

    fn settle<DATA>(&mut self, answer: &BusAnswer<DATA>) {
        self.registers[STATUS] = match answer {
            BusAnswer::Acknowledged(_) => 0xF0,
            BusAnswer::AddressNotAcknowledged => 0xF1,
            BusAnswer::DataNotAcknowledged => 0xF2,
            BusAnswer::TimedOut => 0xF8,
        };
        self.failed = !matches!(answer, BusAnswer::Acknowledged(_));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device at 0x48 that stores the bytes written to it and returns them.
    struct Echoes(Vec<u8>);

    impl I2cDevices for Echoes {
        fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
            if address != 0x48 {
                return BusAnswer::AddressNotAcknowledged;
            }
            self.0 = bytes.to_vec();
            BusAnswer::Acknowledged(())
        }

        fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
            if address != 0x48 {
                return BusAnswer::AddressNotAcknowledged;
            }
            BusAnswer::Acknowledged(self.0.iter().copied().cycle().take(count).collect())
        }
    }

    fn exchange(chip: &mut Sc18im700<Echoes>, bytes: &[u8]) -> Vec<u8> {
        bytes.iter().flat_map(|&byte| chip.byte(byte)).collect()
    }

    #[test]
    fn a_write_and_a_read_with_repeated_start_reach_the_device_at_the_stop() {
        let mut chip = Sc18im700::new(Echoes(Vec::new()));
        assert_eq!(exchange(&mut chip, b"S\x90\x02\x50\x53S\x91\x03"), b"");
        assert_eq!(exchange(&mut chip, b"P"), b"\x50\x53\x50");
        assert_eq!(exchange(&mut chip, b"R\x0AP"), [0xF0]);
    }

    #[test]
    fn an_absent_device_sets_the_status_and_returns_no_data() {
        let mut chip = Sc18im700::new(Echoes(Vec::new()));
        assert_eq!(exchange(&mut chip, b"S\x20\x01\x00S\x21\x04P"), b"");
        assert_eq!(exchange(&mut chip, b"R\x0A\x06P"), [0xF1, 0x26]);
    }

    #[test]
    fn the_baud_rate_registers_follow_the_data_sheets_formula() {
        let mut chip = Sc18im700::new(Echoes(Vec::new()));
        assert_eq!(chip.baud_rate(), 9600);
        exchange(&mut chip, b"W\x00\x30\x01\x00P");
        assert_eq!(chip.baud_rate(), 115_200);
    }
}
