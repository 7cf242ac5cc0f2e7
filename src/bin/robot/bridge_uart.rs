//! The UART of the I2C bridge: it sleeps until a byte arrives.

use cortex_m::{asm, peripheral::NVIC};
use embedded_hal_nb::{nb, serial};
use stm32f4xx_hal::pac;

/// A UART that waits before it returns `WouldBlock`, so that a number of polls is a duration.
///
/// While it transmits, the wait is short, because the receiver buffers one byte only. Otherwise it sleeps until a byte
/// arrives or the clock ticks, which gives the emulator time to deliver the byte.
pub(crate) struct BridgeUart<UART> {
    pub(crate) uart: UART,
    pub(crate) cycles_while_sending: u32,
}

impl<UART: serial::ErrorType> serial::ErrorType for BridgeUart<UART> {
    type Error = UART::Error;
}

impl<UART: serial::Read<u8> + serial::Write<u8>> serial::Read<u8> for BridgeUart<UART> {
    fn read(&mut self) -> nb::Result<u8, UART::Error> {
        let answer = self.uart.read();
        if matches!(answer, Err(nb::Error::WouldBlock)) {
            if self.uart.flush().is_ok() {
                sleep_until_a_byte_or_a_tick();
            } else {
                asm::delay(self.cycles_while_sending);
            }
        }
        answer
    }
}

impl<UART: serial::Write<u8>> serial::Write<u8> for BridgeUart<UART> {
    fn write(&mut self, byte: u8) -> nb::Result<(), UART::Error> {
        self.uart.write(byte)
    }

    fn flush(&mut self) -> nb::Result<(), UART::Error> {
        self.uart.flush()
    }
}

/// Interrupts are disabled, but a pending one still ends the sleep: no byte is missed between the check and the sleep.
fn sleep_until_a_byte_or_a_tick() {
    cortex_m::interrupt::free(|_| {
        // SAFETY: interrupts are disabled until it is masked again, so no handler runs.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::USART2);
        }
        asm::wfi();
        NVIC::mask(pac::Interrupt::USART2);
        NVIC::unpend(pac::Interrupt::USART2);
    });
}
