//! The two peripherals of the nRF51822 that the robot needs: the UART and a timer (nRF51 Series Reference Manual, chapters 18
//! and 29). Both are polled.

/// A register of the chip.
#[derive(Clone, Copy)]
struct Register(usize);

#[allow(unsafe_code)]
impl Register {
    fn read(self) -> u32 {
        // SAFETY: every register of this file exists on the chip, and no other code uses it.
        unsafe { core::ptr::with_exposed_provenance::<u32>(self.0).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: as for reading; no register of this file changes memory.
        unsafe { core::ptr::with_exposed_provenance_mut::<u32>(self.0).write_volatile(value) }
    }
}

const UART: usize = 0x4000_2000;
const START_RECEIVER: Register = Register(UART);
const START_TRANSMITTER: Register = Register(UART + 0x008);
const RECEIVED: Register = Register(UART + 0x108);
const TRANSMITTED: Register = Register(UART + 0x11C);
const ENABLE: Register = Register(UART + 0x500);
const TRANSMIT_PIN: Register = Register(UART + 0x50C);
const RECEIVE_PIN: Register = Register(UART + 0x514);
const RECEIVE: Register = Register(UART + 0x518);
const TRANSMIT: Register = Register(UART + 0x51C);
const BAUD_RATE: Register = Register(UART + 0x524);

const TIMER: usize = 0x4000_8000;
const START_TIMER: Register = Register(TIMER);
const CAPTURE: Register = Register(TIMER + 0x040);
const BITS: Register = Register(TIMER + 0x508);
const PRESCALER: Register = Register(TIMER + 0x510);
const CAPTURED: Register = Register(TIMER + 0x540);

/// The serial line to the debugger of the board.
pub(crate) struct Uart(());

impl Uart {
    /// Opens the line at 115,200 baud, once.
    pub(crate) fn open() -> Self {
        TRANSMIT_PIN.write(24);
        RECEIVE_PIN.write(25);
        BAUD_RATE.write(0x01D7_E000);
        ENABLE.write(4);
        RECEIVED.write(0);
        START_RECEIVER.write(1);
        START_TRANSMITTER.write(1);
        Self(())
    }

    /// Waits for a byte.
    pub(crate) fn receive(&mut self) -> u8 {
        while RECEIVED.read() == 0 {}
        RECEIVED.write(0);
        RECEIVE.read() as u8
    }

    /// Transmits a byte and waits until it is gone.
    pub(crate) fn transmit(&mut self, byte: u8) {
        TRANSMITTED.write(0);
        TRANSMIT.write(byte.into());
        while TRANSMITTED.read() == 0 {}
    }
}

/// A clock of the processor's 16 MHz.
pub(crate) struct Clock(());

impl Clock {
    /// Starts the clock, once.
    pub(crate) fn start() -> Self {
        BITS.write(3);
        PRESCALER.write(0);
        START_TIMER.write(1);
        Self(())
    }

    /// The ticks since the start; they wrap after 268 s.
    pub(crate) fn ticks(&mut self) -> u32 {
        CAPTURE.write(1);
        CAPTURED.read()
    }
}
