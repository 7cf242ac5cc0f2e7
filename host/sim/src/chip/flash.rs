//! A model of a NOR flash with power cuts, between operations and in the middle of one.
//!
//! A power cut follows the contract of `embedded-storage`. In a word that is being written, each bit may be written or
//! not. In a sector that is being erased, each bit may be erased or not. Everything else is unchanged.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// State in which a power cut leaves the interrupted operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tear {
    /// The operation is complete.
    Done,
    /// The first half of its bytes is complete.
    FirstHalf,
    /// The last half of its bytes is complete.
    LastHalf,
    /// Each bit is complete or not, drawn with this seed.
    Bits(u64),
}

/// A power cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Index of the interrupted operation, counted from 0 for a new flash. Each write, and each sector of an erase, is
    /// one.
    pub operation: u64,
    /// State in which that operation is left.
    pub tear: Tear,
}

/// Errors of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashFault {
    /// The power is off.
    NoPower,
    /// The address or the length is not a multiple of the unit.
    NotAligned,
    /// The address is beyond the end.
    OutOfBounds,
    /// A word is already written.
    NotErased,
}

impl NorFlashError for FlashFault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NoPower | Self::NotErased => NorFlashErrorKind::Other,
        }
    }
}

/// A flash that is written in words of `WRITE` bytes and erased in sectors of `ERASE` bytes. Each word is written once
/// between erases, unless the flash is [rewritable](FlashModel::rewritable).
#[derive(Clone, Debug)]
pub struct FlashModel<const WRITE: usize, const ERASE: usize> {
    bytes: Vec<u8>,
    erases: Vec<u32>,
    operations: u64,
    bytes_written: u64,
    cut: Option<Cut>,
    has_power: bool,
    is_rewritable: bool,
}

impl<const WRITE: usize, const ERASE: usize> FlashModel<WRITE, ERASE> {
    /// An erased flash with this number of sectors.
    pub fn new(sectors: usize) -> Self {
        Self {
            bytes: vec![0xFF; sectors * ERASE],
            erases: vec![0; sectors],
            operations: 0,
            bytes_written: 0,
            cut: None,
            has_power: true,
            is_rewritable: false,
        }
    }

    /// The same flash, where a word may be written again as long as the write only clears bits.
    #[must_use]
    pub fn rewritable(self) -> Self {
        Self { is_rewritable: true, ..self }
    }

    /// Schedules a power cut, or cancels it.
    pub fn cut_power(&mut self, cut: Option<Cut>) {
        self.cut = cut;
    }

    /// Whether the power is off.
    pub fn is_off(&self) -> bool {
        !self.has_power
    }

    /// Restores the power and cancels the scheduled cut.
    pub fn power_on(&mut self) {
        self.has_power = true;
        self.cut = None;
    }

    /// Number of operations so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// Number of bytes written so far.
    pub fn bytes_written(&self) -> u64 {
        self.bytes_written
    }

    /// Number of erases of each sector.
    pub fn erases(&self) -> &[u32] {
        &self.erases
    }

    /// The contents of the flash, for tests that corrupt them.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// Begins an operation; returns its tear if the power is cut during it.
    fn begin(&mut self) -> Result<Option<Tear>, FlashFault> {
        if !self.has_power {
            return Err(FlashFault::NoPower);
        }
        let operation = self.operations;
        self.operations += 1;
        let tear = self.cut.filter(|cut| cut.operation == operation).map(|cut| cut.tear);
        self.has_power = tear.is_none();
        Ok(tear)
    }

    /// Applies an operation from an address on. Each byte becomes the value that `wanted` gives, as far as the tear
    /// allows.
    fn carry_out(&mut self, from: usize, wanted: &[u8], tear: Option<Tear>) -> Result<(), FlashFault> {
        let half = wanted.len() / 2;
        let mut state = match tear {
            Some(Tear::Bits(seed)) => seed,
            _ => 0,
        };
        for (index, (byte, &wanted)) in self.bytes[from..].iter_mut().zip(wanted).enumerate() {
            let mask = match tear {
                None | Some(Tear::Done) => 0xFF,
                Some(Tear::FirstHalf) => u8::from(index < half) * 0xFF,
                Some(Tear::LastHalf) => u8::from(index >= half) * 0xFF,
                Some(Tear::Bits(_)) => {
                    state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
                    (state >> 33) as u8
                }
            };
            *byte = *byte & !mask | wanted & mask;
        }
        if tear.is_some() { Err(FlashFault::NoPower) } else { Ok(()) }
    }

    fn check(&self, from: u32, length: usize, unit: usize) -> Result<usize, FlashFault> {
        let from = from as usize;
        match () {
            () if !from.is_multiple_of(unit) || !length.is_multiple_of(unit) => Err(FlashFault::NotAligned),
            () if from + length > self.bytes.len() => Err(FlashFault::OutOfBounds),
            () => Ok(from),
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for FlashModel<WRITE, ERASE> {
    type Error = FlashFault;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for FlashModel<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        if !self.has_power {
            return Err(FlashFault::NoPower);
        }
        let from = self.check(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for FlashModel<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        let length = (to as usize).checked_sub(from as usize).ok_or(FlashFault::OutOfBounds)?;
        let from = self.check(from, length, ERASE)?;
        for sector in from / ERASE..(from + length) / ERASE {
            let tear = self.begin()?;
            self.erases[sector] += 1;
            self.carry_out(sector * ERASE, &vec![0xFF; ERASE], tear)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        let from = self.check(offset, bytes.len(), WRITE)?;
        let refuses = |(&held, &wanted): (&u8, &u8)| held != 0xFF && !(self.is_rewritable && held & wanted == wanted);
        if self.bytes[from..].iter().zip(bytes).any(refuses) {
            return Err(FlashFault::NotErased);
        }
        let tear = self.begin()?;
        self.bytes_written += bytes.len() as u64;
        self.carry_out(from, bytes, tear)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Small = FlashModel<4, 64>;

    #[test]
    fn a_word_is_written_aligned_and_once_between_erases() {
        let mut flash = Small::new(2);
        flash.write(4, &[1, 2, 3, 4]).unwrap();
        assert_eq!(flash.write(4, &[0; 4]), Err(FlashFault::NotErased));
        assert_eq!(flash.write(2, &[0; 4]), Err(FlashFault::NotAligned));
        assert_eq!(flash.write(8, &[0; 3]), Err(FlashFault::NotAligned));
        assert_eq!(flash.write(128, &[0; 4]), Err(FlashFault::OutOfBounds));
        assert_eq!(flash.erase(0, 32), Err(FlashFault::NotAligned));
        let mut again = flash.clone().rewritable();
        assert_eq!(again.write(4, &[0; 4]), Ok(()));
        assert_eq!(again.write(4, &[1; 4]), Err(FlashFault::NotErased));
        let mut read = [0; 6];
        flash.read(3, &mut read).unwrap();
        assert_eq!(read, [0xFF, 1, 2, 3, 4, 0xFF]);
        flash.erase(0, 64).unwrap();
        flash.write(4, &[9; 4]).unwrap();
        assert_eq!((flash.erases(), flash.operations(), flash.bytes_written()), (&[1, 0][..], 3, 8));
    }

    #[test]
    fn a_power_cut_tears_its_operation_and_later_operations_fail_until_power_on() {
        for (tear, written) in [
            (Tear::Done, [0; 8]),
            (Tear::FirstHalf, [0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]),
            (Tear::LastHalf, [0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0]),
        ] {
            let mut flash = Small::new(1);
            flash.write(0, &[5; 4]).unwrap();
            flash.cut_power(Some(Cut { operation: 1, tear }));
            assert_eq!(flash.write(8, &[0; 8]), Err(FlashFault::NoPower));
            assert!(flash.is_off());
            assert_eq!(flash.read(0, &mut [0; 4]), Err(FlashFault::NoPower));
            assert_eq!(flash.erase(0, 64), Err(FlashFault::NoPower));
            flash.power_on();
            let mut read = [0; 16];
            flash.read(0, &mut read).unwrap();
            assert_eq!(read[..8], [5, 5, 5, 5, 0xFF, 0xFF, 0xFF, 0xFF]);
            assert_eq!(read[8..], written);
        }
    }

    #[test]
    fn bits_of_a_torn_operation_are_old_or_new() {
        let mut flash = Small::new(1);
        flash.write(0, &[0x0F; 32]).unwrap();
        flash.cut_power(Some(Cut { operation: 1, tear: Tear::Bits(7) }));
        assert_eq!(flash.write(32, &[0xF0; 32]), Err(FlashFault::NoPower));
        assert!(flash.bytes_mut()[32..].iter().all(|byte| byte & 0xF0 == 0xF0));
        assert!(flash.bytes_mut()[32..].iter().any(|byte| ![0xF0, 0xFF].contains(byte)));
        flash.power_on();
        flash.cut_power(Some(Cut { operation: 2, tear: Tear::Bits(8) }));
        assert_eq!(flash.erase(0, 64), Err(FlashFault::NoPower));
        assert!(flash.bytes_mut()[..32].iter().all(|byte| byte & 0x0F == 0x0F));
        assert!(flash.bytes_mut()[..32].iter().any(|byte| ![0x0F, 0xFF].contains(byte)));
    }
}
