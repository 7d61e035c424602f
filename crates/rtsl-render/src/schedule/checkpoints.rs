//! Conversion of the film to checkpoints, and the schedule of writing them.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rtsl_bvh::LANES;
use rtsl_memory::{Amount, OutOfMemory, reserved};

use super::tile::TILE;
use crate::checkpoint::{Checkpoint, CheckpointError, Damage, Fingerprint, Numbers, Section};
use crate::film::features::{Features, FirstHitSums};
use crate::film::sample_film::{SampleFilm, TileRecord, TileWork};
use crate::statistics::LaneUse;

/// The checkpoint options of a render.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    /// The file.
    pub path: PathBuf,
    /// The interval of writing; if `None`, only a render that ends early writes one.
    pub every: Option<Duration>,
    /// True if the render resumes from the file. If there is no such file, it starts from the beginning.
    pub resume: bool,
    /// The inputs that the image depends on.
    pub fingerprint: Fingerprint,
}

impl Checkpoints {
    /// The memory for writing or reading a checkpoint, besides the film's, which may count work.
    pub fn memory(
        (width, height): (usize, usize),
        features: &Features,
        counts_work: bool,
    ) -> Amount {
        let tiles = width.div_ceil(TILE).saturating_mul(height.div_ceil(TILE));
        FilmNumbers::memory(tiles, features, counts_work)
    }
}

/// The state of checkpoints during a render.
pub struct CheckpointWriter<'a> {
    checkpoints: &'a Checkpoints,
    /// The time of the last attempt.
    last: Mutex<Instant>,
}

impl<'a> CheckpointWriter<'a> {
    /// For a render that starts now.
    pub fn new(checkpoints: &'a Checkpoints) -> Self {
        CheckpointWriter { checkpoints, last: Mutex::new(Instant::now()) }
    }

    /// Writes a checkpoint if it is due and no other thread is writing one. The render continues if that fails, and a
    /// later attempt follows; only the error of the last one is reported.
    pub fn write_if_due(&self, film: &SampleFilm) {
        let Some(every) = self.checkpoints.every else { return };
        let Ok(mut last) = self.last.try_lock() else { return };
        if last.elapsed() >= every {
            let _ = write(film, self.checkpoints);
            *last = Instant::now();
        }
    }

    /// Writes a last checkpoint.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_last(&self, film: &SampleFilm) -> Result<(), CheckpointError> {
        write(film, self.checkpoints)
    }

    /// True if checkpoints are written during the render.
    pub fn is_periodic(&self) -> bool {
        self.checkpoints.every.is_some()
    }
}

/// The numbers of tiles of a film that follow each other.
#[derive(Default)]
struct FilmNumbers {
    taken: Vec<u32>,
    done: Vec<u32>,
    dropped: Vec<u32>,
    seconds: Vec<f64>,
    sums: Vec<f64>,
    squares: Vec<f64>,
    distances: Vec<f64>,
    hits: Vec<u32>,
    objects: Vec<f32>,
    /// The counted work; empty if none was.
    visits: Vec<u32>,
    visited_samples: Vec<u32>,
    lane_use: Vec<f64>,
    /// The outputs, each with the name of its section.
    outputs: Vec<(String, Vec<f64>)>,
}

/// The greatest numbers that a render may leave: of samples of a pixel, of seconds for a tile (30 million years), and
/// of lanes.
const MAX_SAMPLES: u32 = 1 << 31;
const MAX_SECONDS: f64 = 1e15;
const MAX_LANES: f64 = (1_u64 << 62) as f64;

/// The prefix of the names of sections of outputs.
const OUTPUT: &str = "output ";

/// Writes a checkpoint of a film.
///
/// # Errors
/// If it cannot be written.
pub fn write(film: &SampleFilm, checkpoints: &Checkpoints) -> Result<(), CheckpointError> {
    let no_memory = |error: OutOfMemory| CheckpointError::Unwritable {
        path: checkpoints.path.clone(),
        reason: error.to_string(),
    };
    let numbers = FilmNumbers::of(film, 0..film.tiles().len()).map_err(no_memory)?;
    let fingerprint = checkpoints.fingerprint.clone();
    Checkpoint { fingerprint, sections: numbers.sections() }.write(&checkpoints.path)
}

/// Returns the sums of tiles of a film in the form of a checkpoint with this fingerprint.
///
/// # Errors
/// If there is not enough memory.
pub fn to_bytes(
    film: &SampleFilm,
    tiles: Range<usize>,
    fingerprint: Fingerprint,
) -> Result<Vec<u8>, OutOfMemory> {
    let numbers = FilmNumbers::of(film, tiles)?;
    let mut bytes = Vec::new();
    let checkpoint = Checkpoint { fingerprint, sections: numbers.sections() };
    // Writing to memory does not fail.
    let _ = checkpoint.write_to(&mut bytes);
    Ok(bytes)
}

/// Sets tiles of a film to the sums of [`to_bytes`]. If there is an error, nothing changes.
///
/// # Errors
/// If the bytes are damaged, or belong to another render, as a sentence.
pub fn from_bytes(
    film: &SampleFilm,
    tiles: Range<usize>,
    expected: &Fingerprint,
    bytes: &[u8],
) -> Result<(), String> {
    let checkpoint = Checkpoint::from_bytes(bytes).map_err(|damage| damage.to_string())?;
    if let Some(difference) = checkpoint.fingerprint.difference(expected) {
        return Err(format!("they belong to another render: {difference}"));
    }
    FilmNumbers::from_sections(checkpoint.sections, tiles.len(), film)?.give_all(film, tiles);
    Ok(())
}

/// Restores a film from a checkpoint; without one the film stays unchanged. Returns true if there was one.
///
/// # Errors
/// If it cannot be read, is damaged, or belongs to another render.
pub fn restore(film: &SampleFilm, checkpoints: &Checkpoints) -> Result<bool, CheckpointError> {
    let Checkpoints { path, fingerprint, .. } = checkpoints;
    let Some(checkpoint) = Checkpoint::find_for(path, fingerprint)? else { return Ok(false) };
    let tiles = film.tiles().len();
    let numbers = FilmNumbers::from_sections(checkpoint.sections, tiles, film)
        .map_err(|what| malformed(path, what))?;
    numbers.give_all(film, 0..tiles);
    Ok(true)
}

fn malformed(path: &Path, what: String) -> CheckpointError {
    CheckpointError::Damaged { path: path.to_owned(), damage: Damage::Malformed(what) }
}

impl FilmNumbers {
    /// The memory of a film's numbers.
    fn memory(tiles: usize, features: &Features, counts_work: bool) -> Amount {
        let of_work = Amount::of::<u32>(LANES + 1) + Amount::of::<f64>(2);
        let of_work = if counts_work { of_work } else { Amount(0) };
        let of_tile = Amount::of::<u32>(3) + Amount::of::<f64>(1) + of_work;
        let of_hit = Amount::of::<f64>(1) + Amount::of::<u32>(1) + Amount::of::<f32>(1);
        let of_hit = if features.first_hits { of_hit } else { Amount(0) };
        let of_pixel = Amount::of::<f64>(4 + features.components()) + of_hit;
        (of_tile + of_pixel.times(LANES)).times(tiles)
    }

    /// Copies the numbers of tiles of a film.
    fn of(film: &SampleFilm, tiles: Range<usize>) -> Result<Self, OutOfMemory> {
        let mut numbers = FilmNumbers::with_room_for(film, tiles.len())?;
        let counts_work = tiles.clone().any(|tile| film.record(tile).work.is_some());
        if counts_work {
            numbers.visits = reserved(tiles.len() * LANES)?;
        }
        for tile in tiles {
            // Tiles are copied one by one: the state of each is consistent, and that suffices.
            let record = film.record(tile);
            numbers.add(&record, film.features());
            if counts_work {
                numbers.add_work(record.work.as_deref());
            }
        }
        Ok(numbers)
    }

    /// Reserves memory for the numbers of so many tiles.
    fn with_room_for(film: &SampleFilm, tiles: usize) -> Result<Self, OutOfMemory> {
        let pixels = tiles * LANES;
        let hits = if film.features().first_hits { pixels } else { 0 };
        let outputs = film.features().outputs().iter().map(|output| {
            let numbers = reserved(pixels * output.ty.channels())?;
            Ok((format!("{OUTPUT}{}", output.name), numbers))
        });
        Ok(FilmNumbers {
            taken: reserved(tiles)?,
            done: reserved(tiles)?,
            dropped: reserved(tiles)?,
            seconds: reserved(tiles)?,
            sums: reserved(3 * pixels)?,
            squares: reserved(pixels)?,
            distances: reserved(hits)?,
            hits: reserved(hits)?,
            objects: reserved(hits)?,
            visits: Vec::new(),
            visited_samples: Vec::new(),
            lane_use: Vec::new(),
            outputs: outputs.collect::<Result<_, OutOfMemory>>()?,
        })
    }

    fn add(&mut self, record: &TileRecord, features: &Features) {
        self.taken.push(record.taken);
        self.done.push(u32::from(record.is_done));
        self.dropped.push(u32::try_from(record.dropped).unwrap_or(u32::MAX));
        self.seconds.push(record.time.as_secs_f64());
        self.sums.extend((0..LANES).flat_map(|lane| record.sums.color(lane)));
        self.squares.extend(record.sums.squares);
        if let Some(sums) = &record.first_hits {
            self.distances.extend(sums.distance);
            self.hits.extend(sums.hits);
            self.objects.extend(sums.object);
        }
        for (output, (_, numbers)) in features.outputs().iter().zip(&mut self.outputs) {
            let pixels = record.outputs.chunks_exact(features.components());
            numbers.extend(pixels.flat_map(|pixel| &pixel[output.components()]));
        }
    }

    fn add_work(&mut self, work: Option<&TileWork>) {
        let work = work.unwrap_or(&TileWork::NONE);
        self.visits.extend(work.visits);
        self.visited_samples.push(work.samples);
        self.lane_use.extend(work.lane_use.counts().map(|count| count as f64));
    }

    fn sections(&self) -> Vec<Section<'_>> {
        let mut sections = vec![
            Section::u32("taken", &self.taken),
            Section::u32("done", &self.done),
            Section::u32("dropped", &self.dropped),
            Section::f64("seconds", &self.seconds),
            Section::f64("sums", &self.sums),
            Section::f64("squares", &self.squares),
        ];
        if !self.hits.is_empty() {
            sections.extend([
                Section::f64("distances", &self.distances),
                Section::u32("hits", &self.hits),
                Section::f32("objects", &self.objects),
            ]);
        }
        if !self.visits.is_empty() {
            sections.extend([
                Section::u32("visits", &self.visits),
                Section::u32("visited samples", &self.visited_samples),
                Section::f64("lane use", &self.lane_use),
            ]);
        }
        sections.extend(self.outputs.iter().map(|(name, numbers)| Section::f64(name, numbers)));
        sections
    }

    /// Returns the numbers for so many tiles of a film, or an error message.
    fn from_sections(
        sections: Vec<Section<'_>>,
        tiles: usize,
        film: &SampleFilm,
    ) -> Result<Self, String> {
        let mut all = FilmNumbers::default();
        for Section { name, numbers } in sections {
            match (&*name, numbers) {
                ("taken", Numbers::U32(numbers)) => all.taken = numbers.into_owned(),
                ("done", Numbers::U32(numbers)) => all.done = numbers.into_owned(),
                ("dropped", Numbers::U32(numbers)) => all.dropped = numbers.into_owned(),
                ("seconds", Numbers::F64(numbers)) => all.seconds = numbers.into_owned(),
                ("sums", Numbers::F64(numbers)) => all.sums = numbers.into_owned(),
                ("squares", Numbers::F64(numbers)) => all.squares = numbers.into_owned(),
                ("distances", Numbers::F64(numbers)) => all.distances = numbers.into_owned(),
                ("hits", Numbers::U32(numbers)) => all.hits = numbers.into_owned(),
                ("objects", Numbers::F32(numbers)) => all.objects = numbers.into_owned(),
                ("visits", Numbers::U32(numbers)) => all.visits = numbers.into_owned(),
                ("visited samples", Numbers::U32(numbers)) => {
                    all.visited_samples = numbers.into_owned();
                }
                ("lane use", Numbers::F64(numbers)) => all.lane_use = numbers.into_owned(),
                (name, Numbers::F64(numbers)) if name.starts_with(OUTPUT) => {
                    all.outputs.push((name.to_owned(), numbers.into_owned()));
                }
                (name, _) => return Err(format!("its section `{name}` has an unexpected type")),
            }
        }
        all.check(tiles, film)?;
        all.check_values(film.first())?;
        Ok(all)
    }

    /// Checks that no number is one with which a sum of further samples would overflow: whoever has made the file may
    /// have chosen them. `first` is the index of the film's first sample.
    fn check_values(&self, first: u32) -> Result<(), String> {
        let are_counts = |counts: &[u32]| counts.iter().all(|count| *count <= MAX_SAMPLES);
        let are_within =
            |numbers: &[f64], most: f64| numbers.iter().all(|number| (0.0..=most).contains(number));
        let checked = [
            ("taken", are_counts(&self.taken) && self.taken.iter().all(|taken| *taken >= first)),
            ("seconds", are_within(&self.seconds, MAX_SECONDS)),
            ("hits", are_counts(&self.hits)),
            ("visited samples", are_counts(&self.visited_samples)),
            ("lane use", are_within(&self.lane_use, MAX_LANES)),
        ];
        match checked.into_iter().find(|(_, is_right)| !is_right) {
            None => Ok(()),
            Some((name, _)) => {
                Err(format!("its section `{name}` has a number that no render leaves"))
            }
        }
    }

    /// Checks that the counts of numbers fit so many tiles of the film.
    fn check(&self, tiles: usize, film: &SampleFilm) -> Result<(), String> {
        let pixels = tiles * LANES;
        let hits = if film.features().first_hits { pixels } else { 0 };
        let mut lengths = vec![
            ("taken", self.taken.len(), tiles),
            ("done", self.done.len(), tiles),
            ("dropped", self.dropped.len(), tiles),
            ("seconds", self.seconds.len(), tiles),
            ("sums", self.sums.len(), 3 * pixels),
            ("squares", self.squares.len(), pixels),
            ("distances", self.distances.len(), hits),
            ("hits", self.hits.len(), hits),
            ("objects", self.objects.len(), hits),
        ];
        if !self.visits.is_empty() {
            lengths.extend([
                ("visits", self.visits.len(), pixels),
                ("visited samples", self.visited_samples.len(), tiles),
                ("lane use", self.lane_use.len(), 2 * tiles),
            ]);
        }
        let outputs = film.features().outputs();
        // Sections of outputs are in the order of the film's.
        for (index, (name, numbers)) in self.outputs.iter().enumerate() {
            let output = outputs.get(index).filter(|output| name[OUTPUT.len()..] == *output.name);
            let Some(output) = output else {
                return Err(format!("its section `{name}` is not one of this render"));
            };
            lengths.push((name, numbers.len(), output.ty.channels() * pixels));
        }
        if let Some(output) = outputs.get(self.outputs.len()) {
            return Err(format!("it has no section `{OUTPUT}{}`", output.name));
        }
        match lengths.into_iter().find(|(_, found, expected)| found != expected) {
            None => Ok(()),
            Some((name, found, expected)) => {
                Err(format!("its section `{name}` has {found} numbers, expected {expected}"))
            }
        }
    }

    /// Gives tiles of a film the numbers, which are theirs.
    fn give_all(&self, film: &SampleFilm, tiles: Range<usize>) {
        for (index, tile) in tiles.enumerate() {
            film.clear(tile);
            self.give(index, &mut film.record(tile), film.features());
        }
    }

    fn give(&self, tile: usize, record: &mut TileRecord, features: &Features) {
        record.taken = self.taken[tile];
        record.is_done = self.done[tile] != 0;
        record.dropped = u64::from(self.dropped[tile]);
        record.time = Duration::try_from_secs_f64(self.seconds[tile]).unwrap_or_default();
        let first = tile * LANES;
        for lane in 0..LANES {
            let pixel = first + lane;
            record.sums.set_color(lane, vector(&self.sums, pixel));
            record.sums.squares[lane] = self.squares[pixel];
        }
        if let Some(sums) = record.first_hits.as_deref_mut() {
            let FirstHitSums { distance, hits, object } = sums;
            distance.copy_from_slice(&self.distances[first..first + LANES]);
            hits.copy_from_slice(&self.hits[first..first + LANES]);
            object.copy_from_slice(&self.objects[first..first + LANES]);
        }
        if let Some(visits) = self.visits.get(first..first + LANES) {
            let mut work = TileWork::NONE;
            work.visits.copy_from_slice(visits);
            work.samples = self.visited_samples[tile];
            let counts = [self.lane_use[2 * tile], self.lane_use[2 * tile + 1]];
            work.lane_use = LaneUse::of_counts(counts.map(|count| count as u64));
            record.work = Some(Box::new(work));
        }
        for (output, (_, numbers)) in features.outputs().iter().zip(&self.outputs) {
            let channels = output.ty.channels();
            let pixels = record.outputs.chunks_exact_mut(features.components());
            for (pixel, numbers) in pixels.zip(numbers[first * channels..].chunks_exact(channels)) {
                pixel[output.components()].copy_from_slice(numbers);
            }
        }
    }
}

fn vector(numbers: &[f64], pixel: usize) -> [f64; 3] {
    [numbers[3 * pixel], numbers[3 * pixel + 1], numbers[3 * pixel + 2]]
}
