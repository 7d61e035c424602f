//! Loop-invariant code motion: computes loop-invariant values before the loop.
//!
//! Operations without effects, and whole `if`s of such operations, move out of all loops in which their operands are
//! invariant. They are taken from the body of the loop and from the `if`s directly in it, since a `for` becomes a loop
//! whose body is an `if`; not from `if`s nested in those, which more often are rare cases. All operations are defined
//! for all operands, so speculative execution changes nothing. Loops, which might not end, do not move.

use rtsl_ir::{Effect, Function, IndexVec, Op, OpKind, Region, Value, Variable};

/// The depth of nested `if`s in the body of a loop from which operations are taken.
const MAX_IFS: u32 = 1;

/// Moves the loop-invariant operations of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut levels =
        Levels { variables: &function.variables, of: IndexVec::filled(function.values.len(), 0) };
    levels.region(&body, 0);
    let mut motion = Motion { levels: levels.of };
    motion.region(&mut body, Position { loops: 0, ifs: 0 }, &mut Vec::new());
    function.body = body;
}

/// The loop depth at which values vary: a value of level 1 is invariant in the loops inside the outermost one, wherever
/// it is computed.
struct Levels<'a> {
    variables: &'a [Variable],
    /// The level of each value.
    of: IndexVec<Value, u32>,
}

impl Levels<'_> {
    /// Computes the levels in a region at loop depth `loops`; returns the greatest of its operations and yields.
    fn region(&mut self, region: &Region, loops: u32) -> u32 {
        for param in &region.params {
            self.of[*param] = loops;
        }
        let mut greatest = 0;
        for op in &region.ops {
            let level = self.op(op, loops);
            op.results.iter().for_each(|result| self.of[result] = level);
            greatest = greatest.max(level);
        }
        let yields = region.yields.iter().map(|value| self.of[*value]);
        yields.fold(greatest, u32::max)
    }

    /// Computes the level of an operation. One that cannot be moved has the level of its position.
    fn op(&mut self, op: &Op, loops: u32) -> u32 {
        let mut level = 0;
        op.kind.for_each_operand(|value| level = level.max(self.of[value]));
        match &op.kind {
            OpKind::Loop { body, .. } => {
                self.region(body, loops + 1);
                loops
            }
            OpKind::If { then, otherwise, .. } => {
                let then = self.region(then, loops);
                level.max(then).max(self.region(otherwise, loops))
            }
            kind if kind.effect(self.variables) == Effect::None => level,
            _ => loops,
        }
    }
}

/// The position of a region.
#[derive(Clone, Copy)]
struct Position {
    /// The loop depth.
    loops: u32,
    /// The depth of `if`s within the innermost loop.
    ifs: u32,
}

struct Motion {
    /// The levels by value, from [`Levels`].
    levels: IndexVec<Value, u32>,
}

impl Motion {
    /// Processes a region; operations that leave the innermost loop around it go to `hoisted`.
    fn region(&mut self, region: &mut Region, at: Position, hoisted: &mut Vec<Op>) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for op in std::mem::take(&mut region.ops) {
            if self.leaves(&op, at) {
                hoisted.push(op);
            } else {
                self.stay(op, at, hoisted, &mut ops);
            }
        }
        region.ops = ops;
    }

    /// Processes the regions of an operation that does not move as a whole.
    fn stay(&mut self, mut op: Op, at: Position, hoisted: &mut Vec<Op>, ops: &mut Vec<Op>) {
        match &mut op.kind {
            OpKind::Loop { body, .. } => {
                let mut from_body = Vec::new();
                let inside = Position { loops: at.loops + 1, ifs: 0 };
                self.region(body, inside, &mut from_body);
                for op in from_body {
                    let to = if self.leaves(&op, at) { &mut *hoisted } else { &mut *ops };
                    to.push(op);
                }
            }
            OpKind::If { then, otherwise, .. } => {
                let inside = Position { ifs: at.ifs + 1, ..at };
                self.region(then, inside, hoisted);
                self.region(otherwise, inside, hoisted);
            }
            _ => {}
        }
        ops.push(op);
    }

    /// True if an operation is to move before the innermost loop. All results of one have the same level; an operation
    /// without results has an effect or is dead.
    fn leaves(&self, op: &Op, at: Position) -> bool {
        at.ifs <= MAX_IFS && op.results.iter().next().is_some_and(|it| self.levels[it] < at.loops)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn invariants_leave_all_their_loops() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            %r: f32 = loop (%p: f32 = %x) {
                %a: f32 = sqrt %x
                %s: f32 = loop (%q: f32 = %p) {
                    %b: f32 = add %a, %x
                    %d: f32 = add %p, %b
                    %e: f32 = add %q, %d
                    repeat %c, %e
                }
                repeat %c, %s
            }
            return scratch:f@0 = %r";
        expect![[r#"
            %2: f32 = sqrt %0
            %3: f32 = add %2, %0
            %4: f32 = loop (%5: f32 = %0) {
              %6: f32 = add %5, %3
              %7: f32 = loop (%8: f32 = %5) {
                %9: f32 = add %8, %6
                repeat %1, %9
              }
              repeat %1, %7
            }
            return scratch:f@0 = %4
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn the_guard_of_a_for_is_no_obstacle_and_a_rare_case_is() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            loop () {
                %a: f32 = if %c {
                    %m: f32 = load member:m@0
                    store local:s@0, %m
                    %b: f32 = if %c { %n: f32 = sqrt %x store local:s@0, %n yield %n } else { yield %x }
                    yield %b
                } else { %r: f32 = load local:s@0 yield %r }
                store local:s@1, %a
                repeat %c
            }
            return";
        expect![[r#"
            %2: f32 = load member:m@0
            loop () {
              %3: f32 = if %1 {
                store local:s@0, %2
                %4: f32 = if %1 {
                  %5: f32 = sqrt %0
                  store local:s@0, %5
                  yield %5
                } else {
                  yield %0
                }
                yield %4
              } else {
                %6: f32 = load local:s@0
                yield %6
              }
              store local:s@1, %3
              repeat %1
            }
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn an_if_leaves_as_a_whole() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            %r: f32 = loop (%p: f32 = %x) {
                %b: f32 = if %c {
                    %d: f32 = sqrt %x yield %d
                } else {
                    %n: f32 = negate %x yield %n
                }
                %e: f32 = add %p, %b
                repeat %c, %e
            }
            return scratch:f@0 = %r";
        expect![[r#"
            %2: f32 = if %1 {
              %3: f32 = sqrt %0
              yield %3
            } else {
              %4: f32 = negate %0
              yield %4
            }
            %5: f32 = loop (%6: f32 = %0) {
              %7: f32 = add %6, %2
              repeat %1, %7
            }
            return scratch:f@0 = %5
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
