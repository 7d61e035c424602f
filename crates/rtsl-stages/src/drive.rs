//! Runs stages for one path on the interpreter: the reference for runtimes.
//!
//! [`Driver::run`] computes what the interpreter computes for the integrator's function, to the bit, with the same
//! requests to the host in the same order.

use rtsl_ir::host::{Host, LaneColors, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::{
    Constant, Interpreter, Outcome, PrepareError, Query, Scalar, Storage, Variable, VariableId,
    VariableKind,
};

use crate::{MAX_ANSWERS, Port, ResumedBy, SlotId, Stages};

/// Stages ready to run.
#[derive(Clone, Debug)]
pub struct Driver<'a> {
    stages: &'a Stages,
    interpreters: Vec<Interpreter>,
    /// The storage of each stage's variables.
    places: Vec<Vec<Place>>,
    noise: Option<u64>,
}

/// The storage of a variable of a stage.
#[derive(Clone, Copy, Debug)]
enum Place {
    Port(Port),
    /// A variable of the integrator's function, and its kind and type.
    Other(VariableId, VariableKind, Scalar),
    /// A local, which the interpreter stores.
    None,
}

impl<'a> Driver<'a> {
    /// Prepares verified stages of a function with these variables.
    pub fn new(stages: &'a Stages, variables: &[Variable]) -> Result<Driver<'a>, PrepareError> {
        let place = |variable: &Variable| {
            if let Some(port) = Port::of(variable) {
                return Place::Port(port);
            }
            let found = variables.iter().position(|other| other == variable);
            found.map_or(Place::None, |index| {
                Place::Other(VariableId(index as u32), variable.kind, variable.scalar)
            })
        };
        let functions = stages.stages.iter().map(|stage| &stage.function);
        let places = functions.clone().map(|it| it.variables.iter().map(place).collect());
        let interpreters = functions.map(Interpreter::prepare).collect::<Result<_, _>>()?;
        Ok(Driver { stages, interpreters, places: places.collect(), noise: None })
    }

    /// Fills what a stage must not rely on with noise before each stage: slots that are not live, and the state of the
    /// path after its first stage.
    pub fn with_noise(mut self, seed: u64) -> Self {
        self.noise = Some(seed);
        self
    }

    /// Runs for the ray with index `ray` within the call. The storage is that of the integrator's function.
    pub fn run<S: Storage + ?Sized>(
        &mut self,
        ray: u32,
        storage: &mut S,
        host: &mut dyn Host,
    ) -> Outcome {
        let mut path = Path {
            places: &[],
            frame: vec![0; self.stages.slots.len()],
            answers: [0; MAX_ANSWERS],
            request: Default::default(),
            surface: Default::default(),
            next: 0,
            noise: None,
            storage,
        };
        let lanes = LaneSet { base: ray, active: 1 };
        let mut outcome = Outcome::default();
        let mut steps = 0;
        while let Ok(index) = usize::try_from(path.next) {
            let stage = &self.stages.stages[index];
            path.answer(stage.resumed_by, lanes, host);
            path.request = Default::default();
            if let Some(seed) = self.noise.filter(|_| steps > 0) {
                path.noise = Some(mix(seed ^ steps));
                path.spoil(self.stages, &stage.live);
            }
            steps += 1;
            path.places = &self.places[index];
            let found = self.interpreters[index].run(ray, &mut path, host);
            outcome.budget_exceeded |= found.budget_exceeded;
        }
        outcome
    }
}

/// A path between two stages.
struct Path<'a, S: ?Sized> {
    places: &'a [Place],
    frame: Vec<u32>,
    answers: [u32; MAX_ANSWERS],
    request: [u32; crate::MAX_REQUEST as usize],
    surface: [u32; 3],
    next: i32,
    /// Take the place of state.
    noise: Option<u64>,
    storage: &'a mut S,
}

impl<S: Storage + ?Sized> Path<'_, S> {
    /// Has the host answer a request.
    fn answer(&mut self, event: ResumedBy, lanes: LaneSet, host: &mut dyn Host) {
        self.answers = [0; MAX_ANSWERS];
        match event {
            ResumedBy::Start | ResumedBy::Dispatch => {}
            ResumedBy::NearestHit => self.ask(event, Query::NearestHit, lanes, host),
            ResumedBy::Shade => self.ask(event, Query::Shade, lanes, host),
            ResumedBy::Occluded => {
                self.answers[0] = host.occluded(lanes, &self.ray()) & 1;
            }
            ResumedBy::Trace => {
                let mut rays = self.ray();
                rays.weight[0] = f32::from_bits(self.request[7]);
                let mut radiance = LaneColors::default();
                host.trace(lanes, &rays, &mut radiance);
                self.take(0, radiance.iter().map(|component| component[0]));
            }
            ResumedBy::LightSample => self.ask_light(lanes, host),
        }
    }

    fn ask(&mut self, event: ResumedBy, query: Query, lanes: LaneSet, host: &mut dyn Host) {
        let operands = event.request().iter().map(|port| self.request[*port as usize]);
        let operands: Vec<u32> = operands.collect();
        host.query(lanes.base, query, &operands, &mut self.answers[..event.answers().len()]);
    }

    fn ask_light(&mut self, lanes: LaneSet, host: &mut dyn Host) {
        let (mut query, mut light) = (LightQueryLanes::default(), LightLanes::default());
        let [index, floats @ ..] = ResumedBy::LightSample.request() else { return };
        let numbers = query.point.iter_mut().chain(&mut query.normal).chain([&mut query.cosine]);
        for (number, port) in numbers.zip(floats) {
            number[0] = f32::from_bits(self.request[*port as usize]);
        }
        if host.light_sample(lanes, self.request[*index as usize], &query, &mut light) & 1 == 0 {
            return;
        }
        let LightLanes { direction, distance, color, pdf } = &light;
        let results = direction.iter().chain([distance]).chain(color).chain([pdf]);
        self.answers[0] = 1;
        self.take(1, results.map(|lanes| lanes[0]));
    }

    /// Sets the answers from this one on.
    fn take(&mut self, first: usize, numbers: impl Iterator<Item = f32>) {
        let answers = self.answers[first..].iter_mut().zip(numbers);
        answers.for_each(|(answer, number)| *answer = number.to_bits());
    }

    /// Returns the requested ray, in lane 0.
    fn ray(&self) -> RayLanes {
        let mut rays = RayLanes::default();
        let request = self.request.map(f32::from_bits);
        for axis in 0..3 {
            rays.origin[axis][0] = request[axis];
            rays.direction[axis][0] = request[3 + axis];
        }
        rays.limit[0] = request[6];
        rays
    }

    fn spoil(&mut self, stages: &Stages, live: &[SlotId]) {
        for (index, (bits, slot)) in (0..).zip(self.frame.iter_mut().zip(&stages.slots)) {
            if !live.contains(&SlotId(index)) {
                *bits = noise(self.noise, slot.scalar, index);
            }
        }
    }
}

impl<S: Storage + ?Sized> Storage for Path<'_, S> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        match self.places[variable.0 as usize] {
            Place::Port(Port::Frame(slot)) => self.frame[slot.0 as usize],
            Place::Port(Port::Answer(index)) => self.answers[index as usize],
            Place::Port(Port::Request(index)) => self.request[index as usize],
            Place::Port(Port::Surface(index)) => self.surface[index as usize],
            Place::Port(Port::Next) => self.next as u32,
            Place::Other(_, VariableKind::State | VariableKind::Scratch, scalar)
                if self.noise.is_some() =>
            {
                noise(self.noise, scalar, index)
            }
            Place::Other(other, ..) => self.storage.load(other, index),
            Place::None => 0,
        }
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        match self.places[buffer.0 as usize] {
            Place::Other(other, ..) => self.storage.elements(other),
            Place::Port(_) | Place::None => 0,
        }
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        match self.places[variable.0 as usize] {
            Place::Port(Port::Frame(slot)) => self.frame[slot.0 as usize] = bits,
            Place::Port(Port::Answer(index)) => self.answers[index as usize] = bits,
            Place::Port(Port::Request(index)) => self.request[index as usize] = bits,
            Place::Port(Port::Surface(index)) => self.surface[index as usize] = bits,
            Place::Port(Port::Next) => self.next = bits as i32,
            Place::Other(other, ..) => self.storage.store(other, component, bits),
            Place::None => {}
        }
    }
}

fn noise(seed: Option<u64>, scalar: Scalar, index: u32) -> u32 {
    let bits = mix(seed.unwrap_or(0) ^ u64::from(index) << 32) as u32;
    let bits = if scalar == Scalar::Bool { bits & 1 } else { bits };
    Constant::from_bits(scalar, bits).bits()
}

/// A hash, by the finaliser of SplitMix64.
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}
