//! Values that change from frame to frame.

use serde::Deserialize;

/// A number or a list of numbers.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a number or a list of numbers")]
pub(super) enum Value {
    Number(f64),
    List(Vec<f64>),
}

/// `[[frame, value], ...]`: straight lines from key to key, and the first and last value before and after them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Vec<(f64, Value)>")]
pub(super) struct Track(Vec<(f64, Value)>);

impl TryFrom<Vec<(f64, Value)>> for Track {
    type Error = String;

    fn try_from(keys: Vec<(f64, Value)>) -> Result<Self, String> {
        let Some((_, first)) = keys.first() else {
            return Err("keyframes are a list of [frame, value]: there is none".into());
        };
        let is_finite = |(frame, value): &(f64, Value)| match value {
            Value::Number(x) => frame.is_finite() && x.is_finite(),
            Value::List(list) => frame.is_finite() && list.iter().all(|x| x.is_finite()),
        };
        if !keys.iter().all(is_finite) {
            return Err("keyframes are finite numbers: nan and inf have no values between them".into());
        }
        let alike = |a: &Value, b: &Value| match (a, b) {
            (Value::Number(_), Value::Number(_)) => true,
            (Value::List(a), Value::List(b)) => a.len() == b.len(),
            _ => false,
        };
        if keys.iter().any(|(_, value)| !alike(first, value)) {
            return Err("all keyframes of one path are numbers, or lists of one length".into());
        }
        if keys.windows(2).any(|pair| pair[0].0.partial_cmp(&pair[1].0) != Some(std::cmp::Ordering::Less)) {
            return Err("keyframes are in the order of their frames, each later than the one before".into());
        }
        Ok(Self(keys))
    }
}

impl Track {
    /// The value at a frame, as a scene file writes it.
    pub(super) fn at(&self, frame: u32) -> String {
        let frame = f64::from(frame);
        let after = self.0.iter().position(|(key, _)| *key >= frame).unwrap_or(self.0.len() - 1);
        let before = after.saturating_sub(1);
        let ((from, a), (to, b)) = (&self.0[before], &self.0[after]);
        // Between the first two keys `before < after`; outside of all keys the nearest one counts.
        let share = if to > from { ((frame - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        let between = |a: f64, b: f64| if share >= 1.0 { b } else { a + (b - a) * share };
        match (a, b) {
            (Value::List(a), Value::List(b)) => {
                let numbers = a.iter().zip(b).map(|(a, b)| number(between(*a, *b)));
                format!("[{}]", numbers.collect::<Vec<_>>().join(", "))
            }
            (Value::Number(a), Value::Number(b)) => number(between(*a, *b)),
            _ => unreachable!("the keys of a track are alike"),
        }
    }
}

/// A TOML number: whole ones without a point, so that they do for counts too.
fn number(x: f64) -> String {
    x.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(text: &str) -> Result<Track, String> {
        #[derive(Deserialize)]
        struct File {
            track: Track,
        }
        toml::from_str::<File>(&format!("track = {text}")).map(|file| file.track).map_err(|e| e.to_string())
    }

    #[test]
    fn values_go_straight_from_key_to_key_and_rest_outside() {
        let line = track("[[10, 0], [20, 5.0], [30, -5]]").unwrap();
        let values = [0, 10, 12, 20, 25, 30, 99].map(|frame| line.at(frame));
        assert_eq!(values, ["0", "0", "1", "5", "0", "-5", "-5"]);
        let eye = track("[[1, [0, 1, 5]], [3, [2, 1, 4]]]").unwrap();
        assert_eq!(eye.at(2), "[1, 1, 4.5]");
        assert_eq!(track("[[4, 7.5]]").unwrap().at(1), "7.5");
    }

    #[test]
    fn keys_that_make_no_sense_are_refused() {
        for (bad, why) in [
            ("[]", "there is none"),
            ("[[1, 2], [1, 3]]", "order"),
            ("[[1, 2], [2, [3]]]", "one length"),
            ("[[1, [2, 3]], [2, [3]]]", "one length"),
            ("[[1, \"x\"]]", "number"),
            ("[[1, 0], [2, nan]]", "finite"),
            ("[[1, [0, inf]], [2, [0, 1]]]", "finite"),
            ("[[nan, 0]]", "finite"),
        ] {
            let message = track(bad).unwrap_err();
            assert!(message.contains(why), "{bad}: {message}");
        }
    }
}
