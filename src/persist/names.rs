//! The names of vertices in a snapshot. A snapshot without names has no such section.

use super::snapshot::{NAMES_SECTION, Reader, Snapshot, SnapshotError, Writer};
use crate::wire::{Name, Names};

impl<const V: usize> Names<V> {
    /// Writes the section. The section of the filter follows, because it uses all the remaining room.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room.
    pub fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.section(NAMES_SECTION, |section| {
            section.u8(self.iter().count() as u8)?;
            for (vertex, name) in self.iter() {
                section.u8(vertex)?;
                section.u8(name.as_bytes().len() as u8)?;
                section.bytes(name.as_bytes())?;
            }
            Ok(())
        })
    }

    /// Checks that [`Names::restore`] accepts a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError`] if the section is invalid.
    pub fn check(snapshot: &Snapshot<'_>) -> Result<(), SnapshotError> {
        Self::new().read(snapshot)
    }

    /// Replaces all names by those of a snapshot. Names of vertices from `vertices` on are dropped.
    ///
    /// # Errors
    /// As [`Names::check`]; there are no names then.
    pub fn restore(&mut self, snapshot: &Snapshot<'_>, vertices: usize) -> Result<(), SnapshotError> {
        let read = self.read(snapshot);
        if read.is_err() {
            self.clear();
        }
        self.truncate(vertices);
        read
    }

    fn read(&mut self, snapshot: &Snapshot<'_>) -> Result<(), SnapshotError> {
        self.clear();
        let Some(mut section) = snapshot.section(NAMES_SECTION) else { return Ok(()) };
        for _ in 0..section.u8()? {
            self.read_name(&mut section)?;
        }
        section.finish()
    }

    fn read_name(&mut self, section: &mut Reader<'_>) -> Result<(), SnapshotError> {
        let (vertex, length) = (section.u8()?, section.u8()?);
        let text = core::str::from_utf8(section.bytes(length.into())?).map_err(|_| SnapshotError::Contents)?;
        let name = Name::new(text).map_err(|_| SnapshotError::Contents)?;
        if usize::from(vertex) >= V || !self.get(vertex).is_none() {
            return Err(SnapshotError::Contents);
        }
        self.set(vertex, name).map_err(|_| SnapshotError::Contents)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn restored(contents: &[u8]) -> Result<Names<4>, SnapshotError> {
        let mut buffer = [0; 128];
        let mut writer = Writer::new(&mut buffer)?;
        writer.section(NAMES_SECTION, |section| section.bytes(contents))?;
        let length = writer.finish()?;
        let snapshot = Snapshot::open(&buffer[..length])?;
        let mut names = Names::new();
        assert_eq!(names.restore(&snapshot, 4), Names::<4>::check(&snapshot));
        Names::<4>::check(&snapshot).map(|()| names)
    }

    #[test]
    fn names_are_restored_and_replace_the_earlier_ones() {
        let mut names = Names::<4>::new();
        names.set(1, Name::new("hall").unwrap()).unwrap();
        names.set(3, Name::new("Küche").unwrap()).unwrap();
        let mut buffer = [0; 128];
        let mut writer = Writer::new(&mut buffer).unwrap();
        names.save(&mut writer).unwrap();
        let length = writer.finish().unwrap();
        let mut restored = Names::<4>::new();
        restored.set(0, Name::new("Küche").unwrap()).unwrap();
        let snapshot = Snapshot::open(&buffer[..length]).unwrap();
        restored.restore(&snapshot, 4).unwrap();
        assert_eq!(restored, names);
        restored.restore(&snapshot, 3).unwrap();
        assert_eq!((restored.find("hall"), restored.find("Küche")), (Some(1), None), "beyond the map");
    }

    #[test]
    fn a_snapshot_without_names_clears_them() {
        let mut buffer = [0; 32];
        let length = Writer::new(&mut buffer).unwrap().finish().unwrap();
        let mut names = Names::<4>::new();
        names.set(1, Name::new("hall").unwrap()).unwrap();
        names.restore(&Snapshot::open(&buffer[..length]).unwrap(), 4).unwrap();
        assert_eq!(names, Names::new());
    }

    #[test]
    fn invalid_sections_are_refused() {
        assert_eq!(restored(&[1, 3, 1, b'a']).unwrap().find("a"), Some(3));
        for (contents, why) in [
            (&[1, 4, 1, b'a'][..], "no such vertex"),
            (&[1, 0, 0], "an empty name"),
            (&[1, 0, 1, b'7'], "a number"),
            (&[1, 0, 1, 0xFF], "not UTF-8"),
            (&[2, 0, 1, b'a', 1, 1, b'a'], "a name twice"),
            (&[2, 0, 1, b'a', 0, 1, b'b'], "a vertex twice"),
            (&[1, 0, 1, b'a', 0], "bytes behind"),
        ] {
            assert_eq!(restored(contents), Err(SnapshotError::Contents), "{why}");
        }
        assert_eq!(restored(&[1, 0, 2, b'a']), Err(SnapshotError::TooShort));
    }
}
