//! The reader of photometric files of the format IES LM-63, of 1986, 1991, 1995, 2002 and 2019.
//!
//! A file has lines of keywords, a line `TILT=`, and then numbers between white space: those of the lamps and the
//! luminaire, the vertical and horizontal angles, and candela for each pair of angles. IES LM-63-2019 and its
//! predecessors define them.

use std::fmt::{self, Display};

use rtsl::encoding;

/// The greatest number of vertical or horizontal angles: products of both then fit 32 bits.
const MAX_ANGLES: usize = 1 << 15;

/// Half a thousandth of a degree: files round angles.
const TOLERANCE: f64 = 5e-4;

/// A profile with photometry of type C: angles in degrees, and candela for each horizontal angle and all vertical ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    pub verticals: Vec<f32>,
    pub horizontals: Vec<f32>,
    pub candela: Vec<f32>,
}

/// An error of a file, at a line.
#[derive(Debug, PartialEq)]
pub struct PhotometryError {
    pub line: usize,
    pub problem: String,
    pub remedy: &'static str,
}

const REMEDY: &str =
    "expected a photometric file of the format IES LM-63, whose name ends in `.ies`";

impl Photometry {
    /// Reads a file. The luminaire is tilted by these degrees, on which the light of some lamps depends.
    ///
    /// # Errors
    /// If the file does not have the format, or photometry of another type.
    pub fn read(bytes: &[u8], tilt: f64) -> Result<Photometry, PhotometryError> {
        encoding::check_width(bytes).map_err(|problem| PhotometryError::new(1, problem, REMEDY))?;
        let Header { has_lamp_factor, tilt_kind, mut words } = Header::read(bytes)?;
        let mut scale = match tilt_kind {
            Tilt::None => 1.0,
            Tilt::Included => tilt_factor(&mut words, tilt)?,
        };
        words.number("the number of lamps")?;
        words.number("the lumens of a lamp")?;
        scale *= words.factor("the multiplier of candela")?;
        let verticals = words.count("vertical angles", MAX_ANGLES)?;
        let horizontals = words.count("horizontal angles", MAX_ANGLES)?;
        words.expect_type_c()?;
        for what in ["the unit of length", "the width", "the length", "the height"] {
            words.number(what)?;
        }
        scale *= words.factor("the ballast factor")?;
        let lamp_factor = words.number("the number after the ballast factor")?;
        if has_lamp_factor && lamp_factor > 0.0 {
            scale *= lamp_factor;
        }
        words.number("the input watts")?;
        words.check_room(verticals + horizontals + verticals * horizontals)?;
        let verticals = words.angles("vertical angle", verticals, 180.0)?;
        let horizontals = words.angles("horizontal angle", horizontals, 360.0)?;
        words.check_symmetry(&horizontals)?;
        let candela = words.candela(scale, horizontals.len() * verticals.len())?;
        Ok(Photometry { verticals, horizontals, candela })
    }
}

/// The part of a file before its numbers.
struct Header<'a> {
    /// True if the number after the ballast factor is one of the lamp on the ballast. In 2002 it is reserved, and in
    /// 2019 it tells how the file was made.
    has_lamp_factor: bool,
    tilt_kind: Tilt,
    words: Words<'a>,
}

/// The dependence of the light on the tilt of the luminaire.
enum Tilt {
    None,
    Included,
}

impl<'a> Header<'a> {
    fn read(bytes: &'a [u8]) -> Result<Header<'a>, PhotometryError> {
        let mut rest = encoding::without_mark(bytes);
        let mut line = 0;
        let mut has_lamp_factor = true;
        while !rest.is_empty() {
            let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            let end = end.unwrap_or(rest.len());
            let text = rest[..end].trim_ascii();
            let is_pair = rest[end..].starts_with(b"\r\n");
            rest = rest.get(end + 1 + usize::from(is_pair)..).unwrap_or(&[]);
            line += 1;
            if line == 1 {
                has_lamp_factor = !text.ends_with(b"2002") && !text.ends_with(b"2019");
            }
            if let Some(tilt) = tilt_of(text) {
                let tilt_kind = Tilt::of(tilt, line)?;
                let words = Words { rest, line: line + 1 };
                return Ok(Header { has_lamp_factor, tilt_kind, words });
            }
        }
        Err(PhotometryError::new(line.max(1), "the file has no line `TILT=`", REMEDY))
    }
}

/// The text after `TILT=`.
fn tilt_of(line: &[u8]) -> Option<&[u8]> {
    let (name, rest) = line.split_at_checked(4)?;
    let rest = rest.trim_ascii_start().strip_prefix(b"=")?;
    name.eq_ignore_ascii_case(b"TILT").then(|| rest.trim_ascii())
}

impl Tilt {
    fn of(text: &[u8], line: usize) -> Result<Tilt, PhotometryError> {
        if text.eq_ignore_ascii_case(b"NONE") {
            return Ok(Tilt::None);
        }
        if text.eq_ignore_ascii_case(b"INCLUDE") {
            return Ok(Tilt::Included);
        }
        let problem = format!("`TILT={}` names a file, which is not read", shown(text));
        let remedy = "write `TILT=INCLUDE`, and the four lines of that file after it";
        Err(PhotometryError::new(line, problem, remedy))
    }
}

/// Reads the multipliers for angles by which the luminaire is tilted, and returns that of one angle. The geometry of
/// lamp and luminaire before them tells how the lamp turns with the luminaire, which the angles already follow.
fn tilt_factor(words: &mut Words<'_>, tilt: f64) -> Result<f64, PhotometryError> {
    let line = words.line();
    let geometry = words.number("the geometry of lamp and luminaire")?;
    if ![1.0, 2.0, 3.0].contains(&geometry) {
        let problem = format!("the geometry of lamp and luminaire is {geometry}");
        let remedy = "expected 1 for an upright lamp, 2 or 3 for a horizontal one";
        return Err(PhotometryError::new(line, problem, remedy));
    }
    let count = words.count("angles of tilt", MAX_ANGLES)?;
    words.check_room(2 * count)?;
    let angles = words.angles("angle of tilt", count, 180.0)?;
    let mut factors = Vec::with_capacity(count);
    for index in 1..=count {
        factors.push(words.factor(format_args!("multiplier {index} of the tilt"))?);
    }
    Ok(interpolated(&angles, &factors, tilt))
}

/// The value at a place between places in ascending order; at both ends those of the first and the last one.
fn interpolated(places: &[f32], values: &[f64], place: f64) -> f64 {
    let after = places.partition_point(|it| f64::from(*it) <= place);
    if after == 0 || after == places.len() {
        return values[after.saturating_sub(1)];
    }
    let [low, high] = [places[after - 1], places[after]].map(f64::from);
    let part = (place - low) / (high - low);
    values[after - 1] + part * (values[after] - values[after - 1])
}

/// Numbers between white space or commas.
struct Words<'a> {
    rest: &'a [u8],
    /// The line of the rest.
    line: usize,
}

impl<'a> Words<'a> {
    /// Moves on to the next word.
    fn skip_space(&mut self) {
        while let [first @ (b' ' | b'\t' | b'\r' | b'\n' | b',' | 0x0b | 0x0c), rest @ ..] =
            self.rest
        {
            // Lines end with a line feed, a carriage return, or both.
            let ends = *first == b'\n' || (*first == b'\r' && rest.first() != Some(&b'\n'));
            self.line += usize::from(ends);
            self.rest = rest;
        }
    }

    /// The line of the next word.
    fn line(&mut self) -> usize {
        self.skip_space();
        self.line
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let is_end = |byte: &u8| byte.is_ascii_whitespace() || matches!(*byte, b',' | 0x0b);
        let end = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    fn error(&self, problem: impl Into<String>, remedy: &'static str) -> PhotometryError {
        PhotometryError::new(self.line, problem, remedy)
    }

    fn number(&mut self, what: impl Display) -> Result<f64, PhotometryError> {
        let Some(word) = self.next() else {
            let problem = format!("the file ends before {what}");
            return Err(self.error(problem, "it was cut off: copy or download it again"));
        };
        let number = str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        number.filter(|number| number.is_finite()).ok_or_else(|| {
            let problem = format!("{what} is `{}`", shown(word));
            self.error(problem, "expected a number")
        })
    }

    /// A number that is not negative.
    fn factor(&mut self, what: impl Display) -> Result<f64, PhotometryError> {
        let number = self.number(&what)?;
        if number < 0.0 {
            let problem = format!("{what} is {number}");
            return Err(self.error(problem, "expected a number that is not negative"));
        }
        Ok(number)
    }

    fn count(&mut self, what: &str, most: usize) -> Result<usize, PhotometryError> {
        let number = self.number(format_args!("the number of {what}"))?;
        if number.fract() != 0.0 || !(1.0..=most as f64).contains(&number) {
            let problem = format!("the number of {what} is {number}");
            return Err(self.error(problem, "expected a whole number from 1 to 32768"));
        }
        Ok(number as usize)
    }

    fn expect_type_c(&mut self) -> Result<(), PhotometryError> {
        let number = self.number("the type of photometry")?;
        let problem = match number {
            1.0 => return Ok(()),
            2.0 => "the file has photometry of type B, for floodlights".to_owned(),
            3.0 => "the file has photometry of type A, for headlights of vehicles".to_owned(),
            _ => format!("the type of photometry is {number}, which is none of 1, 2 and 3"),
        };
        let remedy =
            "only type C is read, whose angles are about the vertical axis: convert the file to it";
        Err(self.error(problem, remedy))
    }

    /// Checks that so many numbers can follow, before memory is reserved for them.
    fn check_room(&self, numbers: usize) -> Result<(), PhotometryError> {
        let most = self.rest.len() / 2 + 1;
        if numbers <= most {
            return Ok(());
        }
        let problem = format!("{numbers} numbers should follow, but the file ends before");
        Err(self.error(problem, "it was cut off, or its numbers of angles are wrong"))
    }

    /// Angles in ascending order from 0 to a greatest one.
    fn angles(&mut self, what: &str, count: usize, most: f64) -> Result<Vec<f32>, PhotometryError> {
        let mut angles: Vec<f32> = Vec::with_capacity(count);
        for index in 1..=count {
            let angle = self.number(format_args!("{what} {index}"))?;
            if !(-TOLERANCE..=most + TOLERANCE).contains(&angle) {
                let problem = format!("{what} {index} is {angle}, not within 0 to {most} degrees");
                return Err(self.error(problem, "only photometry of type C is read"));
            }
            let angle = angle.clamp(0.0, most) as f32;
            if let Some(before) = angles.last().filter(|before| **before >= angle) {
                let problem = format!("{what} {index} is {angle}, after {before}");
                return Err(self.error(problem, "expected angles in ascending order"));
            }
            angles.push(angle);
        }
        Ok(angles)
    }

    /// Checks that horizontal angles are those of a profile that is whole, or symmetric.
    fn check_symmetry(&self, angles: &[f32]) -> Result<(), PhotometryError> {
        let is = |angle: f32, expected: f64| (f64::from(angle) - expected).abs() < TOLERANCE;
        let (Some(&first), Some(&last)) = (angles.first(), angles.last()) else { return Ok(()) };
        let is_whole = is(first, 0.0) && last > 180.5;
        let is_half = is(first, 0.0) && [0.0, 90.0, 180.0].iter().any(|end| is(last, *end));
        if angles.len() == 1 || is_whole || is_half || (is(first, 90.0) && is(last, 270.0)) {
            return Ok(());
        }
        let problem = format!("the horizontal angles go from {first} to {last} degrees");
        let remedy = "expected 0 alone, or 0 to 90, 0 to 180, 90 to 270 or 0 to 360";
        Err(self.error(problem, remedy))
    }

    fn candela(&mut self, scale: f64, count: usize) -> Result<Vec<f32>, PhotometryError> {
        let mut candela = Vec::with_capacity(count);
        for index in 1..=count {
            let scaled = (self.factor(format_args!("intensity {index}"))? * scale) as f32;
            if !scaled.is_finite() {
                let problem = format!("intensity {index} times its multipliers is too great");
                return Err(self.error(problem, "expected candela and factors of a luminaire"));
            }
            candela.push(scaled);
        }
        Ok(candela)
    }
}

impl PhotometryError {
    fn new(line: usize, problem: impl Into<String>, remedy: &'static str) -> Self {
        PhotometryError { line, problem: problem.into(), remedy }
    }
}

impl Display for PhotometryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.problem)
    }
}

/// The start of a text of the file, for a message.
fn shown(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(&text[..text.len().min(80)]);
    text.chars().take(40).flat_map(char::escape_debug).collect()
}
