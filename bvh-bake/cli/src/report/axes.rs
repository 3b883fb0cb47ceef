//! Axes of figures: from values to places, round numbers to mark, and the frame around.

use super::html::escape;
use std::fmt::Write;

/// The rectangle of a figure.
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

impl Frame {
    /// Where the least and the largest value of the upright axis are.
    pub(super) fn upward(&self) -> [f64; 2] {
        [self.bottom - 8.0, self.top + 8.0]
    }

    /// Draws it, with lines and numbers at these places and names of the axes.
    pub(super) fn draw(
        &self,
        across: impl Iterator<Item = (f64, String)>,
        name_across: &str,
        up: impl Iterator<Item = (f64, String)>,
        name_up: &str,
        text: &mut String,
    ) {
        let Self { left, right, top, bottom } = *self;
        let _ = writeln!(
            text,
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
            right - left,
            bottom - top
        );
        for (at, shown) in up {
            let _ = writeln!(text, "<path class=\"tick\" d=\"M{left} {at:.1}H{right}\"/>");
            let _ = writeln!(
                text,
                "<text text-anchor=\"end\" x=\"{}\" y=\"{:.1}\">{shown}</text>",
                left - 6.0,
                at + 4.0
            );
        }
        for (at, shown) in across {
            let _ = writeln!(text, "<path class=\"tick\" d=\"M{at:.1} {top}V{bottom}\"/>");
            let _ = writeln!(
                text,
                "<text text-anchor=\"middle\" x=\"{at:.1}\" y=\"{}\">{shown}</text>",
                bottom + 16.0
            );
        }
        let middle = (left + right) / 2.0;
        let _ = writeln!(
            text,
            "<text text-anchor=\"middle\" x=\"{middle}\" y=\"{}\">{}</text>",
            bottom + 36.0,
            escape(name_across)
        );
        let _ = writeln!(text, "<text x=\"{left}\" y=\"{}\">{}</text>", top - 8.0, escape(name_up));
    }
}

/// From figures to places.
pub(super) struct Scale {
    is_logarithmic: bool,
    /// Least and largest figure, or their logarithms.
    ends: [f64; 2],
    places: [f64; 2],
}

impl Scale {
    /// Around the positive ones of some values.
    pub(super) fn logarithmic(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let logs = values.filter(|&value| value > 0.0).map(f64::log10);
        let [lo, hi] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        // Nothing to show, or all the same: a decade around it.
        let ends = match hi - lo {
            range if range > 0.1 => [lo, hi],
            range if range >= 0.0 => [lo - 0.5, hi + 0.5],
            _ => [0.0, 1.0],
        };
        Self { is_logarithmic: true, ends, places }
    }

    /// From 0 on.
    pub(super) fn linear(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let largest = values.fold(0.0, f64::max);
        Self { is_logarithmic: false, ends: [0.0, if largest > 0.0 { largest } else { 1.0 }], places }
    }

    pub(super) fn place(&self, value: f64) -> f64 {
        let value = if self.is_logarithmic { value.log10() } else { value };
        let part = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.places[0] + part * (self.places[1] - self.places[0])
    }

    /// Round figures: 1, 2 and 5 of each decade, or only 1 if there are many; of a linear scale about six.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let [lo, hi] = self.ends;
        if !self.is_logarithmic {
            let step = 10f64.powf((hi / 6.0).log10().ceil());
            let step = if hi / step < 3.0 { step / 5.0 } else { step };
            let count = (hi / step) as u32;
            return (0..=count).map(|number| f64::from(number) * step).collect();
        }
        let factors: &[f64] = if hi - lo > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = lo.floor() as i32..=hi.ceil() as i32;
        // Parsed, since powers of ten may come out a rounding away from the figure that is meant.
        let tick = |decade: i32, factor: f64| format!("{factor}e{decade}").parse::<f64>().unwrap_or(f64::NAN);
        let all = decades.flat_map(|decade| factors.iter().map(move |&factor| tick(decade, factor)));
        all.filter(|tick| (lo..=hi).contains(&tick.log10())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_ticks_within_their_ends() {
        let scale = Scale::logarithmic([300.0, 9000.0, 0.0].into_iter(), [100.0, 0.0]);
        assert_eq!(scale.ticks(), [500.0, 1000.0, 2000.0, 5000.0]);
        assert_eq!((scale.place(300.0), scale.place(9000.0)), (100.0, 0.0));
        assert_eq!(
            Scale::linear([60.0].into_iter(), [0.0, 1.0]).ticks(),
            [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
        );
        for none in
            [Scale::logarithmic(std::iter::empty(), [0.0, 1.0]), Scale::linear([0.0].into_iter(), [0.0, 1.0])]
        {
            assert!(none.place(1.0).is_finite() && none.ticks().iter().all(|tick| tick.is_finite()));
        }
    }
}
