//! The contribution of a stage: light that arrives if nothing blocks a ray.
//!
//! A stage that has one at most stores it in arrays, which costs less than a request for each vector of lanes. A stage
//! that has several searches for what blocks each, in scenes in which kernels search.

use rtsl_ir::{Index, Op, OpKind, Output, Scalar, Value, Variable, VariableKind};

use super::linker::{Linker, Linking};
use super::spawning::Places;

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

/// The use of the contributions of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Contributions {
    /// The host is asked for each.
    #[default]
    Requested,
    /// There is one at most, which the stage keeps until it ends.
    Kept,
    /// The stage searches for what blocks each, if stages search at all.
    Searched,
}

/// The greatest number of places at which a stage searches for what blocks contributions: each has a search of its own.
const MAX_SEARCHED: usize = 4;

impl Contributions {
    /// Selects the use of the contributions of a stage, by the places where it makes them.
    pub fn of(places: Places) -> Contributions {
        match places {
            Places { count: 1, is_any_repeated: false } => Contributions::Kept,
            Places { count: 1..=MAX_SEARCHED, .. } => Contributions::Searched,
            _ => Contributions::Requested,
        }
    }
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
    use rtsl_ir::{Function, Query};

    use super::*;

    #[test]
    fn contributions_are_searched_if_there_may_be_several() {
        assert_eq!(Query::Contribute.operand_scalars().count(), CONTRIBUTION_SCALARS);
        let contribute = "query contribute %x, %x, %x, %x, %x, %x, %x, %x, %x, %x";
        let of = |body: &str| {
            let text = format!(
                "function f {{ %x: f32 = constant 1.0 %t: bool = constant true {body} return }}"
            );
            let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
            Contributions::of(Places::of(Query::Contribute, &function, None))
        };
        assert_eq!(of(""), Contributions::Requested);
        assert_eq!(of(contribute), Contributions::Kept);
        let in_branch = format!("if %t {{ {contribute} yield }} else {{ yield }}");
        assert_eq!(of(&in_branch), Contributions::Kept);
        assert_eq!(of(&format!("{contribute} ").repeat(2)), Contributions::Searched);
        let in_loop = format!("%y: f32 = loop (%z: f32 = %x) {{ {contribute} repeat %t, %z }}");
        assert_eq!(of(&in_loop), Contributions::Searched);
        let many = format!("{contribute} ").repeat(MAX_SEARCHED + 1);
        assert_eq!(of(&many), Contributions::Requested);
    }
}
