//! Tests of the interpreter on small functions in text form.

use rtsl_ir::host::{Host, LaneColors, LaneFloats, LaneSet, RayLanes};
use rtsl_ir::verify::verify;
use rtsl_ir::{Function, Interpreter, Outcome, Storage, VariableId};
use rtsl_testing::functions::HashHost;

/// Variables as vectors; missing ones are empty.
#[derive(Default)]
struct Places(Vec<Vec<u32>>);

impl Storage for Places {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.0[variable.0 as usize][index as usize]
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.0[buffer.0 as usize].len() as u32
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.0[variable.0 as usize][component as usize] = bits;
    }
}

/// Runs a function twice with these values in its variables, and returns the first variable after the second run.
fn run(text: &str, variables: &[&[u32]]) -> (Vec<u32>, Outcome) {
    let function: Function = text.parse().unwrap();
    verify(&function).unwrap();
    let mut interpreter = Interpreter::prepare(&function).unwrap();
    let variables = || Places(variables.iter().map(|bits| bits.to_vec()).collect());
    interpreter.run(0, &mut variables(), &mut HashHost::default());
    let mut storage = variables();
    let outcome = interpreter.run(0, &mut storage, &mut HashHost::default());
    (storage.0.swap_remove(0), outcome)
}

fn bits(values: &[i32]) -> Vec<u32> {
    values.iter().map(|value| *value as u32).collect()
}

#[test]
fn carried_values_change_places_at_once() {
    // Fibonacci numbers, carried as a pair that is rotated.
    let text = "function f scratch s: i32[3] {
        %0: i32 = constant 0 %1: i32 = constant 1 %n: i32 = load scratch:s@0
        %a: i32, %b: i32, %i: i32 = loop (%x: i32 = %0, %y: i32 = %1, %k: i32 = %n) {
            %sum: i32 = add %x, %y
            %next: i32 = subtract %k, %1
            %again: bool = less %0, %next
            repeat %again, %y, %sum, %next
        }
        return scratch:s@0 = %a, scratch:s@1 = %b, scratch:s@2 = %i
    }";
    assert_eq!(run(text, &[&bits(&[10, 0, 0])]).0, bits(&[55, 89, 0]));
    assert_eq!(run(text, &[&bits(&[-5, 0, 0])]).0, bits(&[1, 1, -6]));
}

#[test]
fn a_loop_may_end_by_a_carried_bool() {
    let text = "function f scratch s: i32[2] {
        %t: bool = constant true %f: bool = constant false %0: i32 = constant 0
        %1: i32 = constant 1
        %a: bool, %b: bool, %n: i32 = loop (%x: bool = %t, %y: bool = %t, %k: i32 = %0) {
            %next: i32 = add %k, %1
            repeat %x, %y, %f, %next
        }
        %r: i32 = convert %a
        return scratch:s@0 = %n, scratch:s@1 = %r
    }";
    assert_eq!(run(text, &[&[0, 0]]).0, [3, 0]);
}

#[test]
fn locals_start_at_zero_and_indices_are_clamped() {
    let text = "function f scratch s: i32[3] local t: i32[4] {
        %i: i32 = load scratch:s@0
        %before: i32 = load local:t@%i
        %seven: i32 = constant 7
        store local:t@%i, %seven
        %first: i32 = load local:t@0
        %last: i32 = load local:t@3
        return scratch:s@0 = %before, scratch:s@1 = %first, scratch:s@2 = %last
    }";
    assert_eq!(run(text, &[&bits(&[-9, 0, 0])]).0, [0, 7, 0]);
    assert_eq!(run(text, &[&bits(&[99, 0, 0])]).0, [0, 0, 7]);
}

#[test]
fn empty_buffers_read_as_zero() {
    let text = "function f scratch s: i32[3] buffer b: i32[1] {
        %i: i32 = load scratch:s@0
        %a: i32 = load buffer:b@%i
        %b: i32 = load buffer:b@0
        %n: i32 = length buffer:b
        return scratch:s@0 = %a, scratch:s@1 = %b, scratch:s@2 = %n
    }";
    assert_eq!(run(text, &[&[9, 9, 9], &[]]).0, [0, 0, 0]);
    assert_eq!(run(text, &[&[9, 9, 9], &[4, 5]]).0, [5, 4, 2]);
}

#[test]
fn nothing_is_stored_where_no_hit_is_accepted() {
    let text = "function f scratch s: i32[1] accepted hit: bool[1] {
        %i: i32 = load scratch:s@0
        %yes: bool = convert %i
        %one: i32 = constant 5
        return accepted:hit@0 = %yes, scratch:s@0 = %one
    }";
    let accepted = |accepted| Outcome { accepted, budget_exceeded: false };
    assert_eq!(run(text, &[&[0]]), (vec![0], accepted(false)));
    assert_eq!(run(text, &[&[1]]), (vec![5], accepted(true)));
}

#[test]
fn unreached_light_reads_as_zeros() {
    let text = "function f scratch s: f32[8] {
        %z: f32 = constant 0.0 %0: i32 = constant 0 %1: i32 = constant 1 %n: i32 = light_count
        %sum: f32, %i: i32 = loop (%acc: f32 = %z, %k: i32 = %0) {
            %lit: bool, %a: f32, %b: f32, %c: f32, %d: f32, %e: f32, %g: f32, %h: f32, %p: f32 =
                light_sample %k, %z, %z, %z, %z, %z, %z, %z
            %dark: f32 = select %lit, %z, %d
            %next_acc: f32 = add %acc, %dark
            %next: i32 = add %k, %1
            %again: bool = less %next, %n
            repeat %again, %next_acc, %next
        }
        return scratch:s@0 = %sum
    }";
    assert_eq!(run(text, &[&[1; 8]]).0[0], 0);
}

#[test]
fn references_must_be_linked_before() {
    let function: Function = "function f { %a: bool = is_set kd return }".parse().unwrap();
    let error = Interpreter::prepare(&function).unwrap_err();
    assert_eq!(error.to_string(), "the reference `kd` has not been linked");
}

/// A host that answers the first request of each kind alone.
#[derive(Default)]
struct AnswersOnce {
    traced: bool,
    gave_number: bool,
}

impl Host for AnswersOnce {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        if !std::mem::replace(&mut self.traced, true) {
            *radiance = [[2.0; 16]; 3];
        }
    }

    fn rand(&mut self, _: LaneSet, values: &mut LaneFloats) {
        if !std::mem::replace(&mut self.gave_number, true) {
            *values = [0.5; 16];
        }
    }
}

/// Answers left unset by the host read as zero, not as an earlier answer.
#[test]
fn answers_are_not_those_of_earlier_requests() {
    let text = "function f scratch s: f32[4] {
        %0: f32 = constant 0.0 %1: f32 = constant 1.0
        %2: f32, %3: f32, %4: f32 = trace %0, %0, %0, %1, %1, %1, %1, %1
        %5: f32, %6: f32, %7: f32 = trace %0, %0, %0, %1, %1, %1, %1, %1
        %8: f32 = rand
        %9: f32 = rand
        return scratch:s@0 = %2, scratch:s@1 = %5, scratch:s@2 = %8, scratch:s@3 = %9
    }";
    let function: Function = text.parse().unwrap();
    verify(&function).unwrap();
    let mut interpreter = Interpreter::prepare(&function).unwrap();
    let mut storage = Places(vec![vec![7; 4]]);
    interpreter.run(0, &mut storage, &mut AnswersOnce::default());
    assert_eq!(storage.0[0], [2.0_f32, 0.0, 0.5, 0.0].map(f32::to_bits));
}
