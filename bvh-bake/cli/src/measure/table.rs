//! Tables of figures: rows of named cells, written as comma-separated values (RFC 4180) and as JSON.
//!
//! A report lists the cells of a row once, in [`Cells::cells`]; table and JSON are both written from there and hold the
//! same figures under the same names. A figure that was not taken is absent, never 0 or NaN.

use crate::rounds::Work;
use crate::spread::Spread;
use serde::{Serialize, Serializer};

/// A row of a table.
pub trait Cells {
    /// Returns all cells of the row with their names.
    fn cells(&self) -> Vec<(&'static str, Cell)>;
}

/// A list of named cells is a row by itself.
impl Cells for Vec<(&'static str, Cell)> {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        self.clone()
    }
}

/// The content of a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A name.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A finite number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// Nothing.
    Absent,
}

impl Cell {
    /// A name.
    pub fn text(text: &str) -> Self {
        Self::Text(text.to_owned())
    }

    /// A whole number, if there is one.
    pub fn count(value: Option<u64>) -> Self {
        value.map_or(Self::Absent, Self::Count)
    }

    /// A number, if there is one and it is finite.
    pub fn number(value: Option<f64>) -> Self {
        value.filter(|value| value.is_finite()).map_or(Self::Absent, Self::Number)
    }

    /// Yes or no, if it is known.
    pub fn flag(value: Option<bool>) -> Self {
        value.map_or(Self::Absent, Self::Flag)
    }

    /// Writes it as tables have it: numbers in the fewest digits that give them back.
    pub fn field(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(number) => format!("{number:?}"),
            Self::Flag(flag) => u8::from(*flag).to_string(),
            Self::Absent => String::new(),
        }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(text) => serializer.serialize_str(text),
            Self::Count(count) => serializer.serialize_u64(*count),
            Self::Number(number) => serializer.serialize_f64(*number),
            Self::Flag(flag) => serializer.serialize_bool(*flag),
            Self::Absent => serializer.serialize_none(),
        }
    }
}

/// Returns the cells of a spread of times under these names: median, quartiles and ninth decile.
pub fn times(names: [&'static str; 4], spread: Option<Spread>) -> impl Iterator<Item = (&'static str, Cell)> {
    let values = spread.map(|s| [s.median, s.quartiles[0], s.quartiles[1], s.p90]);
    let cells = [0, 1, 2, 3].map(|place| Cell::number(values.map(|values| values[place])));
    names.into_iter().zip(cells)
}

/// Returns the cells of the work of a query.
pub fn work(work: Work) -> [(&'static str, Cell); 3] {
    [("node_tests", work.node_tests), ("packet_tests", work.packet_tests), ("exact_tests", work.exact_tests)]
        .map(|(name, value)| (name, Cell::number(value)))
}

/// Serialises rows as an array of objects, for `#[serde(serialize_with)]`.
///
/// # Errors
/// Returns the error of the serializer.
pub fn objects<R: Cells, S: Serializer>(rows: &[R], serializer: S) -> Result<S::Ok, S::Error> {
    struct Object(Vec<(&'static str, Cell)>);
    impl Serialize for Object {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_map(self.0.iter().map(|(name, cell)| (name, cell)))
        }
    }
    serializer.collect_seq(rows.iter().map(|row| Object(row.cells())))
}

/// Writes rows as comma-separated values: a line of names, then one line per row.
pub fn csv<R: Cells>(rows: &[R]) -> String {
    let mut text = String::new();
    for row in rows {
        let (names, fields): (Vec<String>, Vec<String>) =
            row.cells().iter().map(|(name, cell)| ((*name).to_owned(), cell.field())).unzip();
        if text.is_empty() {
            text = line(&names);
        }
        text += &line(&fields);
    }
    text
}

/// Writes one line of comma-separated values; fields that need quotes get them.
pub fn line(fields: &[String]) -> String {
    let quoted: Vec<_> = fields
        .iter()
        .map(|field| {
            let plain = !field.contains([',', '"', '\n', '\r']);
            if plain { field.clone() } else { format!("\"{}\"", field.replace('"', "\"\"")) }
        })
        .collect();
    quoted.join(",") + "\n"
}

/// Writes a report as one JSON object, with a line feed at the end.
///
/// # Errors
/// Returns the error of the serializer.
pub fn json(report: &impl Serialize) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(report)? + "\n")
}

/// Writes nanoseconds as microseconds with three digits.
pub fn micro(nanoseconds: f64) -> String {
    let value = nanoseconds / 1000.0;
    let decimals = if value >= 99.95 { 0 } else { usize::from(value < 9.995) + 1 };
    format!("{value:.decimals$}")
}

/// Writes a whole number with commas between thousands.
pub fn whole(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Row(f64);

    impl Cells for Row {
        fn cells(&self) -> Vec<(&'static str, Cell)> {
            let spread = Spread { median: self.0, quartiles: [1.0, 3.0], p90: 4.0 };
            let mut cells = vec![("name", Cell::text("a, b")), ("none", Cell::number(Some(f64::NAN)))];
            cells.extend(times(["m", "q1", "q3", "p90"], Some(spread)));
            cells.push(("is", Cell::flag(Some(true))));
            cells
        }
    }

    #[test]
    fn csv_and_json_hold_the_same_figures_under_the_same_names() {
        #[derive(Serialize)]
        struct Report(#[serde(serialize_with = "rows")] [Row; 2]);
        fn rows<S: Serializer>(rows: &[Row; 2], serializer: S) -> Result<S::Ok, S::Error> {
            objects(rows, serializer)
        }
        let rows = [Row(2.0), Row(0.1)];
        assert_eq!(
            csv(&rows),
            "name,none,m,q1,q3,p90,is\n\"a, b\",,2.0,1.0,3.0,4.0,1\n\"a, b\",,0.1,1.0,3.0,4.0,1\n"
        );
        let json: serde_json::Value = serde_json::from_str(&json(&Report(rows)).unwrap()).unwrap();
        let expected = serde_json::json!({
            "name": "a, b", "none": null, "m": 0.1, "q1": 1.0, "q3": 3.0, "p90": 4.0, "is": true
        });
        assert_eq!(json[1], expected);
    }

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        assert_eq!(line(&["a".into(), "b, c".into(), "d \"e\"".into()]), "a,\"b, c\",\"d \"\"e\"\"\"\n");
    }

    #[test]
    fn times_have_three_digits_and_thousands_commas() {
        assert_eq!(
            [123456.0, 99960.0, 12345.0, 9996.0, 1234.0, 56.0].map(micro),
            ["123", "100", "12.3", "10.0", "1.23", "0.06"]
        );
        assert_eq!([0.0, 999.0, 1000.0, 1234567.0].map(whole), ["0", "999", "1,000", "1,234,567"]);
    }
}
