//! JSON in memory, as small as it can be read: a stranger's file may consist of nothing but small values. An object with one member takes a
//! tenth of what serde_json's own does, and text that stands in the file as it is meant is not copied.

use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt;

use serde::de::{Deserialize, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};

/// A JSON value, with text of the file that lives for `'a`.
#[derive(Debug)]
pub(super) enum Value<'a> {
    Null,
    Bool(bool),
    Unsigned(u64),
    Negative(i64),
    Float(f64),
    Text(&'a str),
    /// With what was escaped.
    Unescaped(Box<str>),
    Array(Box<[Value<'a>]>),
    /// By key, each once.
    Object(Box<[(Cow<'a, str>, Value<'a>)]>),
}

impl<'a> Value<'a> {
    /// A member of this object, if it is one and has it.
    pub(super) fn get(&self, key: &str) -> Option<&Value<'a>> {
        let Value::Object(members) = self else { return None };
        let place = members.binary_search_by(|(own, _)| own.as_ref().cmp(key)).ok()?;
        Some(&members[place].1)
    }

    pub(super) fn as_str(&self) -> Option<&str> {
        match self {
            Value::Text(text) => Some(text),
            Value::Unescaped(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn as_f64(&self) -> Option<f64> {
        match *self {
            Value::Unsigned(number) => Some(number as f64),
            Value::Negative(number) => Some(number as f64),
            Value::Float(number) => Some(number),
            _ => None,
        }
    }
}

/// Reads a value, and takes note of keys that stand in one object several times.
#[derive(Clone, Copy)]
pub(super) struct Reader<'r> {
    pub(super) repeated: &'r RefCell<Vec<String>>,
}

impl<'de> DeserializeSeed<'de> for Reader<'_> {
    type Value = Value<'de>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value<'de>, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl Reader<'_> {
    fn note(self, key: &str) {
        /// More are as good as these.
        const MOST: usize = 8;
        let mut repeated = self.repeated.borrow_mut();
        if repeated.len() < MOST && !repeated.iter().any(|known| known == key) {
            repeated.push(key.to_owned());
        }
    }
}

impl<'de> Visitor<'de> for Reader<'_> {
    type Value = Value<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value<'de>, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, truth: bool) -> Result<Value<'de>, E> {
        Ok(Value::Bool(truth))
    }

    fn visit_u64<E>(self, number: u64) -> Result<Value<'de>, E> {
        Ok(Value::Unsigned(number))
    }

    fn visit_i64<E>(self, number: i64) -> Result<Value<'de>, E> {
        Ok(u64::try_from(number).map_or(Value::Negative(number), Value::Unsigned))
    }

    fn visit_f64<E>(self, number: f64) -> Result<Value<'de>, E> {
        Ok(Value::Float(number))
    }

    fn visit_borrowed_str<E>(self, text: &'de str) -> Result<Value<'de>, E> {
        Ok(Value::Text(text))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value<'de>, E> {
        Ok(Value::Unescaped(text.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut array: A) -> Result<Value<'de>, A::Error> {
        let mut elements = Vec::new();
        while let Some(element) = array.next_element_seed(self)? {
            elements.push(element);
        }
        Ok(Value::Array(elements.into_boxed_slice()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Value<'de>, A::Error> {
        let mut members: Vec<(Cow<'de, str>, Value<'de>)> = Vec::new();
        while let Some(Key(key)) = object.next_key()? {
            members.push((key, object.next_value_seed(self)?));
        }
        // Of members with one key the last counts: it is the first now.
        members.reverse();
        members.sort_by(|(a, _), (b, _)| a.cmp(b));
        members.dedup_by(|(later, _), (kept, _)| {
            let is_repeated = later == kept;
            if is_repeated {
                self.note(later);
            }
            is_repeated
        });
        Ok(Value::Object(members.into_boxed_slice()))
    }
}

struct Key<'a>(Cow<'a, str>);

impl<'de> Deserialize<'de> for Key<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Key<'de>, D::Error> {
        deserializer.deserialize_str(Keys)
    }
}

struct Keys;

impl<'de> Visitor<'de> for Keys {
    type Value = Key<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_borrowed_str<E>(self, text: &'de str) -> Result<Key<'de>, E> {
        Ok(Key(Cow::Borrowed(text)))
    }

    fn visit_str<E>(self, text: &str) -> Result<Key<'de>, E> {
        Ok(Key(Cow::Owned(text.to_owned())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_with<'a>(text: &'a str, repeated: &RefCell<Vec<String>>) -> Value<'a> {
        let mut json = serde_json::Deserializer::from_str(text);
        Reader { repeated }.deserialize(&mut json).expect("the test's JSON is fine")
    }

    fn read(text: &str) -> Value<'_> {
        read_with(text, &RefCell::default())
    }

    #[test]
    fn values_are_what_the_text_says() {
        let value = read(r#"{"b":[null,true,7,-7,0.5],"a":"x","\u0063":"\n","e":{}}"#);
        assert_eq!(value.get("a").and_then(Value::as_str), Some("x"));
        assert_eq!(value.get("c").and_then(Value::as_str), Some("\n"));
        assert!(matches!(value.get("e"), Some(Value::Object(members)) if members.is_empty()));
        let Some(Value::Array(list)) = value.get("b") else { panic!("an array") };
        assert!(matches!(list[0], Value::Null) && matches!(list[1], Value::Bool(true)));
        let numbers: Vec<Option<f64>> = list.iter().map(Value::as_f64).collect();
        assert_eq!(numbers, [None, None, Some(7.0), Some(-7.0), Some(0.5)]);
        assert!(value.get("d").is_none());
    }

    #[test]
    fn of_one_key_several_times_the_last_counts() {
        let value = read(r#"{"a":1,"b":2,"a":3,"a":4}"#);
        assert!(matches!(value.get("a"), Some(Value::Unsigned(4))), "{value:?}");
        assert!(matches!(&value, Value::Object(members) if members.len() == 2));
    }

    #[test]
    fn keys_that_come_again_are_told_once_each() {
        let repeated = RefCell::default();
        read_with(r#"[{"a":{"x":0,"y":1,"x":2},"b":2,"a":3,"a":4},{"a":0,"b":1}]"#, &repeated);
        assert_eq!(repeated.into_inner(), ["x", "a"]);
    }

    #[test]
    fn values_are_small() {
        assert_eq!(size_of::<Value<'_>>(), 24);
    }
}
