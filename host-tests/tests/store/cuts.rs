//! A power cut in every single write and erase of a drive.

use super::*;
use rayon::prelude::*;
use toposlam::store::StoreError;
use toposlam_host::chip::{Cut, Tear};

/// What a drive with cuts in it came to.
#[derive(Clone, Copy, Debug, Default)]
struct Figures {
    /// How many operations of the flash the drive without cuts took.
    operations: u64,
    cuts: u64,
    /// Cuts in the start that followed a cut.
    cuts_while_starting: u64,
    /// How often the snapshot that was being stored was there after the cut, and how often the one before.
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
            cuts_while_starting: self.cuts_while_starting + other.cuts_while_starting,
            newest: self.newest + other.newest,
            before: self.before + other.before,
            none: self.none + other.none,
        }
    }
}

/// A start of the robot: the store is looked through, and the start is counted.
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

/// One storing of a snapshot: what the store was before, how many operations it takes, and which snapshot it is.
struct Step<const W: usize, const E: usize> {
    store: Store<FlashModel<W, E>>,
    operations: std::ops::Range<u64>,
    index: usize,
}

impl<const W: usize, const E: usize> Step<W, E> {
    /// Cuts the power in every operation of the step. The flash is taken out of a copy of the store and put back by a start.
    fn cut_everywhere(&self, snapshots: &[Vec<u8>], range: &std::ops::Range<u32>) -> Figures {
        let mut figures = Figures { operations: self.operations.end - self.operations.start, ..Figures::default() };
        for operation in self.operations.clone() {
            let tears = tears(operation);
            for turn in 0..tears.len() {
                let tear = tears[(turn + operation as usize) % tears.len()];
                figures.cuts += 1;
                let flash = self.until(Cut { operation, tear }, &snapshots[self.index]);
                self.check(flash.clone(), snapshots, range, &mut figures);
                if turn == 0 && operation % 2 == 0 {
                    self.cut_while_starting(&flash, snapshots, range, &mut figures);
                }
            }
        }
        figures
    }

    /// The flash, with power again, after a cut in the middle of storing.
    fn until(&self, cut: Cut, snapshot: &[u8]) -> FlashModel<W, E> {
        let mut store = self.store.clone();
        store.flash_mut().cut_power(Some(cut));
        assert!(matches!(store.save(snapshot), Err(StoreError::Flash(_))), "{cut:?}");
        let mut flash = store.release();
        assert!(flash.is_off(), "{cut:?}");
        flash.power_on();
        flash
    }

    /// After a cut the store has the snapshot that was being stored or the one before, and takes the next.
    fn check(
        &self,
        flash: FlashModel<W, E>,
        snapshots: &[Vec<u8>],
        range: &std::ops::Range<u32>,
        figures: &mut Figures,
    ) {
        let starts = self.store.starts();
        let mut store = start(flash, range.clone()).unwrap();
        assert!(store.starts() > starts, "starts are counted on");
        let found = newest(&mut store);
        let before = self.index.checked_sub(1).map(|before| &snapshots[before]);
        if found.as_ref() == Some(&snapshots[self.index]) {
            figures.newest += 1;
        } else if found.is_some() && found.as_ref() == before {
            figures.before += 1;
        } else {
            assert!(found.is_none() && before.is_none(), "snapshot {} and what was before are lost", self.index);
            figures.none += 1;
        }
        let next = &snapshots[(self.index + 1) % snapshots.len()];
        store.save(next).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(next));
        let mut store = start(store.release(), range.clone()).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(next));
    }

    /// Cuts the power again in every operation of the start.
    fn cut_while_starting(
        &self,
        flash: &FlashModel<W, E>,
        snapshots: &[Vec<u8>],
        range: &std::ops::Range<u32>,
        figures: &mut Figures,
    ) {
        let first = flash.operations();
        let last = start(flash.clone(), range.clone()).unwrap().release().operations();
        for operation in first..last {
            let tear = tears(operation)[operation as usize % 5];
            let mut cut = flash.clone();
            cut.cut_power(Some(Cut { operation, tear }));
            let begun = Store::mount(&mut cut, range.clone()).and_then(|mut store| store.count_start());
            assert!(matches!(begun, Err(StoreError::Flash(_))));
            cut.power_on();
            figures.cuts_while_starting += 1;
            let mut ignored = Figures::default();
            self.check(cut, snapshots, range, &mut ignored);
        }
    }
}

fn cut_a_drive<const W: usize, const E: usize>(flash: FlashModel<W, E>, snapshots: &[Vec<u8>]) -> (Figures, Vec<u32>) {
    let range = 0..(flash.erases().len() * E) as u32;
    let mut store = start(flash, range.clone()).unwrap();
    let mut steps = Vec::new();
    for (index, snapshot) in snapshots.iter().enumerate() {
        let before = store.clone();
        let first = store.flash_mut().operations();
        store.save(snapshot).unwrap();
        assert_eq!(newest(&mut store).as_ref(), Some(snapshot));
        let operations = first..store.flash_mut().operations();
        steps.push(Step { store: before, operations, index });
        if index % 4 == 3 {
            store = start(store.release(), range.clone()).unwrap();
        }
    }
    let erases = store.release().erases().to_vec();
    let figures =
        steps.par_iter().map(|step| step.cut_everywhere(snapshots, &range)).reduce(Figures::default, |a, b| a + b);
    (figures, erases)
}

#[test]
fn a_power_cut_in_any_operation_loses_at_most_the_newest_snapshot_in_pages_of_4_kib() {
    let snapshots = snapshots(0, 36, 14);
    let (figures, erases) = cut_a_drive(Pages::new(8), &snapshots);
    println!("8 pages of 4 KiB, words of 4 bytes: {figures:?}; erases {erases:?}");
    assert!(figures.none > 0 && figures.newest > 0 && figures.before > figures.newest);
    assert!(erases.iter().all(|&erases| erases >= 2), "every page is erased: {erases:?}");
}

#[test]
fn a_power_cut_in_any_operation_loses_at_most_the_newest_snapshot_in_sectors_of_128_kib() {
    let snapshots = snapshots(440, 44, 10);
    let (figures, erases) = cut_a_drive(Sectors::new(2).rewritable(), &snapshots);
    println!("2 sectors of 128 KiB, words of 1 byte: {figures:?}; erases {erases:?}");
    assert!(figures.none > 0 && figures.newest > 0 && figures.before > figures.newest);
    assert!(erases.iter().all(|&erases| erases >= 1), "every sector is erased: {erases:?}");
}
