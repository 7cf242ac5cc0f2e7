//! Events as JSON objects, for scripts, browsers and brokers.
//!
//! ```
//! use toposlam::wire::{Arrival, Header, Message};
//! use toposlam_link::{json, listener::Event};
//!
//! let header = Header { sequence: 7, arrival: Arrival::First };
//! let event = json::event(Event::Message(header, &Message::Edge { a: 0, b: 1, present: true }));
//! assert_eq!(event.to_string(), r#"{"a":0,"b":1,"event":"Edge","present":true,"sequence":7}"#);
//! ```

use serde_json::{Map, Value, json};
use toposlam::ring::Echo;
use toposlam::wire::{Arrival, Echoes, Message};

use crate::event_text;
use crate::listener::Event;

/// One event. `event` is the name of the message, `Damaged`, or `Unknown` for an intact frame of another version; the message's
/// fields follow under their names. `lost` is present if frames are missing before the event, `late` if the frame was repeated or
/// overtaken, and `restart` if the robot has restarted.
pub fn event(event: Event<'_>) -> Value {
    let (header, message) = match event {
        Event::Damaged(error) => {
            let name = if event_text::is_unknown(error) { "Unknown" } else { "Damaged" };
            return json!({"event": name, "error": error.to_string()});
        }
        Event::Message(header, message) => (header, message),
    };
    let mut object = match message {
        Message::Ring { frame_index, echoes } => {
            object("Ring", json!({"frame_index": frame_index, "ranges_mm": ranges_mm(echoes)}))
        }
        _ => match serde_json::to_value(message) {
            Ok(Value::Object(variant)) => {
                variant.into_iter().next().map_or_else(Map::new, |(name, fields)| object(&name, fields))
            }
            _ => Map::new(),
        },
    };
    object.insert("sequence".to_owned(), header.sequence.into());
    match header.arrival {
        Arrival::AfterGap { lost } => drop(object.insert("lost".to_owned(), lost.into())),
        Arrival::Late => drop(object.insert("late".to_owned(), true.into())),
        Arrival::Restart => drop(object.insert("restart".to_owned(), true.into())),
        Arrival::First | Arrival::InOrder => {}
    }
    Value::Object(object)
}

/// The range of each sonar in millimetres, `"silence"` or `"dead"`.
pub fn ranges_mm(echoes: &Echoes) -> Value {
    let range = |echo| match echo {
        Echo::Range { range_mm } => range_mm.into(),
        Echo::Silence => "silence".into(),
        Echo::Dead => "dead".into(),
    };
    echoes.iter().map(range).collect::<Vec<Value>>().into()
}

fn object(name: &str, fields: Value) -> Map<String, Value> {
    let mut object = match fields {
        Value::Object(fields) => fields,
        other => Map::from_iter([("value".to_owned(), other)]),
    };
    object.insert("event".to_owned(), name.into());
    object
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::wire::{Belief, DecodeError, Header, List, VertexProbability};

    #[test]
    fn lost_and_damaged_frames_are_reported() {
        let header = Header { sequence: 9, arrival: Arrival::AfterGap { lost: 3 } };
        let echoes = Echoes::new(&[Echo::Dead, Echo::Silence, Echo::Range { range_mm: 5 }]);
        let ring = event(Event::Message(header, &Message::Ring { frame_index: 1, echoes }));
        assert_eq!(
            ring,
            json!({"event": "Ring", "frame_index": 1, "ranges_mm": ["dead", "silence", 5], "sequence": 9, "lost": 3})
        );
        assert_eq!(event(Event::Damaged(DecodeError::Cut))["event"], "Damaged");
    }

    #[test]
    fn restarts_and_late_frames_are_marked() {
        let edge = Message::Edge { a: 0, b: 1, present: true };
        let marks = |arrival| {
            let event = event(Event::Message(Header { sequence: 3, arrival }, &edge));
            [event["restart"].clone(), event["late"].clone()]
        };
        assert_eq!(marks(Arrival::Restart), [json!(true), Value::Null]);
        assert_eq!(marks(Arrival::Late), [Value::Null, json!(true)]);
        assert_eq!(marks(Arrival::InOrder), [Value::Null, Value::Null]);
    }

    #[test]
    fn lists_and_options_become_arrays_and_nulls() {
        let header = Header { sequence: 0, arrival: Arrival::InOrder };
        let vertices = List::new([VertexProbability { vertex: 2, permille: 900 }]);
        let belief =
            event(Event::Message(header, &Message::Belief(Belief { place_index: 4, map_permille: 1000, vertices })));
        assert_eq!(belief["vertices"], json!([{"vertex": 2, "permille": 900}]));
        let place = Message::Place { place_index: 1, frame_index: 2, radius_mm: 3, degree: None };
        assert_eq!(event(Event::Message(header, &place))["degree"], Value::Null);
    }
}
