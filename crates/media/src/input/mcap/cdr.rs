//! What a message's bytes say, field by field: CDR as ROS 2 writes it, and the plain form of ROS 1.

/// Reads the fields of one message in order; nothing that is read is taken on trust.
#[derive(Debug, Clone)]
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    /// Where the fields begin: alignment counts from there.
    origin: usize,
    at: usize,
    big_endian: bool,
    form: Form,
}

/// How fields are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Numbers stand at multiples of their size, texts end with a zero.
    Ros2,
    /// Nothing between the fields, and a sequence number in each header.
    Ros1,
}

impl<'a> Reader<'a> {
    /// Of a message in this form; `None` for CDR whose first four bytes do not say so.
    pub fn new(bytes: &'a [u8], form: Form) -> Option<Self> {
        if form == Form::Ros1 {
            return Some(Self { bytes, origin: 0, at: 0, big_endian: false, form });
        }
        let big_endian = match bytes.get(..2)? {
            [0, 0] => true,
            [0, 1] => false,
            _ => return None,
        };
        bytes.get(2..4)?;
        Some(Self { bytes, origin: 4, at: 4, big_endian, form })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        if self.form == Form::Ros2 {
            self.at = self.origin + (self.at - self.origin).next_multiple_of(N);
        }
        let mut bytes: [u8; N] = self.take(N)?.try_into().ok()?;
        if self.big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.number::<1>().map(u8::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn i32(&mut self) -> Option<i32> {
        self.number().map(i32::from_le_bytes)
    }

    /// Bytes behind their number.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let count = self.u32()?;
        self.take(usize::try_from(count).ok()?)
    }

    pub fn text(&mut self) -> Option<&'a str> {
        let bytes = self.bytes()?;
        std::str::from_utf8(bytes).ok().map(|text| text.trim_end_matches('\0'))
    }

    /// The time of a `std_msgs/Header` in nanoseconds; the name of its frame, which may be in any script, is passed over.
    pub fn header(&mut self) -> Option<i64> {
        if self.form == Form::Ros1 {
            self.u32()?;
        }
        let stamp_ns = self.time()?;
        self.bytes()?;
        Some(stamp_ns)
    }

    /// A time in nanoseconds: seconds as floating-point numbers would be off by a quarter of a microsecond.
    pub fn time(&mut self) -> Option<i64> {
        let (seconds, nanoseconds) = (self.i32()?, self.u32()?);
        Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let bytes = [0, 1, 0, 0, 7, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, b'a', 0];
        let mut reader = Reader::new(&bytes, Form::Ros2).unwrap();
        assert_eq!((reader.u8(), reader.u32(), reader.text()), (Some(7), Some(3), Some("a")));
        assert_eq!(reader.u8(), None, "there is no more");
        let big = [0, 0, 0, 0, 0, 0, 0, 5];
        assert_eq!(Reader::new(&big, Form::Ros2).unwrap().u32(), Some(5));
        assert!(Reader::new(&[9, 9, 0, 0], Form::Ros2).is_none() && Reader::new(&[0, 1], Form::Ros2).is_none());
    }

    #[test]
    fn headers_of_both_forms_are_read() {
        let ros2 = [0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0];
        assert_eq!(Reader::new(&ros2, Form::Ros2).unwrap().header(), Some(2_000_000_000));
        let ros1 = [9, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(Reader::new(&ros1, Form::Ros1).unwrap().header(), Some(2_000_000_000));
    }

    proptest! {
        #[test]
        fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..200), ros1 in any::<bool>()) {
            if let Some(mut reader) = Reader::new(&bytes, if ros1 { Form::Ros1 } else { Form::Ros2 }) {
                while reader.header().is_some() && reader.bytes().is_some() {}
            }
        }
    }
}
