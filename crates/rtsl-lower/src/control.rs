//! Branches and joins of control flow.

use rtsl_ir::{Constant, Region, Value};
use rtsl_source::Span;

use crate::Lowering;
use crate::cells::{Cell, Changes};
use crate::limits::{self, Lowered};

/// One branch, generated but not yet joined with the other.
struct Way {
    region: Region,
    /// The results of the branch.
    values: Vec<Value>,
    /// The cells that it changed; the changes have been rolled back.
    changes: Changes,
}

impl Way {
    fn value_of(&self, cell: Cell, before: Value) -> Value {
        self.changes.get(&cell).copied().unwrap_or(before)
    }
}

impl Lowering<'_> {
    /// Lowers an `if`. Both branches return equally many values of the same types. Afterwards the
    /// cells that they change hold the joined values. If the condition is constant, only one branch
    /// is generated.
    pub fn lower_if(
        &mut self,
        condition: Value,
        span: Span,
        then: impl FnOnce(&mut Self) -> Lowered<Vec<Value>>,
        otherwise: impl FnOnce(&mut Self) -> Lowered<Vec<Value>>,
    ) -> Lowered<Vec<Value>> {
        match self.builder.known(condition) {
            Some(Constant::Bool(true)) => return then(self),
            Some(_) => return otherwise(self),
            None => {}
        }
        let then = self.lower_way(span, then)?;
        let otherwise = self.lower_way(span, otherwise)?;
        Ok(self.join(condition, then, otherwise))
    }

    /// Lowers an `if` without `else` and without results.
    pub fn lower_when(
        &mut self,
        condition: Value,
        span: Span,
        then: impl FnOnce(&mut Self) -> Lowered<()>,
    ) -> Lowered<()> {
        let then = |lowering: &mut Self| then(lowering).map(|()| Vec::new());
        self.lower_if(condition, span, then, |_| Ok(Vec::new()))?;
        Ok(())
    }

    fn lower_way(
        &mut self,
        span: Span,
        fill: impl FnOnce(&mut Self) -> Lowered<Vec<Value>>,
    ) -> Lowered<Way> {
        self.check_regions(span)?;
        let mark = self.cells.mark();
        let looked_up = self.looked_up.len();
        self.builder.begin_region();
        let values = fill(self)?;
        let region = self.builder.end_region(Vec::new());
        self.looked_up.truncate(looked_up);
        Ok(Way { region, values, changes: self.cells.take_back(mark) })
    }

    pub fn check_regions(&self, span: Span) -> Lowered<()> {
        if self.builder.depth() > limits::NESTED_REGIONS {
            return Err(limits::nested_too_deeply(span));
        }
        Ok(())
    }

    /// Joins two branches. If both regions are empty, the results become selects.
    fn join(&mut self, condition: Value, mut then: Way, mut otherwise: Way) -> Vec<Value> {
        let given: Vec<(Value, Value)> =
            then.values.iter().copied().zip(otherwise.values.iter().copied()).collect();
        let mut changed: Vec<Cell> =
            then.changes.keys().chain(otherwise.changes.keys()).copied().collect();
        changed.sort_unstable();
        changed.dedup();
        let of_cells = changed.iter().map(|cell| {
            let before = self.cells.get(*cell);
            (then.value_of(*cell, before), otherwise.value_of(*cell, before))
        });
        let pairs: Vec<(Value, Value)> = given.iter().copied().chain(of_cells).collect();

        let empty = then.region.ops.is_empty() && otherwise.region.ops.is_empty();
        let yielded =
            |&&(then, otherwise): &&(Value, Value)| !empty && !self.is_plain(then, otherwise);
        let (then_yields, otherwise_yields) = pairs.iter().filter(yielded).copied().unzip();
        then.region.yields = then_yields;
        otherwise.region.yields = otherwise_yields;
        let results: Vec<Value> = if empty {
            Vec::new()
        } else {
            self.builder.if_regions(condition, then.region, otherwise.region).iter().collect()
        };

        let mut results = results.into_iter();
        let mut joined: Vec<Value> = Vec::with_capacity(pairs.len());
        for (then, otherwise) in pairs {
            let value = if empty || self.is_plain(then, otherwise) {
                self.join_plain(condition, then, otherwise)
            } else {
                results.next().expect("a result for each yield")
            };
            joined.push(value);
        }
        for (cell, value) in changed.iter().zip(&joined[given.len()..]) {
            self.set_cell(*cell, *value);
        }
        joined.truncate(given.len());
        joined
    }

    /// True if the two values need no result of the `if`: they are the same, or both are constants.
    fn is_plain(&self, then: Value, otherwise: Value) -> bool {
        let known = |value| matches!(self.builder.known(value), Some(Constant::Bool(_)));
        then == otherwise || (known(then) && known(otherwise))
    }

    fn join_plain(&mut self, condition: Value, then: Value, otherwise: Value) -> Value {
        match (self.builder.known(then), self.builder.known(otherwise)) {
            (Some(Constant::Bool(true)), Some(Constant::Bool(false))) => condition,
            (Some(Constant::Bool(false)), Some(Constant::Bool(true))) => {
                self.builder.not(condition)
            }
            _ => self.builder.select(condition, then, otherwise),
        }
    }

    // Flags.

    /// Sets a flag.
    pub fn raise(&mut self, flag: Cell) {
        let yes = self.builder.bool(true);
        self.cells.set(flag, yes);
    }

    /// Clears a flag.
    pub fn clear(&mut self, flag: Cell) {
        let no = self.builder.bool(false);
        self.cells.set(flag, no);
    }

    /// True if any of the flags is set.
    pub fn any_flag(&mut self, flags: impl IntoIterator<Item = Cell>) -> Value {
        let mut any = self.builder.bool(false);
        for flag in flags {
            let flag = self.cells.get(flag);
            any = self.either(any, flag);
        }
        any
    }

    /// `a || b` of two evaluated values; constants are folded.
    pub fn either(&mut self, a: Value, b: Value) -> Value {
        match (self.builder.known(a), self.builder.known(b)) {
            (Some(Constant::Bool(true)), _) | (_, Some(Constant::Bool(false))) => a,
            (Some(_), _) | (_, Some(_)) => b,
            (None, None) => self.builder.or(a, b),
        }
    }

    /// `a && b` of two evaluated values; constants are folded.
    pub fn both(&mut self, a: Value, b: Value) -> Value {
        match (self.builder.known(a), self.builder.known(b)) {
            (Some(Constant::Bool(false)), _) | (_, Some(Constant::Bool(true))) => a,
            (Some(_), _) | (_, Some(_)) => b,
            (None, None) => self.builder.and(a, b),
        }
    }
}
