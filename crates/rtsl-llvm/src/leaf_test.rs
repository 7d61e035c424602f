//! The tests of `intersect` in the leaf mode.
//!
//! One test is a separate function, which the kernel's function calls for each test, and which LLVM inlines there. It
//! ends without a branch on its result: a hit in a leaf is unpredictable, so without such a branch the processor
//! overlaps several tests.

use rtsl_abi::offsets;

use crate::emitter::{Emitter, PointerSource};
use crate::operand::{LlvmType, Operand};

/// The current test.
#[derive(Clone, Copy)]
pub struct LeafTest {
    /// The lane of its ray, i64.
    ray: Operand,
    /// The index of its first object, i32.
    first: Operand,
}

/// Returns the head of the function of one test.
pub fn test_header(symbol: &str) -> String {
    format!("internal void @\"{symbol}.test\"(ptr noalias %call, ptr noalias %test) alwaysinline")
}

/// Returns the function that executes all tests of a call.
pub fn all_tests(symbol: &str) -> String {
    let (tests, count, size) = (offsets::CALL_TESTS, offsets::CALL_TEST_COUNT, offsets::TEST_SIZE);
    // A test of no objects does not run, so a previous result must be overwritten.
    let (nearest, none) = (offsets::TEST_NEAREST, offsets::NO_OBJECT as i32);
    format!(
        "define void @\"{symbol}\"(ptr noalias %call) #0 {{
entry:
  %count.at = getelementptr i8, ptr %call, i64 {count}
  %count.word = load i32, ptr %count.at, align 4
  %count = zext i32 %count.word to i64
  %tests.at = getelementptr i8, ptr %call, i64 {tests}
  %tests = load ptr, ptr %tests.at, align 8
  %none = icmp eq i64 %count, 0
  br i1 %none, label %done, label %loop
loop:
  %number = phi i64 [ 0, %entry ], [ %next, %loop ]
  %offset = mul nuw i64 %number, {size}
  %test = getelementptr i8, ptr %tests, i64 %offset
  %nearest = getelementptr i8, ptr %test, i64 {nearest}
  store i32 {none}, ptr %nearest, align 4
  call void @\"{symbol}.test\"(ptr %call, ptr %test)
  %next = add nuw i64 %number, 1
  %more = icmp ult i64 %next, %count
  br i1 %more, label %loop, label %done
done:
  ret void
}}

"
    )
}

impl Emitter<'_, '_> {
    /// Loads the test and locates its objects, before anything else.
    pub fn begin_test(&mut self) {
        let word = |emitter: &mut Self, offset: u32| {
            let at = emitter.setup(format_args!("getelementptr i8, ptr %test, i64 {offset}"));
            emitter.setup(format_args!("load i32, ptr {at}, align 4"))
        };
        let ray = word(self, offsets::TEST_RAY);
        let ray = self.setup(format_args!("zext i32 {ray} to i64"));
        let first = word(self, offsets::TEST_FIRST);
        self.test = Some(LeafTest { ray, first });
        let all = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
        let bytes = self.block_bytes() / offsets::OBJECTS_IN_BLOCK;
        let number = self.setup(format_args!("zext i32 {first} to i64"));
        let offset = self.setup(format_args!("mul nuw i64 {number}, {bytes}"));
        let objects = self.setup(format_args!("getelementptr i8, ptr {all}, i64 {offset}"));
        self.set_pointer(PointerSource::Call, offsets::CALL_OBJECTS, objects);
    }

    /// Returns the address of the ray's word in a lane array; the array itself if there is no uniform ray.
    pub fn lane_of_ray(&mut self, array: Operand) -> Operand {
        match self.test {
            None => array,
            Some(LeafTest { ray, .. }) => {
                self.setup(format_args!("getelementptr i32, ptr {array}, i64 {ray}"))
            }
        }
    }

    /// Like [`Emitter::lane_of_ray`], for several arrays located within a chunk.
    pub fn lanes_of_ray(&mut self, pointers: LlvmType, arrays: Operand) -> Operand {
        match self.test {
            None => arrays,
            Some(LeafTest { ray, .. }) => {
                self.instruction(format_args!("getelementptr i32, {pointers} {arrays}, i64 {ray}"))
            }
        }
    }

    /// Stores the result of the test: the object's position among those of the test, or -1 for none.
    pub fn store_nearest(&mut self, variable: Operand, any: Operand) {
        let Some(LeafTest { first, .. }) = self.test else { return };
        let number = self.instruction(format_args!("add i32 {first}, {variable}"));
        let none = offsets::NO_OBJECT as i32;
        let number = self.instruction(format_args!("select i1 {any}, i32 {number}, i32 {none}"));
        let offset = offsets::TEST_NEAREST;
        let at = self.instruction(format_args!("getelementptr i8, ptr %test, i64 {offset}"));
        self.effect(format_args!("store i32 {number}, ptr {at}, align 4"));
    }
}
