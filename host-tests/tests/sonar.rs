//! The sonar drivers: the exact bytes of the data sheets, and every way a ring can fail, against models of the chips.

use std::{collections::VecDeque, convert::Infallible};

use embedded_hal::{
    delay::DelayNs,
    i2c::{ErrorKind, I2c, NoAcknowledgeSource},
};
use embedded_hal_mock::eh1::i2c::{Mock as I2cMock, Transaction};
use embedded_hal_nb::{nb, serial};
use toposlam::{
    FaultCounters, FaultKind,
    ring::{Echo, RingFrame},
    sonar::{BridgeError, Sc18im700, SonarError, SonarFault, SonarRing, Srf08Config, Srf08Ring},
};
use toposlam_host::chip::{self, SensorFault, Srf08Bank};

/// A UART whose other end is a model of the bridge; it can be cut.
struct Link<DEVICES> {
    chip: chip::Sc18im700<DEVICES>,
    incoming: VecDeque<u8>,
    sent: Vec<u8>,
    cut: bool,
}

impl<DEVICES> Link<DEVICES> {
    fn to(chip: chip::Sc18im700<DEVICES>) -> Self {
        Self { chip, incoming: VecDeque::new(), sent: Vec::new(), cut: false }
    }
}

impl<DEVICES> serial::ErrorType for Link<DEVICES> {
    type Error = NoError;
}

/// The link itself has no errors.
#[derive(Debug)]
struct NoError(Infallible);

impl serial::Error for NoError {
    fn kind(&self) -> serial::ErrorKind {
        match self.0 {}
    }
}

impl<DEVICES: chip::I2cDevices> serial::Read for Link<DEVICES> {
    fn read(&mut self) -> nb::Result<u8, NoError> {
        self.incoming.pop_front().ok_or(nb::Error::WouldBlock)
    }
}

impl<DEVICES: chip::I2cDevices> serial::Write for Link<DEVICES> {
    fn write(&mut self, byte: u8) -> nb::Result<(), NoError> {
        self.sent.push(byte);
        if !self.cut {
            self.incoming.extend(self.chip.byte(byte));
        }
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), NoError> {
        Ok(())
    }
}

/// Counts the time that the driver waits.
#[derive(Default)]
struct Waited {
    nanoseconds: u64,
}

impl DelayNs for &mut Waited {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.nanoseconds += u64::from(nanoseconds);
    }
}

/// A frame in which every sensor hears something else, with silence in two places.
fn world_frame(number: u16) -> RingFrame<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for (sensor, echo) in (0_u16..).zip(&mut frame.echoes).filter(|(sensor, _)| sensor % 8 != 5) {
        *echo = Echo::Range { range_mm: 30 + number * 7 + sensor * 371 };
    }
    frame
}

fn world() -> impl FnMut() -> Option<RingFrame<16>> {
    let mut numbers = 0..50;
    move || numbers.next().map(world_frame)
}

type World = Box<dyn FnMut() -> Option<RingFrame<16>>>;
type Ring<'a> = Srf08Ring<Sc18im700<Link<Srf08Bank<World>>>, &'a mut Waited, 16>;

fn ring(world: impl FnMut() -> Option<RingFrame<16>> + 'static, config: Srf08Config, waited: &mut Waited) -> Ring<'_> {
    ring_with_fault(world, config, waited, None)
}

fn ring_with_fault(
    world: impl FnMut() -> Option<RingFrame<16>> + 'static,
    config: Srf08Config,
    waited: &mut Waited,
    fault: Option<(usize, SensorFault)>,
) -> Ring<'_> {
    let mut bank = Srf08Bank::new(Box::new(world) as World, 3);
    if let Some((sensor, fault)) = fault {
        bank.set_fault(sensor, Some(fault));
    }
    let mut bridge = Sc18im700::new(Link::to(chip::Sc18im700::new(bank)), 100);
    bridge.start().unwrap();
    Srf08Ring::new(bridge, waited, config).unwrap()
}

#[test]
fn the_simulated_ring_is_the_reference_robots() {
    assert_eq!(toposlam_host::world::even_ring(), toposlam::reference::RING);
}

#[test]
fn the_ring_reads_the_world_as_it_is_together_or_in_groups() {
    for firing_groups in [1, 2, 3, 4, 16] {
        let mut waited = Waited::default();
        let config = Srf08Config { firing_groups, ..Srf08Config::DEFAULT };
        let mut ring = ring(world(), config, &mut waited);
        let mut faults = FaultCounters::new();
        for number in 0..50 {
            assert_eq!(ring.read(&mut faults), world_frame(number), "frame {number} in {firing_groups} groups");
            assert_eq!(ring.last_error(), None);
        }
        assert_eq!(faults, FaultCounters::new());
        // Three polls say "ranging", the fourth has the answer.
        assert_eq!(waited.nanoseconds, 50 * u64::from(firing_groups) * 4 * 2_000_000);
    }
}

#[test]
fn a_sensor_in_trouble_is_dead_and_counted_and_the_others_go_on() {
    let cases = [
        (SensorFault::Absent, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::NeverDone, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::RefusesData, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::Nonsense, Echo::Dead, Some(SonarFault::Nonsense)),
        (SensorFault::BlocksBus, Echo::Dead, Some(SonarFault::Bus)),
        (SensorFault::Zeros, Echo::Silence, None),
    ];
    for firing_groups in [1, 2] {
        for sensor in [0_u8, 7, 15] {
            for (defect, echo, fault) in cases {
                let mut waited = Waited::default();
                let config = Srf08Config { firing_groups, ..Srf08Config::DEFAULT };
                let mut ring = ring_with_fault(world(), config, &mut waited, Some((sensor.into(), defect)));
                let mut faults = FaultCounters::new();
                for number in 0..2 {
                    let mut expected = world_frame(number);
                    expected.echoes[usize::from(sensor)] = echo;
                    assert_eq!(ring.read(&mut faults), expected, "{defect:?} of sensor {sensor}");
                    assert_eq!(ring.last_error(), fault.map(|fault| SonarError { sensor, fault }));
                }
                for kind in FaultKind::ALL {
                    let expected = if fault.map(SonarFault::kind) == Some(kind) { 2 } else { 0 };
                    assert_eq!(faults.of(kind), expected, "{defect:?} counted as {kind:?}");
                }
            }
        }
    }
}

#[test]
fn a_sensor_that_never_finishes_costs_no_more_than_the_time_out() {
    let mut waited = Waited::default();
    let config = Srf08Config { firing_groups: 1, timeout_ms: 100, poll_interval_us: 3000, ..Srf08Config::DEFAULT };
    let mut ring = ring_with_fault(world(), config, &mut waited, Some((4, SensorFault::NeverDone)));
    ring.read(&mut FaultCounters::new());
    assert_eq!(waited.nanoseconds, 33 * 3_000_000);
}

#[test]
fn when_the_bridge_is_cut_off_every_sensor_is_dead_and_a_healed_line_works_again() {
    let mut waited = Waited::default();
    let mut ring = ring(world(), Srf08Config::DEFAULT, &mut waited);
    let mut faults = FaultCounters::new();
    assert_eq!(ring.read(&mut faults), world_frame(0));
    let (mut bridge, waited) = ring.release();
    let mut link = bridge.release();
    link.cut = true;
    let mut ring = Srf08Ring::new(Sc18im700::new(link, 100), waited, Srf08Config::DEFAULT).unwrap();
    assert_eq!(ring.read(&mut faults), RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(faults.of(FaultKind::BusError), 16);
    let (cut, waited) = ring.release();
    bridge = Sc18im700::new(Link { cut: false, ..cut.release() }, 100);
    bridge.start().unwrap();
    let mut ring = Srf08Ring::new(bridge, waited, Srf08Config::DEFAULT).unwrap();
    assert_eq!(ring.read(&mut faults), world_frame(1));
    assert_eq!(faults.of(FaultKind::BusError), 16);
}

#[test]
fn after_the_last_frame_of_the_world_the_ring_is_dead_and_does_not_hang() {
    let mut waited = Waited::default();
    let mut frames = [world_frame(0)].into_iter();
    let mut ring = ring(move || frames.next(), Srf08Config::DEFAULT, &mut waited);
    let mut faults = FaultCounters::new();
    ring.read(&mut faults);
    assert_eq!(ring.read(&mut faults), RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(faults.of(FaultKind::SonarSilent), 16);
}

#[test]
fn the_srf08_driver_puts_the_data_sheets_bytes_on_the_bus() {
    let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    // 1000 mm and back at 343 m/s are 5831 us; 2000 mm are 11,662 us.
    let expected = [
        Transaction::write(0x70, vec![0x00, 0x52]),
        Transaction::write(0x72, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0xFF; 4]),
        Transaction::write_read(0x72, vec![0x00], vec![0xFF; 4]).with_error(nack),
        Transaction::write_read(0x70, vec![0x00], vec![0x06, 0x80, 0x16, 0xC7]),
        Transaction::write_read(0x72, vec![0x00], vec![0x06, 0x80, 0x00, 0x00]),
        Transaction::write(0x71, vec![0x00, 0x52]),
        Transaction::write_read(0x71, vec![0x00], vec![0x06, 0x80, 0x2D, 0x8E]),
    ];
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 3>::new(I2cMock::new(&expected), &mut waited, Srf08Config::DEFAULT).unwrap();
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    let echoes = [Echo::Range { range_mm: 1000 }, Echo::Range { range_mm: 2000 }, Echo::Silence];
    assert_eq!(frame, RingFrame { echoes });
    assert_eq!(faults, FaultCounters::new());
    ring.release().0.done();
}

#[test]
fn together_means_one_write_to_the_general_call_address() {
    let expected = [
        Transaction::write(0x00, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0x06, 0x80, 0x16, 0xC7]),
        Transaction::write_read(0x71, vec![0x00], vec![0x06, 0x80, 0xFF, 0xFF]),
    ];
    let config = Srf08Config { firing_groups: 1, ..Srf08Config::DEFAULT };
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 2>::new(I2cMock::new(&expected), &mut waited, config).unwrap();
    let mut faults = FaultCounters::new();
    assert_eq!(ring.read(&mut faults).echoes, [Echo::Range { range_mm: 1000 }, Echo::Dead]);
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 1, fault: SonarFault::Nonsense }));
    ring.release().0.done();
}

/// One device that takes everything and answers with a fixed text.
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
fn the_bridge_driver_sends_the_data_sheets_messages() {
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
fn adjacent_operations_of_one_kind_are_one_run_on_the_bus() {
    use embedded_hal::i2c::Operation::{Read, Write};
    let mut bridge = bridge_to(&[1, 2, 3]);
    let (mut first, mut second) = ([0; 2], [0; 1]);
    bridge.transaction(0x50, &mut [Write(&[5]), Write(&[6]), Read(&mut first), Read(&mut second)]).unwrap();
    assert_eq!((first, second), ([1, 2], [3]));
    let sent = bridge.release().sent;
    assert_eq!(&sent[6..], b"S\xA0\x02\x05\x06S\xA1\x03PR\x0AP");
}

#[test]
fn data_that_looks_like_a_failure_is_still_data() {
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
    // None of it leaves the bridge out of step.
    assert_eq!(bridge.read(0x50, &mut [0; 16]), Ok(()));
}

#[test]
fn a_reply_that_lost_or_gained_a_byte_is_an_error_and_the_next_message_works() {
    for lost in [true, false] {
        let mut bridge = bridge_to(&[9]);
        bridge.read(0x50, &mut [0; 2]).unwrap();
        let mut link = bridge.release();
        // A late byte of an earlier message is thrown away before the next one is sent.
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
