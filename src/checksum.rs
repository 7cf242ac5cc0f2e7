//! The CRC of frames, maps and snapshots.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32 ISO-HDLC, the one of zlib and Ethernet. Its table takes 1 KiB of flash.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
