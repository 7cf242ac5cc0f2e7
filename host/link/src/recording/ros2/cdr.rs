//! ROS 2 messages in CDR, the encoding of DDS: little-endian, each number aligned to its size after the header.

/// The header: CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// The bytes of a message.
pub(super) struct Cdr(Vec<u8>);

macro_rules! numbers {
    ($($name:ident: $type:ty;)*) => {
        $(
            pub(super) fn $name(&mut self, value: $type) -> &mut Self {
                self.aligned(&value.to_le_bytes())
            }
        )*
    };
}

impl Cdr {
    pub(super) fn new() -> Self {
        Self(HEADER.to_vec())
    }

    numbers! {
        u8: u8;
        u32: u32;
        i32: i32;
        f32: f32;
        f64: f64;
    }

    fn aligned(&mut self, bytes: &[u8]) -> &mut Self {
        let written = self.0.len() - HEADER.len();
        let padding = written.next_multiple_of(bytes.len()) - written;
        self.0.resize(self.0.len() + padding, 0);
        self.0.extend_from_slice(bytes);
        self
    }

    /// The length of a sequence; its elements follow.
    pub(super) fn length(&mut self, length: usize) -> &mut Self {
        self.u32(u32::try_from(length).unwrap_or(u32::MAX))
    }

    /// A string with its terminating zero.
    pub(super) fn string(&mut self, text: &str) -> &mut Self {
        self.length(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
        self
    }

    pub(super) fn sequence<T>(&mut self, items: &[T], mut write: impl FnMut(&mut Self, &T)) -> &mut Self {
        self.length(items.len());
        items.iter().for_each(|item| write(self, item));
        self
    }

    /// `std_msgs/Header`.
    pub(super) fn header(&mut self, time_ns: u64, frame: &str) -> &mut Self {
        let seconds = i32::try_from(time_ns / 1_000_000_000).unwrap_or(i32::MAX);
        self.i32(seconds).u32((time_ns % 1_000_000_000) as u32).string(frame)
    }

    pub(super) fn finish(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_to_their_size_after_the_header() {
        let bytes = Cdr::new().u8(7).f64(1.0).u8(8).u32(9).string("ab").u8(1).finish();
        let expected: [&[u8]; 7] = [
            &[0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0],
            &1_f64.to_le_bytes(),
            &[8, 0, 0, 0],
            &[9, 0, 0, 0],
            &[3, 0, 0, 0],
            b"ab\0",
            &[1],
        ];
        assert_eq!(bytes, expected.concat());
    }
}
