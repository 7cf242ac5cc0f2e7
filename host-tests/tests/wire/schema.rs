//! The schema: a description of all messages and requests, taken from the types themselves by a serde serializer.

use super::samples::{requests, typical};
use serde::ser::{self, Serialize};
use toposlam::wire::{Decoder, Message, Payload, Progress, Request, SCHEMA_HASH};

/// One line for each message, reply and command: its number, its name, and the names and types of its fields.
pub(crate) fn description() -> String {
    let messages = typical().into_iter().map(|message| describe(&message));
    messages.chain(requests().iter().map(describe)).map(|line| line + "\n").collect()
}

/// FNV-1a, 64 bit.
pub(crate) fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

#[test]
fn the_schema_hash_matches_the_types() {
    let description = description();
    let hash = fnv1a(&description);
    assert_eq!(
        SCHEMA_HASH, hash,
        "the messages have changed and must be append-only: raise PROTOCOL_VERSION, set SCHEMA_HASH to {hash:#018X}:\n{description}"
    );
}

#[test]
fn the_samples_cover_every_message_in_the_order_of_numbers() {
    let expected = [
        "Hello",
        "Place",
        "Map",
        "Vertex",
        "Edge",
        "Location",
        "Evidence",
        "Row",
        "Fault",
        "Health",
        "Ring",
        "Belief",
        "Remapped",
        "Worst",
        "Reply",
        "Velocity",
        "GoalStatus",
        "Ways",
        "Exploration",
        "Name",
        "Named",
    ];
    let mut described: Vec<_> = typical().iter().map(describe).collect();
    described.dedup_by_key(|line| line.split(' ').next().map(str::to_owned));
    for (number, line) in described.iter().enumerate() {
        assert!(line.starts_with(&format!("{number} {}", expected[number])), "{line}");
    }
    assert_eq!(described.len(), expected.len());
    // A message or an outcome with the next number needs a sample.
    assert!(!is_known::<Message>(&[expected.len() as u8]));
    assert!(is_known::<Message>(&[14, 0, 4]) && !is_known::<Message>(&[14, 0, 5]));
}

#[test]
fn the_samples_cover_every_command_and_setting_in_the_order_of_numbers() {
    let expected = [
        "0 Info",
        "1 GetMap",
        "2 GetSnapshot",
        "3 RestoreBegin",
        "4 RestoreChunk",
        "5 RestoreCommit",
        "6 Reset",
        "7 SetConfig(0 NoiseMm",
        "7 SetConfig(1 Hypotheses",
        "7 SetConfig(2 Moves",
        "7 SetConfig(3 WrongTurnPermille",
        "7 SetConfig(4 WrongDegreePermille",
        "7 SetConfig(5 EquidistanceMm",
        "7 SetConfig(6 LeaveMm",
        "7 SetConfig(7 SpeedPermille",
        "7 SetConfig(8 SnapshotEveryPlaces",
        "8 LocaliseOnly",
        "9 GoTo",
        "10 Explore",
        "11 Pause",
        "12 GetSettings",
        "13 Name",
    ];
    let described: Vec<_> = requests().iter().map(describe).collect();
    for (line, expected) in described.iter().zip(expected) {
        assert!(line.starts_with(&format!("Request {{ id: u16, command: {expected}")), "{line}");
    }
    assert_eq!(described.len(), expected.len());
    assert!(is_known::<Request>(&[0, 13]) && !is_known::<Request>(&[0, 14]));
    assert!(is_known::<Request>(&[0, 7, 8]) && !is_known::<Request>(&[0, 7, 9]));
}

/// Whether bytes begin a known message or request: zeros are a value of every type.
fn is_known<M: Payload>(begin: &[u8]) -> bool {
    (0..100).any(|zeros| {
        let mut body = vec![M::VERSION, 0, 0];
        body.extend(begin);
        body.resize(body.len() + zeros, 0);
        let mut decoder = Decoder::<M>::new();
        matches!(decoder.feed(&super::damage::with_crc(&body)), Progress::Message { .. })
    })
}

#[test]
fn a_renamed_or_moved_field_changes_the_description() {
    #[derive(Clone, Copy)]
    struct Pair(&'static str, &'static str);
    impl Serialize for Pair {
        fn serialize<S: ser::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            use ser::SerializeStruct;
            let mut fields = serializer.serialize_struct("Pair", 2)?;
            fields.serialize_field(self.0, &1u8)?;
            fields.serialize_field(self.1, &Some(2u16))?;
            fields.end()
        }
    }
    assert_eq!(describe(&Pair("a", "b")), "Pair { a: u8, b: Option<u16> }");
    assert_ne!(describe(&Pair("a", "b")), describe(&Pair("b", "a")));
}

fn describe(value: &impl Serialize) -> String {
    value.serialize(Describer).expect("every message can be described")
}

struct Describer;

/// The fields of a struct, or the elements of a sequence.
struct Fields {
    open: String,
    close: &'static str,
    fields: Vec<String>,
}

type Described = Result<String, std::fmt::Error>;

impl Fields {
    fn new(open: String, close: &'static str) -> Self {
        Self { open, close, fields: Vec::new() }
    }

    fn describe(self) -> Described {
        Ok(format!("{}{}{}", self.open, self.fields.join(", "), self.close))
    }

    fn element(&mut self, value: &(impl Serialize + ?Sized)) -> Result<(), std::fmt::Error> {
        self.fields.push(value.serialize(Describer)?);
        Ok(())
    }

    fn field(&mut self, name: &str, value: &(impl Serialize + ?Sized)) -> Result<(), std::fmt::Error> {
        self.fields.push(format!("{name}: {}", value.serialize(Describer)?));
        Ok(())
    }
}

/// A number is described by its type.
macro_rules! by_type {
    ($($method:ident: $type:ty,)*) => {
        $(fn $method(self, _: $type) -> Described { Ok(stringify!($type).to_owned()) })*
    };
}

/// The messages have no values of these types.
macro_rules! never {
    ($($method:ident($($type:ty),*) -> $result:ty,)*) => {
        $(fn $method(self, $(_: $type),*) -> $result { Err(std::fmt::Error) })*
    };
}

impl ser::Serializer for Describer {
    type Ok = String;
    type Error = std::fmt::Error;
    type SerializeSeq = Fields;
    type SerializeTuple = ser::Impossible<String, std::fmt::Error>;
    type SerializeTupleStruct = ser::Impossible<String, std::fmt::Error>;
    type SerializeTupleVariant = ser::Impossible<String, std::fmt::Error>;
    type SerializeMap = ser::Impossible<String, std::fmt::Error>;
    type SerializeStruct = Fields;
    type SerializeStructVariant = Fields;

    by_type! {
        serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64,
        serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_f32: f32,
        serialize_f64: f64, serialize_char: char,
    }

    never! {
        serialize_bytes(&[u8]) -> Described,
        serialize_unit() -> Described,
        serialize_unit_struct(&'static str) -> Described,
        serialize_tuple(usize) -> Result<Self::SerializeTuple, Self::Error>,
        serialize_tuple_struct(&'static str, usize) -> Result<Self::SerializeTupleStruct, Self::Error>,
        serialize_tuple_variant(&'static str, u32, &'static str, usize) -> Result<Self::SerializeTupleVariant, Self::Error>,
        serialize_map(Option<usize>) -> Result<Self::SerializeMap, Self::Error>,
    }

    fn serialize_unit_variant(self, _: &'static str, number: u32, name: &'static str) -> Described {
        Ok(format!("{number} {name}"))
    }

    fn serialize_str(self, _: &str) -> Described {
        Ok("str".to_owned())
    }

    fn serialize_none(self) -> Described {
        Ok("Option<_>".to_owned())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Described {
        Ok(format!("Option<{}>", value.serialize(Describer)?))
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, name: &'static str, value: &T) -> Described {
        Ok(format!("{name}({})", value.serialize(Describer)?))
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        number: u32,
        name: &'static str,
        value: &T,
    ) -> Described {
        Ok(format!("{number} {name}({})", value.serialize(Describer)?))
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Fields, Self::Error> {
        Ok(Fields::new("[".to_owned(), "]"))
    }

    fn serialize_struct(self, name: &'static str, _: usize) -> Result<Fields, Self::Error> {
        Ok(Fields::new(format!("{name} {{ "), " }"))
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        number: u32,
        name: &'static str,
        _: usize,
    ) -> Result<Fields, Self::Error> {
        Ok(Fields::new(format!("{number} {name} {{ "), " }"))
    }
}

impl ser::SerializeSeq for Fields {
    type Ok = String;
    type Error = std::fmt::Error;

    fn serialize_element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Self::Error> {
        self.element(value)
    }

    /// The elements of a sequence have one type, however many there are. One without missing values describes it.
    fn end(mut self) -> Described {
        self.fields = self.fields.into_iter().max_by_key(String::len).into_iter().collect();
        self.describe()
    }
}

impl ser::SerializeStruct for Fields {
    type Ok = String;
    type Error = std::fmt::Error;

    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Self::Error> {
        self.field(name, value)
    }

    fn end(self) -> Described {
        self.describe()
    }
}

impl ser::SerializeStructVariant for Fields {
    type Ok = String;
    type Error = std::fmt::Error;

    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Self::Error> {
        self.field(name, value)
    }

    fn end(self) -> Described {
        self.describe()
    }
}
