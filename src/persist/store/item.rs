//! The items in a half of the store: pieces of snapshots, end marks, and counts of starts.

/// The largest item.
pub(super) const ITEM_BYTES: usize = 256;
/// The tag, the number and the index of a piece.
const PIECE_HEADER_BYTES: usize = 7;
/// Bytes of a snapshot in a piece; the last piece may hold fewer.
pub(super) const PIECE_BYTES: usize = ITEM_BYTES - PIECE_HEADER_BYTES;

const PIECE: u8 = 1;
const END: u8 = 2;
const STARTS: u8 = 3;

/// An item. All items of one snapshot share its serial number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item<'a> {
    /// A piece of a snapshot.
    Piece { serial: u32, index: u16, bytes: &'a [u8] },
    /// Marks a snapshot as complete.
    End { serial: u32, pieces: u16, length: u32 },
    /// The number of starts of the robot.
    Starts { serial: u32, starts: u32 },
}

/// A packed item, aligned for flashes that need it.
#[repr(align(4))]
pub(super) struct Packed(pub(super) [u8; ITEM_BYTES]);

impl<'a> Item<'a> {
    pub(super) const fn serial(&self) -> u32 {
        match *self {
            Self::Piece { serial, .. } | Self::End { serial, .. } | Self::Starts { serial, .. } => serial,
        }
    }

    /// The length of the packed item in bytes.
    pub(super) const fn length(&self) -> usize {
        match self {
            Self::Piece { bytes, .. } => PIECE_HEADER_BYTES + bytes.len(),
            Self::End { .. } => 11,
            Self::Starts { .. } => 9,
        }
    }

    /// Packs the item; returns its length in bytes.
    #[inline(never)]
    pub(super) fn pack(&self, to: &mut Packed) -> usize {
        let serial = self.serial().to_le_bytes();
        let mut length = 0;
        let mut put = |bytes: &[u8]| {
            to.0.iter_mut().skip(length).zip(bytes).for_each(|(to, &byte)| *to = byte);
            length += bytes.len();
        };
        match *self {
            Self::Piece { index, bytes, .. } => {
                put(&[PIECE]);
                put(&serial);
                put(&index.to_le_bytes());
                put(bytes);
            }
            Self::End { pieces, length, .. } => {
                put(&[END]);
                put(&serial);
                put(&pieces.to_le_bytes());
                put(&length.to_le_bytes());
            }
            Self::Starts { starts, .. } => {
                put(&[STARTS]);
                put(&serial);
                put(&starts.to_le_bytes());
            }
        }
        length.min(ITEM_BYTES)
    }

    /// Unpacks an item; `None` if the bytes are not a valid item.
    #[inline(never)]
    pub(super) fn unpack(bytes: &'a [u8]) -> Option<Self> {
        let (&tag, rest) = bytes.split_first()?;
        let (serial, rest) = rest.split_first_chunk()?;
        let serial = u32::from_le_bytes(*serial);
        match tag {
            PIECE => {
                let (index, bytes) = rest.split_first_chunk()?;
                Some(Self::Piece { serial, index: u16::from_le_bytes(*index), bytes })
            }
            END => {
                let (pieces, rest) = rest.split_first_chunk()?;
                let (length, _) = rest.split_first_chunk()?;
                Some(Self::End { serial, pieces: u16::from_le_bytes(*pieces), length: u32::from_le_bytes(*length) })
            }
            STARTS => {
                let (starts, _) = rest.split_first_chunk()?;
                Some(Self::Starts { serial, starts: u32::from_le_bytes(*starts) })
            }
            _ => None,
        }
    }
}

/// Tracks the pieces of a snapshot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Assembly {
    serial: u32,
    pieces: u16,
    length: usize,
    is_whole: bool,
}

impl Assembly {
    pub(super) const NONE: Self = Self { serial: 0, pieces: 0, length: 0, is_whole: false };

    /// Processes the next item; returns number and length of a snapshot that it completes.
    #[inline(never)]
    pub(super) fn take(&mut self, item: &Item<'_>) -> Option<(u32, usize)> {
        match *item {
            Item::Piece { serial, index, bytes } => {
                if index == 0 {
                    *self = Self { serial, pieces: 0, length: 0, is_whole: true };
                }
                // Only the last piece is shorter.
                let is_next = serial == self.serial && index == self.pieces;
                self.is_whole &= is_next && self.length == usize::from(index) * PIECE_BYTES;
                self.pieces = self.pieces.saturating_add(1);
                self.length += bytes.len();
                None
            }
            Item::End { serial, pieces, length } => {
                let is_complete =
                    self.is_whole && (serial, pieces, length as usize) == (self.serial, self.pieces, self.length);
                // An empty snapshot has no pieces.
                let is_empty = pieces == 0 && length == 0;
                let length = self.length;
                *self = Self::NONE;
                match (is_complete, is_empty) {
                    (true, _) => Some((serial, length)),
                    (_, true) => Some((serial, 0)),
                    _ => None,
                }
            }
            Item::Starts { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_items_unpack_unchanged() {
        let bytes = [7; PIECE_BYTES];
        for item in [
            Item::Piece { serial: 1, index: 2, bytes: &bytes },
            Item::Piece { serial: 1, index: 2, bytes: &[] },
            Item::End { serial: u32::MAX, pieces: u16::MAX, length: 9 },
            Item::Starts { serial: 3, starts: 4 },
        ] {
            let mut packed = Packed([0; ITEM_BYTES]);
            let length = item.pack(&mut packed);
            assert_eq!(length, item.length());
            assert_eq!(Item::unpack(&packed.0[..length]), Some(item));
            assert_eq!(Item::unpack(&packed.0[..4]), None);
        }
        assert_eq!(Item::unpack(&[9; 20]), None);
        assert_eq!(Item::unpack(&[]), None);
    }

    #[test]
    fn a_snapshot_needs_all_pieces_in_order() {
        let bytes = [7; PIECE_BYTES];
        let piece = |serial, index| Item::Piece { serial, index, bytes: &bytes };
        let last = Item::Piece { serial: 5, index: 2, bytes: &bytes[..3] };
        let end = Item::End { serial: 5, pieces: 3, length: 2 * PIECE_BYTES as u32 + 3 };
        let completed = |items: &[Item<'_>]| {
            let mut assembly = Assembly::NONE;
            items.iter().filter_map(|item| assembly.take(item)).collect::<Vec<_>>()
        };
        let whole = [piece(5, 0), piece(5, 1), last, end];
        assert_eq!(completed(&whole), [(5, 2 * PIECE_BYTES + 3)]);
        for missing in 0..whole.len() {
            let items: Vec<_> = (0..whole.len()).filter(|&index| index != missing).map(|index| whole[index]).collect();
            assert_eq!(completed(&items), [], "{missing}");
        }
        // Pieces of an earlier snapshot and counts of starts in between are ignored.
        let starts = Item::Starts { serial: 5, starts: 1 };
        let after_a_cut = [piece(4, 0), piece(4, 1), starts, piece(5, 0), piece(5, 1), starts, last, end];
        assert_eq!(completed(&after_a_cut), [(5, 2 * PIECE_BYTES + 3)]);
        assert_eq!(completed(&[piece(4, 0), piece(5, 1), last, end]), []);
        assert_eq!(completed(&[end, end]), []);
    }
}
