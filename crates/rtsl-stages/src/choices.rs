//! Merges values that `if`s of one condition choose, so that only one of them passes through the frame.
//!
//! In the branches of an `if`, each result of an earlier `if` of the same condition is what the latter's branch yields.
//! So a result of the second may be one that the first has, or one that the first could have: a branch that yields a
//! placeholder may yield any value instead.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{OpKind, Region, Value};

/// The values that a result has if a condition is true, and if it is false.
type Pair = [Value; 2];

/// Merges the values of a region, and those of the regions in it.
pub(crate) fn merge(region: &mut Region, placeholders: &BTreeSet<Value>) {
    let mut merging = Merging {
        defined: defined_in(region),
        region,
        placeholders,
        conditions: BTreeMap::new(),
        same: BTreeMap::new(),
    };
    for at in 0..merging.region.ops.len() {
        merging.op(at);
    }
    let same = merging.same;
    region.for_each_use_mut(&mut |value| *value = *same.get(value).unwrap_or(value));
}

struct Merging<'a> {
    region: &'a mut Region,
    /// The values that the region defines, with the index of the operation; `None` for those of regions in it.
    defined: BTreeMap<Value, Option<usize>>,
    placeholders: &'a BTreeSet<Value>,
    /// By conditions, the results of their `if`s up to now.
    conditions: BTreeMap<Value, Choices>,
    /// The results that are others.
    same: BTreeMap<Value, Value>,
}

/// The results of the `if`s of one condition.
#[derive(Default)]
struct Choices {
    pairs: BTreeMap<Value, Pair>,
    /// The first result with a pair.
    by_pair: BTreeMap<Pair, Value>,
    /// By branches, the first result that has a value there.
    by_branch: [BTreeMap<Value, Value>; 2],
    /// The results that a branch yields a placeholder for.
    free: Vec<Free>,
}

#[derive(Clone, Copy)]
struct Free {
    result: Value,
    /// The branch with the placeholder.
    branch: usize,
    /// The index of the `if`, and that of the result.
    at: usize,
    index: usize,
}

impl Merging<'_> {
    fn op(&mut self, at: usize) {
        let op = &mut self.region.ops[at];
        op.kind.regions_mut().for_each(|inner| merge(inner, self.placeholders));
        let OpKind::If { condition, then, otherwise } = &mut op.kind else { return };
        let mut choices = self.conditions.remove(condition).unwrap_or_default();
        let (condition, results) = (*condition, op.results);
        for (branch, region) in [&mut *then, otherwise].into_iter().enumerate() {
            region.for_each_use_mut(&mut |value| *value = choices.first_in(branch, *value));
        }
        let yields = then.yields.iter().zip(&otherwise.yields);
        let yields: Vec<Pair> = yields.map(|(one, other)| [*one, *other]).collect();
        for (index, (result, pair)) in results.iter().zip(yields).enumerate() {
            let known = choices.with(pair).or_else(|| self.fill(&mut choices, pair));
            choices.add(result, pair);
            if let Some(known) = known {
                self.same.insert(result, known);
            }
            let branches = (0..2).filter(|branch| self.placeholders.contains(&pair[*branch]));
            choices.free.extend(branches.map(|branch| Free { result, branch, at, index }));
        }
        self.conditions.insert(condition, choices);
    }

    /// Returns a result that has become this pair, since a branch yields one of its values instead of a placeholder.
    fn fill(&mut self, choices: &mut Choices, pair: Pair) -> Option<Value> {
        let is_fit = |free: &Free| {
            let other = 1 - free.branch;
            choices.value_in(other, free.result) == choices.value_in(other, pair[other])
        };
        let candidates = choices.free.iter().enumerate().filter(|(_, free)| is_fit(free));
        let found = candidates.filter_map(|(place, free)| {
            let value = choices.value_in(free.branch, pair[free.branch]);
            self.is_visible(value, free).then_some((place, value))
        });
        let (place, value) = found.collect::<Vec<_>>().into_iter().next()?;
        let Free { result, branch, at, index } = choices.free.remove(place);
        let region = self.region.ops[at].kind.regions_mut().nth(branch)?;
        region.yields[index] = value;
        let mut filled = *choices.pairs.get(&result)?;
        filled[branch] = value;
        choices.add(result, filled);
        Some(result)
    }

    /// True if a branch with a placeholder could yield a value instead.
    fn is_visible(&self, value: Value, free: &Free) -> bool {
        match self.defined.get(&value) {
            None => true,
            Some(Some(at)) => *at < free.at,
            Some(None) => {
                let region = self.region.ops[free.at].kind.regions().nth(free.branch);
                let mut results =
                    region.into_iter().flat_map(|it| &it.ops).flat_map(|op| op.results.iter());
                results.any(|result| result == value)
            }
        }
    }
}

impl Choices {
    /// Returns what a value is in a branch.
    fn value_in(&self, branch: usize, mut value: Value) -> Value {
        while let Some(pair) = self.pairs.get(&value) {
            value = pair[branch];
        }
        value
    }

    /// Returns the first result that is the same in a branch as another; the value itself if it is not a result.
    fn first_in(&self, branch: usize, value: Value) -> Value {
        if !self.pairs.contains_key(&value) {
            return value;
        }
        *self.by_branch[branch].get(&self.value_in(branch, value)).unwrap_or(&value)
    }

    /// Returns the result with a pair.
    fn with(&self, [one, other]: Pair) -> Option<Value> {
        self.by_pair.get(&[self.value_in(0, one), self.value_in(1, other)]).copied()
    }

    fn add(&mut self, result: Value, pair: Pair) {
        self.pairs.insert(result, pair);
        let pair = [0, 1].map(|branch| self.value_in(branch, result));
        self.by_pair.entry(pair).or_insert(result);
        for (by_value, value) in self.by_branch.iter_mut().zip(pair) {
            by_value.entry(value).or_insert(result);
        }
    }
}

/// Returns the values that a region defines, with the index of the operation; `None` for those of regions in it.
fn defined_in(region: &Region) -> BTreeMap<Value, Option<usize>> {
    let mut defined = BTreeMap::new();
    region.for_each_op(&mut |op| defined.extend(op.results.iter().map(|result| (result, None))));
    for (at, op) in region.ops.iter().enumerate() {
        defined.extend(op.results.iter().map(|result| (result, Some(at))));
    }
    defined
}
