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

/// Returns the head of the function of one test, with as many objects as lanes or with any number of them.
pub fn test_header(symbol: &str, is_full: bool) -> String {
    let name = if is_full { "full" } else { "test" };
    format!("internal void @\"{symbol}.{name}\"(ptr noalias %call, ptr noalias %test) alwaysinline")
}

/// Returns the function that executes all tests of a call. With as many objects as lanes a test has no loop.
pub fn all_tests(symbol: &str, width: u32) -> String {
    let (tests, count) = (offsets::CALL_TESTS, offsets::CALL_TEST_COUNT);
    let (objects, mask) = (offsets::CALL_COUNT, offsets::CALL_MASK);
    let (full, any) = (loop_over_tests(symbol, "full"), loop_over_tests(symbol, "test"));
    format!(
        "define void @\"{symbol}\"(ptr noalias %call) #0 {{
entry:
  %count.at = getelementptr i8, ptr %call, i64 {count}
  %count.word = load i32, ptr %count.at, align 4
  %count = zext i32 %count.word to i64
  %tests.at = getelementptr i8, ptr %call, i64 {tests}
  %tests = load ptr, ptr %tests.at, align 8
  %none = icmp eq i64 %count, 0
  br i1 %none, label %done, label %some
some:
  %objects.at = getelementptr i8, ptr %call, i64 {objects}
  %objects = load i32, ptr %objects.at, align 4
  %mask.at = getelementptr i8, ptr %call, i64 {mask}
  %mask = load ptr, ptr %mask.at, align 8
  %unmasked = icmp eq ptr %mask, null
  %whole = icmp eq i32 %objects, {width}
  %is.full = and i1 %whole, %unmasked
  br i1 %is.full, label %full, label %test
{full}{any}done:
  ret void
}}

"
    )
}

/// Returns the blocks of a loop over all tests, which begins with the one of this name and calls its function.
fn loop_over_tests(symbol: &str, name: &str) -> String {
    let size = offsets::TEST_SIZE;
    // A test of no objects does not run, so a previous result must be overwritten.
    let (nearest, none) = (offsets::TEST_NEAREST, offsets::NO_OBJECT as i32);
    format!(
        "{name}:
  %{name}.number = phi i64 [ 0, %some ], [ %{name}.next, %{name} ]
  %{name}.offset = mul nuw i64 %{name}.number, {size}
  %{name}.of = getelementptr i8, ptr %tests, i64 %{name}.offset
  %{name}.nearest = getelementptr i8, ptr %{name}.of, i64 {nearest}
  store i32 {none}, ptr %{name}.nearest, align 4
  call void @\"{symbol}.{name}\"(ptr %call, ptr %{name}.of)
  %{name}.next = add nuw i64 %{name}.number, 1
  %{name}.more = icmp ult i64 %{name}.next, %count
  br i1 %{name}.more, label %{name}, label %done
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
