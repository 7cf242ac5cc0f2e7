//! One half of the store as a queue of `sequential-storage`. Its futures are ready at the first poll, because the flash
//! blocks.

use core::future::Future;
use core::ops::Range;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, ReadNorFlash};
use embedded_storage_async::nor_flash as asynchronous;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::queue::{QueueConfig, QueueStorage};

use super::StoreError;
use super::item::{ITEM_BYTES, Item, Packed};

/// A blocking flash behind the asynchronous traits.
struct Blocking<'a, FLASH>(&'a mut FLASH);

impl<FLASH: ErrorType> ErrorType for Blocking<'_, FLASH> {
    type Error = FLASH::Error;
}

impl<FLASH: ReadNorFlash> asynchronous::ReadNorFlash for Blocking<'_, FLASH> {
    const READ_SIZE: usize = FLASH::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<FLASH: NorFlash> asynchronous::NorFlash for Blocking<'_, FLASH> {
    const WRITE_SIZE: usize = FLASH::WRITE_SIZE;
    const ERASE_SIZE: usize = FLASH::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write(offset, bytes)
    }
}

/// Polls a future that is ready at once.
fn now<T>(future: impl Future<Output = T>) -> Result<T, StoreError> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(outcome) => Ok(outcome),
        Poll::Pending => Err(StoreError::NotReady),
    }
}

pub(super) fn flash_error(error: impl NorFlashError) -> StoreError {
    StoreError::Flash(error.kind())
}

/// Whether an item had room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Push {
    Done,
    Full,
}

/// A half of the store.
pub(super) struct Log<'a, FLASH: NorFlash> {
    queue: QueueStorage<Blocking<'a, FLASH>, Cache<Uncached, Uncached, Uncached>>,
}

impl<'a, FLASH: NorFlash> Log<'a, FLASH> {
    /// The word size of the queue.
    const WORD: usize = if FLASH::WRITE_SIZE > FLASH::READ_SIZE { FLASH::WRITE_SIZE } else { FLASH::READ_SIZE };
    /// The number of largest items that fit an erasable unit beside its two marks.
    pub(super) const ITEMS_IN_UNIT: usize =
        FLASH::ERASE_SIZE.saturating_sub(2 * Self::WORD) / Self::room_of(ITEM_BYTES);

    /// The size of an item in flash, its header of 8 bytes included.
    pub(super) const fn room_of(length: usize) -> usize {
        8_usize.next_multiple_of(Self::WORD) + length.next_multiple_of(Self::WORD)
    }

    pub(super) fn new(flash: &'a mut FLASH, range: Range<u32>) -> Result<Self, StoreError> {
        let config = QueueConfig::try_new(range).map_err(|_| StoreError::Range)?;
        Ok(Self { queue: QueueStorage::new(Blocking(flash), config, Cache::new_uncached()) })
    }

    /// Appends an item.
    #[inline(never)]
    pub(super) fn push(&mut self, item: &Item<'_>) -> Result<Push, StoreError> {
        let mut packed = Packed([0; ITEM_BYTES]);
        let length = item.pack(&mut packed);
        let bytes = packed.0.get(..length).unwrap_or(&[]);
        match now(self.queue.push(bytes, false))? {
            Ok(()) => Ok(Push::Done),
            Err(sequential_storage::Error::Storage { value, .. }) => Err(flash_error(value)),
            // Full, or in a state that only an erase repairs.
            Err(_) => Ok(Push::Full),
        }
    }

    /// Visits every item, the oldest first, up to the first unreadable one.
    #[inline(never)]
    pub(super) fn each(&mut self, visit: &mut dyn FnMut(Item<'_>)) -> Result<(), StoreError> {
        let mut packed = Packed([0; ITEM_BYTES]);
        let mut items = match now(self.queue.iter())? {
            Ok(items) => items,
            Err(sequential_storage::Error::Storage { value, .. }) => return Err(flash_error(value)),
            Err(_) => return Ok(()),
        };
        loop {
            match now(items.next(&mut packed.0))? {
                Ok(Some(entry)) => {
                    if let Some(item) = Item::unpack(&entry) {
                        visit(item);
                    }
                }
                Ok(None) => return Ok(()),
                Err(sequential_storage::Error::Storage { value, .. }) => return Err(flash_error(value)),
                Err(_) => return Ok(()),
            }
        }
    }
}
