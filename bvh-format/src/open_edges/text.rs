//! Says in a sentence how many open edges of which kind there are, and what to do about them.

use super::OpenEdges;
use std::fmt::{Display, Formatter, Result};

impl Display for OpenEdges {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        if self.is_empty() {
            return f.write_str("no edge is open");
        }
        let rests = [
            "one triangle",
            "two triangles that face opposite ways",
            "more than two triangles, which do not cancel",
        ];
        let mut between = "";
        for ((_, of_kind), rest) in self.kinds().iter().zip(rests) {
            if of_kind.count > 0 {
                let verb = if of_kind.count == 1 { "edge has" } else { "edges have" };
                write!(f, "{between}{} {verb} {rest}", of_kind.count)?;
                between = ", ";
            }
        }
        match (self.gaps.nearest, self.proposed_weld()) {
            (Some(nearest), Some(weld)) => {
                write!(f, "; the nearest gap is {nearest:.2e}: bake with --weld {weld:e}")?;
                if self.gaps.cracks < self.boundary.count {
                    let rest = self.boundary.count - self.gaps.cracks;
                    write!(f, ", which leaves {rest} {}", if rest == 1 { "edge" } else { "edges" })?;
                    f.write_str(" that are no cracks")?;
                }
                Ok(())
            }
            (Some(nearest), None) => write!(f, "; the nearest gap is {nearest:.2e}, and no crack"),
            _ => Ok(()),
        }
    }
}
