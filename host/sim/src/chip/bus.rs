//! The I2C bus of the models: what devices say to transfers, with or without a bridge in between.

use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// What a device on the bus says to a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BusAnswer<DATA> {
    /// It took or gave the data.
    Acknowledged(DATA),
    /// No device has that address, or it keeps silent.
    AddressNotAcknowledged,
    /// The device refused a byte.
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
    /// A read of some bytes from a 7-bit address.
    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>>;
}

/// Devices on the controller's own I2C bus, as a driver sees them. It takes one operation as one run on the bus.
#[derive(Clone, Debug)]
pub struct I2cBus<DEVICES> {
    /// What is on the bus.
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
