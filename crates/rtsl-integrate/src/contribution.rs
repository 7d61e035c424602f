//! The contribution of a stage: light that arrives if nothing blocks a ray.
//!
//! In scenes in which kernels search, a stage that has one at most searches at its end, and one that has several
//! searches for what blocks each. In others, a stage [keeps](super::kept_requests) a few, or makes requests.

use rtsl_ir::{Index, Op, OpKind, Scalar, Value, Variable, VariableKind};
use rtsl_link::Linking;

use crate::spawning::Places;
use crate::stage_linker::StageLinker;

/// The number of scalars of a contribution, the operands of its query.
pub const CONTRIBUTION_SCALARS: usize = 10;

/// The greatest number of places in a stage whose contributions have arrays.
pub const MAX_CONTRIBUTIONS: usize = 8;

/// Returns the name of the scratch array with a scalar of the contribution at a place.
pub fn contribution_column(place: usize, index: usize) -> String {
    format!("contribution.{place}.{index}")
}

/// Returns the place of the scratch with a contribution; `None` for other variables.
pub fn place_of_contribution(variable: &Variable) -> Option<usize> {
    let scalars = variable.name.strip_prefix("contribution.")?;
    scalars.split_once('.')?.0.parse().ok()
}

/// The use of the contributions of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contributions {
    /// The host is told of each.
    #[default]
    Requested,
    /// There is one at most, which the stage keeps until it ends, and searches for what blocks it.
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

impl StageLinker {
    /// Keeps the operands of a contribution until the stage ends.
    pub(crate) fn keep_contribution(
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
