//! Wear levelling, capacity, and stores with foreign or damaged contents.

use super::*;
use toposlam::persist::store::StoreError;
use toposlam_sim::chip::FlashFault;

/// Saves repeatedly; returns the erases of each sector.
fn worn<const W: usize, const E: usize>(sectors: usize, snapshots: &[Vec<u8>], times: usize) -> Vec<u32> {
    let mut store = Store::mount(FlashModel::<W, E>::new(sectors), 0..(sectors * E) as u32).unwrap();
    let mut bytes = 0;
    for snapshot in snapshots.iter().cycle().take(times) {
        store.save(snapshot).unwrap();
        bytes += snapshot.len();
    }
    let flash = store.release();
    let erases: u32 = flash.erases().iter().sum();
    println!(
        "{sectors} sectors of {E} bytes, {times} snapshots of {} bytes on average: erases {:?}, {:.2} snapshots an erase, {:.2} \
         bytes written for one",
        bytes / times,
        flash.erases(),
        times as f64 / f64::from(erases),
        flash.bytes_written() as f64 / bytes as f64,
    );
    flash.erases().to_vec()
}

#[test]
fn all_sectors_wear_evenly() {
    let snapshots = snapshots(440, 8, 10);
    for erases in [
        worn::<1, { 128 * 1024 }>(2, &snapshots, 200),
        worn::<4, 4096>(8, &snapshots, 80),
        worn::<4, 4096>(32, &snapshots, 80),
    ] {
        let (least, most) = (erases.iter().min().unwrap(), erases.iter().max().unwrap());
        assert!(most - least <= 1, "{erases:?}");
    }
}

#[test]
// A reversed range must be refused too.
#[allow(clippy::reversed_empty_ranges)]
fn a_range_without_an_even_number_of_sectors_in_the_flash_is_refused() {
    for range in [0..0, 0..4096, 0..3 * 4096, 1..8193, 4096..2 * 4096, 8192..4096, 24_576..40_960] {
        let refused = Store::mount(Pages::new(8), range.clone()).err();
        assert_eq!(refused, Some(StoreError::Range), "{range:?}");
    }
    assert_eq!(Store::mount(FlashModel::<4, 256>::new(8), 0..2048).err(), Some(StoreError::Range));
    assert!(Store::mount(Pages::new(8), 4096..3 * 4096).is_ok());
}

#[test]
fn the_largest_snapshot_fits_and_a_larger_one_is_refused_without_loss() {
    let mut store = Store::mount(Pages::new(8), 0..32_768).unwrap();
    let largest = store.largest();
    println!(
        "8 pages of 4 KiB: snapshots of {largest} bytes at most; 2 sectors of 128 KiB: {}",
        Store::mount(Sectors::new(2), 0..262_144).unwrap().largest()
    );
    assert!(largest >= reference::SNAPSHOT_BYTES);
    let bytes: Vec<u8> = (0..=largest).map(|index| (index * 31 % 251) as u8).collect();
    let mut buffer = vec![0; largest];
    for length in [0, 1, 248, 249, 250, largest] {
        store.save(&bytes[..length]).unwrap();
        let kept = store.newest(&mut buffer).unwrap().unwrap();
        assert_eq!((kept.length, &buffer[..length]), (length, &bytes[..length]));
    }
    assert_eq!(store.save(&bytes), Err(StoreError::TooLarge));
    assert_eq!(store.newest(&mut buffer).unwrap().unwrap().length, largest);
    // A buffer that is too small for the newest snapshot receives an older one.
    let kept = store.newest(&mut buffer[..100]).unwrap();
    assert!(kept.is_none_or(|kept| kept.length <= 100));
}

#[test]
fn older_snapshots_remain_readable_until_erased() {
    let mut store = Store::mount(Sectors::new(2), 0..262_144).unwrap();
    for number in 0..9_u8 {
        store.save(&[number; 600]).unwrap();
        store.count_start().unwrap();
    }
    let mut buffer = [0; 600];
    let mut found = Vec::new();
    let mut next = store.newest(&mut buffer).unwrap();
    while let Some(kept) = next {
        assert_eq!(buffer, [buffer[0]; 600]);
        found.push(buffer[0]);
        next = store.before(kept, &mut buffer).unwrap();
    }
    assert_eq!(found, [8, 7, 6, 5, 4, 3, 2, 1, 0]);
    store.erase().unwrap();
    assert_eq!(newest(&mut store), None);
    let mut store = Store::mount(store.release(), 0..262_144).unwrap();
    assert_eq!((newest(&mut store), store.starts()), (None, 9));
}

#[test]
fn a_flash_with_foreign_contents_is_treated_as_empty() {
    let mut state = 1_u64;
    for round in 0..40 {
        let mut flash = Pages::new(8);
        for byte in flash.bytes_mut() {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
            *byte = match round % 4 {
                0 => (state >> 40) as u8,
                1 => 0,
                2 => (state >> 40) as u8 & (state >> 48) as u8,
                _ if state >> 61 == 0 => (state >> 40) as u8,
                _ => 0xFF,
            };
        }
        let mut store = Store::mount(flash, 0..32_768).unwrap();
        assert_eq!(newest(&mut store), None);
        store.count_start().unwrap();
        store.save(&[5; 3000]).unwrap();
        let mut store = Store::mount(store.release(), 0..32_768).unwrap();
        assert_eq!(newest(&mut store), Some(vec![5; 3000]));
    }
}

#[test]
fn a_half_not_erased_by_the_store_is_erased_before_use() {
    // The start of each page is erased, the marks of the queue included; the rest may remain from an interrupted erase.
    let mut flash = Pages::new(8);
    (0..8).for_each(|page| flash.bytes_mut()[page * 4096 + 3000..][..100].fill(0xAB));
    let mut store = Store::mount(flash, 0..32_768).unwrap();
    store.count_start().unwrap();
    store.save(&[5; 600]).unwrap();
    let erases = store.release().erases().to_vec();
    assert!(erases[..4] == [1; 4] || erases[4..] == [1; 4], "{erases:?}");
}

#[test]
fn a_damaged_byte_invalidates_at_most_one_snapshot() {
    let mut store = Store::mount(Pages::new(8), 0..32_768).unwrap();
    for number in 0..4_u8 {
        store.save(&[number; 2000]).unwrap();
    }
    let flash = store.release();
    for at in (0..4096 * 3).step_by(13) {
        let mut damaged = flash.clone();
        damaged.bytes_mut()[at] ^= 0x10;
        let mut store = Store::mount(damaged, 0..32_768).unwrap();
        let found = newest(&mut store).unwrap();
        assert!(found == vec![3; 2000] || found == vec![2; 2000], "{at}: {:?}", found[0]);
        store.save(&[9; 2000]).unwrap();
        assert_eq!(newest(&mut store), Some(vec![9; 2000]), "{at}");
    }
}

/// A flash whose writes succeed without effect.
struct Deaf(Pages);

impl embedded_storage::nor_flash::ErrorType for Deaf {
    type Error = FlashFault;
}

impl embedded_storage::nor_flash::ReadNorFlash for Deaf {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl embedded_storage::nor_flash::NorFlash for Deaf {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        self.0.erase(from, to)
    }

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), FlashFault> {
        Ok(())
    }
}

#[test]
fn a_flash_that_loses_writes_is_detected() {
    use embedded_storage::nor_flash::ReadNorFlash;
    let mut store = Store::mount(Deaf(Pages::new(8)), 0..32_768).unwrap();
    assert_eq!(store.flash_mut().capacity(), 32_768);
    assert_eq!(store.save(&[1; 3000]), Err(StoreError::Damaged));
}
