//! Every public type has an example in its documentation, or names an item that has one, and so has every query.
//!
//! This reads the sources as text, with neither a compiler nor a parser. A type is what a line declares `pub`: a lint of the workspace
//! refuses types that are `pub` and cannot be reached. Whether an example shows much of its type is left to those who read it, but an
//! example that is only named has to be there.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The sources of the libraries, beside the repository's root. `cbvh` has no types of its own.
const LIBRARIES: [&str; 5] =
    ["bvh-format/src", "bvh-bake/src", "bvh-query/src", "bvh-query/robot/src", "bvh-query/view/src"];

/// The types whose methods are queries, unless they return nothing or the type itself. A query of the first ones borrows them as
/// mutable; batches are shared.
const ASKED: [&str; 6] = ["Querier", "Tracker", "Scene", "Robot", "Batch", "ProbeBatch"];
const SHARED: [&str; 2] = ["Batch", "ProbeBatch"];

/// What the root of bvh-query re-exports for the bindings and for `cbvh view` alone, hidden from the documentation.
const HIDDEN: [&str; 2] = ["FloatState", "Step"];

/// A type, a method or a function, by its name: `Pose`, `Pose::new`, `displacement`.
struct Item {
    file: String,
    line: usize,
    kind: Kind,
    doc: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Type,
    Query,
    Other,
}

/// Returns the public items of a file. Those of unit tests and those that documentation hides are left out.
fn items(file: &str, text: &str, found: &mut BTreeMap<String, Item>) {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let (mut doc, mut is_hidden, mut owner) = (String::new(), false, None);
    let lines: Vec<&str> = text.lines().collect();
    for (number, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        if let Some(rest) = code.strip_prefix("///") {
            doc.push_str(rest.strip_prefix(' ').unwrap_or(rest));
            doc.push('\n');
            continue;
        }
        if code.starts_with("#[") {
            is_hidden |= code.contains("doc(hidden)");
            // An example that depends on a feature begins with an attribute.
            doc.push_str(if code.contains("doc = \"```\"") { "```\n" } else { "" });
            continue;
        }
        if line.starts_with("impl") {
            owner = owner_of(line);
        }
        if let Some((kind, name)) = declared(code, owner, &lines[number..])
            && !is_hidden
        {
            let name = match owner {
                Some(owner) if kind != Kind::Type && *line != code => format!("{owner}::{name}"),
                _ => name,
            };
            let (file, doc) = (file.to_owned(), doc.clone());
            found.insert(name, Item { file, line: number + 1, kind, doc });
        }
        // Attributes of several lines stand between a comment and its item.
        if !code.starts_with([')', '"']) {
            (doc, is_hidden) = (String::new(), false);
        }
    }
}

/// Returns the type that a block of methods belongs to; `None` if it implements a trait.
fn owner_of(line: &str) -> Option<&str> {
    let mut rest = line.strip_prefix("impl")?;
    if rest.starts_with('<') {
        let mut depth = 0;
        let end = rest.find(|c| {
            depth += i32::from(c == '<') - i32::from(c == '>');
            depth == 0
        });
        rest = &rest[end? + 1..];
    }
    if rest.contains(" for ") {
        return None;
    }
    let name = rest.trim_start().split(['<', ' ']).next()?;
    name.rsplit("::").next()
}

/// Returns what a line declares, if it is public, given the type of its block and the lines from there on.
fn declared(code: &str, owner: Option<&str>, lines: &[&str]) -> Option<(Kind, String)> {
    let mut words =
        code.strip_prefix("pub ")?.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '$'));
    let word = words.by_ref().find(|word| !matches!(*word, "const" | "unsafe" | "async"))?;
    let name = words.next().filter(|name| !name.is_empty() && !name.contains('$'))?.to_owned();
    match word {
        "struct" | "enum" | "trait" | "union" => Some((Kind::Type, name)),
        "fn" => {
            let end = lines.iter().position(|line| line.trim_end().ends_with('{'))?;
            let signature = lines[..=end].join(" ");
            Some((
                if owner.is_some_and(|owner| is_query(owner, &name, &signature)) {
                    Kind::Query
                } else {
                    Kind::Other
                },
                name,
            ))
        }
        _ => None,
    }
}

/// Returns whether a method answers a question: it fails as questions do, and returns something or visits it.
fn is_query(owner: &str, name: &str, signature: &str) -> bool {
    let borrowed = if SHARED.contains(&owner) { "&self" } else { "&mut self" };
    let Some((arguments, returned)) = signature.split_once("-> Result<") else { return false };
    let fails = ["QueryError>", "SceneError>", "RobotError>"].iter().any(|error| returned.contains(error));
    let answers = !["(),", "Self,", "InstanceId,"].iter().any(|nothing| returned.starts_with(nothing));
    ASKED.contains(&owner) && arguments.contains(borrowed) && fails && (answers || name.starts_with("visit"))
}

/// Returns whether a comment has a block of Rust.
fn has_example(doc: &str) -> bool {
    let mut is_inside = false;
    doc.lines().filter_map(|line| line.strip_prefix("```")).any(|language| {
        is_inside = !is_inside;
        let is_rust =
            language.split(',').all(|word| matches!(word.trim(), "" | "rust" | "no_run" | "should_panic"));
        is_inside && is_rust
    })
}

/// Returns the items that a comment links to, one name each. Of a path, the last type and what follows it count.
fn links(sentence: &str) -> impl Iterator<Item = String> {
    sentence.split("[`").skip(1).filter_map(|rest| {
        let path: Vec<&str> = rest.split_once("`]")?.0.trim_end_matches("()").split("::").collect();
        let is_type = |part: &&str| part.starts_with(char::is_uppercase);
        let first = path.iter().position(is_type).unwrap_or(path.len() - 1);
        Some(path[first..].join("::"))
    })
}

/// Returns the public types and queries that have no example and name none, one message each.
fn without_example(all: &BTreeMap<String, Item>) -> Vec<String> {
    let has = |name: &str| all.get(name).is_some_and(|item| has_example(&item.doc));
    let is_query = |name: &str| all.get(name).is_some_and(|item| item.kind == Kind::Query);
    // A type says that it names an example: its links alone may lead anywhere.
    let says_so = |doc: &str| {
        let prose = doc.replace('\n', " ");
        let mut sentences = prose.split_inclusive(". ").filter(|sentence| sentence.contains("example"));
        sentences.any(|sentence| links(sentence).any(|name| has(&name)))
    };
    let is_named = |name: &str, item: &Item| match name.split_once("::") {
        // The example of its type has it, or it is another query for many poses, or by other means.
        Some((owner, method)) => {
            let is_used = || all[owner].doc.contains(&format!(".{method}("));
            has(owner) && is_used() || links(&item.doc).any(|other| is_query(&other) && has(&other))
        }
        None => says_so(&item.doc),
    };
    let lacking = all.iter().filter(|(name, item)| {
        item.kind != Kind::Other
            && !has_example(&item.doc)
            && !is_named(name, item)
            && !HIDDEN.contains(&name.as_str())
    });
    lacking.map(|(name, item)| format!("{}:{}: {name}", item.file, item.line)).collect()
}

/// Reads all files of a folder and of those in it.
fn read(folder: &Path, found: &mut BTreeMap<String, Item>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("tests") {
                read(&path, found);
            }
        } else if path.extension().is_some_and(|ending| ending == "rs") && !path.ends_with("tests.rs") {
            items(path.to_str().unwrap(), &fs::read_to_string(&path).unwrap(), found);
        }
    }
}

#[test]
fn every_public_type_and_query_has_an_example() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let (mut types, mut queries, mut lacking) = (0, 0, Vec::new());
    for library in LIBRARIES {
        let mut all = BTreeMap::new();
        read(&root.join(library), &mut all);
        types += all.values().filter(|item| item.kind == Kind::Type).count();
        queries += all.values().filter(|item| item.kind == Kind::Query).count();
        lacking.append(&mut without_example(&all));
    }
    assert!(types > 150 && queries > 70, "{types} types, {queries} queries");
    assert!(
        lacking.is_empty(),
        "expected an example, or a sentence that links to an item with one and has the word example, found none:\n{}",
        lacking.join("\n")
    );
}

/// Returns what lacks an example in a file of this text.
fn lacking(text: &str) -> Vec<String> {
    let mut all = BTreeMap::new();
    items("lib.rs", text, &mut all);
    without_example(&all)
}

#[test]
fn what_has_no_example_is_found() {
    assert_eq!(lacking("/// A type.\npub struct Bare;"), ["lib.rs:2: Bare"]);
    assert_eq!(lacking("/// A type.\n#[derive(\n    Debug,\n)]\npub enum Bare {}"), ["lib.rs:5: Bare"]);
    assert_eq!(lacking("    /// A type in a macro.\n    pub struct Bare {"), ["lib.rs:2: Bare"]);
    // A drawing is no example, and neither is what is said about one that is not there.
    assert_eq!(lacking("/// ```text\n/// a -> b\n/// ```\npub trait Bare {}"), ["lib.rs:4: Bare"]);
    let named = "/// [`Other`] has an example.\npub struct Bare;\n/// No.\npub struct Other;";
    assert_eq!(lacking(named), ["lib.rs:2: Bare", "lib.rs:4: Other"]);
    // A link by itself is none either.
    let linked = "/// See [`Other`].\npub struct Bare;\n/// ```\n/// Other;\n/// ```\npub struct Other;";
    assert_eq!(lacking(linked), ["lib.rs:2: Bare"]);
    // A method is not named by the example of its type unless that uses it.
    let query = "/// ```\n/// querier.other();\n/// ```\npub struct Querier;\nimpl Querier {\n    /// Answers.\n    \
                 pub fn answer(\n        &mut self,\n    ) -> Result<bool, QueryError> {\n    }\n}";
    assert_eq!(lacking(query), ["lib.rs:7: Querier::answer"]);
}

#[test]
fn what_has_an_example_is_not_found() {
    let own = "/// ```\n/// Own;\n/// ```\n#[derive(Debug)]\npub struct Own;";
    assert_eq!(lacking(own), Vec::<String>::new());
    assert_eq!(lacking("/// ```no_run\n/// Own;\n/// ```\npub struct Own;"), Vec::<String>::new());
    let named = "/// A type. See [`crate::Maker::make`]\n/// for an example.\npub struct Made;\nimpl<'a, T: Into<u8>> Maker<'a, T> {\n    \
                 /// ```\n    /// Maker;\n    /// ```\n    pub fn make() {\n    }\n}";
    assert_eq!(lacking(named), Vec::<String>::new());
    let batch = "impl Querier {\n    /// ```\n    /// ```\n    pub fn answer(&mut self) -> Result<bool, QueryError> {\n    }\n}\n\
                 impl<'a> Batch<'a> {\n    /// Answers [`Querier::answer`] for each.\n    \
                 pub fn answers(&self) -> Result<Vec<bool>, QueryError> {\n    }\n}";
    assert_eq!(lacking(batch), Vec::<String>::new());
    let used = "/// ```\n/// querier.answer();\n/// ```\npub struct Querier;\nimpl Querier {\n    /// Answers.\n    \
                pub fn answer(&mut self) -> Result<bool, QueryError> {\n    }\n}";
    assert_eq!(lacking(used), Vec::<String>::new());
    // These are not public, or no queries.
    assert_eq!(
        lacking("/// A type.\npub(crate) struct Own;\n/// For bindings.\n#[doc(hidden)]\npub struct Hidden;"),
        Vec::<String>::new()
    );
    assert_eq!(
        lacking(
            "impl Scene {\n    /// Sets.\n    pub fn set(&mut self) -> Result<(), SceneError> {\n    }\n}"
        ),
        Vec::<String>::new()
    );
}
