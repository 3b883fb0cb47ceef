//! Shows a record for a person: one field per line. Objects in a list take one line each if they are flat.

use crate::console::{Record, shown};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::fmt;

/// The most objects of a list that are shown.
const MAX_LISTED: usize = 100;

/// Returns the lines of a record.
pub(super) fn of(record: &Record) -> String {
    let mut text = String::new();
    add_fields(&mut text, &record.to_string(), "");
    text
}

/// The fields of a JSON object in their order.
struct Fields<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Fields<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Ordered;
        impl<'de> Visitor<'de> for Ordered {
            type Value = Fields<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fields<'de>, A::Error> {
                let mut fields = Vec::new();
                while let Some(field) = map.next_entry()? {
                    fields.push(field);
                }
                Ok(Fields(fields))
            }
        }
        deserializer.deserialize_map(Ordered)
    }
}

/// Adds the fields of an object, each on a line of its own.
fn add_fields(text: &mut String, object: &str, indent: &str) {
    let Ok(Fields(fields)) = serde_json::from_str(object) else { return };
    let is_plain = |value: &RawValue| !value.get().starts_with('{') && !value.get().starts_with("[{");
    let plain_names = fields.iter().filter(|(_, value)| is_plain(value)).map(|(name, _)| name.len());
    let width = plain_names.max().unwrap_or(0);
    let deeper = format!("{indent}  ");
    for (name, value) in fields {
        let value = value.get();
        match serde_json::from_str::<Vec<&RawValue>>(value) {
            Ok(list) if list.first().is_some_and(|first| first.get().starts_with('{')) => {
                *text += &format!("{indent}{name}\n");
                list.iter().take(MAX_LISTED).for_each(|one| add_object(text, one.get(), &deeper));
                if list.len() > MAX_LISTED {
                    *text += &format!("{deeper}and {} more: --json lists all\n", list.len() - MAX_LISTED);
                }
            }
            _ if value.starts_with('{') => {
                *text += &format!("{indent}{name}\n");
                add_fields(text, value, &deeper);
            }
            _ => *text += &format!("{indent}{name:<width$}  {}\n", plain(value)),
        }
    }
}

/// Adds an object of a list: on one line, if no field has further objects.
fn add_object(text: &mut String, object: &str, indent: &str) {
    let Ok(Fields(fields)) = serde_json::from_str(object) else { return };
    if fields.iter().any(|(_, value)| value.get().starts_with("[{")) {
        add_fields(text, object, indent);
        text.push('\n');
    } else {
        let fields = fields.iter().map(|(name, value)| format!("{name} {}", plain(value.get())));
        *text += &format!("{indent}{}\n", fields.collect::<Vec<_>>().join(", "));
    }
}

/// Shows a value without quotes. What JSON escapes stays escaped, and so does the rest that a terminal would obey.
fn plain(value: &str) -> String {
    let text = value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    shown(&text.map_or_else(|| value.replace(',', ", "), str::to_owned))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::record;

    #[test]
    fn flat_objects_take_a_line_and_others_a_block() {
        let level = |number: u8| record! { level: number, slabs: [0.5f32, 2.0] };
        let object = record! { name: "a\u{7}\u{9b}", levels: [level(0), level(1)] };
        let text = of(&record! { file: "f", closed: true, objects: [object] });
        let lines = [
            "file    f",
            "closed  true",
            "objects",
            "  name  a\\u0007\\u{9b}",
            "  levels",
            "    level 0, slabs [0.5, 2.0]",
            "    level 1, slabs [0.5, 2.0]",
            "",
            "",
        ];
        assert_eq!(text, lines.join("\n"));
        let many: Vec<_> = (0..102).map(level).collect();
        assert!(of(&record! { many: many }).ends_with("  and 2 more: --json lists all\n"));
    }
}
