//! A UART connected to a model of the bridge.

use std::{collections::VecDeque, convert::Infallible};

use embedded_hal_nb::{nb, serial};
use toposlam_sim::chip;

/// A UART connected to a model of the bridge. The connection can be cut.
pub(crate) struct Link<DEVICES> {
    pub(crate) chip: chip::Sc18im700<DEVICES>,
    pub(crate) incoming: VecDeque<u8>,
    pub(crate) sent: Vec<u8>,
    pub(crate) cut: bool,
}

impl<DEVICES> Link<DEVICES> {
    pub(crate) fn to(chip: chip::Sc18im700<DEVICES>) -> Self {
        Self { chip, incoming: VecDeque::new(), sent: Vec::new(), cut: false }
    }
}

impl<DEVICES> serial::ErrorType for Link<DEVICES> {
    type Error = NoError;
}

/// The link has no errors of its own.
#[derive(Debug)]
pub(crate) struct NoError(Infallible);

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
