//! Random functions with queries, as integrators have them.

use rtsl_ir::{Function, OpKind, Query, Scalar, Value, Values};

use super::{Entropy, Generator, MAX_OPERATIONS};

/// Generates a verified function with queries from these bytes: searches, queries about the surfaces found, which pass
/// through branches and loops, and all others. It accepts no hits.
pub fn integrator(entropy: &[u8]) -> Function {
    let mut generator = Generator::new(Entropy::new(entropy));
    generator.surfaces = Some(Surfaces::default());
    generator.statements(MAX_OPERATIONS);
    generator.outputs(false);
    generator.builder.finish()
}

/// Generates the integrator for this seed; `size` is the number of bytes.
pub fn seeded_integrator(seed: u64, size: usize) -> Function {
    integrator(&Entropy::bytes(seed, size))
}

/// The visible surfaces, each with the number of values that were visible when it was found.
#[derive(Default)]
pub(super) struct Surfaces {
    visible: Vec<(usize, [Value; 3])>,
}

/// The queries about neither rays nor surfaces.
const OTHERS: [Query; 10] = [
    Query::SampleLight,
    Query::SkyCount,
    Query::SkyEmission,
    Query::SkyPdf,
    Query::Contribute,
    Query::Sample,
    Query::SamplePair,
    Query::Spawn,
    Query::SpawnPath,
    Query::UnshadowedLight,
];

impl Generator<'_> {
    /// Generates what integrators consist of: queries, branches and loops.
    pub(super) fn integrator_statement(&mut self) {
        match self.entropy.below(16) {
            0..2 => self.branch(),
            2..4 => {
                // Unrolling can't remove the loop.
                let number = self.pick(Scalar::I32);
                let mask = self.builder.i32(3);
                let rounds = self.builder.and(number, mask);
                self.counted_loop(rounds, |_, _| ());
            }
            _ => self.query(),
        }
    }

    fn query(&mut self) {
        let query = match self.entropy.below(16) {
            0..6 => Query::NearestHit,
            6..13 => {
                let mut of_surfaces = Query::ALL.to_vec();
                of_surfaces.retain(|query| query.is_of_surface());
                self.entropy.choose(&of_surfaces)
            }
            _ => self.entropy.choose(&OTHERS),
        };
        let mut operands = Vec::new();
        if query.is_of_surface() {
            operands.extend(self.surface());
        }
        let scalars = query.operand_scalars().skip(operands.len());
        operands.extend(scalars.map(|scalar| self.pick(scalar)));
        let results = self.builder.push(OpKind::Query(query, operands));
        if query == Query::NearestHit {
            self.find(std::array::from_fn(|index| results.get(index as u32 + 1)));
        }
        self.available.extend(results.iter());
    }

    /// Returns object, instance and element of a surface: mostly of one that was found.
    pub(super) fn surface(&mut self) -> [Value; 3] {
        let visible = self.surfaces.iter().flat_map(|it| it.visible.iter().rev());
        let visible: Vec<[Value; 3]> = visible.map(|(_, surface)| *surface).take(256).collect();
        if visible.is_empty() || self.entropy.chance(12) {
            return std::array::from_fn(|_| self.pick(Scalar::I32));
        }
        let first = self.entropy.below(visible.len());
        visible[self.entropy.below(first + 1)]
    }

    /// True if a surface passes through the next branch or loop.
    pub(super) fn passes_surface(&mut self) -> bool {
        self.surfaces.is_some() && self.entropy.chance(90)
    }

    /// Makes the results of an operation available; the last three may be a surface.
    pub(super) fn receive(&mut self, results: Values, passes_surface: bool) {
        if passes_surface {
            let first = results.count - 3;
            self.find(std::array::from_fn(|index| results.get(first + index as u32)));
        }
        self.available.extend(results.iter());
    }

    /// Leaves a region, outside of which this many values are visible.
    pub(super) fn leave(&mut self, outside: usize) {
        self.available.truncate(outside);
        if let Some(Surfaces { visible }) = &mut self.surfaces {
            visible.retain(|(position, _)| *position < outside);
        }
    }

    fn find(&mut self, surface: [Value; 3]) {
        let position = self.available.len();
        if let Some(Surfaces { visible }) = &mut self.surfaces {
            visible.push((position, surface));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rtsl_ir::{Interpreter, verify::verify};

    use super::super::{HashHost, Memory};
    use super::*;

    #[test]
    fn integrators_verify_and_have_all_queries_and_end() {
        let mut queries = BTreeSet::new();
        for seed in 0..200 {
            let function = seeded_integrator(seed, 600);
            verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
            function.body.for_each_op(&mut |op| {
                if let OpKind::Query(query, _) = op.kind {
                    queries.insert(query);
                }
            });
            let bytes = Entropy::bytes(seed, 400);
            let mut memory = Memory::new(&function, &mut Entropy::new(&bytes));
            let mut interpreter = Interpreter::prepare(&function).unwrap();
            interpreter.run(0, &mut memory, &mut HashHost::default());
        }
        assert!(queries.into_iter().eq(Query::ALL));
    }
}
