//! The inputs of a call's rays.

use rtsl::{
    CallArguments, CallMode, Diagnostic, LaneBlock, LaneMask, Method, PacketKernel, Program, Role,
    StateVariable, lookup_state, new_state, set_defaults, state_variables,
};

use super::host::BenchHost;
use super::objects::Objects;
use super::random::{Random, Vector};
use super::rays::{Ray, make_unusual};
use super::settings::Setting;

/// The number of rays sent towards an object for each hit that is needed.
const RAYS_FOR_A_HIT: usize = 4;
/// The limit of loop iterations of `intersect` per ray: beyond it, no hits are searched, because the loop may be
/// endless.
const ROUNDS_FOR_A_HIT: u64 = 1 << 12;

/// The variable that rays with a common origin share.
pub const ORIGIN: &str = "rt_RayOrigin";

/// The state and scratch of some rays before a call.
#[derive(Clone, Debug)]
pub struct Inputs {
    pub state: LaneBlock,
    pub scratch: LaneBlock,
}

impl Inputs {
    /// Returns the number of rays.
    pub fn lanes(&self) -> usize {
        self.state.lanes()
    }

    /// Returns one ray alone.
    pub fn lane(&self, lane: usize) -> Inputs {
        let alone = |block: &LaneBlock| LaneBlock::new(block.components(), 1);
        let mut inputs = Inputs { state: alone(&self.state), scratch: alone(&self.scratch) };
        inputs.copy_lane(0, self, lane);
        inputs
    }

    /// Copies the lane `from` of `other` to `lane`.
    pub fn copy_lane(&mut self, lane: usize, other: &Inputs, from: usize) {
        copy_lane(&mut self.state, lane, &other.state, from);
        copy_lane(&mut self.scratch, lane, &other.scratch, from);
    }
}

fn copy_lane(block: &mut LaneBlock, lane: usize, other: &LaneBlock, from: usize) {
    for component in 0..block.components() {
        block.words_mut(component)[lane] = other.words(component)[from];
    }
}

/// A source of rays for a method.
pub struct RaySource<'a> {
    program: &'a Program,
    objects: &'a Objects,
    role: Role,
    /// The kernel that finds hits, if hosts call the method for accepted hits.
    intersect: Option<PacketKernel>,
    reads: Vec<&'static StateVariable>,
    settings: &'a [Setting],
    random: Random,
    /// The common origin of all rays, if they have one.
    origin: Option<Vector>,
}

impl<'a> RaySource<'a> {
    /// Creates a source of rays for a method in one of the roles of its class.
    ///
    /// # Errors
    /// If the class has no such method.
    pub fn new(
        program: &'a Program,
        objects: &'a Objects,
        method: Method,
        role: Role,
        settings: &'a [Setting],
        seed: u64,
    ) -> Result<RaySource<'a>, Diagnostic> {
        let reads = program.method(method)?.reads.clone();
        let follows = matches!(
            method,
            Method::ComputeNormal | Method::ComputeTextureCoordinates | Method::ComputeDerivatives
        );
        let intersect = (follows && program.has(Method::Intersect))
            .then(|| program.packet_kernel(Method::Intersect, CallMode::Packet));
        let intersect = intersect.transpose()?;
        let random = Random::new(seed);
        Ok(RaySource { program, objects, role, intersect, reads, settings, random, origin: None })
    }

    /// Gives all further rays the same origin.
    pub fn start_at_one_point(&mut self) {
        self.origin = Some(Ray::random_origin(&mut self.random));
        self.reads.retain(|variable| variable.name != ORIGIN);
    }

    /// Returns rays with values as a host would set them.
    pub fn usual(&mut self, lanes: usize) -> Inputs {
        let mut inputs = self.random_rays(lanes);
        self.make_hits(&mut inputs);
        self.set(&mut inputs);
        inputs
    }

    /// Returns rays in which some floats have unusual values.
    pub fn unusual(&mut self, lanes: usize) -> Inputs {
        let mut inputs = self.usual(lanes);
        for lane in 0..lanes {
            make_unusual(&mut self.random, &self.reads, &mut inputs.state, lane);
        }
        self.set(&mut inputs);
        inputs
    }

    fn set(&mut self, inputs: &mut Inputs) {
        for setting in self.settings {
            for lane in 0..inputs.lanes() {
                setting.apply(&mut self.random, &mut inputs.state, lane);
            }
        }
    }

    fn random_rays(&mut self, lanes: usize) -> Inputs {
        let state = random_state(&mut self.random, self.role, self.origin, lanes);
        Inputs { state, scratch: self.program.new_scratch(lanes) }
    }

    /// Replaces the rays by ones that hit the object, with the scratch of `intersect`, if the method is called for hits
    /// and any are found.
    fn make_hits(&mut self, inputs: &mut Inputs) {
        if self.intersect.is_none() {
            return;
        }
        let count = RAYS_FOR_A_HIT * inputs.lanes();
        let mut sent = self.random_rays(count);
        let mut accepted = LaneMask::new(count);
        let call = CallArguments {
            state: &mut sent.state,
            scratch: &mut sent.scratch,
            count,
            mask: None,
            accepted: Some(&mut accepted),
            instances: self.objects.of_mode(CallMode::Packet),
            host: &mut BenchHost,
        };
        let run = self.intersect.as_ref().map(|it| it.run(call, ROUNDS_FOR_A_HIT * count as u64));
        if run.is_some_and(|run| run.cut_short) {
            return;
        }
        let hits: Vec<usize> = accepted.iter_on().collect();
        for (lane, &from) in (0..inputs.lanes()).zip(hits.iter().cycle()) {
            inputs.copy_lane(lane, &sent, from);
            set_hit_point(&mut inputs.state, lane);
        }
    }
}

/// Returns the state of rays as a host would set it for a role.
pub fn random_state(
    random: &mut Random,
    role: Role,
    origin: Option<Vector>,
    lanes: usize,
) -> LaneBlock {
    let mut state = new_state(lanes);
    set_defaults(&mut state, role);
    for lane in 0..lanes {
        let ray = Ray::random(random, role, origin);
        for variable in state_variables() {
            if role.row(variable.name).is_some() {
                ray.set(variable, &mut state, lane);
            }
        }
    }
    state
}

/// The hit point from ray and distance.
fn set_hit_point(state: &mut LaneBlock, lane: usize) {
    let names = [ORIGIN, "rt_RayDirection", "rt_HitDistance", "rt_HitPoint"];
    let first = names.map(|name| lookup_state(name).map(|it| it.first_component as usize));
    let [Some(origin), Some(direction), Some(distance), Some(point)] = first else { return };
    let distance = state.floats(distance)[lane];
    for axis in 0..3 {
        let along = distance * state.floats(direction + axis)[lane];
        state.floats_mut(point + axis)[lane] = state.floats(origin + axis)[lane] + along;
    }
}
