//! Checks that every bound of `spec/numerics.md` names code and a test that exist.

use std::path::Path;

/// Returns the path and the name in a cell of the form `` `path` `name` ``.
fn reference(cell: &str) -> Option<(&str, &str)> {
    let mut quoted = cell.split('`').skip(1).step_by(2);
    Some((quoted.next()?, quoted.next()?))
}

#[test]
fn code_and_tests_of_all_bounds_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("spec/numerics.md")).unwrap();
    let mut bounds = 0;
    let tables = text.split("| bound | code | test |\n|---|---|---|\n").skip(1);
    for line in tables.flat_map(|table| table.lines().take_while(|line| line.starts_with('|'))) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").collect();
        assert_eq!(cells.len(), 3, "{line}");
        for cell in &cells[1..] {
            let (path, name) = reference(cell).unwrap_or_else(|| panic!("{cell}"));
            let source =
                std::fs::read_to_string(root.join(path)).unwrap_or_else(|_| panic!("no file {path}"));
            let stands_alone = |(at, _): (usize, &str)| {
                let next = source[at + name.len()..].chars().next();
                !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
            };
            assert!(source.match_indices(name).any(stands_alone), "{path} has no {name}");
        }
        // The named test must be declared as a function.
        let (path, name) = reference(cells[2]).unwrap();
        let source = std::fs::read_to_string(root.join(path)).unwrap();
        let declared = [format!("fn {name}("), format!("def {name}(")];
        assert!(declared.iter().any(|line| source.contains(line)), "{path} has no test {name}");
        bounds += 1;
    }
    assert!(bounds > 20, "{bounds}");
}
