//! Snapshots in flash: wear-levelled, and safe against a power cut at any time.
//!
//! The range of flash has two halves. Snapshots are appended to one half. When it is full, the other half is erased and used
//! next. **The half with the newest complete snapshot is never erased**, so a power cut loses at most the snapshot that was
//! being stored, in any state of the flash. Each half is a queue of the crate `sequential-storage`. A snapshot is
//! split into pieces of 249 bytes; it is valid once its last piece is written.
//!
//! ```
//! # use embedded_storage::nor_flash::NorFlash;
//! use toposlam::persist::store::{Store, StoreError};
//!
//! fn save<FLASH: NorFlash>(flash: FLASH, snapshot: &[u8], buffer: &mut [u8]) -> Result<(), StoreError> {
//!     // The last 256 KiB of 1 MiB.
//!     let mut store = Store::mount(flash, 0xC_0000..0x10_0000)?;
//!     let starts = store.count_start()?;
//!     store.save(snapshot)?;
//!     if let Some(stored) = store.newest(buffer)? {
//!         assert_eq!(buffer.get(..stored.length), Some(snapshot));
//!     }
//!     # let _ = starts;
//!     Ok(())
//! }
//! ```

mod boot;
mod item;
mod log;

pub use boot::{BootOutcome, BootPolicy, BootReport, resume};

use core::fmt;
use core::ops::Range;
use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind};
use item::{Assembly, Item, PIECE_BYTES};
use log::{Log, Push};

/// Why something could not be stored or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StoreError {
    /// The range is not an even number of erasable units, or not in the flash, or the units are smaller than 512 bytes.
    Range,
    /// The flash reported an error.
    Flash(NorFlashErrorKind),
    /// The snapshot is larger than [`Store::largest`].
    TooLarge,
    /// The stored bytes read back differently: the flash is worn out or damaged.
    Damaged,
    /// The flash was not ready, which a blocking flash never is.
    NotReady,
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Range => "the range is not an even number of erasable units",
            Self::Flash(NorFlashErrorKind::NotAligned) => "the alignment does not fit the flash",
            Self::Flash(NorFlashErrorKind::OutOfBounds) => "the range is beyond the flash",
            Self::Flash(_) => "the flash reported an error",
            Self::TooLarge => "the snapshot is larger than half of the range",
            Self::Damaged => "the stored bytes read back differently",
            Self::NotReady => "the flash is not ready",
        })
    }
}

impl core::error::Error for StoreError {}

/// A snapshot in the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Later snapshots have larger numbers.
    pub serial: u32,
    /// Its length in bytes.
    pub length: usize,
}

/// The contents of one half of the range.
#[derive(Clone, Copy, Debug, Default)]
struct Survey {
    /// Whether it begins with a count of starts. If not, an erase was interrupted.
    is_sound: bool,
    /// The largest number in it.
    serial: u32,
    /// The newest complete snapshot below the requested number.
    newest: Option<Stored>,
    starts: u32,
    /// The bytes that its items occupy.
    used: usize,
}

/// Snapshots in a range of flash. Memory: some words beside the flash's own, and some 500 bytes of stack.
#[derive(Clone, Debug)]
pub struct Store<FLASH> {
    flash: FLASH,
    halves: [Range<u32>; 2],
    /// The half that is written, if one is writable.
    current: Option<usize>,
    /// The bytes that the items in that half occupy.
    used: usize,
    /// The half with the newest complete snapshot.
    newest: Option<usize>,
    /// The last serial number in use.
    serial: u32,
    starts: u32,
}

impl<FLASH: NorFlash> Store<FLASH> {
    /// Mounts a range of flash and finds the stored snapshots. Erases a page that a power cut left partly erased.
    ///
    /// # Errors
    /// [`StoreError::Range`], [`StoreError::Flash`], [`StoreError::NotReady`].
    #[inline(never)]
    pub fn mount(flash: FLASH, range: Range<u32>) -> Result<Self, StoreError> {
        let unit = FLASH::ERASE_SIZE as u32;
        let length = range.end.saturating_sub(range.start);
        let is_whole = |address: u32| address.checked_rem(unit) == Some(0);
        let is_fit = is_whole(range.start)
            && is_whole(length / 2)
            && length.is_multiple_of(2)
            && length > 0
            && range.end as usize <= flash.capacity()
            && unit >= 512;
        if !is_fit {
            return Err(StoreError::Range);
        }
        let middle = range.start + length / 2;
        let halves = [range.start..middle, middle..range.end];
        let mut store = Self { flash, halves, current: None, used: 0, newest: None, serial: 0, starts: 0 };
        let (mut last, mut newest) = (0, None);
        for half in 0..2 {
            let survey = store.survey(half, u32::MAX)?;
            store.serial = store.serial.max(survey.serial);
            store.starts = store.starts.max(survey.starts);
            if survey.is_sound && survey.serial >= last {
                (store.current, store.used, last) = (Some(half), survey.used, survey.serial);
            }
            if survey.newest > newest {
                (store.newest, newest) = (Some(half), survey.newest);
            }
        }
        Ok(store)
    }

    /// The largest snapshot that fits, in bytes.
    pub fn largest(&self) -> usize {
        let [half, _] = &self.halves;
        let units = (half.end.saturating_sub(half.start) as usize).checked_div(FLASH::ERASE_SIZE).unwrap_or(0);
        // Two pieces are reserved for the count of starts and the end mark.
        (units * Log::<FLASH>::ITEMS_IN_UNIT).saturating_sub(2) * PIECE_BYTES
    }

    /// Stores a snapshot, or any bytes, and reads them back. Cost: some 8 bytes more than the snapshot for every 249 bytes are
    /// written; when a half is full, one erase.
    ///
    /// # Errors
    /// [`StoreError`]; earlier snapshots are still stored.
    pub fn save(&mut self, snapshot: &[u8]) -> Result<(), StoreError> {
        if snapshot.len() > self.largest() {
            return Err(StoreError::TooLarge);
        }
        if let Some(half) = self.current {
            match self.append(half, snapshot) {
                Ok(true) => return Ok(()),
                // The half is full, or the flash refuses it: a power cut may have left partly written words.
                Ok(false) | Err(StoreError::Flash(_)) => {}
                Err(error) => return Err(error),
            }
        }
        let half = self.change_halves()?;
        if self.append(half, snapshot)? { Ok(()) } else { Err(StoreError::Damaged) }
    }

    /// Reads the newest snapshot that fits a buffer; `None` when there is none.
    ///
    /// # Errors
    /// [`StoreError::Flash`], [`StoreError::NotReady`].
    pub fn newest(&mut self, buffer: &mut [u8]) -> Result<Option<Stored>, StoreError> {
        self.newest_below(u32::MAX, buffer)
    }

    /// Reads the snapshot that was stored before another one, as [`Store::newest`] does.
    ///
    /// # Errors
    /// As [`Store::newest`].
    pub fn before(&mut self, stored: Stored, buffer: &mut [u8]) -> Result<Option<Stored>, StoreError> {
        self.newest_below(stored.serial, buffer)
    }

    /// Counts a start of the robot and returns the number of starts.
    ///
    /// The number is larger than at the start before, unless the power was cut between the erase of a half and its first
    /// write while the other half was full.
    ///
    /// # Errors
    /// [`StoreError::Flash`], [`StoreError::NotReady`], [`StoreError::Damaged`].
    pub fn count_start(&mut self) -> Result<u32, StoreError> {
        self.starts = self.starts.saturating_add(1);
        if let Some(half) = self.current {
            match self.push_starts(half) {
                Ok(Push::Done) => return Ok(self.starts),
                Ok(Push::Full) | Err(StoreError::Flash(_)) => {}
                Err(error) => return Err(error),
            }
        }
        self.change_halves()?;
        Ok(self.starts)
    }

    /// The number of starts.
    pub fn starts(&self) -> u32 {
        self.starts
    }

    /// Erases all snapshots and keeps the number of starts.
    ///
    /// # Errors
    /// As [`Store::count_start`].
    pub fn erase(&mut self) -> Result<(), StoreError> {
        self.newest = None;
        for _ in 0..2 {
            self.change_halves()?;
        }
        Ok(())
    }

    /// The flash. The store does not notice writes to its range until it is mounted again.
    pub fn flash_mut(&mut self) -> &mut FLASH {
        &mut self.flash
    }

    /// Returns the flash.
    pub fn release(self) -> FLASH {
        self.flash
    }

    fn log(&mut self, half: usize) -> Result<Log<'_, FLASH>, StoreError> {
        let range = self.halves.get(half).cloned().ok_or(StoreError::Range)?;
        Log::new(&mut self.flash, range)
    }

    fn next_serial(&mut self) -> u32 {
        self.serial = self.serial.saturating_add(1);
        self.serial
    }

    /// Searches a half for complete snapshots below a serial number.
    #[inline(never)]
    fn survey(&mut self, half: usize, below: u32) -> Result<Survey, StoreError> {
        let mut survey = Survey::default();
        let mut assembly = Assembly::NONE;
        let mut is_first = true;
        self.log(half)?.each(&mut |item| {
            survey.serial = survey.serial.max(item.serial());
            survey.used += Log::<FLASH>::room_of(item.length());
            if let Item::Starts { starts, .. } = item {
                survey.is_sound |= is_first;
                survey.starts = survey.starts.max(starts);
            }
            is_first = false;
            if let Some((serial, length)) = assembly.take(&item)
                && serial < below
            {
                survey.newest = survey.newest.max(Some(Stored { serial, length }));
            }
        })?;
        Ok(survey)
    }

    #[inline(never)]
    fn newest_below(&mut self, below: u32, buffer: &mut [u8]) -> Result<Option<Stored>, StoreError> {
        let mut below = below;
        loop {
            let mut found = None;
            for half in 0..2 {
                let newest = self.survey(half, below)?.newest;
                if newest > found.map(|(stored, _)| stored) {
                    found = newest.map(|stored| (stored, half));
                }
            }
            let Some((stored, half)) = found else { return Ok(None) };
            if let Some(room) = buffer.get_mut(..stored.length)
                && self.read(half, stored, room)?
            {
                return Ok(Some(stored));
            }
            below = stored.serial;
        }
    }

    /// Copies a snapshot; returns whether it is complete.
    #[inline(never)]
    fn read(&mut self, half: usize, stored: Stored, to: &mut [u8]) -> Result<bool, StoreError> {
        let mut is_complete = false;
        let mut assembly = Assembly::NONE;
        self.log(half)?.each(&mut |item| {
            if item.serial() != stored.serial {
                return;
            }
            if let Item::Piece { index, bytes, .. } = item {
                let begin = usize::from(index) * PIECE_BYTES;
                to.iter_mut().skip(begin).zip(bytes).for_each(|(to, &byte)| *to = byte);
            }
            is_complete |= assembly.take(&item).is_some();
        })?;
        Ok(is_complete)
    }

    /// Whether a snapshot reads back unchanged.
    #[inline(never)]
    fn is_stored(&mut self, half: usize, serial: u32, snapshot: &[u8]) -> Result<bool, StoreError> {
        let mut is_same = true;
        let mut is_complete = false;
        let mut assembly = Assembly::NONE;
        self.log(half)?.each(&mut |item| {
            if item.serial() != serial {
                return;
            }
            if let Item::Piece { index, bytes, .. } = item {
                is_same &= snapshot.chunks(PIECE_BYTES).nth(index.into()) == Some(bytes);
            }
            is_complete |= assembly.take(&item).is_some_and(|(_, length)| length == snapshot.len());
        })?;
        Ok(is_same && is_complete)
    }

    /// Appends a snapshot to a half; returns whether it had room and reads back.
    #[inline(never)]
    fn append(&mut self, half: usize, snapshot: &[u8]) -> Result<bool, StoreError> {
        // Page ends waste some bytes, so a snapshot may still not fit.
        let pieces =
            snapshot.len() / PIECE_BYTES * Log::<FLASH>::room_of(item::ITEM_BYTES) + snapshot.len() % PIECE_BYTES;
        let range = self.halves.get(half).cloned().unwrap_or(0..0);
        if self.used.saturating_add(pieces) > range.end.saturating_sub(range.start) as usize {
            return Ok(false);
        }
        let serial = self.next_serial();
        let mut pieces = 0;
        for (index, bytes) in (0..).zip(snapshot.chunks(PIECE_BYTES)) {
            if self.push(half, &Item::Piece { serial, index, bytes })? == Push::Full {
                return Ok(false);
            }
            pieces = index + 1;
        }
        let end = Item::End { serial, pieces, length: snapshot.len() as u32 };
        if self.push(half, &end)? == Push::Full || !self.is_stored(half, serial, snapshot)? {
            return Ok(false);
        }
        self.newest = Some(half);
        Ok(true)
    }

    #[inline(never)]
    fn push_starts(&mut self, half: usize) -> Result<Push, StoreError> {
        let (serial, starts) = (self.next_serial(), self.starts);
        self.push(half, &Item::Starts { serial, starts })
    }

    fn push(&mut self, half: usize, item: &Item<'_>) -> Result<Push, StoreError> {
        self.used += Log::<FLASH>::room_of(item.length());
        self.log(half)?.push(item)
    }

    /// Erases the half without the newest snapshot and makes it the written half.
    #[inline(never)]
    fn change_halves(&mut self) -> Result<usize, StoreError> {
        let stored = self.newest.or(self.current).unwrap_or(1);
        let half = 1 - stored.min(1);
        let range = self.halves.get(half).cloned().ok_or(StoreError::Range)?;
        self.current = None;
        self.used = 0;
        self.flash.erase(range.start, range.end).map_err(log::flash_error)?;
        if self.push_starts(half)? == Push::Full {
            return Err(StoreError::Damaged);
        }
        self.current = Some(half);
        Ok(half)
    }
}

impl PartialOrd for Stored {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Stored {
    /// By age: the later one is the greater.
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        self.serial.cmp(&other.serial).then(self.length.cmp(&other.length))
    }
}
