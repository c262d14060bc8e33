//! A JSON value that knows where it stands, so that every complaint names its JSON pointer.

use std::borrow::Cow;
use std::cell::RefCell;

use serde::de::DeserializeSeed;

use super::error::{Fault, Place, Problem, quoted};
use super::limits::{Budget, within};
use super::value::{Reader, Value};
use super::warnings::Warnings;

/// A value in the document.
#[derive(Clone, Debug)]
pub(super) struct Json<'a> {
    value: &'a Value<'a>,
    pointer: String,
}

impl<'a> Json<'a> {
    pub(super) fn root(value: &'a Value<'a>) -> Json<'a> {
        Json { value, pointer: String::new() }
    }

    pub(super) fn pointer(&self) -> &str {
        &self.pointer
    }

    /// A complaint about this value.
    pub(super) fn fault(&self, wanted: impl std::fmt::Display) -> Fault {
        Fault::at(&self.pointer, wanted, summary(self.value))
    }

    /// A member of this object, if it is there.
    pub(super) fn field(&self, key: &str) -> Result<Option<Json<'a>>, Fault> {
        self.object()?;
        let value = self.value.get(key);
        Ok(value.map(|value| Json { value, pointer: child(&self.pointer, key) }))
    }

    /// A member of this object that must be there.
    pub(super) fn required(&self, key: &str) -> Result<Json<'a>, Fault> {
        self.field(key)?.ok_or_else(|| Fault::at(&child(&self.pointer, key), "a value", "nothing"))
    }

    /// All members of this object.
    pub(super) fn members(&self) -> Result<Vec<(&'a str, Json<'a>)>, Fault> {
        let members = self.object()?.iter();
        let json = |value, key| Json { value, pointer: child(&self.pointer, key) };
        Ok(members.map(|(key, value)| (key.as_ref(), json(value, key))).collect())
    }

    fn object(&self) -> Result<&'a [(Cow<'a, str>, Value<'a>)], Fault> {
        match self.value {
            Value::Object(members) => Ok(members),
            _ => Err(self.fault("an object")),
        }
    }

    fn array(&self) -> Option<&'a [Value<'a>]> {
        match self.value {
            Value::Array(elements) => Some(elements),
            _ => None,
        }
    }

    /// The elements of this array.
    pub(super) fn elements(&self) -> Result<Vec<Json<'a>>, Fault> {
        let elements = self.array().ok_or_else(|| self.fault("an array"))?;
        Ok(elements
            .iter()
            .enumerate()
            .map(|(i, value)| Json { value, pointer: format!("{}/{i}", self.pointer) })
            .collect())
    }

    /// The elements of an array member; none if it is not there.
    pub(super) fn list(&self, key: &str) -> Result<Vec<Json<'a>>, Fault> {
        self.field(key)?.map_or(Ok(Vec::new()), |array| array.elements())
    }

    /// How many elements an array member has; none if it is none.
    pub(super) fn count(&self, key: &str) -> usize {
        match self.value.get(key) {
            Some(Value::Array(elements)) => elements.len(),
            _ => 0,
        }
    }

    /// A member of `extensions`, if it is there.
    pub(super) fn extension(&self, name: &str) -> Result<Option<Json<'a>>, Fault> {
        self.field("extensions")?.map_or(Ok(None), |extensions| extensions.field(name))
    }

    /// A whole number from 0 to 2⁵³; `3.0` is one, as JSON does not tell them apart.
    pub(super) fn unsigned(&self) -> Result<usize, Fault> {
        const LARGEST_EXACT: f64 = 9_007_199_254_740_992.0;
        let number = match *self.value {
            Value::Unsigned(number) => Some(number),
            Value::Float(number) => {
                let whole = number.fract() == 0.0 && (0.0..=LARGEST_EXACT).contains(&number);
                whole.then_some(number as u64)
            }
            _ => None,
        };
        number
            .and_then(|number| usize::try_from(number).ok())
            .ok_or_else(|| self.fault("a whole number from 0 to 2^53"))
    }

    /// An index into `count` things called `what`.
    pub(super) fn index(&self, count: usize, what: &str) -> Result<usize, Fault> {
        let index = self.unsigned()?;
        if index < count {
            return Ok(index);
        }
        Err(self.fault(format!("an index into the {count} {what}")))
    }

    /// A finite number.
    pub(super) fn number(&self) -> Result<f32, Fault> {
        let number = self.value.as_f64().map(|number| number as f32);
        number.filter(|number| number.is_finite()).ok_or_else(|| self.fault("a 32-bit number"))
    }

    /// An array of exactly `N` finite numbers.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f32; N], Fault> {
        let wrong_length = || self.fault(format!("an array of {N} numbers"));
        let elements = self.array().ok_or_else(wrong_length)?;
        if elements.len() != N {
            return Err(wrong_length());
        }
        let mut numbers = [0.0; N];
        for (number, element) in numbers.iter_mut().zip(self.elements()?) {
            *number = element.number()?;
        }
        Ok(numbers)
    }

    pub(super) fn text(&self) -> Result<&'a str, Fault> {
        self.value.as_str().ok_or_else(|| self.fault("a string"))
    }

    pub(super) fn boolean(&self) -> Result<bool, Fault> {
        match self.value {
            Value::Bool(truth) => Ok(*truth),
            _ => Err(self.fault("true or false")),
        }
    }

    /// A number member, or `default` if it is not there.
    pub(super) fn number_or(&self, key: &str, default: f32) -> Result<f32, Fault> {
        self.field(key)?.map_or(Ok(default), |field| field.number())
    }

    /// An array member of `N` numbers, or `default` if it is not there.
    pub(super) fn numbers_or<const N: usize>(
        &self,
        key: &str,
        default: [f32; N],
    ) -> Result<[f32; N], Fault> {
        self.field(key)?.map_or(Ok(default), |field| field.numbers())
    }

    /// A whole-number member, or `default` if it is not there.
    pub(super) fn unsigned_or(&self, key: &str, default: usize) -> Result<usize, Fault> {
        self.field(key)?.map_or(Ok(default), |field| field.unsigned())
    }

    /// A true-or-false member; false if it is not there.
    pub(super) fn flag(&self, key: &str) -> Result<bool, Fault> {
        self.field(key)?.map_or(Ok(false), |field| field.boolean())
    }

    /// The `name` member; empty if it is not there or no string, since nothing depends on it.
    pub(super) fn name(&self) -> &'a str {
        self.value.get("name").and_then(Value::as_str).unwrap_or_default()
    }

    /// How a message calls this value: `mesh "wheel" (/meshes/3)`, or `/meshes/3` if it has no name.
    pub(super) fn called(&self, what: &str) -> String {
        called(what, self.name(), &self.pointer)
    }
}

/// The same of a thing that is known by its name, which may be empty, and where it stands.
pub(super) fn called(what: &str, name: &str, pointer: &str) -> String {
    match name {
        "" => pointer.to_owned(),
        _ => format!("{what} {} ({pointer})", quoted(name)),
    }
}

/// The pointer to a member (RFC 6901 §3: `~` and `/` are escaped).
fn child(pointer: &str, key: &str) -> String {
    format!("{pointer}/{}", key.replace('~', "~0").replace('/', "~1"))
}

fn summary(value: &Value<'_>) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(truth) => truth.to_string(),
        Value::Unsigned(number) => number.to_string(),
        Value::Negative(number) => number.to_string(),
        // Which has an exponent where it is better read so.
        Value::Float(number) => format!("{number:?}"),
        Value::Text(text) => quoted(text),
        Value::Unescaped(text) => quoted(text),
        Value::Array(elements) => format!("an array of {}", elements.len()),
        Value::Object(_) => "an object".to_owned(),
    }
}

/// Parses JSON text that begins at byte `offset` of the file.
pub(super) fn parse<'a>(
    text: &'a [u8],
    offset: usize,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Value<'a>, Fault> {
    check_size(text, budget)?;
    let mut json = serde_json::Deserializer::from_slice(text);
    let repeated = RefCell::default();
    let value = Reader { repeated: &repeated }.deserialize(&mut json);
    let value = value.and_then(|value| json.end().map(|()| value)).map_err(|error| Fault {
        place: Place::Byte((offset + byte_of(text, error.line(), error.column())) as u64),
        problem: Problem::Json(error.to_string()),
    })?;
    for key in repeated.into_inner() {
        warnings.about("keys that an object has several times: the last counts", quoted(&key));
    }
    Ok(value)
}

/// Counts brackets and separators outside strings, since a parsed value needs up to thirty times the memory of its text.
fn check_size(text: &[u8], budget: &mut Budget) -> Result<(), Fault> {
    /// Its own 24, a key's as many, and what those need who read it.
    const BYTES_PER_VALUE: usize = 64;
    /// What one says at most: a number has 12 characters with its comma, a name 20. More is blanks, or data that are told of where they are used.
    const BYTES_TOLD: u64 = 32;
    let (mut depth, mut deepest, mut values) = (0_u64, 0_u64, 0_u64);
    let mut bytes = text.iter();
    while let Some(byte) = bytes.next() {
        match byte {
            b'"' => skip_string(&mut bytes),
            b'[' | b'{' => {
                values += 1;
                depth += 1;
                deepest = deepest.max(depth);
            }
            b']' | b'}' => depth = depth.saturating_sub(1),
            b',' | b':' => values += 1,
            _ => {}
        }
    }
    budget.tell((text.len() as u64).min(BYTES_TOLD.saturating_mul(values)));
    within(deepest, budget.limits.json_depth, "levels of JSON nesting", "")?;
    within(values, budget.limits.json_values, "JSON values", "")?;
    budget.allocate("", values as usize, BYTES_PER_VALUE)
}

/// Moves behind the quote that ends a string.
fn skip_string(bytes: &mut std::slice::Iter<'_, u8>) {
    while let Some(byte) = bytes.next() {
        match byte {
            b'"' => return,
            b'\\' => {
                bytes.next();
            }
            _ => {}
        }
    }
}

/// The byte offset of a line and column, both counted from 1.
fn byte_of(text: &[u8], line: usize, column: usize) -> usize {
    let line_begins = text.split_inclusive(|byte| *byte == b'\n').take(line.saturating_sub(1));
    let before: usize = line_begins.map(<[u8]>::len).sum();
    (before + column.saturating_sub(1)).min(text.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limits;

    fn parse_within<'a>(text: &'a [u8], limits: &Limits) -> Result<Value<'a>, Fault> {
        parse(text, 0, &mut Budget::new(limits), &mut Warnings::default())
    }

    fn problem(text: &str, read: impl Fn(Json<'_>) -> Result<(), Fault>) -> String {
        let value = parse_within(text.as_bytes(), &Limits::default());
        let value = value.expect("the test's JSON is fine");
        read(Json::root(&value)).expect_err("the test's JSON is refused").in_file("f").to_string()
    }

    #[test]
    fn complaints_name_the_pointer_and_both_sides() {
        let third = |json: Json<'_>| json.list("a")?[2].index(3, "nodes").map(drop);
        assert_eq!(
            problem(r#"{"a":[0,1,7]}"#, third),
            "f: /a/2: wanted an index into the 3 nodes, got 7"
        );
        let missing = |json: Json<'_>| json.required("a/b").map(drop);
        assert_eq!(problem("{}", missing), "f: /a~1b: wanted a value, got nothing");
        let matrix = |json: Json<'_>| json.required("m")?.numbers::<2>().map(drop);
        assert_eq!(
            problem(r#"{"m":[1]}"#, matrix),
            "f: /m: wanted an array of 2 numbers, got an array of 1"
        );
        assert_eq!(
            problem(r#"{"m":[1,1e300]}"#, matrix),
            "f: /m/1: wanted a 32-bit number, got 1e300"
        );
        let not_an_object = |json: Json<'_>| json.required("m")?.field("x").map(drop);
        assert_eq!(
            problem(r#"{"m":[]}"#, not_an_object),
            "f: /m: wanted an object, got an array of 0"
        );
    }

    #[test]
    fn whole_numbers_may_be_written_as_floats() {
        for (text, expected) in [("3", Some(3)), ("3.0", Some(3)), ("3e2", Some(300))] {
            let value = parse_within(text.as_bytes(), &Limits::default()).unwrap();
            assert_eq!(Json::root(&value).unsigned().ok(), expected, "{text}");
        }
        for text in ["3.5", "-1", "1e300", "null", "\"3\""] {
            let value = parse_within(text.as_bytes(), &Limits::default()).unwrap();
            assert!(Json::root(&value).unsigned().is_err(), "{text}");
        }
    }

    #[test]
    fn syntax_errors_name_the_byte_in_the_file() {
        let fault = parse(
            b"{\n  \"a\": x}",
            20,
            &mut Budget::new(&Limits::default()),
            &mut Warnings::default(),
        );
        let fault = fault.unwrap_err();
        assert_eq!(fault.place, Place::Byte(20 + 9));
    }

    #[test]
    fn nesting_and_size_are_counted_before_parsing() {
        let limits = Limits { json_depth: 3, json_values: 8, ..Limits::default() };
        assert!(parse_within(b"[[[1]]]", &limits).is_ok());
        assert!(parse_within(b"[[[[1]]]]", &limits).is_err());
        assert!(parse_within(br#"["[[[[[,,,,,,,\"[[["]"#, &limits).is_ok(), "brackets in strings");
        assert!(parse_within(b"[1,1,1,1,1,1,1,1,1]", &limits).is_err());
        assert!(parse_within(&[b'['; 100_000], &Limits::default()).is_err());
    }
}
