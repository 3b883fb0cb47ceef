//! Parses the files of a report: tables, and documents that follow the rules of XML.

use crate::common::names;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Returns the lines of comma-separated values, each as a map from names to values. No field here contains a comma.
pub(crate) fn rows_of(csv: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = csv.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().unwrap();
    lines
        .map(|fields| {
            assert_eq!(fields.len(), header.len(), "{fields:?}");
            header.iter().cloned().zip(fields).collect()
        })
        .collect()
}

/// An element: its name and attributes.
pub(crate) type Element = (String, BTreeMap<String, String>);

/// Returns the elements of a document, all of which must be closed as XML requires.
pub(crate) fn elements(document: &str) -> Vec<Element> {
    let (mut all, mut open) = (Vec::new(), Vec::new());
    let mut rest = document;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').expect("an end of the tag");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if tag.starts_with('!') {
            continue;
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "closed out of order");
            continue;
        }
        let (tag, is_closed) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, mut attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut found = BTreeMap::new();
        while let Some((key, after)) = attributes.split_once("=\"") {
            let (value, after) = after.split_once('"').expect("an end of the attribute");
            assert!(found.insert(key.trim().to_owned(), value.to_owned()).is_none(), "{tag}");
            attributes = after;
        }
        assert_eq!(attributes.trim(), "", "{tag}");
        if !is_closed {
            open.push(name.to_owned());
        }
        all.push((name.to_owned(), found));
    }
    assert!(open.is_empty(), "{open:?} left open");
    all
}

pub(crate) fn number(value: &Value, field: &str) -> Option<f64> {
    value[field].as_f64()
}

/// Asserts that a table has the given rows, with the same figures under the same names.
#[track_caller]
pub(crate) fn same_figures(csv: &str, rows: &[Value]) {
    let table = rows_of(csv);
    assert_eq!(table.len(), rows.len());
    for (line, row) in table.iter().zip(rows) {
        let row = row.as_object().unwrap();
        assert!(line.keys().eq(row.keys()), "the same names");
        for (name, value) in row {
            let cell = &line[name];
            match value {
                Value::Null => assert_eq!(cell, "", "{name}"),
                Value::String(text) => assert_eq!(cell, text),
                Value::Bool(flag) => assert_eq!(cell == "1", *flag),
                value => assert_eq!(cell.parse::<f64>().unwrap(), value.as_f64().unwrap(), "{name}"),
            }
        }
    }
}

/// Asserts that the tables of a page have the figures of the rows they name, and returns how many they have.
#[track_caller]
pub(crate) fn same_figures_in_page(page: &[Element], rows: &[Value]) -> usize {
    let (mut row, mut shown) = (&rows[0], 0);
    for (_, attributes) in page {
        if let Some(number) = attributes.get("data-row") {
            row = &rows[number.parse::<usize>().unwrap()];
        }
        if let Some(field) = attributes.get("data-field") {
            assert_eq!(number(row, field), attributes["data-value"].parse().ok(), "{attributes:?}");
            shown += 1;
        }
    }
    shown
}

/// Returns the four files: table, page, JSON and drawing. Two pairs were small enough to be shown.
pub(crate) fn report_files(directory: &Path, out: &str) -> [String; 4] {
    let out = directory.join(out);
    let (reports, views): (Vec<String>, Vec<String>) =
        names(&out).into_iter().partition(|name| name.starts_with("report."));
    assert_eq!(reports, ["report.csv", "report.html", "report.json", "report.svg"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(
        (page.matches("See the pair").count(), &views[..]),
        (2, &["view-1.html", "view-2.html"].map(str::to_owned)[..])
    );
    for view in views {
        assert!(page.contains(&format!("<a href=\"{view}\">")), "{view}");
        let shown = fs::read_to_string(out.join(&view)).unwrap();
        assert!(shown.contains("id=\"cbvh-content\"") && !shown.contains(directory.to_str().unwrap()));
    }
    let files = ["csv", "html", "json", "svg"]
        .map(|extension| fs::read_to_string(out.join(format!("report.{extension}"))).unwrap());
    for text in &files {
        assert!(!text.contains("NaN") && !text.contains("inf,") && !text.contains(">inf"));
        assert!(!text.contains(directory.to_str().unwrap()), "a path of this machine");
    }
    files
}

/// Returns the pose in which a page shows a pair, as `--pose` takes it.
#[track_caller]
pub(crate) fn pose_shown(page: &str) -> String {
    let (_, content) = page.split_once("id=\"cbvh-content\">").unwrap();
    let content: Value = serde_json::from_str(content.split_once("</script>").unwrap().0).unwrap();
    assert_eq!(content["show"]["kind"], "pair");
    let numbers = content["show"]["pose"].as_array().unwrap();
    numbers.iter().map(Value::to_string).collect::<Vec<_>>().join(" ")
}

/// Asserts that a page fetches nothing from elsewhere, and that no browser would.
#[track_caller]
pub(crate) fn fetches_nothing(page: &[Element]) {
    let policy = page.iter().find_map(|(_, attributes)| {
        let is_policy = attributes.get("http-equiv").is_some_and(|what| what == "Content-Security-Policy");
        attributes.get("content").filter(|_| is_policy)
    });
    assert_eq!(policy.map(String::as_str), Some("default-src 'none'; style-src 'unsafe-inline'"));
    let outside = ["src", "xlink:href"];
    for (name, attributes) in page {
        assert!(
            name != "script" && name != "link" && outside.iter().all(|key| !attributes.contains_key(*key))
        );
        let is_inside = |to: &String| to.starts_with('#') || to.starts_with("view-");
        assert!(attributes.get("href").is_none_or(is_inside));
    }
}
