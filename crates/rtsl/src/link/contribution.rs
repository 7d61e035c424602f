//! The contribution of a stage: light that arrives if nothing blocks a ray.
//!
//! A stage that has one at most stores it in arrays, which costs less than a request for each vector of lanes.

use rtsl_ir::{
    Function, Index, Op, OpKind, Output, Query, Region, Scalar, Value, Variable, VariableKind,
};

use super::linker::{Linker, Linking};

/// The number of scalars of a contribution, the operands of its query.
pub(crate) const CONTRIBUTION_SCALARS: usize = 10;

/// Returns the name of the scratch array with a scalar of the contribution.
pub(crate) fn contribution_column(index: usize) -> String {
    format!("contribution.{index}")
}

/// True for the scratch with a contribution.
pub(crate) fn is_contribution(variable: &Variable) -> bool {
    (0..CONTRIBUTION_SCALARS).any(|index| variable.name == contribution_column(index))
}

/// True if a stage contributes at one place, which it passes at most once.
pub(crate) fn is_single(function: &Function) -> bool {
    contributions(&function.body, false) == 1
}

/// Counts the contributions of a region; one in a loop counts as several.
fn contributions(region: &Region, is_repeated: bool) -> usize {
    let of_op = |op: &Op| match &op.kind {
        OpKind::Query(Query::Contribute, _) => 1 + usize::from(is_repeated),
        kind => {
            let is_repeated = is_repeated || matches!(kind, OpKind::Loop { .. });
            kind.regions().map(|region| contributions(region, is_repeated)).sum()
        }
    };
    region.ops.iter().map(of_op).sum()
}

impl Linker {
    /// Keeps the operands of a contribution until the stage ends.
    pub(super) fn keep_contribution(
        &mut self,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let local = Variable {
            kind: VariableKind::Local,
            name: "contribution".to_owned(),
            scalar: Scalar::F32,
            len: CONTRIBUTION_SCALARS as u32,
        };
        let local = self.intern_variable(local);
        self.contribution = Some(local);
        for (index, operand) in (0..).zip(operands) {
            self.emit(to, OpKind::Store(local, Index::Constant(index), *operand), &[], false)?;
        }
        Ok(())
    }

    /// Stores what was kept; zeros if the path passed no contribution.
    pub(super) fn store_contribution(&mut self) -> Linking<()> {
        let Some(local) = self.contribution else { return Ok(()) };
        let mut body = std::mem::take(&mut self.out.body);
        for index in 0..CONTRIBUTION_SCALARS {
            let kind = OpKind::Load(local, Index::Constant(index as u32));
            let value = self.emit(&mut body.ops, kind, &[Scalar::F32], false)?.get(0);
            let column = Variable {
                kind: VariableKind::Scratch,
                name: contribution_column(index),
                scalar: Scalar::F32,
                len: 1,
            };
            let variable = self.intern_variable(column);
            self.out.outputs.push(Output { variable, component: 0 });
            body.yields.push(value);
        }
        self.out.body = body;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contribution_is_stored_unless_it_is_repeated() {
        assert_eq!(Query::Contribute.operand_scalars().count(), CONTRIBUTION_SCALARS);
        let contribute = "query contribute %x, %x, %x, %x, %x, %x, %x, %x, %x, %x";
        let function = |body: String| -> Function {
            let text = format!(
                "function f {{ %x: f32 = constant 1.0 %t: bool = constant true {body} return }}"
            );
            text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"))
        };
        assert!(!is_single(&function(String::new())));
        assert!(is_single(&function(contribute.to_owned())));
        assert!(is_single(&function(format!("if %t {{ {contribute} yield }} else {{ yield }}"))));
        assert!(!is_single(&function(format!("{contribute} {contribute}"))));
        assert!(!is_single(&function(format!(
            "%y: f32 = loop (%z: f32 = %x) {{ {contribute} repeat %t, %z }}"
        ))));
    }
}
