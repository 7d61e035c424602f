//! Measured materials of the RGL database, as values of the class `Measured`: the tables of a file, with sums to sample
//! them by, and spectra as colours.

use rtsl::{Diagnostic, Numbers, Scalar, Value, diagnostic_codes as codes};
use rtsl_memory::Amount;

use super::images::Images;
use super::named_file::NamedFile;
use super::tensor::{TensorError, Tensors};
use crate::description::Entity;
use crate::reader::{Input, SceneFiles};
use crate::spectrum::daylight_weights;

/// The parameter of the format.
pub const PARAMETERS: &[&str] = &["filename"];

/// The greatest number of rows or columns of a table, and of views: products of sizes then fit 64 bits.
const MAX_SIZE: usize = 1 << 12;

/// The greatest number of all numbers: indices of the class are 32-bit integers.
const MAX_NUMBERS: usize = 1 << 30;

/// The values of the class for the file that a material names.
pub fn values(
    entity: &Entity,
    files: SceneFiles<'_>,
    _: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let file = NamedFile::of(entity, files)?;
    // Densities are stored with their sums, and colours are at most as long as spectra.
    let Input { bytes, held } = file.read(files, 4)?;
    let measured = Tensors::new(&bytes).and_then(|tensors| Measured::new(&tensors));
    let measured = measured.map_err(|error| {
        let message = format!("cannot read `{}`: {error}", file.path.display());
        let help = "expected a file of the RGL material database, whose name ends in `.bsdf`";
        file.at(Diagnostic::new(codes::UNREADABLE_FILE, message).help(help))
    })?;
    held.keep(Amount::of::<u32>(measured.tables.len()));
    Ok(measured.values())
}

/// Columns and rows of a table.
type Size = [usize; 2];

/// The arguments of the class.
#[derive(Debug)]
struct Measured {
    tables: Vec<u32>,
    views: Size,
    facets: Size,
    areas: Size,
    visible: Size,
    lit: Size,
}

impl Measured {
    fn new(tensors: &Tensors<'_>) -> Result<Measured, TensorError> {
        let [angles] = tensors.shape("theta_i")?;
        let [azimuths] = tensors.shape("phi_i")?;
        let [wavelengths] = tensors.shape("wavelengths")?;
        let sizes = [angles, azimuths, wavelengths];
        for (name, size) in ["theta_i", "phi_i", "wavelengths"].into_iter().zip(sizes) {
            check(name, "a list of 1 to 4096 numbers", (1..=MAX_SIZE).contains(&size))?;
        }
        let facets = table(tensors, "ndf")?;
        let areas = table(tensors, "sigma")?;
        let visible = slices(tensors, "vndf", [azimuths, angles])?;
        let lit = slices(tensors, "luminance", [azimuths, angles])?;
        let spectra: [usize; 5] = tensors.shape("spectra")?;
        let expected = [azimuths, angles, wavelengths, lit[1], lit[0]];
        check("spectra", "a spectrum for each number of `luminance`", spectra == expected)?;
        let weights = weights(tensors)?;
        let [visible_count, lit_count] = [visible, lit].map(|[columns, rows]| columns * rows);
        let count = azimuths * angles * (3 * visible_count + 6 * lit_count);
        check("vndf", "small enough: the tables have too many numbers", count <= MAX_NUMBERS)?;
        let mut tables = Vec::new();
        push(&mut tables, increasing(tensors, "theta_i")?);
        push(&mut tables, increasing(tensors, "phi_i")?);
        push(&mut tables, positive(tensors, "ndf")?);
        push(&mut tables, positive(tensors, "sigma")?);
        push(&mut tables, warps(&positive(tensors, "vndf")?, visible));
        push(&mut tables, warps(&positive(tensors, "luminance")?, lit));
        push(&mut tables, colors(&positive(tensors, "spectra")?, &weights, lit_count));
        Ok(Measured { tables, views: [angles, azimuths], facets, areas, visible, lit })
    }

    fn values(self) -> Vec<(String, Value)> {
        let Measured { tables, views, facets, areas, visible, lit } = self;
        let sizes = [
            ("views", views),
            ("facets", facets),
            ("areas", areas),
            ("visible", visible),
            ("lit", lit),
        ];
        let size = |(name, size): (&str, Size)| {
            (name.to_owned(), Value::List(size.map(|side| Value::Int(side as i32)).to_vec()))
        };
        let numbers = Value::Numbers(Numbers::from_words(Scalar::F32, tables));
        let tables = ("tables".to_owned(), numbers);
        std::iter::once(tables).chain(sizes.map(size)).collect()
    }
}

fn check(name: &'static str, expected: &str, holds: bool) -> Result<(), TensorError> {
    if holds { Ok(()) } else { Err(TensorError::Unexpected(name, expected.to_owned())) }
}

/// The size of a table, which has at least two rows and columns.
fn table(tensors: &Tensors<'_>, name: &'static str) -> Result<Size, TensorError> {
    let [rows, columns] = tensors.shape(name)?;
    let is_usable = [rows, columns].iter().all(|size| (2..=MAX_SIZE).contains(size));
    check(name, "a table of 2 to 4096 rows and columns", is_usable)?;
    Ok([columns, rows])
}

/// The size of tables for each azimuth and angle of a view.
fn slices(
    tensors: &Tensors<'_>,
    name: &'static str,
    views: [usize; 2],
) -> Result<Size, TensorError> {
    let [azimuths, angles, rows, columns] = tensors.shape(name)?;
    let is_usable = [rows, columns].iter().all(|size| (2..=MAX_SIZE).contains(size));
    let expected = "a table of 2 to 4096 rows and columns for each of `phi_i` and `theta_i`";
    check(name, expected, is_usable && [azimuths, angles] == views)?;
    Ok([columns, rows])
}

/// The numbers of a field, those below 0 as 0.
fn positive(tensors: &Tensors<'_>, name: &'static str) -> Result<Vec<f32>, TensorError> {
    let numbers: Vec<f32> = tensors.floats(name)?.map(|number| number.max(0.0)).collect();
    // Comparisons with NaN are false: the greatest of NaN and 0 is 0.
    let finite = tensors.floats(name)?.all(f32::is_finite);
    check(name, "of finite numbers", finite)?;
    Ok(numbers)
}

fn increasing(tensors: &Tensors<'_>, name: &'static str) -> Result<Vec<f32>, TensorError> {
    let numbers: Vec<f32> = tensors.floats(name)?.collect();
    let is_finite = numbers.iter().all(|number| number.is_finite());
    let rises = numbers.windows(2).all(|two| two[0] < two[1]);
    check(name, "of finite numbers that increase", is_finite && rises)?;
    Ok(numbers)
}

/// The parts of red, green and blue that each wavelength has.
fn weights(tensors: &Tensors<'_>) -> Result<Vec<[f32; 3]>, TensorError> {
    let wavelengths = increasing(tensors, "wavelengths")?;
    let wavelengths: Vec<f64> = wavelengths.into_iter().map(f64::from).collect();
    let weights = daylight_weights(&wavelengths).into_iter();
    Ok(weights.map(|weight| weight.map(|part| part as f32)).collect())
}

fn push(tables: &mut Vec<u32>, numbers: Vec<f32>) {
    tables.extend(numbers.into_iter().map(f32::to_bits));
}

/// The densities of all slices, such that each integrates to 1 over its cells, then the sums along the rows of all,
/// then the sums of rows.
fn warps(numbers: &[f32], [columns, rows]: Size) -> Vec<f32> {
    let count = columns * rows;
    let slices = numbers.len() / count;
    let mut densities = Vec::with_capacity(slices * count);
    let mut along = Vec::with_capacity(slices * count);
    let mut sums = Vec::with_capacity(slices * rows);
    let flat = vec![1.0; count];
    for slice in numbers.chunks_exact(count) {
        // A slice without any light has none to sample: any density serves.
        let slice = if slice.iter().any(|number| *number > 0.0) { slice } else { &flat };
        let in_rows: Vec<Vec<f64>> = slice.chunks_exact(columns).map(sums_of_cells).collect();
        let last: Vec<f64> = in_rows.iter().map(|row| row[columns - 1]).collect();
        let up: Vec<f64> = cumulative(&last);
        let scale = 1.0 / up[rows - 1];
        densities.extend(slice.iter().map(|number| (f64::from(*number) * scale) as f32));
        along.extend(in_rows.iter().flatten().map(|sum| (sum * scale) as f32));
        sums.extend(up.iter().map(|sum| (sum * scale) as f32));
    }
    densities.extend(along);
    densities.extend(sums);
    densities
}

fn sums_of_cells(row: &[f32]) -> Vec<f64> {
    let row: Vec<f64> = row.iter().map(|number| f64::from(*number)).collect();
    cumulative(&row)
}

/// The integral from the first number to each, of a function that is linear between them.
fn cumulative(numbers: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![0.0];
    for two in numbers.windows(2) {
        sum += 0.5 * (two[0] + two[1]);
        sums.push(sum);
    }
    sums
}

/// The colour of each of `count` places of all slices, from their reflectance at each wavelength.
fn colors(spectra: &[f32], weights: &[[f32; 3]], count: usize) -> Vec<f32> {
    let mut colors = Vec::with_capacity(3 * spectra.len() / weights.len());
    for slice in spectra.chunks_exact(weights.len() * count) {
        for place in 0..count {
            let mut color = [0.0; 3];
            for (wavelength, weight) in weights.iter().enumerate() {
                let value = slice[wavelength * count + place];
                for (channel, part) in color.iter_mut().zip(weight) {
                    *channel += value * part;
                }
            }
            colors.extend(color.map(|channel| channel.max(0.0)));
        }
    }
    colors
}
