//! `docs/snapshot.md` is the specification: this test reads snapshots by its tables alone.

use super::*;
use std::collections::HashMap;
use toposlam::Filter;
use toposlam::persist::snapshot::SNAPSHOT_VERSION;
use toposlam::reference;

const SPECIFICATION: &str = include_str!("../../../docs/snapshot.md");

struct Field {
    name: &'static str,
    kind: &'static str,
    count: &'static str,
}

/// The tables of fields, by their headings.
fn tables() -> HashMap<&'static str, Vec<Field>> {
    let sections = SPECIFICATION.split("\n### ").skip(1);
    let fields = |section: &'static str| {
        let rows = section.lines().filter(|line| line.starts_with("| "));
        rows.map(|row| row.split('|').map(str::trim).collect::<Vec<_>>())
            .filter(|cells| cells.len() == 6 && cells[1] != "Field")
            .map(|cells| Field { name: cells[1], kind: cells[2], count: cells[3] })
            .collect()
    };
    sections.map(|section| (section.lines().next().unwrap(), fields(section))).collect()
}

struct Interpreter<'a> {
    tables: &'a HashMap<&'static str, Vec<Field>>,
    bytes: &'a [u8],
    values: HashMap<&'static str, u64>,
}

impl Interpreter<'_> {
    fn count(&self, text: &str) -> u64 {
        let factor = |name: &str| name.parse().unwrap_or_else(|_| self.values[name]);
        text.split(" × ").map(factor).product()
    }

    fn number(&mut self, bytes: usize) -> u64 {
        let (read, rest) = self.bytes.split_at(bytes);
        self.bytes = rest;
        read.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
    }

    fn read(&mut self, table: &str) {
        for Field { name, kind, count } in &self.tables[table] {
            let count = self.count(count);
            let is_narrow = self.values.get("V").is_some_and(|&vertices| vertices <= 16);
            if *kind == "path" {
                let bytes = if is_narrow { count.div_ceil(2) } else { count };
                self.bytes = &self.bytes[bytes as usize..];
                continue;
            }
            for _ in 0..count {
                let bytes = match *kind {
                    "u8" => 1,
                    "u16" => 2,
                    "u32" | "f32" => 4,
                    "u64" => 8,
                    "row" if is_narrow => 2,
                    "row" => 4,
                    table => {
                        self.read(table);
                        continue;
                    }
                };
                let number = self.number(bytes);
                self.values.insert(name, number);
            }
        }
    }
}

fn check<const N: usize, const V: usize, const T: usize>(drive: &Drive) {
    let tables = tables();
    let mut filter = drive.start::<N, V, T>();
    for index in 0..drive.observations.len() {
        if index % 3 == 0 {
            let snapshot = saved(&mut filter, RobustFilter::<N, V, T>::SNAPSHOT_BYTES).unwrap();
            let bytes = contents(&snapshot);
            let mut interpreter = Interpreter { tables: &tables, bytes: &bytes, values: HashMap::new() };
            interpreter.read("Robust filter");
            assert!(interpreter.bytes.is_empty(), "{} {index}: {} left", drive.name, interpreter.bytes.len());
            let value = |name| interpreter.values[name];
            assert_eq!((value("kind"), value("V"), value("HISTORY")), (1, V as u64, T as u64));
            assert_eq!((value("seed"), value("observed")), (7, u64::from(filter.observed())));
            assert_eq!(value("places"), filter.path().count() as u64);
            assert_eq!(value("vertices"), filter.map().vertices().len() as u64);
            assert_eq!(value("map_probability"), u64::from(filter.map_probability_q16()));
            let scale = f32::from_bits(value("scale") as u32);
            assert!(
                (f64::from(filter.noise_mm()) / 2.0).mul_add(f64::from(filter.noise_mm()), -f64::from(scale)).abs()
                    < 0.1
            );
        }
        drive.step(&mut filter, index);
    }
}

#[test]
fn snapshots_of_the_ordered_filter_match_the_tables() {
    type Small = toposlam::OrderedFilter<6, 16, 60, 40>;
    let tables = tables();
    let mut filter = ordered::started::<6, 16, 60, 40>();
    for (index, observation) in ordered::walk(60, 5).into_iter().enumerate() {
        filter.observe(observation);
        filter.refine();
        if index % 3 > 0 {
            continue;
        }
        let bytes = contents(&ordered::saved(&mut filter, Small::SNAPSHOT_BYTES).unwrap());
        let mut interpreter = Interpreter { tables: &tables, bytes: &bytes, values: HashMap::new() };
        interpreter.read("Ordered filter");
        assert!(interpreter.bytes.is_empty(), "{index}: {} left", interpreter.bytes.len());
        let value = |name| interpreter.values[name];
        assert_eq!((value("kind"), value("V"), value("D"), value("T")), (3, 16, 60, 40));
        assert_eq!((value("seed"), value("observed")), (7, u64::from(filter.observed())));
        assert_eq!(value("places"), filter.path().len() as u64);
        assert_eq!(value("vertices"), filter.map().vertices().len() as u64);
        assert_eq!(value("map_probability"), u64::from(filter.map_probability_q16()));
        assert_eq!(f32::from_bits(value("noise_steps") as u32) * 2.0, filter.noise_mm());
    }
}

#[test]
fn snapshots_of_the_paper_s_filter_match_the_tables() {
    let tables = tables();
    let mut filter = paper::started();
    for observation in paper::walks()[0].iter().copied() {
        filter.observe(observation);
        let bytes = contents(&paper::saved(&mut filter, paper::ROOM).unwrap());
        let mut interpreter = Interpreter { tables: &tables, bytes: &bytes, values: HashMap::new() };
        interpreter.read("Paper's filter");
        assert!(interpreter.bytes.is_empty(), "{} left", interpreter.bytes.len());
        let value = |name| interpreter.values[name];
        assert_eq!((value("kind"), value("V"), value("HISTORY")), (2, 12, 32));
        assert_eq!(
            (value("observed"), value("particles")),
            (u64::from(filter.observed()), filter.particles().len() as u64)
        );
    }
}

#[test]
fn a_snapshot_of_another_version_is_refused() {
    let mut filter = ordered::started::<3, 8, 30, 16>();
    filter.observe(Fingerprint::from_steps(500).unwrap());
    let mut snapshot = ordered::saved(&mut filter, 10_000).unwrap();
    snapshot[4..6].copy_from_slice(&1_u16.to_le_bytes());
    let end = snapshot.len() - 4;
    let crc = toposlam::wire::crc32(&snapshot[..end]);
    snapshot[end..].copy_from_slice(&crc.to_le_bytes());
    let error = Snapshot::open(&snapshot).unwrap_err();
    assert_eq!(error, SnapshotError::Version { found: 1 });
    assert_eq!(error.to_string(), "the snapshot has version 1, not 3");
}

#[test]
fn snapshots_of_the_robust_filter_match_the_tables() {
    for drive in drives(60) {
        check::<4, 12, 24>(&drive);
        check::<3, 20, 16>(&drive);
    }
}

#[test]
fn the_specification_states_the_version_and_the_largest_snapshot() {
    for sentence in [
        format!("The snapshot version is {SNAPSHOT_VERSION}."),
        format!("{} bytes for the reference robot", reference::ordered::Filter::SNAPSHOT_BYTES),
        format!("{} bytes with the robust filter", reference::robust::Filter::SNAPSHOT_BYTES),
        format!("{} bytes with\nthe paper's", reference::paper::Filter::SNAPSHOT_BYTES),
    ] {
        assert!(SPECIFICATION.contains(&sentence), "{sentence}");
    }
}
