//! Power cuts in every write and erase of a drive.

use super::*;
use rayon::prelude::*;
use toposlam::persist::store::StoreError;
use toposlam_sim::chip::{Cut, Tear};

/// Results of the power cuts of a drive.
#[derive(Clone, Copy, Debug, Default)]
struct Figures {
    /// The number of flash operations of the drive without cuts.
    operations: u64,
    cuts: u64,
    /// Second cuts: during the start after a cut, and during the next save.
    second_cuts: u64,
    /// Cuts after which the store had the new snapshot; below, the previous one and none.
    newest: u64,
    before: u64,
    none: u64,
}

impl std::ops::Add for Figures {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            operations: self.operations + other.operations,
            cuts: self.cuts + other.cuts,
            second_cuts: self.second_cuts + other.second_cuts,
            newest: self.newest + other.newest,
            before: self.before + other.before,
            none: self.none + other.none,
        }
    }
}

/// A start of the robot: mounts the store and counts the start.
fn start<const W: usize, const E: usize>(
    flash: FlashModel<W, E>,
    range: std::ops::Range<u32>,
) -> Result<Store<FlashModel<W, E>>, StoreError> {
    let mut store = Store::mount(flash, range)?;
    store.count_start()?;
    Ok(store)
}

/// The tears of an operation.
fn tears(operation: u64) -> [Tear; 5] {
    let bits = |salt: u64| Tear::Bits((2 * operation + salt).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    [Tear::Done, Tear::FirstHalf, Tear::LastHalf, bits(0), bits(1)]
}

/// One save: the store before it, its flash operations, and the index of the snapshot.
struct Step<const W: usize, const E: usize> {
    store: Store<FlashModel<W, E>>,
    operations: std::ops::Range<u64>,
    index: usize,
}

impl<const W: usize, const E: usize> Step<W, E> {
    /// Cuts the power in every operation of the step, and a second time after one in `thinned` operations.
    fn cut_everywhere(&self, drive: &Drive, thinned: u64) -> Figures {
        let mut figures = Figures { operations: self.operations.end - self.operations.start, ..Figures::default() };
        let before = self.index.checked_sub(1).map(|before| &drive.snapshots[before]);
        let stored = Some(&drive.snapshots[self.index]);
        for operation in self.operations.clone() {
            for (turn, tear) in tears(operation).into_iter().enumerate() {
                figures.cuts += 1;
                let flash = self.until(Cut { operation, tear }, &drive.snapshots[self.index]);
                let found = self.check(flash.clone(), drive, [before, stored]);
                match () {
                    () if found == stored => figures.newest += 1,
                    () if found.is_some() => figures.before += 1,
                    () => figures.none += 1,
                }
                if turn as u64 == operation / thinned % 5 && operation % thinned == 0 {
                    figures.second_cuts += self.cut_again(&flash, drive, found);
                }
            }
        }
        figures
    }

    /// The flash after a power cut during a save, with the power on again.
    fn until(&self, cut: Cut, snapshot: &[u8]) -> FlashModel<W, E> {
        let mut store = self.store.clone();
        store.flash_mut().cut_power(Some(cut));
        assert!(matches!(store.save(snapshot), Err(StoreError::Flash(_))), "{cut:?}");
        let mut flash = store.release();
        assert!(flash.is_off(), "{cut:?}");
        flash.power_on();
        flash
    }

    /// Asserts that after a cut the store has one of two snapshots, or none before the first, and stores the next one.
    /// Returns the snapshot found.
    fn check<'a>(
        &self,
        flash: FlashModel<W, E>,
        drive: &'a Drive,
        either: [Option<&'a Vec<u8>>; 2],
    ) -> Option<&'a Vec<u8>> {
        let starts = self.store.starts();
        let mut store = start(flash, drive.range.clone()).unwrap();
        assert!(store.starts() > starts, "the number of starts increases");
        let found = newest(&mut store);
        let found = either.into_iter().find(|one| found.as_ref() == *one);
        assert!(found.is_some(), "snapshot {} and the previous one are lost", self.index);
        let next = drive.next(self.index);
        store.save(next).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(next));
        let mut store = start(store.release(), drive.range.clone()).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(next));
        found.flatten()
    }

    /// Cuts the power again in every operation of the start and of the next save; returns the number of cuts.
    fn cut_again(&self, flash: &FlashModel<W, E>, drive: &Drive, found: Option<&Vec<u8>>) -> u64 {
        let next = drive.next(self.index);
        let go_on = |flash: &mut FlashModel<W, E>| {
            let mut store = Store::mount(flash, drive.range.clone())?;
            store.count_start()?;
            store.save(next)
        };
        let first = flash.operations();
        let mut whole = flash.clone();
        go_on(&mut whole).unwrap();
        for operation in first..whole.operations() {
            let tear = tears(operation)[operation as usize % 5];
            let mut cut = flash.clone();
            cut.cut_power(Some(Cut { operation, tear }));
            assert!(matches!(go_on(&mut cut), Err(StoreError::Flash(_))));
            cut.power_on();
            self.check(cut, drive, [found, Some(next)]);
        }
        whole.operations() - first
    }
}

/// The snapshots of a drive, and the range of flash that stores them.
struct Drive {
    snapshots: Vec<Vec<u8>>,
    range: std::ops::Range<u32>,
}

impl Drive {
    fn next(&self, index: usize) -> &Vec<u8> {
        &self.snapshots[(index + 1) % self.snapshots.len()]
    }
}

fn cut_a_drive<const W: usize, const E: usize>(
    flash: FlashModel<W, E>,
    snapshots: Vec<Vec<u8>>,
    thinned: u64,
) -> (Figures, Vec<u32>) {
    let range = 0..(flash.erases().len() * E) as u32;
    let drive = Drive { snapshots, range };
    let mut store = start(flash, drive.range.clone()).unwrap();
    let mut steps = Vec::new();
    for (index, snapshot) in drive.snapshots.iter().enumerate() {
        let before = store.clone();
        let first = store.flash_mut().operations();
        store.save(snapshot).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(snapshot));
        let operations = first..store.flash_mut().operations();
        steps.push(Step { store: before, operations, index });
        if index % 4 == 3 {
            store = start(store.release(), drive.range.clone()).unwrap();
        }
    }
    let erases = store.release().erases().to_vec();
    let cut = |step: &Step<W, E>| step.cut_everywhere(&drive, thinned);
    (steps.par_iter().map(cut).reduce(Figures::default, |a, b| a + b), erases)
}

#[test]
fn a_power_cut_in_any_operation_loses_at_most_the_newest_snapshot_in_pages_of_4_kib() {
    let (figures, erases) = cut_a_drive(Pages::new(8), snapshots(0, 36, 14), 5);
    println!("8 pages of 4 KiB, words of 4 bytes: {figures:?}; erases {erases:?}");
    assert!(figures.none > 0 && figures.newest > 0 && figures.before > figures.newest);
    assert!(erases.iter().all(|&erases| erases >= 2), "every page is erased: {erases:?}");
}

#[test]
fn a_power_cut_in_any_operation_loses_at_most_the_newest_snapshot_in_sectors_of_128_kib() {
    let (figures, erases) = cut_a_drive(Sectors::new(2).rewritable(), snapshots(440, 44, 10), 30);
    println!("2 sectors of 128 KiB, words of 1 byte: {figures:?}; erases {erases:?}");
    assert!(figures.none > 0 && figures.newest > 0 && figures.before > figures.newest);
    assert!(erases.iter().all(|&erases| erases >= 1), "every sector is erased: {erases:?}");
}
