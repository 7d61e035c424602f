//! Requests without answers that a stage keeps in arrays until it ends: the light that it contributes, and the paths
//! that it spawns. Each place in the stage has arrays of its own, which costs less than asking a host for each vector
//! of lanes.

use std::collections::BTreeSet;
use std::ops::Range;

use rtsl_ir::{
    Function, Index, Op, OpKind, Output, Query, Region, Value, Variable, VariableId, VariableKind,
};
use rtsl_opt::{dce, if_convert, mem2reg, simplify};

use crate::spawning::Places;

/// Requests of a kind, as a stage may keep them.
pub struct KeptRequests {
    /// The kind.
    pub query: Query,
    /// The operands that are all 0 where a request has no effect.
    pub effect: Range<usize>,
    /// The greatest number of places.
    pub greatest: usize,
    /// Returns the name of the scratch array with an operand of the request at a place. It is 0 for paths that make none.
    pub column: fn(usize, usize) -> String,
}

impl KeptRequests {
    /// Removes the requests of a stage that never have an effect, and replaces the others by outputs, unless there are
    /// too many, or any is in a loop.
    pub fn keep(&self, function: &mut Function) {
        let mut body = std::mem::take(&mut function.body);
        let zeros = zeros(&body);
        self.remove_needless(&mut body, &zeros);
        function.body = body;
        let places = Places::of(self.query, function, None);
        if places.count == 0 || !places.can_be_kept(self.greatest) {
            return;
        }
        let mut body = std::mem::take(&mut function.body);
        let mut kept = Vec::new();
        self.replace(function, &mut body, &mut kept);
        for (place, locals) in kept.into_iter().enumerate() {
            for (index, local) in locals.into_iter().enumerate() {
                let scalar = function.variable(local).scalar;
                let load = OpKind::Load(local, Index::Constant(0));
                let value = function.push(&mut body.ops, scalar, load);
                let (kind, name) = (VariableKind::Scratch, (self.column)(place, index));
                let column = Variable { kind, name, scalar, len: 1 };
                let variable = function.intern_variable(column);
                function.outputs.push(Output { variable, component: 0 });
                body.yields.push(value);
            }
        }
        function.body = body;
        mem2reg::run(function);
        simplify::run(function);
        if_convert::run(function);
        dce::run(function);
        function.renumber();
    }

    /// Removes the requests without an effect, given the values that are 0.
    fn remove_needless(&self, region: &mut Region, zeros: &BTreeSet<Value>) {
        region.ops.retain(|op| match &op.kind {
            OpKind::Query(query, operands) if *query == self.query => {
                !operands[self.effect.clone()].iter().all(|operand| zeros.contains(operand))
            }
            _ => true,
        });
        let regions = region.ops.iter_mut().flat_map(|op| op.kind.regions_mut());
        regions.for_each(|region| self.remove_needless(region, zeros));
    }

    /// Replaces the requests of a region by stores to locals, which are 0 elsewhere.
    fn replace(
        &self,
        function: &mut Function,
        region: &mut Region,
        kept: &mut Vec<Vec<VariableId>>,
    ) {
        let mut ops: Vec<Op> = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            op.kind.regions_mut().for_each(|region| self.replace(function, region, kept));
            let OpKind::Query(query, operands) = &op.kind else {
                ops.push(op);
                continue;
            };
            if *query != self.query {
                ops.push(op);
                continue;
            }
            let local = |(index, operand): (usize, &Value)| {
                let name = format!("{}.{}.{index}", self.query.name(), kept.len());
                let scalar = function.scalar(*operand);
                let local = Variable { kind: VariableKind::Local, name, scalar, len: 1 };
                let local = function.intern_variable(local);
                let kind = OpKind::Store(local, Index::Constant(0), *operand);
                ops.push(Op { results: function.new_values(&[]), precise: false, kind });
                local
            };
            let locals = operands.iter().enumerate().map(local).collect();
            kept.push(locals);
        }
        region.ops = ops;
    }
}

/// Returns the constants of a region that are 0.
fn zeros(region: &Region) -> BTreeSet<Value> {
    let mut zeros = BTreeSet::new();
    region.for_each_op(&mut |op| {
        if let OpKind::Constant(constant) = &op.kind
            && constant.bits() == 0
        {
            zeros.extend(op.results.iter());
        }
    });
    zeros
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use rtsl_ir::verify::verify;

    use super::*;

    const SAMPLES: KeptRequests = KeptRequests {
        query: Query::SpawnPath,
        effect: 10..11,
        greatest: 2,
        column: |place, index| format!("kept.{place}.{index}"),
    };

    fn kept(body: &str) -> String {
        let spawn = "query spawn_path %x, %x, %x, %x, %x, %x, %x, %x, %x, %x, %y, %k, %k";
        let text = format!(
            "function f scratch a: f32[1] {{
                %x: f32 = load scratch:a@0 %y: f32 = add %x, %x %k: u32 = constant 7
                %t: bool = less %x, %y {} return scratch:a@0 = %y
            }}",
            body.replace("SPAWN", spawn)
        );
        let mut function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
        SAMPLES.keep(&mut function);
        verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
        let columns = ["kept.0.10", "kept.0.12", "kept.1.10"];
        let lines = function.to_string();
        let is_shown = |line: &&str| {
            line.contains("query")
                || columns.iter().any(|it| line.contains(&format!("scratch {it}:")))
        };
        lines.lines().filter(is_shown).map(|line| format!("{}\n", line.trim())).collect()
    }

    #[test]
    fn requests_at_a_few_places_are_kept() {
        expect![[r#"
            scratch kept.0.10: f32[1]
            scratch kept.0.12: u32[1]
            scratch kept.1.10: f32[1]
        "#]]
        .assert_eq(&kept("if %t { SPAWN yield } else { yield } SPAWN"));
    }

    #[test]
    fn requests_without_an_effect_are_removed() {
        assert_eq!(kept(&"SPAWN".replace("SPAWN", "%z: f32 = constant 0.0 query spawn_path %x, %x, %x, %x, %x, %x, %x, %x, %x, %x, %z, %k, %k")), "");
    }

    #[test]
    fn many_requests_and_those_of_loops_stay() {
        assert!(kept("SPAWN SPAWN SPAWN").lines().count() == 3);
        let repeated = "%z: f32 = loop (%w: f32 = %x) { SPAWN repeat %t, %w }";
        assert!(kept(repeated).starts_with("query"));
    }
}
