//! Amounts of memory and their text form.

use std::fmt;
use std::iter::Sum;
use std::ops::{Add, AddAssign};
use std::str::FromStr;

/// A number of bytes. Arithmetic saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Amount(pub u64);

/// Units with their names, the least first.
const UNITS: [(&str, u64); 4] =
    [("KiB", 1 << 10), ("MiB", 1 << 20), ("GiB", 1 << 30), ("TiB", 1 << 40)];

impl Amount {
    /// Returns the bytes of `count` values.
    pub fn of<T>(count: usize) -> Self {
        Amount((count as u64).saturating_mul(size_of::<T>() as u64))
    }

    /// Returns the amount multiplied by `count`.
    pub fn times(self, count: usize) -> Self {
        Amount(self.0.saturating_mul(count as u64))
    }

    /// Returns the amount minus `other`, at least 0.
    pub fn without(self, other: Amount) -> Self {
        Amount(self.0.saturating_sub(other.0))
    }
}

impl Add for Amount {
    type Output = Amount;

    fn add(self, other: Amount) -> Amount {
        Amount(self.0.saturating_add(other.0))
    }
}

impl AddAssign for Amount {
    fn add_assign(&mut self, other: Amount) {
        *self = *self + other;
    }
}

impl Sum for Amount {
    fn sum<I: Iterator<Item = Amount>>(amounts: I) -> Amount {
        amounts.fold(Amount(0), Amount::add)
    }
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, unit) = match self.0 {
            0..0x10_0000 => UNITS[0],
            0x10_0000..0x4000_0000 => UNITS[1],
            0x4000_0000.. => UNITS[2],
        };
        write!(f, "{:.1} {name}", self.0 as f64 / unit as f64)
    }
}

impl FromStr for Amount {
    type Err = String;

    /// Parses a number with a unit, for example `512MiB` or `1.5GiB`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = UNITS.iter().find_map(|(name, unit)| {
            let number: f64 = text.strip_suffix(name)?.trim_end().parse().ok()?;
            let bytes = number * *unit as f64;
            (number > 0.0 && bytes <= i64::MAX as f64).then_some(Amount(bytes as u64))
        });
        found.ok_or_else(|| "expected an amount of memory, such as 512MiB or 4GiB".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_written_with_units() {
        let parsed = |text: &str| text.parse::<Amount>().ok();
        assert_eq!(parsed("4GiB"), Some(Amount(4 << 30)));
        assert_eq!(parsed("1.5 MiB"), Some(Amount(3 << 19)));
        assert_eq!(parsed("1TiB"), Some(Amount(1 << 40)));
        for text in ["4", "4GB", "-1GiB", "0MiB", "nanGiB", "infGiB", "1e30GiB", "GiB", ""] {
            assert_eq!(parsed(text), None, "{text}");
        }
        let shown = [0, 1 << 10, 3 << 19, 5 << 29].map(|bytes| Amount(bytes).to_string());
        assert_eq!(shown, ["0.0 KiB", "1.0 KiB", "1.5 MiB", "2.5 GiB"]);
    }
}
