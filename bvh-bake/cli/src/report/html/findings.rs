//! What stands out in the rows of a pair, in sentences.

use crate::report::json::Report;
use crate::report::plot::micro;
use crate::report::row::Row;
use crate::report::variant::Group;

/// The sentences, the most important first.
pub(in crate::report) fn findings(report: &Report, pair: &str) -> Vec<String> {
    let rows = Of(report.rows.iter().filter(|row| row.pair == pair).collect());
    [
        rows.fastest(),
        rows.smallest(),
        rows.against_floats(),
        rows.allowed(),
        rows.splits(),
        rows.pages(),
        rows.noise(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

struct Of<'a>(Vec<&'a Row>);

impl<'a> Of<'a> {
    /// Rows of a group and a question, of distances those without an allowed error.
    fn group(&self, group: Group, question: &str) -> impl Iterator<Item = &'a Row> + use<'a, '_> {
        let question = question.to_owned();
        let is_it = move |row: &&&'a Row| {
            row.group == group && row.question == question && row.rel_err.unwrap_or(0.0) == 0.0
        };
        self.0.iter().filter(is_it).copied()
    }

    fn time(row: &Row) -> f64 {
        row.warm.map_or(f64::INFINITY, |warm| warm.median)
    }

    /// The fastest layout without loss.
    fn best(&self, question: &str) -> Option<&'a Row> {
        let lossless = self.group(Group::Layout, question).filter(|row| row.triangles != "quantized");
        lossless.min_by(|a, b| Self::time(a).total_cmp(&Self::time(b)))
    }

    fn named(&self, group: Group, variant: &str, question: &str) -> Option<&'a Row> {
        self.group(group, question).find(|row| row.variant == variant)
    }

    fn fastest(&self) -> Option<String> {
        let (collide, distance) = (self.best("collide")?, self.best("distance")?);
        Some(format!(
            "Fastest without loss: {} for contact, {} \u{b5}s; {} for distance, {} \u{b5}s (medians, warm).",
            collide.variant,
            micro(Self::time(collide)),
            distance.variant,
            micro(Self::time(distance))
        ))
    }

    fn smallest(&self) -> Option<String> {
        let bytes = |row: &Row| row.size.file_bytes.unwrap_or(f64::INFINITY);
        let lossless = self.group(Group::Layout, "distance").filter(|row| row.triangles != "quantized");
        let smallest = lossless.min_by(|a, b| bytes(a).total_cmp(&bytes(b)))?;
        let best = self.best("distance")?;
        Some(format!(
            "Smallest without loss: {}, {:.1} bytes a triangle (the fastest for distance has {:.1}), at {:.2} times \
             the time for distance.",
            smallest.variant,
            bytes(smallest),
            bytes(best),
            Self::time(smallest) / Self::time(best)
        ))
    }

    fn against_floats(&self) -> Option<String> {
        let ratio = |question: &str, of: fn(&Row) -> f64| {
            let [codes, floats] =
                ["dop14-u8 f32", "dop14-f32 f32"].map(|name| self.named(Group::Layout, name, question));
            Some(of(codes?) / of(floats?))
        };
        let nodes = |row: &Row| row.size.node_bytes.unwrap_or(f64::NAN);
        let cold = |row: &Row| row.cold.map_or(f64::NAN, |cold| cold.median);
        Some(format!(
            "Codes of a byte against plain floats (dop14-u8, dop14-f32): nodes take {:.2} times the bytes; warm \
             contact {:.2} times the time, distance {:.2} times; cold {:.2} and {:.2} times.",
            ratio("collide", nodes)?,
            ratio("collide", Self::time)?,
            ratio("distance", Self::time)?,
            ratio("collide", cold)?,
            ratio("distance", cold)?
        ))
    }

    fn allowed(&self) -> Option<String> {
        let best = self.best("distance")?;
        let with = |rel_err: f64| {
            self.0.iter().find(|row| {
                row.group == Group::Layout && row.variant == best.variant && row.rel_err == Some(rel_err)
            })
        };
        let parts: Vec<String> = [(1e-3, "0.1 %"), (1e-2, "1 %"), (1e-1, "10 %")]
            .into_iter()
            .filter_map(|(rel_err, name)| {
                let row = with(rel_err)?;
                let error = row.errors.max.map_or("none".to_owned(), |error| format!("{error:.1e}"));
                Some(format!("{name} {:.2} times, largest error {error}", Self::time(row) / Self::time(best)))
            })
            .collect();
        Some(format!("Time for distance with an allowed error ({}): {}.", best.variant, parts.join("; ")))
    }

    /// Times of a group's variants over that of its first.
    fn ratios(&self, group: Group, question: &str, of: fn(&Row) -> f64) -> Option<String> {
        let rows: Vec<&Row> = self.group(group, question).collect();
        let (first, others) = rows.split_first()?;
        let ratio = |row: &&Row| format!("{} {:.2}", row.variant, of(row) / of(first));
        Some(format!("{question} {}", others.iter().map(ratio).collect::<Vec<_>>().join(", ")))
    }

    fn splits(&self) -> Option<String> {
        let [collide, distance] = ["collide", "distance"].map(|q| self.ratios(Group::Splits, q, Self::time));
        Some(format!("Time with other splits over that with the usual ones: {}; {}.", collide?, distance?))
    }

    fn pages(&self) -> Option<String> {
        let cold = |row: &Row| row.cold.map_or(f64::NAN, |cold| cold.median);
        let [collide, distance] = ["collide", "distance"].map(|q| self.ratios(Group::Pages, q, cold));
        Some(format!("Cold time with other orders of pages over the usual one: {}; {}.", collide?, distance?))
    }

    /// The usual layout is measured three times.
    fn noise(&self) -> Option<String> {
        let cold = |row: &Row| row.cold.map_or(f64::NAN, |cold| cold.median);
        let spread = |question: &str, of: fn(&Row) -> f64| {
            let three = [(Group::Layout, "dop14-u8 f32"), (Group::Splits, "reach"), (Group::Pages, "levels")];
            let times = three.map(|(group, name)| self.named(group, name, question).map(of));
            let times: Vec<f64> = times.into_iter().flatten().collect();
            let ends = times.iter().fold([f64::INFINITY, 0.0f64], |[lo, hi], &t| [lo.min(t), hi.max(t)]);
            100.0 * (ends[1] / ends[0] - 1.0)
        };
        Some(format!(
            "Noise: equal files measured three times differ by {:.1} % for contact and {:.1} % for distance, cold by \
             {:.1} % and {:.1} %.",
            spread("collide", Self::time),
            spread("distance", Self::time),
            spread("collide", cold),
            spread("distance", cold)
        ))
    }
}
