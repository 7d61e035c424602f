//! Tests of the emitted text: single-ray text in, LLVM text out.

use expect_test::{Expect, expect};
use rtsl_abi::{CallMode, Layout, Mark, MarkWord, RayRecord};
use rtsl_ir::{Function, VariableKind};
use rtsl_llvm::{Callback, TargetFeatures};

fn emit(text: &str, target: &str, mode: CallMode, width: u32) -> String {
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
    rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}"));
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    let kernel = rtsl_packet::lower(&function, &layout, mode, width).unwrap();
    let target = TargetFeatures::new("x86_64-unknown-linux-gnu", target, "");
    rtsl_llvm::emit([("kernel", &kernel)], &target)
}

fn check(text: &str, target: &str, width: u32, expected: Expect) {
    expected.assert_eq(&emit(text, target, CallMode::Packet, width));
}

fn emit_callback(text: &str, target: &str, width: u32) -> String {
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
    let layout = Layout::new(
        function.variables.iter().filter(|variable| variable.kind == VariableKind::Member),
        [],
        [],
    );
    let kernel = rtsl_packet::lower_packet(&function, &layout, width).unwrap();
    let component = |name| rtsl_spec::lookup_state(name).unwrap().first_component;
    let record = RayRecord {
        rays: 0,
        mask: Some(8),
        instances: 16,
        number: Some(24),
        rows: [(component("rt_HitDistance"), 8), (component("rt_Epsilon"), 3)].into(),
        marks: vec![
            Mark { row: 17, word: MarkWord::Argument(24) },
            Mark { row: 19, word: MarkWord::Behind { pointer: 32, offset: 4 } },
            Mark { row: 20, word: MarkWord::Constant(7) },
        ],
    };
    kernel.check_record(&record).unwrap();
    let target = TargetFeatures::new("x86_64-unknown-linux-gnu", target, "");
    let callback = Callback { kernel: &kernel, record: &record, block_bytes: 8 };
    rtsl_llvm::emit_callbacks([("callback", callback)], &target)
}

const NEARER: &str = "function f member far: f32[1] state rt_HitDistance: f32[1] state rt_Epsilon: f32[1] accepted a: bool[1] {
    %t: f32 = load state:rt_HitDistance@0
    %e: f32 = load state:rt_Epsilon@0
    %f: f32 = load member:far@0
    %x: f32 = subtract %e, %f
    %c: bool = less %x, %t
    return accepted:a@0 = %c, state:rt_HitDistance@0 = %x
}";

#[test]
fn a_host_s_packet_is_found_in_its_own_struct() {
    expect![[r#"
        target triple = "x86_64-unknown-linux-gnu"

        define void @"callback"(ptr noalias %call) #4 {
        entry:
          %t1 = getelementptr i8, ptr %call, i64 8
          %t2 = load ptr, ptr %t1, align 8
          %t3 = load <4 x i32>, ptr %t2, align 4
          %t4 = icmp ne <4 x i32> %t3, zeroinitializer
          %t5 = bitcast <4 x i1> %t4 to i4
          %t6 = icmp ne i4 %t5, 0
          br i1 %t6, label %b2, label %b1
        b2:
          %t7 = getelementptr i8, ptr %call, i64 16
          %t8 = load ptr, ptr %t7, align 8
          %t9 = getelementptr i8, ptr %call, i64 24
          %t10 = load i32, ptr %t9, align 4
          %t11 = zext i32 %t10 to i64
          %t12 = mul nuw i64 %t11, 8
          %t13 = getelementptr i8, ptr %t8, i64 %t12
          %t16 = getelementptr i8, ptr %call, i64 0
          %t17 = load ptr, ptr %t16, align 8
          %t18 = getelementptr i8, ptr %t17, i64 128
          %t21 = getelementptr i8, ptr %t17, i64 48
          %t48 = getelementptr i8, ptr %t17, i64 272
          %t51 = getelementptr i8, ptr %t17, i64 304
          %t54 = getelementptr i8, ptr %t17, i64 320
          %t14 = load float, ptr %t13, align 4
          %t15 = fneg float %t14
          %t24 = insertelement <4 x float> poison, float %t14, i64 0
          %t25 = shufflevector <4 x float> %t24, <4 x float> poison, <4 x i32> zeroinitializer
          %t26 = fneg <4 x float> %t25
          %t46 = insertelement <4 x i32> poison, i32 7, i64 0
          %t47 = shufflevector <4 x i32> %t46, <4 x i32> poison, <4 x i32> zeroinitializer
          %t19 = getelementptr i32, ptr %t18, i64 0
          %t20 = load <4 x float>, ptr %t19, align 4
          %t22 = getelementptr i32, ptr %t21, i64 0
          %t23 = load <4 x float>, ptr %t22, align 4
          %t27 = fadd <4 x float> %t23, %t26
          %t28 = fcmp olt <4 x float> %t27, %t20
          %t29 = and <4 x i1> %t28, %t4
          %t30 = sext <4 x i1> %t29 to <4 x i32>
          %t31 = bitcast <4 x i1> %t29 to i4
          %t32 = icmp ne i4 %t31, 0
          br i1 %t32, label %b3, label %b4
        b3:
          %t33 = getelementptr i32, ptr %t18, i64 0
          %t34 = load <4 x float>, ptr %t33, align 4
          %t35 = select <4 x i1> %t29, <4 x float> %t27, <4 x float> %t34
          store <4 x float> %t35, ptr %t33, align 4
          %t36 = getelementptr i8, ptr %call, i64 24
          %t37 = load i32, ptr %t36, align 4
          %t38 = insertelement <4 x i32> poison, i32 %t37, i64 0
          %t39 = shufflevector <4 x i32> %t38, <4 x i32> poison, <4 x i32> zeroinitializer
          %t40 = getelementptr i8, ptr %call, i64 32
          %t41 = load ptr, ptr %t40, align 8
          %t42 = getelementptr i8, ptr %t41, i64 4
          %t43 = load i32, ptr %t42, align 4
          %t44 = insertelement <4 x i32> poison, i32 %t43, i64 0
          %t45 = shufflevector <4 x i32> %t44, <4 x i32> poison, <4 x i32> zeroinitializer
          %t49 = load <4 x i32>, ptr %t48, align 4
          %t50 = select <4 x i1> %t29, <4 x i32> %t39, <4 x i32> %t49
          store <4 x i32> %t50, ptr %t48, align 4
          %t52 = load <4 x i32>, ptr %t51, align 4
          %t53 = select <4 x i1> %t29, <4 x i32> %t45, <4 x i32> %t52
          store <4 x i32> %t53, ptr %t51, align 4
          %t55 = load <4 x i32>, ptr %t54, align 4
          %t56 = select <4 x i1> %t29, <4 x i32> %t47, <4 x i32> %t55
          store <4 x i32> %t56, ptr %t54, align 4
          br label %b4
        b4:
          br label %b1
        b1:
          ret void
        }


        attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v4" }
        attributes #1 = { nounwind }
        attributes #4 = { nounwind "frame-pointer"="none" "probe-stack"="inline-asm" "target-cpu"="x86-64-v4" }
    "#]].assert_eq(&emit_callback(NEARER, "x86-64-v4", 4));
}

#[test]
fn a_host_s_single_ray_takes_no_vectors() {
    expect![[r#"
        target triple = "x86_64-unknown-linux-gnu"

        define void @"callback"(ptr noalias %call) #2 {
        entry:
          %t1 = getelementptr i8, ptr %call, i64 8
          %t2 = load ptr, ptr %t1, align 8
          %t3 = load i32, ptr %t2, align 4
          %t4 = icmp ne i32 %t3, 0
          br i1 %t4, label %b2, label %b1
        b2:
          %t5 = getelementptr i8, ptr %call, i64 16
          %t6 = load ptr, ptr %t5, align 8
          %t7 = getelementptr i8, ptr %call, i64 24
          %t8 = load i32, ptr %t7, align 4
          %t9 = zext i32 %t8 to i64
          %t10 = mul nuw i64 %t9, 8
          %t11 = getelementptr i8, ptr %t6, i64 %t10
          %t14 = getelementptr i8, ptr %call, i64 0
          %t15 = load ptr, ptr %t14, align 8
          %t16 = getelementptr i8, ptr %t15, i64 32
          %t19 = getelementptr i8, ptr %t15, i64 12
          %t33 = getelementptr i8, ptr %t15, i64 68
          %t34 = getelementptr i8, ptr %t15, i64 76
          %t35 = getelementptr i8, ptr %t15, i64 80
          %t12 = load float, ptr %t11, align 4
          %t13 = fneg float %t12
          %t17 = getelementptr i32, ptr %t16, i64 0
          %t18 = load float, ptr %t17, align 4
          %t20 = getelementptr i32, ptr %t19, i64 0
          %t21 = load float, ptr %t20, align 4
          %t22 = fadd float %t21, %t13
          %t23 = fcmp olt float %t22, %t18
          %t24 = and i1 %t23, true
          %t25 = sext i1 %t24 to i32
          br i1 %t24, label %b3, label %b4
        b3:
          %t26 = getelementptr i32, ptr %t16, i64 0
          store float %t22, ptr %t26, align 4
          %t27 = getelementptr i8, ptr %call, i64 24
          %t28 = load i32, ptr %t27, align 4
          %t29 = getelementptr i8, ptr %call, i64 32
          %t30 = load ptr, ptr %t29, align 8
          %t31 = getelementptr i8, ptr %t30, i64 4
          %t32 = load i32, ptr %t31, align 4
          store i32 %t28, ptr %t33, align 4
          store i32 %t32, ptr %t34, align 4
          store i32 7, ptr %t35, align 4
          br label %b4
        b4:
          br label %b1
        b1:
          ret void
        }


        attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v4" }
        attributes #1 = { nounwind }
        attributes #2 = { nounwind "frame-pointer"="none" "probe-stack"="inline-asm" "target-cpu"="x86-64-v4" "target-features"="-avx512f" }
    "#]].assert_eq(&emit_callback(NEARER, "x86-64-v4", 1));
}

#[test]
fn a_host_s_packet_without_mask_registers() {
    expect![[r#"
        target triple = "x86_64-unknown-linux-gnu"

        define void @"callback"(ptr noalias %call) #0 {
        entry:
          %t1 = getelementptr i8, ptr %call, i64 8
          %t2 = load ptr, ptr %t1, align 8
          %t3 = load <8 x i32>, ptr %t2, align 4
          %t4 = icmp ne <8 x i32> %t3, zeroinitializer
          %t5 = bitcast <8 x i1> %t4 to i8
          %t6 = icmp ne i8 %t5, 0
          %t7 = zext <8 x i1> %t4 to <8 x i32>
          %t8 = sub <8 x i32> zeroinitializer, %t7
          br i1 %t6, label %b2, label %b1
        b2:
          %t9 = getelementptr i8, ptr %call, i64 16
          %t10 = load ptr, ptr %t9, align 8
          %t11 = getelementptr i8, ptr %call, i64 24
          %t12 = load i32, ptr %t11, align 4
          %t13 = zext i32 %t12 to i64
          %t14 = mul nuw i64 %t13, 8
          %t15 = getelementptr i8, ptr %t10, i64 %t14
          %t18 = getelementptr i8, ptr %call, i64 0
          %t19 = load ptr, ptr %t18, align 8
          %t20 = getelementptr i8, ptr %t19, i64 256
          %t23 = getelementptr i8, ptr %t19, i64 96
          %t57 = getelementptr i8, ptr %t19, i64 544
          %t62 = getelementptr i8, ptr %t19, i64 608
          %t67 = getelementptr i8, ptr %t19, i64 640
          %t16 = load float, ptr %t15, align 4
          %t17 = fneg float %t16
          %t26 = insertelement <8 x float> poison, float %t16, i64 0
          %t27 = shufflevector <8 x float> %t26, <8 x float> poison, <8 x i32> zeroinitializer
          %t28 = fneg <8 x float> %t27
          %t38 = insertelement <8 x i32> poison, i32 -1, i64 0
          %t39 = shufflevector <8 x i32> %t38, <8 x i32> poison, <8 x i32> zeroinitializer
          %t55 = insertelement <8 x i32> poison, i32 7, i64 0
          %t56 = shufflevector <8 x i32> %t55, <8 x i32> poison, <8 x i32> zeroinitializer
          %t21 = getelementptr i32, ptr %t20, i64 0
          %t22 = load <8 x float>, ptr %t21, align 4
          %t24 = getelementptr i32, ptr %t23, i64 0
          %t25 = load <8 x float>, ptr %t24, align 4
          %t29 = fadd <8 x float> %t25, %t28
          %t30 = fcmp olt <8 x float> %t29, %t22
          %t31 = zext <8 x i1> %t30 to <8 x i32>
          %t32 = sub <8 x i32> zeroinitializer, %t31
          %t33 = and <8 x i32> %t32, %t8
          %t34 = icmp slt <8 x i32> %t33, zeroinitializer
          %t35 = icmp slt <8 x i32> %t33, zeroinitializer
          %t36 = bitcast <8 x i1> %t35 to i8
          %t37 = icmp ne i8 %t36, 0
          %t40 = xor <8 x i32> %t33, %t39
          br i1 %t37, label %b3, label %b4
        b3:
          %t41 = getelementptr i32, ptr %t20, i64 0
          %t42 = bitcast <8 x i32> %t40 to <8 x float>
          %t43 = load <8 x float>, ptr %t41, align 4
          %t44 = call <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float> %t29, <8 x float> %t43, <8 x float> %t42)
          store <8 x float> %t44, ptr %t41, align 4
          %t45 = getelementptr i8, ptr %call, i64 24
          %t46 = load i32, ptr %t45, align 4
          %t47 = insertelement <8 x i32> poison, i32 %t46, i64 0
          %t48 = shufflevector <8 x i32> %t47, <8 x i32> poison, <8 x i32> zeroinitializer
          %t49 = getelementptr i8, ptr %call, i64 32
          %t50 = load ptr, ptr %t49, align 8
          %t51 = getelementptr i8, ptr %t50, i64 4
          %t52 = load i32, ptr %t51, align 4
          %t53 = insertelement <8 x i32> poison, i32 %t52, i64 0
          %t54 = shufflevector <8 x i32> %t53, <8 x i32> poison, <8 x i32> zeroinitializer
          %t58 = bitcast <8 x i32> %t48 to <8 x float>
          %t59 = bitcast <8 x i32> %t40 to <8 x float>
          %t60 = load <8 x float>, ptr %t57, align 4
          %t61 = call <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float> %t58, <8 x float> %t60, <8 x float> %t59)
          store <8 x float> %t61, ptr %t57, align 4
          %t63 = bitcast <8 x i32> %t54 to <8 x float>
          %t64 = bitcast <8 x i32> %t40 to <8 x float>
          %t65 = load <8 x float>, ptr %t62, align 4
          %t66 = call <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float> %t63, <8 x float> %t65, <8 x float> %t64)
          store <8 x float> %t66, ptr %t62, align 4
          %t68 = bitcast <8 x i32> %t56 to <8 x float>
          %t69 = bitcast <8 x i32> %t40 to <8 x float>
          %t70 = load <8 x float>, ptr %t67, align 4
          %t71 = call <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float> %t68, <8 x float> %t70, <8 x float> %t69)
          store <8 x float> %t71, ptr %t67, align 4
          br label %b4
        b4:
          br label %b1
        b1:
          ret void
        }

        declare <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float>, <8 x float>, <8 x float>)

        attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v3" }
        attributes #1 = { nounwind }
    "#]].assert_eq(&emit_callback(NEARER, "x86-64-v3", 8));
}

const SCALE: &str = "function f member scale: f32[1] state rt_HitDistance: f32[1] {
    %t: f32 = load state:rt_HitDistance@0
    %s: f32 = load member:scale@0
    %half: f32 = constant 0.5
    %c: f32 = multiply %s, %half
    %r: f32 = multiply %t, %c
    return state:rt_HitDistance@0 = %r
}";

#[test]
fn vectors() {
    check(
        SCALE,
        "x86-64-v3",
        4,
        expect![[r#"
            target triple = "x86_64-unknown-linux-gnu"

            define void @"kernel"(ptr noalias %call) #0 {
            entry:
              %count.at = getelementptr i8, ptr %call, i64 72
              %count.word = load i32, ptr %count.at, align 4
              %count = zext i32 %count.word to i64
              %first.at = getelementptr i8, ptr %call, i64 84
              %first.word = load i32, ptr %first.at, align 4
              %first = zext i32 %first.word to i64
              %t1 = add i64 %first, 0
              %none = icmp ule i64 %count, %t1
              br i1 %none, label %b1, label %b2
            b2:
              %t2 = getelementptr i8, ptr %call, i64 32
              %t3 = load ptr, ptr %t2, align 8
              %t8 = getelementptr i8, ptr %call, i64 16
              %t9 = load ptr, ptr %t8, align 8
              %t10 = icmp eq ptr %t9, null
              %t31 = getelementptr i8, ptr %call, i64 0
              %t32 = load ptr, ptr %t31, align 8
              %t33 = getelementptr i8, ptr %t32, i64 136
              %t34 = load ptr, ptr %t33, align 8
              %t4 = load float, ptr %t3, align 4
              %t5 = fmul float %t4, 0x3FE0000000000000
              %t28 = insertelement <4 x i32> poison, i32 -1, i64 0
              %t29 = shufflevector <4 x i32> %t28, <4 x i32> poison, <4 x i32> zeroinitializer
              %t37 = insertelement <4 x float> poison, float %t5, i64 0
              %t38 = shufflevector <4 x float> %t37, <4 x float> poison, <4 x i32> zeroinitializer
              br label %b3
            b3:
              %t6 = phi i64 [ %t1, %b2 ], [ %t7, %b6 ]
              %t11 = sub nuw i64 %count, %t6
              %t12 = icmp uge i64 %t11, 4
              %t13 = and i1 %t12, %t10
              br i1 %t13, label %b4, label %b7
            b7:
              %t14 = trunc i64 %t11 to i32
              %t15 = insertelement <4 x i32> poison, i32 %t14, i64 0
              %t16 = shufflevector <4 x i32> %t15, <4 x i32> poison, <4 x i32> zeroinitializer
              %t17 = icmp ugt <4 x i32> %t16, <i32 0, i32 1, i32 2, i32 3>
              %t18 = zext <4 x i1> %t17 to <4 x i32>
              %t19 = sub <4 x i32> zeroinitializer, %t18
              br i1 %t10, label %b4, label %b8
            b8:
              %t20 = getelementptr i32, ptr %t9, i64 %t6
              %t21 = load <4 x i32>, ptr %t20, align 4
              %t22 = icmp ne <4 x i32> %t21, zeroinitializer
              %t23 = and <4 x i1> %t22, %t17
              %t24 = zext <4 x i1> %t23 to <4 x i32>
              %t25 = sub <4 x i32> zeroinitializer, %t24
              %t26 = bitcast <4 x i1> %t23 to i4
              %t27 = icmp ne i4 %t26, 0
              br i1 %t27, label %b4, label %b5
            b4:
              %t30 = phi <4 x i32> [ %t29, %b3 ], [ %t19, %b7 ], [ %t25, %b8 ]
              %t35 = getelementptr i32, ptr %t34, i64 %t6
              %t36 = load <4 x float>, ptr %t35, align 4
              %t39 = fmul <4 x float> %t36, %t38
              br i1 %t13, label %b9, label %b10
            b9:
              %t40 = getelementptr i32, ptr %t34, i64 %t6
              store <4 x float> %t39, ptr %t40, align 4
              br label %b11
            b10:
              %t41 = icmp slt <4 x i32> %t30, zeroinitializer
              %t42 = getelementptr i32, ptr %t34, i64 %t6
              %t43 = load volatile <4 x float>, ptr %t42, align 4
              %t44 = select <4 x i1> %t41, <4 x float> %t39, <4 x float> %t43
              store <4 x float> %t44, ptr %t42, align 4
              br label %b11
            b11:
              br label %b6
            b5:
              br label %b6
            b6:
              %t7 = add nuw i64 %t6, 4
              %t45 = icmp ult i64 %t7, %count
              br i1 %t45, label %b3, label %b1
            b1:
              ret void
            }


            attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v3" }
            attributes #1 = { nounwind }
        "#]],
    );
}

#[test]
fn scalars_for_one_ray() {
    check(
        SCALE,
        "x86-64-v3",
        1,
        expect![[r#"
            target triple = "x86_64-unknown-linux-gnu"

            define void @"kernel"(ptr noalias %call) #0 {
            entry:
              %count.at = getelementptr i8, ptr %call, i64 72
              %count.word = load i32, ptr %count.at, align 4
              %count = zext i32 %count.word to i64
              %first.at = getelementptr i8, ptr %call, i64 84
              %first.word = load i32, ptr %first.at, align 4
              %first = zext i32 %first.word to i64
              %t1 = add i64 %first, 0
              %none = icmp ule i64 %count, %t1
              br i1 %none, label %b1, label %b2
            b2:
              %t2 = getelementptr i8, ptr %call, i64 32
              %t3 = load ptr, ptr %t2, align 8
              %t8 = getelementptr i8, ptr %call, i64 16
              %t9 = load ptr, ptr %t8, align 8
              %t10 = icmp eq ptr %t9, null
              %t14 = getelementptr i8, ptr %call, i64 0
              %t15 = load ptr, ptr %t14, align 8
              %t16 = getelementptr i8, ptr %t15, i64 136
              %t17 = load ptr, ptr %t16, align 8
              %t4 = load float, ptr %t3, align 4
              %t5 = fmul float %t4, 0x3FE0000000000000
              br label %b3
            b3:
              %t6 = phi i64 [ %t1, %b2 ], [ %t7, %b6 ]
              br i1 %t10, label %b4, label %b7
            b7:
              %t11 = getelementptr i32, ptr %t9, i64 %t6
              %t12 = load i32, ptr %t11, align 4
              %t13 = icmp ne i32 %t12, 0
              br i1 %t13, label %b4, label %b5
            b4:
              %t18 = getelementptr i32, ptr %t17, i64 %t6
              %t19 = load float, ptr %t18, align 4
              %t20 = fmul float %t19, %t5
              %t21 = getelementptr i32, ptr %t17, i64 %t6
              store float %t20, ptr %t21, align 4
              br label %b6
            b5:
              br label %b6
            b6:
              %t7 = add nuw i64 %t6, 1
              %t22 = icmp ult i64 %t7, %count
              br i1 %t22, label %b3, label %b1
            b1:
              ret void
            }


            attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v3" }
            attributes #1 = { nounwind }
        "#]],
    );
}

const BRANCH: &str = "function f state rt_HitDistance: f32[1] accepted accepted: bool[1] {
    %t: f32 = load state:rt_HitDistance@0
    %one: f32 = constant 1.0
    %below: bool = less %t, %one
    %r: f32, %b: bool = if %below {
        %x: f32 = divide %one, %t %y: f32 = sqrt %x %z: f32 = divide %y, %t %w: f32 = sqrt %z
        %c: bool = less %w, %one
        yield %w, %c
    } else {
        yield %t, %below
    }
    return state:rt_HitDistance@0 = %r, accepted:accepted@0 = %b
}";

#[test]
fn masks_cross_blocks_as_words() {
    check(
        BRANCH,
        "x86-64-v3",
        8,
        expect![[r#"
            target triple = "x86_64-unknown-linux-gnu"

            define void @"kernel"(ptr noalias %call) #0 {
            entry:
              %count.at = getelementptr i8, ptr %call, i64 72
              %count.word = load i32, ptr %count.at, align 4
              %count = zext i32 %count.word to i64
              %none = icmp ule i64 %count, 0
              br i1 %none, label %b1, label %b2
            b2:
              %t3 = getelementptr i8, ptr %call, i64 16
              %t4 = load ptr, ptr %t3, align 8
              %t5 = icmp eq ptr %t4, null
              %t26 = getelementptr i8, ptr %call, i64 0
              %t27 = load ptr, ptr %t26, align 8
              %t28 = getelementptr i8, ptr %t27, i64 136
              %t29 = load ptr, ptr %t28, align 8
              %t52 = getelementptr i8, ptr %call, i64 24
              %t53 = load ptr, ptr %t52, align 8
              %t23 = insertelement <8 x i32> poison, i32 -1, i64 0
              %t24 = shufflevector <8 x i32> %t23, <8 x i32> poison, <8 x i32> zeroinitializer
              %t32 = insertelement <8 x float> poison, float 0x3FF0000000000000, i64 0
              %t33 = shufflevector <8 x float> %t32, <8 x float> poison, <8 x i32> zeroinitializer
              br label %b3
            b3:
              %t1 = phi i64 [ 0, %b2 ], [ %t2, %b6 ]
              %t6 = sub nuw i64 %count, %t1
              %t7 = icmp uge i64 %t6, 8
              %t8 = and i1 %t7, %t5
              br i1 %t8, label %b4, label %b7
            b7:
              %t9 = trunc i64 %t6 to i32
              %t10 = insertelement <8 x i32> poison, i32 %t9, i64 0
              %t11 = shufflevector <8 x i32> %t10, <8 x i32> poison, <8 x i32> zeroinitializer
              %t12 = icmp ugt <8 x i32> %t11, <i32 0, i32 1, i32 2, i32 3, i32 4, i32 5, i32 6, i32 7>
              %t13 = zext <8 x i1> %t12 to <8 x i32>
              %t14 = sub <8 x i32> zeroinitializer, %t13
              br i1 %t5, label %b4, label %b8
            b8:
              %t15 = getelementptr i32, ptr %t4, i64 %t1
              %t16 = load <8 x i32>, ptr %t15, align 4
              %t17 = icmp ne <8 x i32> %t16, zeroinitializer
              %t18 = and <8 x i1> %t17, %t12
              %t19 = zext <8 x i1> %t18 to <8 x i32>
              %t20 = sub <8 x i32> zeroinitializer, %t19
              %t21 = bitcast <8 x i1> %t18 to i8
              %t22 = icmp ne i8 %t21, 0
              br i1 %t22, label %b4, label %b5
            b4:
              %t25 = phi <8 x i32> [ %t24, %b3 ], [ %t14, %b7 ], [ %t20, %b8 ]
              %t30 = getelementptr i32, ptr %t29, i64 %t1
              %t31 = load <8 x float>, ptr %t30, align 4
              %t34 = fcmp olt <8 x float> %t31, %t33
              %t35 = zext <8 x i1> %t34 to <8 x i32>
              %t36 = sub <8 x i32> zeroinitializer, %t35
              %t37 = fdiv <8 x float> %t33, %t31
              %t38 = call <8 x float> @llvm.sqrt.v8f32(<8 x float> %t37)
              %t39 = fdiv <8 x float> %t38, %t31
              %t40 = call <8 x float> @llvm.sqrt.v8f32(<8 x float> %t39)
              %t41 = fcmp olt <8 x float> %t40, %t33
              %t42 = zext <8 x i1> %t41 to <8 x i32>
              %t43 = sub <8 x i32> zeroinitializer, %t42
              %t44 = and <8 x i1> %t34, %t41
              %t45 = zext <8 x i1> %t44 to <8 x i32>
              %t46 = sub <8 x i32> zeroinitializer, %t45
              %t47 = and <8 x i32> %t46, %t25
              %t48 = icmp slt <8 x i32> %t47, zeroinitializer
              %t49 = icmp slt <8 x i32> %t47, zeroinitializer
              %t50 = bitcast <8 x i1> %t49 to i8
              %t51 = icmp ne i8 %t50, 0
              %t54 = getelementptr i32, ptr %t53, i64 %t1
              br i1 %t8, label %b11, label %b12
            b11:
              store <8 x i32> %t47, ptr %t54, align 4
              br label %b13
            b12:
              %t55 = trunc i64 %t6 to i32
              %t56 = insertelement <8 x i32> poison, i32 %t55, i64 0
              %t57 = shufflevector <8 x i32> %t56, <8 x i32> poison, <8 x i32> zeroinitializer
              %t58 = icmp ugt <8 x i32> %t57, <i32 0, i32 1, i32 2, i32 3, i32 4, i32 5, i32 6, i32 7>
              %t59 = load volatile <8 x i32>, ptr %t54, align 4
              %t60 = select <8 x i1> %t58, <8 x i32> %t47, <8 x i32> %t59
              store <8 x i32> %t60, ptr %t54, align 4
              br label %b13
            b13:
              %t61 = xor <8 x i32> %t47, %t24
              br i1 %t51, label %b9, label %b10
            b9:
              %t62 = getelementptr i32, ptr %t29, i64 %t1
              %t63 = bitcast <8 x i32> %t61 to <8 x float>
              %t64 = load <8 x float>, ptr %t62, align 4
              %t65 = call <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float> %t40, <8 x float> %t64, <8 x float> %t63)
              store <8 x float> %t65, ptr %t62, align 4
              br label %b10
            b10:
              br label %b6
            b5:
              %t66 = getelementptr i32, ptr %t53, i64 %t1
              %t67 = trunc i64 %t6 to i32
              %t68 = insertelement <8 x i32> poison, i32 %t67, i64 0
              %t69 = shufflevector <8 x i32> %t68, <8 x i32> poison, <8 x i32> zeroinitializer
              %t70 = icmp ugt <8 x i32> %t69, <i32 0, i32 1, i32 2, i32 3, i32 4, i32 5, i32 6, i32 7>
              %t71 = load volatile <8 x i32>, ptr %t66, align 4
              %t72 = select <8 x i1> %t70, <8 x i32> zeroinitializer, <8 x i32> %t71
              store <8 x i32> %t72, ptr %t66, align 4
              br label %b6
            b6:
              %t2 = add nuw i64 %t1, 8
              %t73 = icmp ult i64 %t2, %count
              br i1 %t73, label %b3, label %b1
            b1:
              ret void
            }

            declare <8 x float> @llvm.sqrt.v8f32(<8 x float>)
            declare <8 x float> @llvm.x86.avx.blendv.ps.256(<8 x float>, <8 x float>, <8 x float>)

            attributes #0 = { nounwind "frame-pointer"="none" "stackrealign" "probe-stack"="inline-asm" "target-cpu"="x86-64-v3" }
            attributes #1 = { nounwind }
        "#]],
    );
}

#[test]
fn masks_have_registers() {
    let text = emit(BRANCH, "x86-64-v4", CallMode::Packet, 16);
    assert!(text.contains("phi <16 x i1>") && !text.contains("phi <16 x i32>"), "{text}");
}

const POSITIVE_NORMAL: &str = "function f state rt_HitDistance: f32[1] state rt_PDF: f32[1] {
    %x: f32 = load state:rt_HitDistance@0
    %l: f32 = constant 1.1754944e-38
    %u: f32 = constant inf
    %a: bool = greater_equal %x, %l
    %b: bool = less %x, %u
    %c: bool = and %a, %b
    %r: f32 = select %c, %x, %l
    return state:rt_PDF@0 = %r
}";

#[test]
fn one_comparison_into_a_mask_register_finds_positive_normal_numbers() {
    let text = emit(POSITIVE_NORMAL, "x86-64-v4", CallMode::Packet, 16);
    assert!(text.contains("icmp ult <16 x i32>"), "{text}");
    for (target, width) in [("x86-64-v3", 8), ("x86-64-v4", 1)] {
        let text = emit(POSITIVE_NORMAL, target, CallMode::Packet, width);
        assert!(!text.contains("icmp ult <"), "{text}");
    }
}

#[test]
fn few_outputs_of_hits_are_stored_without_a_branch_on_the_hit() {
    let branches = |target| emit(NEARER, target, CallMode::Packet, 8).matches("br i1").count();
    assert_eq!((branches("x86-64-v3"), branches("x86-64-v4")), (7, 6));
}

#[test]
fn full_chunks_take_their_arguments_in_registers() {
    let has_arguments = |body: &str| {
        let text =
            format!("function f state rt_PDF: f32[1] {{ %x: f32 = load state:rt_PDF@0 {body} }}");
        let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
        let layout = Layout::new([], [], []);
        let mut kernel = rtsl_packet::lower(&function, &layout, CallMode::Packet, 8).unwrap();
        kernel.interleave = Some(2);
        let target = TargetFeatures::new("x86_64-unknown-linux-gnu", "x86-64-v3", "");
        let text = rtsl_llvm::emit([("kernel", &kernel)], &target);
        text.contains("define hidden void @\"kernel.full\"(ptr noundef %t")
    };
    assert!(has_arguments("return state:rt_PDF@0 = %x"));
    // It stores the status of the call.
    assert!(!has_arguments("report_budget return state:rt_PDF@0 = %x"));
    // It calls functions of the call's host.
    assert!(!has_arguments("%n: f32 = rand return state:rt_PDF@0 = %n"));
}

#[test]
fn masks_of_several_vectors_are_split_in_straight_line_code() {
    let is_split = |text: &str| {
        let function: Function = text.parse().unwrap();
        let layout = Layout::new([], [], []);
        let mut kernel = rtsl_packet::lower(&function, &layout, CallMode::Packet, 16).unwrap();
        kernel.interleave = Some(2);
        let target = TargetFeatures::new("x86_64-unknown-linux-gnu", "x86-64-v4", "");
        let text = rtsl_llvm::emit([("kernel", &kernel)], &target);
        text.contains("-avx512bw")
    };
    assert!(is_split(POSITIVE_NORMAL));
    let text = emit(POSITIVE_NORMAL, "x86-64-v4", CallMode::Packet, 16);
    assert!(text.contains("%call) #4 {"), "its vectors fit in registers: {text}");
    assert!(!is_split(
        "function f state rt_PDF: f32[1] {
            %x: f32 = load state:rt_PDF@0
            %b: f32 = constant 2.0
            %r: f32 = loop (%c: f32 = %x) {
                %n: f32 = add %c, %c
                %m: bool = less %n, %b
                repeat %m, %n
            }
            return state:rt_PDF@0 = %r
        }"
    ));
}

#[test]
fn constants_keep_their_bits() {
    for (constant, text) in [
        ("0.1", "0x3FB99999A0000000"),
        ("-0.0", "0x8000000000000000"),
        ("inf", "0x7FF0000000000000"),
        ("1e-45", "0x36A0000000000000"),
    ] {
        let function = format!(
            "function f state rt_PDF: f32[1] {{
                %c: f32 = constant {constant} return state:rt_PDF@0 = %c }}"
        );
        let found = emit(&function, "x86-64-v3", CallMode::Packet, 4);
        assert!(found.contains(&format!("float {text}")), "{constant}: {found}");
    }
}

#[test]
fn fused_multiply_add_is_an_instruction_or_emulated() {
    let text = "function f state rt_PDF: f32[1] {
        %t: f32 = load state:rt_PDF@0
        %r: f32 = fma %t, %t, %t
        return state:rt_PDF@0 = %r
    }";
    let v3 = emit(text, "x86-64-v3", CallMode::Packet, 8);
    assert!(v3.contains("@llvm.fma.v8f32") && !v3.contains("rtsl.fma"), "{v3}");
    let v2 = emit(text, "x86-64-v2", CallMode::Packet, 4);
    assert!(v2.contains("define internal <4 x float> @rtsl.fma.v4f32") && !v2.contains("llvm.fma"));
}

#[test]
fn nothing_lets_llvm_change_results() {
    for width in [1, 4, 8, 16] {
        for seed in 0..20 {
            let function = rtsl_testing::functions::seeded_function(seed, 200).to_string();
            let text = emit(&function, "x86-64-v2", CallMode::Stream, width);
            for word in [" fast ", " contract ", " nnan ", " ninf ", " nsz ", " reassoc ", " afn "]
            {
                assert!(!text.contains(word), "{word}: {text}");
            }
        }
    }
}

/// Regions nested to the greatest depth of functions, in a thread with a small stack.
#[test]
fn the_deepest_nesting_is_no_trouble() {
    let depth = rtsl_ir::MAX_NESTING - 1;
    let mut text = String::from(
        "function f state rt_PDF: f32[1] local s: f32[1] { %t: f32 = load state:rt_PDF@0
         %c: bool = less %t, %t ",
    );
    for level in 0..depth {
        text += &match level % 2 {
            0 => format!("%r{level}: f32 = if %c {{ store local:s@0, %t "),
            _ => format!("%r{level}: f32 = loop (%p{level}: f32 = %t) {{ "),
        };
    }
    for level in (0..depth).rev() {
        let inner = if level + 1 == depth { "%t".to_owned() } else { format!("%r{}", level + 1) };
        text += &match level % 2 {
            0 => format!("yield {inner} }} else {{ yield %t }} "),
            _ => format!("repeat %c, {inner} }} "),
        };
    }
    text += "return state:rt_PDF@0 = %r0 }";
    let thread = std::thread::Builder::new().stack_size(2 << 20);
    let emitted = thread.spawn(move || emit(&text, "x86-64-v3", CallMode::Packet, 8).len());
    assert!(emitted.unwrap().join().unwrap() > 10_000);
}
