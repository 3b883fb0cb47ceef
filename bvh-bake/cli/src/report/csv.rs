//! Lines of comma-separated values after RFC 4180.

/// One line; what needs quotes has them.
pub(super) fn line(fields: &[String]) -> String {
    let quoted: Vec<_> = fields
        .iter()
        .map(|field| {
            let plain = !field.contains([',', '"', '\n', '\r']);
            if plain { field.clone() } else { format!("\"{}\"", field.replace('"', "\"\"")) }
        })
        .collect();
    quoted.join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_and_quotes_are_quoted() {
        assert_eq!(line(&["a".into(), "b, c".into(), "d \"e\"".into()]), "a,\"b, c\",\"d \"\"e\"\"\"\n");
    }
}
