//! Random functions, values for their variables, and a host that answers their requests.
//!
//! Passes and backends must agree with the interpreter on every result of [`function`]. The functions use every
//! operation except reference calls and queries, nest regions, run every loop only a few times, and request lights only
//! in uniform loops. Those of [`integrator`] have queries too.

mod entropy;
mod integrators;
mod memory;

pub use entropy::Entropy;
pub use integrators::{integrator, seeded_integrator};
pub use memory::{HashHost, Memory};

use rtsl_ir::{
    BinaryOp, Builder, CompareOp, Constant, Function, OpKind, Scalar, UnaryOp, Value, Variable,
    VariableId, VariableKind, evaluate,
};

/// Generates a verified function from these bytes: about one operation for three bytes.
pub fn function(entropy: &[u8]) -> Function {
    let mut generator = Generator::new(Entropy::new(entropy));
    // One in three; drawn first, since statements use all the bytes.
    let accepts = generator.entropy.chance(85);
    generator.statements(MAX_OPERATIONS);
    generator.outputs(accepts);
    generator.builder.finish()
}

/// Generates the function for this seed; `size` is the number of bytes.
pub fn seeded_function(seed: u64, size: usize) -> Function {
    function(&Entropy::bytes(seed, size))
}

/// The greatest number of operations, including those of nested regions.
const MAX_OPERATIONS: usize = 2000;
/// The greatest depth of regions in the body.
const MAX_DEPTH: usize = 4;
/// The greatest trip count of a loop.
const MAX_ROUNDS: usize = 4;

/// The variables of every function: kind, name, type, length.
const VARIABLES: [(VariableKind, &str, Scalar, u32); 14] = [
    (VariableKind::State, "rt_RayOrigin", Scalar::F32, 3),
    (VariableKind::State, "rt_RayDirection", Scalar::F32, 3),
    (VariableKind::State, "rt_HitDistance", Scalar::F32, 1),
    (VariableKind::Member, "scale", Scalar::F32, 4),
    (VariableKind::Member, "count", Scalar::I32, 3),
    (VariableKind::Member, "mask", Scalar::U32, 2),
    (VariableKind::Member, "flag", Scalar::Bool, 2),
    (VariableKind::Scratch, "kept", Scalar::F32, 2),
    (VariableKind::Scratch, "number", Scalar::I32, 2),
    (VariableKind::Buffer, "points", Scalar::F32, 3),
    (VariableKind::Buffer, "indices", Scalar::I32, 1),
    (VariableKind::Local, "stack", Scalar::F32, 5),
    (VariableKind::Local, "order", Scalar::I32, 4),
    (VariableKind::Local, "local", Scalar::F32, 2),
];

/// The positions of the buffers in [`VARIABLES`].
const BUFFERS: std::ops::Range<usize> = 9..11;
/// The positions of the locals; the last is only accessed at constant indices.
const LOCALS: std::ops::Range<usize> = 11..14;

struct Generator<'a> {
    entropy: Entropy<'a>,
    builder: Builder,
    variables: Vec<VariableId>,
    /// The values visible at the current position.
    available: Vec<Value>,
    operations: usize,
    /// The surfaces found so far, for functions with queries.
    surfaces: Option<integrators::Surfaces>,
}

impl<'a> Generator<'a> {
    fn new(entropy: Entropy<'a>) -> Self {
        let mut builder = Builder::new("Generated.method");
        let variable = |&(kind, name, scalar, len): &(VariableKind, &str, Scalar, u32)| {
            builder.variable(Variable { kind, name: name.to_owned(), scalar, len })
        };
        let variables = VARIABLES.iter().map(variable).collect();
        Generator {
            entropy,
            builder,
            variables,
            available: Vec::new(),
            operations: 0,
            surfaces: None,
        }
    }

    /// Generates up to `count` operations.
    fn statements(&mut self, count: usize) {
        for _ in 0..count {
            if self.entropy.is_empty() || self.operations >= MAX_OPERATIONS {
                return;
            }
            self.operations += 1;
            self.statement();
        }
    }

    fn statement(&mut self) {
        let precise = self.entropy.chance(24);
        self.builder.set_precise(precise);
        if self.surfaces.is_some() && self.entropy.chance(80) {
            return self.integrator_statement();
        }
        let value = match self.entropy.below(64) {
            0..3 => self.constant(),
            3..7 => self.unary(),
            7..18 => self.binary(),
            18..22 => self.compare(),
            22..26 => self.select(),
            26..28 => self.fma(),
            28..31 => self.convert(),
            31..33 => self.bitcast(),
            33..38 => self.load(),
            38..41 => return self.store(),
            41 => self.length(),
            42..48 => return self.branch(),
            48..52 => return self.repeat(),
            52 => return self.light_loop(),
            53 => {
                let (origin, direction, limit) = self.ray();
                let weight = self.weight();
                return self.push(OpKind::Trace { origin, direction, limit, weight });
            }
            54 => {
                let (origin, direction, limit) = self.ray();
                return self.push(OpKind::Occluded { origin, direction, limit });
            }
            55 => return self.push(OpKind::Ambient),
            56 => return self.push(OpKind::Rand),
            57 => return self.push(OpKind::LightCount),
            _ => self.contractible(),
        };
        self.available.push(value);
    }

    fn push(&mut self, kind: OpKind) {
        let results = self.builder.push(kind);
        self.available.extend(results.iter());
    }

    fn constant(&mut self) -> Value {
        let scalar = self.scalar();
        let constant = self.entropy.constant(scalar);
        self.builder.constant(constant)
    }

    fn unary(&mut self) -> Value {
        let op = self.entropy.choose(UnaryOp::EXACT);
        let scalar = self.scalar_where(|scalar| evaluate::unary(op, scalar).is_some());
        let a = self.pick(scalar);
        self.builder.unary(op, a)
    }

    fn binary(&mut self) -> Value {
        let op = self.entropy.choose(BinaryOp::ALL);
        let scalar = self.scalar_where(|scalar| evaluate::binary(op, scalar).is_some());
        let (a, b) = (self.pick(scalar), self.pick(scalar));
        self.builder.binary(op, a, b)
    }

    /// Generates a sum or difference of products, to which contraction applies.
    fn contractible(&mut self) -> Value {
        let [a, b, c, d] = std::array::from_fn(|_| self.pick(Scalar::F32));
        let product = self.builder.multiply(a, b);
        let other = if self.entropy.chance(64) { self.builder.multiply(c, d) } else { c };
        self.available.extend([product, other]);
        let op = self.entropy.choose(&[BinaryOp::Add, BinaryOp::Subtract]);
        match self.entropy.chance(128) {
            true => self.builder.binary(op, product, other),
            false => self.builder.binary(op, other, product),
        }
    }

    fn compare(&mut self) -> Value {
        let op = self.entropy.choose(CompareOp::ALL);
        let scalar = self.scalar_where(|scalar| evaluate::compare(op, scalar).is_some());
        let (a, b) = (self.pick(scalar), self.pick(scalar));
        self.builder.compare(op, a, b)
    }

    fn select(&mut self) -> Value {
        let condition = self.pick(Scalar::Bool);
        let scalar = self.scalar();
        let (a, b) = (self.pick(scalar), self.pick(scalar));
        self.builder.select(condition, a, b)
    }

    fn fma(&mut self) -> Value {
        let [a, b, c] = std::array::from_fn(|_| self.pick(Scalar::F32));
        self.builder.fma(a, b, c)
    }

    fn convert(&mut self) -> Value {
        let (from, to) = (self.scalar(), self.scalar());
        let a = self.pick(from);
        self.builder.convert(to, a)
    }

    fn bitcast(&mut self) -> Value {
        let [from, to] = std::array::from_fn(|_| self.scalar_where(|it| it != Scalar::Bool));
        let a = self.pick(from);
        self.builder.bitcast(to, a)
    }

    fn load(&mut self) -> Value {
        let variable = self.entropy.choose(&self.variables);
        match self.entropy.chance(100) && !self.is_local(variable) {
            true => {
                let index = self.pick(Scalar::I32);
                self.load_at(variable, index)
            }
            false => {
                let index = self.constant_index(variable);
                self.builder.load(variable, index)
            }
        }
    }

    fn load_at(&mut self, variable: VariableId, index: Value) -> Value {
        match self.known_in_range(variable, index) {
            true => self.builder.load_at(variable, index),
            false => self.builder.load(variable, 0),
        }
    }

    fn store(&mut self) {
        let local = self.entropy.choose(&self.variables[LOCALS]);
        let scalar = self.builder.function().variable(local).scalar;
        let value = self.pick(scalar);
        let index = self.pick(Scalar::I32);
        let dynamic = self.entropy.chance(128) && !self.is_local(local);
        if dynamic && self.known_in_range(local, index) {
            self.builder.store_at(local, index, value);
        } else {
            let index = self.constant_index(local);
            self.builder.store(local, index, value);
        }
    }

    fn length(&mut self) -> Value {
        let buffer = self.entropy.choose(&self.variables[BUFFERS]);
        self.builder.length(buffer)
    }

    fn branch(&mut self) {
        if self.builder.depth() > MAX_DEPTH {
            return;
        }
        let condition = self.pick(Scalar::Bool);
        let results = self.scalars();
        let passes_surface = self.passes_surface();
        let then = self.region(&results, passes_surface);
        let otherwise = self.region(&results, passes_surface);
        let results = self.builder.if_regions(condition, then, otherwise);
        self.receive(results, passes_surface);
    }

    fn region(&mut self, results: &[Scalar], passes_surface: bool) -> rtsl_ir::Region {
        let outside = self.available.len();
        self.builder.begin_region();
        let count = self.entropy.below(6);
        self.statements(count);
        let mut yields: Vec<Value> = results.iter().map(|scalar| self.pick(*scalar)).collect();
        if passes_surface {
            yields.extend(self.surface());
        }
        self.leave(outside);
        self.builder.end_region(yields)
    }

    /// Generates a loop with a counter and perhaps another exit.
    fn repeat(&mut self) {
        let rounds = self.entropy.below(MAX_ROUNDS) as i32 + 1;
        let rounds = self.builder.i32(rounds);
        self.counted_loop(rounds, |_, _| ());
    }

    /// Generates a loop over all lights.
    fn light_loop(&mut self) {
        let count = self.builder.push(OpKind::LightCount).get(0);
        self.counted_loop(count, |generator, index| {
            let point = generator.vector();
            let normal = generator.vector();
            let cosine = generator.pick(Scalar::F32);
            generator.push(OpKind::LightSample { index, point, normal, cosine });
        });
    }

    fn counted_loop(&mut self, rounds: Value, body: impl FnOnce(&mut Self, Value)) {
        if self.builder.depth() > MAX_DEPTH {
            return;
        }
        let outside = self.available.len();
        let carried = self.scalars();
        let zero = self.builder.i32(0);
        let mut initial = vec![zero];
        initial.extend(carried.iter().map(|scalar| self.pick(*scalar)));
        let passes_surface = self.passes_surface();
        if passes_surface {
            initial.extend(self.surface());
        }
        let params = self.builder.begin_loop(initial);
        let counter = params.get(0);
        self.receive(params, passes_surface);
        body(self, counter);
        let count = self.entropy.below(7);
        self.statements(count);
        let one = self.builder.i32(1);
        let next = self.builder.add(counter, one);
        let mut again = self.builder.compare(CompareOp::Less, next, rounds);
        if self.entropy.chance(80) {
            let condition = self.pick(Scalar::Bool);
            again = self.builder.and(again, condition);
        }
        let mut yields = vec![next];
        yields.extend(carried.iter().map(|scalar| self.pick(*scalar)));
        if passes_surface {
            yields.extend(self.surface());
        }
        self.leave(outside);
        let results = self.builder.end_loop(again, &yields);
        self.receive(results, passes_surface);
    }

    fn ray(&mut self) -> ([Value; 3], [Value; 3], Value) {
        (self.vector(), self.vector(), self.pick(Scalar::F32))
    }

    /// Generates a weight: unknown (1), or any value.
    fn weight(&mut self) -> Value {
        match self.entropy.chance(128) {
            true => self.builder.f32(1.0),
            false => self.pick(Scalar::F32),
        }
    }

    fn vector(&mut self) -> [Value; 3] {
        std::array::from_fn(|_| self.pick(Scalar::F32))
    }

    /// Generates outputs to the state, some scratch, and perhaps the accepted variable.
    fn outputs(&mut self, accepts: bool) {
        for variable in [2, 0, 1, 7, 8] {
            let (_, _, scalar, len) = VARIABLES[variable];
            for component in 0..len {
                let value = self.pick(scalar);
                self.builder.output(self.variables[variable], component, value);
            }
        }
        if accepts {
            let (kind, name) = (VariableKind::Accepted, "accepted".to_owned());
            let variable =
                self.builder.variable(Variable { kind, name, scalar: Scalar::Bool, len: 1 });
            let value = self.pick(Scalar::Bool);
            self.builder.output(variable, 0, value);
        }
    }

    /// Returns a visible value of this type, more often a late one; a new constant if there is none.
    fn pick(&mut self, scalar: Scalar) -> Value {
        let fits = |value: &Value| self.builder.scalar(*value) == scalar;
        let fitting: Vec<Value> = self.available.iter().rev().copied().filter(fits).collect();
        if fitting.is_empty() || self.entropy.chance(16) {
            let constant = self.entropy.constant(scalar);
            return self.builder.constant(constant);
        }
        let first = self.entropy.below(fitting.len().min(256));
        fitting[self.entropy.below(first + 1)]
    }

    fn scalar(&mut self) -> Scalar {
        use Scalar::{Bool, F32, I32, U32};
        self.entropy.choose(&[F32, F32, F32, F32, I32, I32, U32, Bool])
    }

    fn scalar_where(&mut self, fits: impl Fn(Scalar) -> bool) -> Scalar {
        let fitting: Vec<Scalar> = Scalar::ALL.into_iter().filter(|scalar| fits(*scalar)).collect();
        self.entropy.choose(&fitting)
    }

    fn scalars(&mut self) -> Vec<Scalar> {
        (0..self.entropy.below(4)).map(|_| self.scalar()).collect()
    }

    fn constant_index(&mut self, variable: VariableId) -> u32 {
        let len = self.builder.function().variable(variable).len;
        self.entropy.below(len as usize) as u32
    }

    fn is_local(&self, variable: VariableId) -> bool {
        variable == self.variables[VARIABLES.len() - 1]
    }

    /// True if `index` is not a constant, or is one in range.
    fn known_in_range(&self, variable: VariableId, index: Value) -> bool {
        let len = self.builder.function().variable(variable).len;
        self.builder.known(index).is_none_or(|constant: Constant| constant.bits() < len)
    }
}

/// Returns the number of operations of each kind, for tests of the generator.
#[cfg(test)]
fn count_kinds(function: &Function) -> std::collections::BTreeMap<String, usize> {
    let mut counts = std::collections::BTreeMap::new();
    function.body.for_each_op(&mut |op: &rtsl_ir::Op| {
        let debug = format!("{:?}", op.kind);
        let name = debug.split([' ', '(']).next().unwrap_or_default().to_owned();
        *counts.entry(name).or_default() += 1;
    });
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtsl_ir::{Interpreter, verify::verify};

    #[test]
    fn functions_verify_and_print_and_end() {
        let mut counts = std::collections::BTreeMap::new();
        for seed in 0..200 {
            let function = seeded_function(seed, 600);
            verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
            let mut renumbered = function.clone();
            renumbered.renumber();
            let parsed: Function = function.to_string().parse().unwrap();
            assert_eq!(parsed.to_string(), renumbered.to_string());
            for (name, count) in count_kinds(&function) {
                *counts.entry(name).or_insert(0) += count;
            }
            let bytes = Entropy::bytes(seed, 400);
            let mut memory = Memory::new(&function, &mut Entropy::new(&bytes));
            let mut interpreter = Interpreter::prepare(&function).unwrap();
            interpreter.run(0, &mut memory, &mut HashHost::default());
        }
        // All but reference calls, tests of references, and the budget.
        assert_eq!(counts.len(), 19, "{counts:?}");
    }
}
