//! The driver of the SC18IM700 bridge.

use embedded_hal::i2c::I2c;
use embedded_hal_nb::{nb, serial};
use toposlam::ring::drivers::{BridgeError, Sc18im700};
use toposlam_sim::chip;

use crate::link::{Link, NoError};

/// A device that acknowledges everything and answers with a fixed text.
struct Reciter(Vec<u8>);

impl chip::I2cDevices for Reciter {
    fn write(&mut self, address: u8, _: &[u8]) -> chip::BusAnswer<()> {
        if address == 0x50 { chip::BusAnswer::Acknowledged(()) } else { chip::BusAnswer::AddressNotAcknowledged }
    }

    fn read(&mut self, address: u8, count: usize) -> chip::BusAnswer<Vec<u8>> {
        match address {
            0x50 => chip::BusAnswer::Acknowledged(self.0.iter().copied().cycle().take(count).collect()),
            0x51 => chip::BusAnswer::TimedOut,
            _ => chip::BusAnswer::AddressNotAcknowledged,
        }
    }
}

fn bridge_to(text: &[u8]) -> Sc18im700<Link<Reciter>> {
    let mut bridge = Sc18im700::new(Link::to(chip::Sc18im700::new(Reciter(text.to_vec()))), 100);
    bridge.start().unwrap();
    bridge
}

#[test]
fn the_messages_to_the_bridge_are_those_of_the_data_sheet() {
    let mut bridge = bridge_to(&[1, 2, 3]);
    let mut data = [0; 3];
    bridge.write(0x50, &[0xAA, 0xBB]).unwrap();
    bridge.write_read(0x50, &[0x07], &mut data).unwrap();
    bridge.read(0x50, &mut data).unwrap();
    let sent = bridge.release().sent;
    let mut expected = b"W\x06\x26\x09\x67P".to_vec();
    for message in [b"S\xA0\x02\xAA\xBBP".as_slice(), b"S\xA0\x01\x07S\xA1\x03P", b"S\xA1\x03P"] {
        expected.extend_from_slice(message);
        expected.extend_from_slice(b"R\x0AP");
    }
    assert_eq!(sent, expected);
}

#[test]
fn adjacent_operations_of_one_kind_are_merged() {
    use embedded_hal::i2c::Operation::{Read, Write};
    let mut bridge = bridge_to(&[1, 2, 3]);
    let (mut first, mut second) = ([0; 2], [0; 1]);
    bridge.transaction(0x50, &mut [Write(&[5]), Write(&[6]), Read(&mut first), Read(&mut second)]).unwrap();
    assert_eq!((first, second), ([1, 2], [3]));
    let sent = bridge.release().sent;
    assert_eq!(&sent[6..], b"S\xA0\x02\x05\x06S\xA1\x03PR\x0AP");
}

#[test]
fn data_equal_to_a_failure_code_is_data() {
    for text in [[0xF1, 0xF1, 0xF1, 0xF1], [0xF8, 0x26, 0xF0, 0x26], [0x26, 0x67, 0xF1, 0x26]] {
        for count in 1..=4 {
            let mut data = vec![0; count];
            bridge_to(&text).read(0x50, &mut data).unwrap();
            assert_eq!(data, text[..count]);
        }
    }
}

#[test]
fn each_failure_of_the_bus_has_its_error() {
    let mut bridge = bridge_to(&[0]);
    assert_eq!(bridge.write(0x20, &[1]), Err(BridgeError::AddressNotAcknowledged));
    assert_eq!(bridge.read(0x20, &mut [0; 4]), Err(BridgeError::AddressNotAcknowledged));
    assert_eq!(bridge.read(0x51, &mut [0; 4]), Err(BridgeError::BusTimeout));
    assert_eq!(bridge.write(0x50, &[0; 17]), Err(BridgeError::TooLong));
    assert_eq!(bridge.read(0x50, &mut [0; 17]), Err(BridgeError::TooLong));
    assert_eq!(bridge.set_baud_rate(0), Err(BridgeError::BaudRate));
    assert_eq!(bridge.set_baud_rate(112), Err(BridgeError::BaudRate));
    // After each failure the next message works.
    assert_eq!(bridge.read(0x50, &mut [0; 16]), Ok(()));
}

#[test]
fn a_lost_or_doubled_byte_is_an_error_and_the_next_message_works() {
    for lost in [true, false] {
        let mut bridge = bridge_to(&[9]);
        bridge.read(0x50, &mut [0; 2]).unwrap();
        let mut link = bridge.release();
        // A late byte of an earlier message is discarded before the next one is sent.
        link.incoming.push_back(0x55);
        let mut bridge = Sc18im700::new(Trouble { link, lost, done: false }, 100);
        let answer = bridge.read(0x50, &mut [0; 4]);
        assert_eq!(answer, Err(if lost { BridgeError::Silent } else { BridgeError::OutOfStep }));
        assert_eq!(bridge.read(0x50, &mut [0; 4]), Ok(()));
    }
}

/// A link that once drops or doubles a byte of a reply.
struct Trouble {
    link: Link<Reciter>,
    lost: bool,
    done: bool,
}

impl serial::ErrorType for Trouble {
    type Error = NoError;
}

impl serial::Read for Trouble {
    fn read(&mut self) -> nb::Result<u8, NoError> {
        if !self.done && self.link.incoming.len() == 5 {
            self.done = true;
            if self.lost {
                self.link.incoming.pop_front();
            } else {
                self.link.incoming.push_front(9);
            }
        }
        self.link.read()
    }
}

impl serial::Write for Trouble {
    fn write(&mut self, byte: u8) -> nb::Result<(), NoError> {
        self.link.write(byte)
    }

    fn flush(&mut self) -> nb::Result<(), NoError> {
        Ok(())
    }
}
