//! `curve`: hair and fur, as arguments of the library's class `Curve`, whose curves are cubic Beziers.

use rtsl::{Diagnostic, Numbers, Value, diagnostic_codes as codes};
use rtsl_memory::Amount;

use super::images::Images;
use crate::description::Entity;
use crate::reader::{Parameter, SceneFiles, Values};

/// The greatest number of times that curves are halved.
const MOST_SPLITS: f64 = 10.0;

type Point = [f64; 3];

/// The parameters that are read here.
pub const PARAMETERS: &[&str] =
    &["P", "N", "basis", "degree", "type", "width", "width0", "width1", "splitdepth"];

/// The arguments of the class for `entity`.
///
/// # Errors
/// If a parameter is wrong, or the curves would take too much memory.
pub fn curves(
    entity: &Entity,
    files: SceneFiles<'_>,
    _: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let reader = Reader { entity };
    let basis = Basis::read(&reader)?;
    let points = reader.vectors("P")?;
    let count =
        basis.curves(points.len()).ok_or_else(|| reader.wrong_count(basis, points.len()))?;
    let splits = reader.number("splitdepth", 3.0)?.clamp(0.0, MOST_SPLITS) as u32;
    // Kernels count pieces in 31 bits.
    let pieces = count << splits.min((i32::MAX as usize / count).ilog2());
    let splits = (pieces / count).ilog2();
    let amount = Amount::of::<f32>(3 * 4 + 2 + 3 * 2).times(count) + Amount::of::<i32>(pieces);
    let held = files
        .budget
        .hold(amount)
        .map_err(|error| Box::new(error.diagnostic("curve").at(entity.class_span, "this shape")))?;
    let mut controls = Vec::with_capacity(12 * count);
    for curve in 0..count {
        let four = basis.bezier(&points, curve);
        controls.extend(four.into_iter().flatten().map(|coordinate| coordinate as f32));
    }
    let kind = reader.text("type")?.unwrap_or("flat");
    let normals = match kind {
        "ribbon" => reader.normals(count)?,
        _ => Vec::new(),
    };
    let arguments = vec![
        ("points".to_owned(), Value::Numbers(Numbers::floats(controls))),
        ("widths".to_owned(), Value::Numbers(Numbers::floats(reader.widths(count)?))),
        ("normals".to_owned(), Value::Numbers(Numbers::floats(normals))),
        ("round".to_owned(), Value::Bool(kind != "flat" && kind != "ribbon")),
        ("splits".to_owned(), Value::Int(splits as i32)),
        ("pieces".to_owned(), Value::Numbers(Numbers::ints(0..pieces as i32))),
    ];
    held.keep(amount);
    Ok(arguments)
}

/// The meaning of the control points.
#[derive(Clone, Copy, Debug)]
enum Basis {
    /// Bezier curves that share their ends.
    Bezier { degree: usize },
    /// A uniform B-spline.
    Spline { degree: usize },
}

impl Basis {
    fn read(reader: &Reader<'_>) -> Result<Basis, Box<Diagnostic>> {
        let degree = match reader.number("degree", 3.0)? {
            2.0 => 2,
            3.0 => 3,
            _ => return Err(reader.wrong("degree", "2 or 3")),
        };
        match reader.text("basis")? {
            None | Some("bezier") => Ok(Basis::Bezier { degree }),
            Some("bspline") => Ok(Basis::Spline { degree }),
            Some(_) => Err(reader.wrong("basis", "`bezier` or `bspline`")),
        }
    }

    /// The number of curves of so many control points; `None` if they make no whole number.
    fn curves(self, points: usize) -> Option<usize> {
        match self {
            Basis::Bezier { degree } => {
                let sides = points.checked_sub(1)?;
                (sides > 0 && sides.is_multiple_of(degree)).then_some(sides / degree)
            }
            Basis::Spline { degree } => points.checked_sub(degree).filter(|curves| *curves > 0),
        }
    }

    /// The control points of a curve as a cubic Bezier.
    fn bezier(self, points: &[Point], curve: usize) -> [Point; 4] {
        match self {
            Basis::Bezier { degree: 3 } => std::array::from_fn(|index| points[3 * curve + index]),
            Basis::Bezier { .. } => {
                elevated(std::array::from_fn(|index| points[2 * curve + index]))
            }
            Basis::Spline { degree: 3 } => {
                let [a, b, c, d] = std::array::from_fn(|index| points[curve + index]);
                [
                    mean([(1.0, a), (4.0, b), (1.0, c)]),
                    mean([(4.0, b), (2.0, c), (0.0, d)]),
                    mean([(2.0, b), (4.0, c), (0.0, d)]),
                    mean([(1.0, b), (4.0, c), (1.0, d)]),
                ]
            }
            Basis::Spline { .. } => {
                let [a, b, c] = std::array::from_fn(|index| points[curve + index]);
                elevated([
                    mean([(1.0, a), (1.0, b), (0.0, c)]),
                    b,
                    mean([(1.0, b), (1.0, c), (0.0, a)]),
                ])
            }
        }
    }
}

/// The cubic that is the same curve as a quadratic.
fn elevated([a, b, c]: [Point; 3]) -> [Point; 4] {
    [a, mean([(1.0, a), (2.0, b), (0.0, c)]), mean([(2.0, b), (1.0, c), (0.0, a)]), c]
}

fn mean(terms: [(f64, Point); 3]) -> Point {
    let weights: f64 = terms.iter().map(|(weight, _)| weight).sum();
    std::array::from_fn(|axis| {
        terms.iter().map(|(weight, point)| weight * point[axis]).sum::<f64>() / weights
    })
}

/// The parameters of the shape.
struct Reader<'e> {
    entity: &'e Entity,
}

impl<'e> Reader<'e> {
    fn find(&self, name: &str) -> Option<&'e Parameter> {
        self.entity.parameter(name)
    }

    fn wrong(&self, name: &str, expected: &str) -> Box<Diagnostic> {
        let message = format!("`{name}` of `curve` must be {expected}");
        let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
        let span = self.find(name).map_or(self.entity.class_span, |it| it.values_span);
        Box::new(diagnostic.at(span, ""))
    }

    fn wrong_count(&self, basis: Basis, found: usize) -> Box<Diagnostic> {
        let expected = match basis {
            Basis::Bezier { degree } => {
                format!("{} points and {degree} more for each further curve", degree + 1)
            }
            Basis::Spline { degree } => format!("at least {} points", degree + 1),
        };
        self.wrong("P", &format!("{expected}, found {found}"))
    }

    fn numbers(&self, name: &str) -> Result<&'e [f64], Box<Diagnostic>> {
        match self.find(name).map(|parameter| &parameter.values) {
            Some(Values::Numbers(numbers)) if numbers.iter().all(|it| (*it as f32).is_finite()) => {
                Ok(numbers)
            }
            Some(_) => Err(self.wrong(name, "finite numbers")),
            None => Ok(&[]),
        }
    }

    fn number(&self, name: &str, default: f64) -> Result<f64, Box<Diagnostic>> {
        match self.numbers(name)? {
            [] => Ok(default),
            [number] => Ok(*number),
            _ => Err(self.wrong(name, "one number")),
        }
    }

    fn text(&self, name: &str) -> Result<Option<&'e str>, Box<Diagnostic>> {
        match self.find(name).map(|parameter| &parameter.values) {
            Some(Values::Texts(texts)) if texts.len() == 1 => Ok(Some(&texts[0])),
            Some(_) => Err(self.wrong(name, "one string")),
            None => Ok(None),
        }
    }

    fn vectors(&self, name: &str) -> Result<Vec<Point>, Box<Diagnostic>> {
        let numbers = self.numbers(name)?;
        if !numbers.len().is_multiple_of(3) {
            return Err(self.wrong(name, "three numbers for each point"));
        }
        Ok(numbers.chunks_exact(3).map(|it| [it[0], it[1], it[2]]).collect())
    }

    /// Widths at both ends of each curve: they change evenly from the first curve to the last.
    fn widths(&self, curves: usize) -> Result<Vec<f32>, Box<Diagnostic>> {
        let both = self.number("width", 1.0)?;
        let (first, last) = (self.number("width0", both)?, self.number("width1", both)?);
        let at = |end: usize| {
            let part = end as f64 / curves as f64;
            ((1.0 - part) * first + part * last) as f32
        };
        Ok((0..curves).flat_map(|curve| [at(curve), at(curve + 1)]).collect())
    }

    /// Normals at both ends of each curve.
    fn normals(&self, curves: usize) -> Result<Vec<f32>, Box<Diagnostic>> {
        let normals = self.vectors("N")?;
        if normals.len() != curves + 1 {
            let expected = format!("{} normals, one for each end of a curve", curves + 1);
            return Err(self.wrong("N", &expected));
        }
        let both = normals.windows(2).flatten().flatten();
        Ok(both.map(|coordinate| *coordinate as f32).collect())
    }
}
