//! The I2C bus of the models: the answers of devices to transfers, with or without a bridge in between.

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// The answer of a device to a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BusAnswer<DATA> {
    /// The device accepted or returned the data.
    Acknowledged(DATA),
    /// No device acknowledged the address.
    AddressNotAcknowledged,
    /// The device did not acknowledge a data byte.
    DataNotAcknowledged,
    /// The bus is stuck.
    TimedOut,
}

impl<DATA> BusAnswer<DATA> {
    fn into_result(self) -> Result<DATA, ErrorKind> {
        match self {
            Self::Acknowledged(data) => Ok(data),
            Self::AddressNotAcknowledged => Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)),
            Self::DataNotAcknowledged => Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data)),
            Self::TimedOut => Err(ErrorKind::Bus),
        }
    }
}

/// The devices on a bus.
pub trait I2cDevices {
    /// A write to a 7-bit address.
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()>;
    /// A read of `count` bytes from a 7-bit address.
    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>>;
}

/// Devices on the controller's own I2C bus, as a driver sees them. Each operation is one transfer on the bus.
#[derive(Clone, Debug)]
pub struct I2cBus<DEVICES> {
    /// The devices on the bus.
    pub devices: DEVICES,
}

impl<DEVICES> ErrorType for I2cBus<DEVICES> {
    type Error = ErrorKind;
}

impl<DEVICES: I2cDevices> I2c for I2cBus<DEVICES> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        for operation in operations {
            match operation {
                Operation::Write(bytes) => self.devices.write(address, bytes).into_result()?,
                Operation::Read(bytes) => {
                    let data = self.devices.read(address, bytes.len()).into_result()?;
                    bytes.copy_from_slice(&data);
                }
            }
        }
        Ok(())
    }
}
