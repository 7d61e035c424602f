//! Placed objects: transforms the ray into object space.
//!
//! A placement is an affine map from the space of the call's rays into the space for which the method was written: the
//! images of the three axes and of the origin. It is data of the object, so the call mode determines if the placement,
//! the ray or both are uniform. The parameter of points along the ray is preserved, since the direction is not
//! normalised after the transformation.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Function, Index, Op, OpKind, Region, Scalar, Value, Variable,
    VariableId, VariableKind,
};

use crate::substitution::Substitution;

/// The name of the member that holds the placement, which no shader can declare.
pub const PLACEMENT: &str = "rt_Placement";

/// The number of the placement's scalars: the images of the three axes, then that of the origin.
pub const PLACEMENT_SCALARS: u32 = 12;

/// The state variables of a ray, in the order in which they are computed.
const RAY: [&str; 3] = ["rt_RayOrigin", "rt_RayDirection", "rt_InverseRayDirection"];

/// Transforms the function's loads of the ray by its object's placement, with `fma` if `contract` is true.
pub fn run(function: &mut Function, contract: bool) {
    let variables = RAY.map(|name| function.find_variable(VariableKind::State, name));
    if variables == [None; 3] {
        return;
    }
    let mut body = std::mem::take(&mut function.body);
    let mut mapping = Mapping { function, contract, ops: Vec::new() };
    let vectors = mapping.ray(&variables);
    let mut ops = mapping.ops;
    let mut loads = Loads {
        function,
        vectors: variables.into_iter().flatten().zip(vectors).collect(),
        substitution: Substitution::default(),
    };
    loads.region(&mut body);
    ops.append(&mut body.ops);
    body.ops = ops;
    function.body = body;
}

/// Computes the ray in object space.
struct Mapping<'a> {
    function: &'a mut Function,
    contract: bool,
    ops: Vec<Op>,
}

impl Mapping<'_> {
    /// Returns the vectors of those variables that the function has.
    fn ray(&mut self, variables: &[Option<VariableId>; 3]) -> Vec<[Value; 3]> {
        let placement = self.function.intern_variable(Variable {
            kind: VariableKind::Member,
            name: PLACEMENT.to_owned(),
            scalar: Scalar::F32,
            len: PLACEMENT_SCALARS,
        });
        let [origin, direction, inverse] = *variables;
        let origin = origin.map(|variable| {
            let origin = self.load(variable, 0);
            let translation = self.load(placement, 9);
            self.map(placement, origin, Some(translation))
        });
        let mapped = direction.or(inverse).map(|_| {
            let direction = self.direction();
            let direction = self.load(direction, 0);
            self.map(placement, direction, None)
        });
        let inverse = inverse.and(mapped).map(|mapped| {
            let one = self.push(OpKind::Constant(Constant::F32(1.0)));
            mapped.map(|it| self.push(OpKind::Binary(BinaryOp::Divide, one, it)))
        });
        [origin, direction.and(mapped), inverse].into_iter().flatten().collect()
    }

    fn direction(&mut self) -> VariableId {
        self.function.intern_variable(Variable {
            kind: VariableKind::State,
            name: RAY[1].to_owned(),
            scalar: Scalar::F32,
            len: 3,
        })
    }

    fn map(
        &mut self,
        placement: VariableId,
        vector: [Value; 3],
        origin: Option<[Value; 3]>,
    ) -> [Value; 3] {
        let columns = [0, 3, 6].map(|first| self.load(placement, first));
        std::array::from_fn(|row| {
            let start = origin.map(|origin| origin[row]);
            let terms = columns.iter().zip(vector).map(|(column, scalar)| (column[row], scalar));
            let sum = terms.fold(start, |sum, (a, b)| Some(self.multiply_add(a, b, sum)));
            sum.expect("there are three terms")
        })
    }

    fn multiply_add(&mut self, a: Value, b: Value, sum: Option<Value>) -> Value {
        match sum {
            Some(sum) if self.contract => self.push(OpKind::Fma(a, b, sum)),
            Some(sum) => {
                let product = self.push(OpKind::Binary(BinaryOp::Multiply, a, b));
                self.push(OpKind::Binary(BinaryOp::Add, sum, product))
            }
            None => self.push(OpKind::Binary(BinaryOp::Multiply, a, b)),
        }
    }

    fn load(&mut self, variable: VariableId, first: u32) -> [Value; 3] {
        [0, 1, 2].map(|index| self.push(OpKind::Load(variable, Index::Constant(first + index))))
    }

    fn push(&mut self, kind: OpKind) -> Value {
        self.function.push(&mut self.ops, Scalar::F32, kind)
    }
}

/// Replaces loads of the ray.
struct Loads<'a> {
    function: &'a mut Function,
    /// The replacement vectors, by variable.
    vectors: Vec<(VariableId, [Value; 3])>,
    substitution: Substitution,
}

impl Loads<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            op.kind.regions_mut().for_each(|region| self.region(region));
            match self.mapped(&op.kind, &mut ops) {
                Some(value) => self.substitution.set_all(op.results, [value]),
                None => ops.push(op),
            }
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Returns the replacement of a load of the ray; operations that it needs are appended to `ops`.
    fn mapped(&mut self, kind: &OpKind, ops: &mut Vec<Op>) -> Option<Value> {
        let OpKind::Load(variable, index) = kind else { return None };
        let (_, vector) = self.vectors.iter().find(|(mapped, _)| mapped == variable)?;
        match (*index, *vector) {
            (Index::Constant(index), vector) => vector.get(index as usize).copied(),
            (Index::Dynamic(index), [x, y, z]) => {
                let y_or_z = self.choose(ops, index, 1, y, z);
                Some(self.choose(ops, index, 0, x, y_or_z))
            }
        }
    }

    /// Returns `then` for indices up to `last`, and `otherwise` for those beyond.
    fn choose(
        &mut self,
        ops: &mut Vec<Op>,
        index: Value,
        last: i32,
        then: Value,
        otherwise: Value,
    ) -> Value {
        let last = self.function.push(ops, Scalar::I32, OpKind::Constant(Constant::I32(last)));
        let kind = OpKind::Compare(CompareOp::LessEqual, index, last);
        let condition = self.function.push(ops, Scalar::Bool, kind);
        self.function.push(ops, Scalar::F32, OpKind::Select(condition, then, otherwise))
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use rtsl_ir::Function;

    use super::run;

    fn placed(text: &str, contract: bool) -> String {
        let mut function: Function = text.parse().unwrap();
        run(&mut function, contract);
        crate::dce::run(&mut function);
        function.renumber();
        rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
        function.to_string()
    }

    #[test]
    fn loads_of_the_ray_are_of_the_object_s_space() {
        let text = "function f state rt_RayOrigin: f32[3] state rt_InverseRayDirection: f32[3]
            scratch f: f32[2] scratch i: i32[1] {
            %a: f32 = load state:rt_RayOrigin@1
            %i: i32 = load scratch:i@0
            %b: f32 = load state:rt_InverseRayDirection@%i
            return scratch:f@0 = %a, scratch:f@1 = %b }";
        expect![[r#"
            function f
            state rt_RayOrigin: f32[3]
            state rt_InverseRayDirection: f32[3]
            scratch f: f32[2]
            scratch i: i32[1]
            member rt_Placement: f32[12]
            state rt_RayDirection: f32[3]
            {
              %0: f32 = load state:rt_RayOrigin@0
              %1: f32 = load state:rt_RayOrigin@1
              %2: f32 = load state:rt_RayOrigin@2
              %3: f32 = load member:rt_Placement@10
              %4: f32 = load member:rt_Placement@1
              %5: f32 = load member:rt_Placement@4
              %6: f32 = load member:rt_Placement@7
              %7: f32 = fma %4, %0, %3
              %8: f32 = fma %5, %1, %7
              %9: f32 = fma %6, %2, %8
              %10: f32 = load state:rt_RayDirection@0
              %11: f32 = load state:rt_RayDirection@1
              %12: f32 = load state:rt_RayDirection@2
              %13: f32 = load member:rt_Placement@0
              %14: f32 = load member:rt_Placement@1
              %15: f32 = load member:rt_Placement@2
              %16: f32 = load member:rt_Placement@3
              %17: f32 = load member:rt_Placement@4
              %18: f32 = load member:rt_Placement@5
              %19: f32 = load member:rt_Placement@6
              %20: f32 = load member:rt_Placement@7
              %21: f32 = load member:rt_Placement@8
              %22: f32 = multiply %13, %10
              %23: f32 = fma %16, %11, %22
              %24: f32 = fma %19, %12, %23
              %25: f32 = multiply %14, %10
              %26: f32 = fma %17, %11, %25
              %27: f32 = fma %20, %12, %26
              %28: f32 = multiply %15, %10
              %29: f32 = fma %18, %11, %28
              %30: f32 = fma %21, %12, %29
              %31: f32 = constant 1.0
              %32: f32 = divide %31, %24
              %33: f32 = divide %31, %27
              %34: f32 = divide %31, %30
              %35: i32 = load scratch:i@0
              %36: i32 = constant 1
              %37: bool = less_equal %35, %36
              %38: f32 = select %37, %33, %34
              %39: i32 = constant 0
              %40: bool = less_equal %35, %39
              %41: f32 = select %40, %32, %38
              return scratch:f@0 = %9, scratch:f@1 = %41
            }
        "#]]
        .assert_eq(&placed(text, true));
        assert_eq!(placed(text, false).matches("fma").count(), 0);
    }

    #[test]
    fn a_method_that_reads_no_ray_has_no_placement() {
        let text =
            "function f scratch f: f32[1] { %a: f32 = load scratch:f@0 return scratch:f@0 = %a }";
        assert!(!placed(text, true).contains("rt_Placement"));
    }
}
