//! The searches that a stage asks for, as its last operations: a path that waits for the nearest hit has the answer
//! when the next stage begins, and light that nothing blocks is added to the path's sum.
//!
//! The rays are then values of the stage, and pass through memory neither on their way to the search nor to the sum.

use std::collections::BTreeSet;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Region, Scalar, Value, Variable, VariableKind,
};
use rtsl_link::{Linker, Linking};
use rtsl_stages::Port;

use crate::arithmetic::Arithmetic;
use crate::contribution::CONTRIBUTION_SCALARS;
use crate::next_stages::NextStages;
use crate::search::{Search, SearchCode, SearchLinks};
use crate::stage_linker::StageLinker;

/// The scratch arrays with the sum of the contributions to a path that nothing blocked.
pub const LIT_COLUMNS: [&str; 3] = ["path.lit.red", "path.lit.green", "path.lit.blue"];
/// The scratch array with the number of the contributions to a path for which stages searched.
pub const SHADOW_RAYS_COLUMN: &str = "path.shadow_rays";

/// The scratch arrays with what a path has received: an `rt_ReceivedLight`.
const RECEIVED: [(&str, Scalar); 4] = [
    (LIT_COLUMNS[0], Scalar::F32),
    (LIT_COLUMNS[1], Scalar::F32),
    (LIT_COLUMNS[2], Scalar::F32),
    (SHADOW_RAYS_COLUMN, Scalar::U32),
];

/// The searches of stages.
#[derive(Debug)]
pub struct StageSearch {
    /// The objects among which rays search.
    pub links: SearchLinks,
    /// The stages that begin with the answer to a search of the nearest hit.
    pub resumed: BTreeSet<i32>,
}

impl StageLinker {
    /// Adds the searches that the linked stage asks for.
    pub(crate) fn search_at_end(&mut self, search: &StageSearch) -> Linking<()> {
        let next = NextStages::of(&self.out);
        let mut ops = std::mem::take(&mut self.out.body.ops);
        self.add_light(&search.links, &mut ops)?;
        let resumed: Vec<i32> =
            search.resumed.iter().copied().filter(|stage| next.may_be(*stage)).collect();
        if !resumed.is_empty() {
            self.find_nearest(&search.links, &resumed, &mut ops)?;
        }
        self.out.body.ops = ops;
        Ok(())
    }

    /// Adds the stage's contribution to the path's sum if nothing blocks its ray.
    fn add_light(&mut self, links: &SearchLinks, to: &mut Vec<Op>) -> Linking<()> {
        let Some(local) = self.contribution else { return Ok(()) };
        let mut kept = Vec::with_capacity(CONTRIBUTION_SCALARS);
        for index in 0..CONTRIBUTION_SCALARS as u32 {
            let kind = OpKind::Load(local, Index::Constant(index));
            kept.push(self.emit(to, kind, &[Scalar::F32], false)?.get(0));
        }
        let operands = self.light_and_shadow(links, &kept, to)?;
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let before = RECEIVED.map(|(column, scalar)| code.column(column, scalar));
        let before = before.into_iter().collect::<Linking<Vec<Value>>>()?;
        let received = code.call("rt_receivedLight", &[before, operands].concat())?;
        for ((column, _), sum) in RECEIVED.into_iter().zip(received) {
            self.set_column(column.to_owned(), sum);
        }
        Ok(())
    }

    /// Adds a contribution to the path's sum where the stage makes it, if nothing blocks its ray.
    pub(crate) fn add_light_at_once(
        &mut self,
        links: &SearchLinks,
        contribution: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let operands = self.light_and_shadow(links, contribution, to)?;
        let sums = RECEIVED.map(|(column, scalar)| self.passed_value(column, scalar));
        let code = &mut Arithmetic { linker: self, to };
        let before = sums.iter().map(|sum| code.load_local(*sum));
        let before = before.collect::<Linking<Vec<Value>>>()?;
        let received = code.call("rt_receivedLight", &[before, operands].concat())?;
        sums.into_iter().zip(received).try_for_each(|(sum, value)| code.store_local(sum, value))
    }

    /// Searches for what blocks a contribution. Returns its light, whether there is any, so that its ray was traced, and
    /// whether anything blocks it.
    fn light_and_shadow(
        &mut self,
        links: &SearchLinks,
        contribution: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let (ray, light) = contribution.split_at(contribution.len() - 3);
        let is_lit = self.call_text("rt_isLit", light, to)?[0];
        let blocked = |linker: &mut StageLinker, to: &mut Vec<Op>| {
            let code = SearchCode { links, search: Search::Any };
            let hit = code.find(linker, ray, to)?;
            Ok(vec![Arithmetic { linker, to }.is_found(hit)?])
        };
        let is_blocked = self.only_if(is_lit, to, blocked)?[0];
        Ok([light, &[is_lit, is_blocked]].concat())
    }

    /// Finds the nearest hits for paths whose next stage is among these.
    fn find_nearest(
        &mut self,
        links: &SearchLinks,
        resumed: &[i32],
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let Some(next) = self.stored(Port::Next) else { return Ok(()) };
        let ports = Search::Nearest.event().request().iter();
        let request: Vec<Value> =
            ports.filter_map(|port| self.stored(Port::Request(*port))).collect();
        let searches = Arithmetic { linker: self, to }.is_one_of(next, resumed)?;
        let mut names = Vec::new();
        let answers = |linker: &mut StageLinker, to: &mut Vec<Op>| {
            let code = SearchCode { links, search: Search::Nearest };
            let nearest = code.find(linker, &request, to)?;
            let (found, answers) = code.answers(linker, nearest, to)?.into_iter().unzip();
            names = found;
            Ok(answers)
        };
        let answers = self.only_if(searches, to, answers)?;
        for (name, answer) in names.into_iter().zip(answers) {
            self.set_column(name, answer);
        }
        let counts = Arithmetic { linker: &mut *self, to: &mut *to }.counts()?;
        for (name, count) in counts {
            self.replace_column(&name, searches, count, to)?;
        }
        Ok(())
    }

    /// Adds operations that run under a condition; their results are zeros where it does not hold.
    fn only_if(
        &mut self,
        condition: Value,
        to: &mut Vec<Op>,
        work: impl FnOnce(&mut StageLinker, &mut Vec<Op>) -> Linking<Vec<Value>>,
    ) -> Linking<Vec<Value>> {
        let mut then = Region::default();
        self.nested(|linker| {
            then.yields = work(linker, &mut then.ops)?;
            Ok(())
        })?;
        let scalars: Vec<Scalar> = then.yields.iter().map(|it| self.out.scalar(*it)).collect();
        let mut otherwise = Region::default();
        for scalar in &scalars {
            let zero = self.constant(&mut otherwise.ops, Constant::zero(*scalar))?;
            otherwise.yields.push(zero);
        }
        let kind = OpKind::If { condition, then, otherwise };
        Ok(self.emit(to, kind, &scalars, false)?.iter().collect())
    }

    /// Returns the value that the stage stores to a port.
    fn stored(&self, port: Port) -> Option<Value> {
        let mut outputs = self.out.outputs.iter().zip(&self.out.body.yields);
        let is_port = |variable| Port::of(self.out.variable(variable)) == Some(port);
        outputs.find(|(output, _)| is_port(output.variable)).map(|(_, value)| *value)
    }

    /// Stores a value to a scratch array where a condition holds; elsewhere what the stage stores, or what it was.
    fn replace_column(
        &mut self,
        name: &str,
        condition: Value,
        value: Value,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let scalar = self.out.scalar(value);
        let (kind, name) = (VariableKind::Scratch, name.to_owned());
        let variable = self.intern_variable(Variable { kind, name, scalar, len: 1 });
        let stored = self.out.outputs.iter().position(|output| output.variable == variable);
        let before = match stored {
            Some(index) => self.out.body.yields[index],
            None => {
                let kind = OpKind::Load(variable, Index::Constant(0));
                self.emit(to, kind, &[scalar], false)?.get(0)
            }
        };
        let value = Arithmetic { linker: self, to }.select(condition, value, before)?;
        match stored {
            Some(index) => self.out.body.yields[index] = value,
            None => {
                let name = self.out.variable(variable).name.clone();
                self.set_column(name, value);
            }
        }
        Ok(())
    }
}

impl Arithmetic<'_> {
    /// True if a value is one of these.
    fn is_one_of(&mut self, value: Value, integers: &[i32]) -> Linking<Value> {
        let mut is_any = self.boolean(false)?;
        for integer in integers {
            let integer = self.integer(*integer)?;
            let is_equal = self.compare(CompareOp::Equal, value, integer)?;
            is_any = self.binary(BinaryOp::Or, is_any, is_equal)?;
        }
        Ok(is_any)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rtsl_ir::Function;
    use rtsl_ir::verify::verify;
    use rtsl_link::{Linked, LinkedMethod};

    use super::*;
    use crate::contribution::Contributions;
    use crate::search::SearchedClassLink;
    use crate::stage::{SurfaceLinks, link_stage};

    fn function(text: &str) -> Function {
        text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    /// Two shapes that rays hit at the distance that is a member.
    fn links() -> SearchLinks {
        let intersect = function(
            "function intersect member at: f32[1] state rt_HitDistance: f32[1] accepted accepted: bool[1] {
                %d: f32 = load member:at@0 %l: f32 = load state:rt_HitDistance@0 %hit: bool = less %d, %l
                %new: f32 = select %hit, %d, %l
                return state:rt_HitDistance@0 = %new, accepted:accepted@0 = %hit
            }",
        );
        let (unchanged, warnings) = (Vec::new(), Vec::new());
        let linked = Linked { function: intersect, unchanged, warnings };
        let intersect = Arc::new(LinkedMethod::new(linked));
        let class = SearchedClassLink { prefix: "class.0.".to_owned(), count: 2, intersect };
        SearchLinks { classes: vec![class], items: 2, slack: 1e-6 }
    }

    /// Links a stage that contributes and requests a search, after which stage `next` follows.
    fn linked(next: &str) -> Function {
        let request: String =
            (0..8).map(|index| format!("scratch request.{index}: f32[1] ")).collect();
        let stored: String =
            (0..8).map(|index| format!("scratch:request.{index}@0 = %x, ")).collect();
        let stage = function(&format!(
            "function f.0 {request} scratch next: i32[1] state rt_HitDistance: f32[1] {{
                %x: f32 = load state:rt_HitDistance@0 %n: i32 = constant {next}
                query contribute %x, %x, %x, %x, %x, %x, %x, %x, %x, %x
                return {stored} scratch:next@0 = %n
            }}"
        ));
        let search = StageSearch { links: links(), resumed: BTreeSet::from([1]) };
        let links = SurfaceLinks {
            contributions: Contributions::Kept,
            search: Some(Arc::new(search)),
            ..SurfaceLinks::default()
        };
        let Linked { function, .. } = link_stage(&stage, links).unwrap();
        verify(&function).unwrap();
        function
    }

    fn stored(function: &Function) -> BTreeSet<&str> {
        let outputs = function.outputs.iter();
        outputs.map(|output| function.variable(output.variable).name.as_str()).collect()
    }

    #[test]
    fn a_stage_stores_answers_and_light_in_the_place_of_a_contribution() {
        let function = linked("1");
        let stored = stored(&function);
        for name in ["answer.0", "answer.4", "path.group", "path.surface", "path.searches"] {
            assert!(stored.contains(name), "{name}");
        }
        assert!(LIT_COLUMNS.iter().all(|name| stored.contains(name)));
        assert!(stored.contains(SHADOW_RAYS_COLUMN));
        assert!(!stored.iter().any(|name| name.starts_with("contribution")));
    }

    #[test]
    fn a_stage_after_which_nothing_is_searched_has_no_answers() {
        let function = linked("2");
        let stored = stored(&function);
        assert!(!stored.iter().any(|name| name.starts_with("answer")), "{stored:?}");
        assert!(stored.contains(LIT_COLUMNS[0]));
    }
}
