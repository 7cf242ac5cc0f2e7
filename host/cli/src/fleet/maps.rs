//! The merged maps of a fleet: one file per building, written by a thread of its own, so that no robot waits for a merge.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use anyhow::Context;
use toposlam_link::export;
use toposlam_link::layout::Layout;
use toposlam_link::merge::{Building, MergeError, buildings};
use toposlam_link::plural::count;
use toposlam_link::topology::TopologicalMap;

use super::Fleet;
use crate::output;

/// Keeps the merged maps of a fleet in a directory.
pub struct Maps {
    /// The digest of each robot's map that was merged last.
    digests: BTreeMap<usize, u32>,
    /// Every map of a robot that has converged once.
    maps: BTreeMap<usize, TopologicalMap>,
    sender: SyncSender<Vec<(usize, TopologicalMap)>>,
    writer: JoinHandle<anyhow::Result<Vec<String>>>,
}

impl Maps {
    /// Keeps the maps of robots with these names in a directory, which is created.
    ///
    /// # Errors
    /// If the directory cannot be created, or has files and `force` is not given.
    pub fn start(directory: &Path, names: Vec<String>, force: bool) -> anyhow::Result<Self> {
        output::check_directory(directory, force)?;
        std::fs::create_dir_all(directory).with_context(|| format!("creating {}", directory.display()))?;
        let (sender, received) = sync_channel(1);
        let directory = directory.to_owned();
        let writer = thread::spawn(move || write(&directory, &names, &received));
        Ok(Self { digests: BTreeMap::new(), maps: BTreeMap::new(), sender, writer })
    }

    /// Takes the complete maps of a fleet, and merges them if one has changed. While earlier maps are being merged, the
    /// changes wait for the next call.
    pub fn update(&mut self, fleet: &Fleet) {
        if !self.collect(fleet) {
            return;
        }
        let digests = self.maps.iter().map(|(robot, map)| (*robot, map.digest())).collect();
        match self.sender.try_send(self.all()) {
            Ok(()) => self.digests = digests,
            // The writer has failed; `finish` says why.
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
        }
    }

    /// Merges the newest maps and writes the files. Returns a line of text for each building.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(mut self, fleet: &Fleet) -> anyhow::Result<Vec<String>> {
        self.collect(fleet);
        // Without a receiver the writer has failed.
        let _ = self.sender.send(self.all());
        drop(self.sender);
        self.writer.join().unwrap_or_else(|_| Err(anyhow::anyhow!("merging the maps failed")))
    }

    /// Takes every complete map; returns whether one has changed since the last merge.
    fn collect(&mut self, fleet: &Fleet) -> bool {
        for (number, robot) in fleet.robots().iter().enumerate() {
            if robot.is_converged() && robot.listener().replica().is_complete() {
                self.maps.insert(number, robot.listener().map());
            }
        }
        self.maps.iter().any(|(robot, map)| self.digests.get(robot) != Some(&map.digest()))
    }

    fn all(&self) -> Vec<(usize, TopologicalMap)> {
        self.maps.iter().map(|(robot, map)| (*robot, map.clone())).collect()
    }
}

/// Merges and writes the maps that are received, until there are no more. Returns the text for the last ones.
fn write(
    directory: &Path,
    names: &[String],
    received: &Receiver<Vec<(usize, TopologicalMap)>>,
) -> anyhow::Result<Vec<String>> {
    let mut texts = Vec::new();
    let mut written = 0;
    for maps in received {
        let buildings = buildings(&maps);
        texts.clear();
        for (number, building) in buildings.iter().enumerate() {
            let mut layout = Layout::new();
            layout.arrange(&building.map);
            // The location of a robot is not part of a building.
            output::write_file(&file(directory, number), export::json(&building.map, &layout, None), true)?;
            texts.push(text(number, building, names));
        }
        for number in buildings.len()..written {
            std::fs::remove_file(file(directory, number)).context("removing a merged map")?;
        }
        written = buildings.len();
    }
    Ok(texts)
}

/// The file of a building.
fn file(directory: &Path, number: usize) -> PathBuf {
    directory.join(format!("building-{}.json", number + 1))
}

fn text(number: usize, building: &Building, names: &[String]) -> String {
    let robots: Vec<&str> = building.robots.iter().filter_map(|&robot| names.get(robot).map(String::as_str)).collect();
    let vertices = count(building.map.vertices.len(), "vertex", "vertices");
    let mut text = format!("building {}: {vertices}, from {}", number + 1, robots.join(", "));
    let uncertain = building.refused.iter().filter_map(|(other, error)| match error {
        MergeError::Uncertain(doubt, _) => Some(format!("{}: {doubt}", other + 1)),
        _ => None,
    });
    // The nearest ones suffice for a person.
    let uncertain: Vec<String> = uncertain.take(3).collect();
    if !uncertain.is_empty() {
        text += &format!("; not merged with building {}", uncertain.join("; "));
    }
    text
}
