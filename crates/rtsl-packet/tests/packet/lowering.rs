//! Tests of the lowering: single-ray text in, packet text out.

use expect_test::{Expect, expect};
use rtsl_abi::{CallMode, Layout, ObjectForm};
use rtsl_ir::{Function, VariableKind};
use rtsl_packet::{Kernel, LowerError};

fn lower(text: &str, mode: CallMode, width: u32) -> Result<Kernel, LowerError> {
    lower_for(text, mode, width, None)
}

fn lower_for(
    text: &str,
    mode: CallMode,
    width: u32,
    objects: Option<ObjectForm>,
) -> Result<Kernel, LowerError> {
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
    rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}"));
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    let layout = Layout { objects, ..layout };
    let kernel = rtsl_packet::lower(&function, &layout, mode, width)?;
    rtsl_packet::verify(&kernel).unwrap_or_else(|error| panic!("{error}"));
    Ok(kernel)
}

fn check(text: &str, expected: Expect) {
    expected.assert_eq(&lower(text, CallMode::Packet, 8).unwrap().to_string());
}

const SHARED_WORK: &str = "function f member radius: f32[1] member table: f32[8]
    state rt_HitDistance: f32[1] {
        %t: f32 = load state:rt_HitDistance@0
        %r: f32 = load member:radius@0
        %square: f32 = multiply %r, %r
        %n: i32 = convert %square
        %e: f32 = load member:table@%n
        %sum: f32 = add %t, %e
        return state:rt_HitDistance@0 = %sum
    }";

/// The three loads are in use together, then a product and a load; uniform values and masks do not count.
#[test]
fn numbers_in_lanes_are_live_from_definition_to_last_use() {
    let kernel = lower(
        "function f member radius: f32[1] state rt_RayOrigin: f32[3] state rt_PDF: f32[1] {
            %r: f32 = load member:radius@0
            %x: f32 = load state:rt_RayOrigin@0
            %y: f32 = load state:rt_RayOrigin@1
            %z: f32 = load state:rt_RayOrigin@2
            %xy: f32 = multiply %x, %y
            %far: bool = less %r, %z
            %s: f32 = select %far, %xy, %z
            return state:rt_PDF@0 = %s
        }",
        CallMode::Packet,
        8,
    );
    assert_eq!(kernel.unwrap().live_lanes(), 3);
    assert_eq!(lower(SHARED_WORK, CallMode::Packet, 8).unwrap().live_lanes(), 1);
}

#[test]
fn uniform_work_is_hoisted_to_the_prologue() {
    check(
        SHARED_WORK,
        expect![[r#"
        kernel f packet W=8 {
          member radius: f32[1] at 0
          member table: f32[8] at 1
          state rt_HitDistance: f32xW[1] at 17
          prologue {
            %2 = load radius[0] : f32
            %3 = multiply %2, %2 : f32
            %4 = convert %3 : i32
            %5 = load table[%4] : f32
          }
          chunk (%0: mask) {
            %1 = load rt_HitDistance[0] : f32xW
            %6 = add %1, %5 : f32xW
          }
          rt_HitDistance[0] = %6
        }
    "#]],
    );
}

#[test]
fn branches_and_loops_that_rays_share_are_run_once() {
    // The loop under the condition might not end, and no ray might reach it: it is not hoisted.
    check(
        "function f member count: i32[1] member flag: bool[1] state rt_HitDistance: f32[1] {
            %t: f32 = load state:rt_HitDistance@0
            %count: i32 = load member:count@0 %flag: bool = load member:flag@0
            %0: i32 = constant 0 %1: i32 = constant 1 %one: f32 = constant 1.0
            %n: i32, %sum: i32 = loop (%i: i32 = %0, %s: i32 = %0) {
                %more: i32 = add %s, %i
                %next: i32 = add %i, %1
                %again: bool = less %next, %count
                repeat %again, %next, %more
            }
            %below: bool = less %t, %one
            %a: i32 = if %below {
                %m: i32 = loop (%j: i32 = %sum) {
                    %k: i32 = multiply %j, %j
                    %again2: bool = less %k, %count
                    repeat %again2, %k
                }
                yield %m
            } else {
                yield %n
            }
            %b: i32 = if %flag {
                %o: i32 = divide %sum, %count %p: i32 = divide %o, %sum
                yield %p
            } else {
                %q: i32 = remainder %sum, %count
                yield %q
            }
            %c: i32 = add %a, %b
            %r: f32 = convert %c
            return state:rt_HitDistance@0 = %r
        }",
        expect![[r#"
            kernel f packet W=8 {
              member count: i32[1] at 0
              member flag: bool[1] at 1
              state rt_HitDistance: f32xW[1] at 17
              prologue {
                %2 = load count[0] : i32
                %3 = load flag[0] : bool
                %4 = 0 : i32
                %5 = 1 : i32
                %6 = 1.0 : f32
                %12, %13 = loop (%4, %4) (%7: i32, %8: i32) {
                  %9 = add %8, %7 : i32
                  %10 = add %7, %5 : i32
                  %11 = less %10, %2 : bool
                  yield %11, %10, %9
                } : i32, i32
                %23 = divide %13, %2 : i32
                %24 = divide %23, %13 : i32
                %25 = remainder %13, %2 : i32
                %26 = select %3, %24, %25 : i32
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %14 = less %1, %6 : mask
                %15 = and %0, %14 : mask
                %16 = any %15 : bool
                %22 = if %16 {
                  %20 = loop (%13) (%17: i32) {
                    %18 = multiply %17, %17 : i32
                    %19 = less %18, %2 : bool
                    yield %19, %18
                  } : i32
                  %21 = select %14, %20, %12 : i32xW
                  yield %21
                } else {
                  yield %12
                } : i32xW
                %27 = add %22, %26 : i32xW
                %28 = convert %27 : f32xW
              }
              rt_HitDistance[0] = %28
            }
        "#]],
    );
}

#[test]
fn in_the_stream_mode_members_are_lanes() {
    let kernel = lower(SHARED_WORK, CallMode::Stream, 8).unwrap();
    assert!(kernel.prologue.ops.is_empty());
    expect![[r#"
        kernel f stream W=8 {
          member radius: f32xW[1] at 0 of objects
          member table: f32xW[8] at 1 of objects
          state rt_HitDistance: f32xW[1] at 17
          prologue {
          }
          chunk (%0: mask) {
            %1 = load rt_HitDistance[0] : f32xW
            %2 = load radius[0] : f32xW
            %3 = multiply %2, %2 : f32xW
            %4 = convert %3 : i32xW
            %5 = load table[%4] : f32xW
            %6 = add %1, %5 : f32xW
          }
          rt_HitDistance[0] = %6
        }
    "#]]
    .assert_eq(&kernel.to_string());
}

/// Only per-object values vary; in modes with one object none of them does.
#[test]
fn data_shared_by_objects_is_uniform() {
    let radius = Some(ObjectForm::new([0]));
    let kernel = lower_for(SHARED_WORK, CallMode::Leaf, 8, radius.clone()).unwrap();
    expect![[r#"
        kernel f leaf W=8 {
          member radius: f32xW[1] at 0 of objects
          member table: f32[8] at 1
          state rt_HitDistance: f32[1] at 17
          prologue {
            %1 = load rt_HitDistance[0] : f32
          }
          chunk (%0: mask) {
            %2 = load radius[0] : f32xW
            %3 = multiply %2, %2 : f32xW
            %4 = convert %3 : i32xW
            %5 = load table[%4] : f32xW
            %6 = add %1, %5 : f32xW
          }
          rt_HitDistance[0] = %6
        }
    "#]]
    .assert_eq(&kernel.to_string());
    let kernel = lower_for(SHARED_WORK, CallMode::Packet, 8, radius).unwrap();
    let variables = kernel.variables.iter().map(|it| (it.of_objects, it.varies, it.location));
    assert_eq!(variables.collect::<Vec<_>>()[..2], [(true, false, 0), (false, false, 1)]);
    // Only a part of the table is per object.
    let part = lower_for(SHARED_WORK, CallMode::Leaf, 8, Some(ObjectForm::new(3..5)));
    assert_eq!(part, Err(LowerError::NoLocation(VariableKind::Member, "table".to_owned())));
}

#[test]
fn short_sides_are_selected() {
    check(
        "function f state rt_HitDistance: f32[1] {
            %t: f32 = load state:rt_HitDistance@0
            %0: f32 = constant 0.0
            %below: bool = less %t, %0
            %r: f32, %flag: bool = if %below {
                %n: f32 = negate %t
                yield %n, %below
            } else {
                %h: f32 = multiply %t, %t
                %true: bool = constant true
                yield %h, %true
            }
            %one: f32 = convert %flag
            %sum: f32 = add %r, %one
            return state:rt_HitDistance@0 = %sum
        }",
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitDistance: f32xW[1] at 17
              prologue {
                %2 = 0.0 : f32
                %6 = true : bool
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %3 = less %1, %2 : mask
                %4 = negate %1 : f32xW
                %5 = multiply %1, %1 : f32xW
                %7 = select %3, %4, %5 : f32xW
                %8 = or %3, %6 : mask
                %9 = convert %8 : f32xW
                %10 = add %7, %9 : f32xW
              }
              rt_HitDistance[0] = %10
            }
        "#]],
    );
}

/// A side that is too long to be speculated.
const LONG: &str = "%q: f32 = divide %t, %t %a: f32 = sqrt %q %b: f32 = sqrt %a
    %c: f32 = sqrt %b %e: f32 = sqrt %c %f: f32 = sqrt %e %d: f32 = divide %f, %b";
const LONG_TOO: &str = "%k: f32 = divide %0, %t %l: f32 = sqrt %k %m: f32 = sqrt %l
    %o: f32 = sqrt %m %g: f32 = sqrt %o %i: f32 = sqrt %g %p: f32 = divide %i, %m";

#[test]
fn long_sides_are_branched_over() {
    let one = format!(
        "function f state rt_HitDistance: f32[1] {{
            %t: f32 = load state:rt_HitDistance@0
            %0: f32 = constant 0.0
            %below: bool = less %t, %0
            %r: f32 = if %below {{ {LONG} yield %d }} else {{ yield %t }}
            return state:rt_HitDistance@0 = %r
        }}"
    );
    check(
        &one,
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitDistance: f32xW[1] at 17
              prologue {
                %2 = 0.0 : f32
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %3 = less %1, %2 : mask
                %4 = and %0, %3 : mask
                %5 = any %4 : bool
                %14 = if %5 {
                  %6 = divide %1, %1 : f32xW
                  %7 = sqrt %6 : f32xW
                  %8 = sqrt %7 : f32xW
                  %9 = sqrt %8 : f32xW
                  %10 = sqrt %9 : f32xW
                  %11 = sqrt %10 : f32xW
                  %12 = divide %11, %8 : f32xW
                  %13 = select %3, %12, %1 : f32xW
                  yield %13
                } else {
                  yield %1
                } : f32xW
              }
              rt_HitDistance[0] = %14
            }
        "#]],
    );
    let both = one.replace("{ yield %t }", &format!("{{ {LONG_TOO} yield %p }}"));
    check(
        &both,
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitDistance: f32xW[1] at 17
              prologue {
                %2 = 0.0 : f32
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %3 = less %1, %2 : mask
                %4 = unspecified : f32xW
                %5 = and %0, %3 : mask
                %6 = any %5 : bool
                %14 = if %6 {
                  %7 = divide %1, %1 : f32xW
                  %8 = sqrt %7 : f32xW
                  %9 = sqrt %8 : f32xW
                  %10 = sqrt %9 : f32xW
                  %11 = sqrt %10 : f32xW
                  %12 = sqrt %11 : f32xW
                  %13 = divide %12, %9 : f32xW
                  yield %13
                } else {
                  yield %4
                } : f32xW
                %15 = not %3 : mask
                %16 = and %0, %15 : mask
                %17 = any %16 : bool
                %26 = if %17 {
                  %18 = divide %2, %1 : f32xW
                  %19 = sqrt %18 : f32xW
                  %20 = sqrt %19 : f32xW
                  %21 = sqrt %20 : f32xW
                  %22 = sqrt %21 : f32xW
                  %23 = sqrt %22 : f32xW
                  %24 = divide %23, %20 : f32xW
                  %25 = select %3, %14, %24 : f32xW
                  yield %25
                } else {
                  yield %14
                } : f32xW
              }
              rt_HitDistance[0] = %26
            }
        "#]],
    );
}

#[test]
fn the_speculation_limit_grows_with_the_width() {
    // An early out whose remainder costs 42 units, and in it another whose remainder costs 20.
    let text = "function f state rt_HitDistance: f32[1] {
        %t: f32 = load state:rt_HitDistance@0
        %0: f32 = constant 0.0
        %below: bool = less %t, %0
        %r: f32 = if %below { yield %t } else {
            %a: f32 = divide %0, %t %b: f32 = sqrt %a %c: bool = less %b, %t
            %s: f32 = if %c { yield %b } else { %d: f32 = sqrt %b %e: f32 = divide %d, %a yield %e }
            yield %s
        }
        return state:rt_HitDistance@0 = %r
    }";
    for (width, branches) in [(1, 2), (2, 2), (4, 1), (8, 0), (16, 0)] {
        let kernel = lower(text, CallMode::Packet, width).unwrap().to_string();
        assert_eq!(kernel.matches("= if").count(), branches, "{width}: {kernel}");
    }
}

#[test]
fn the_negation_is_added_to_loaded_lanes() {
    let text = "function f state rt_HitDistance: f32[1] member m: f32[1] {
        %t: f32 = load state:rt_HitDistance@0
        %m: f32 = load member:m@0
        %a: f32 = subtract %t, %m
        %b: f32 = subtract %a, %m
        %c: f32 = subtract %m, %b
        %d: f32 = subtract %c, %t
        return state:rt_HitDistance@0 = %d
    }";
    let lowered = |mode| {
        let text = lower(text, mode, 8).unwrap().to_string();
        text[text.find("  prologue").unwrap()..].to_owned()
    };
    expect![[r#"
          prologue {
            %2 = load m[0] : f32
            %3 = negate %2 : f32
          }
          chunk (%0: mask) {
            %1 = load rt_HitDistance[0] : f32xW
            %4 = add %1, %3 : f32xW
            %5 = subtract %4, %2 : f32xW
            %6 = subtract %2, %5 : f32xW
            %7 = subtract %6, %1 : f32xW
          }
          rt_HitDistance[0] = %7
        }
    "#]]
    .assert_eq(&lowered(CallMode::Packet));
    // Here the negation would be an additional operation.
    expect![[r#"
          prologue {
          }
          chunk (%0: mask) {
            %1 = load rt_HitDistance[0] : f32
            %2 = load m[0] : f32
            %3 = subtract %1, %2 : f32
            %4 = subtract %3, %2 : f32
            %5 = subtract %2, %4 : f32
            %6 = subtract %5, %1 : f32
          }
          rt_HitDistance[0] = %6
        }
    "#]]
    .assert_eq(&lowered(CallMode::Single));
}

#[test]
fn one_ray_branches() {
    let text = format!(
        "function f state rt_HitDistance: f32[1] {{
            %t: f32 = load state:rt_HitDistance@0
            %0: f32 = constant 0.0
            %below: bool = less %t, %0
            %r: f32 = if %below {{ {LONG} yield %d }} else {{ {LONG_TOO} yield %p }}
            return state:rt_HitDistance@0 = %r
        }}"
    );
    expect![[r#"
        kernel f packet W=1 {
          state rt_HitDistance: f32xW[1] at 17
          prologue {
            %2 = 0.0 : f32
          }
          chunk (%0: mask) {
            %1 = load rt_HitDistance[0] : f32xW
            %3 = less %1, %2 : mask
            %18 = any %3 : bool
            %19 = if %18 {
              %4 = divide %1, %1 : f32xW
              %5 = sqrt %4 : f32xW
              %6 = sqrt %5 : f32xW
              %7 = sqrt %6 : f32xW
              %8 = sqrt %7 : f32xW
              %9 = sqrt %8 : f32xW
              %10 = divide %9, %6 : f32xW
              yield %10
            } else {
              %11 = divide %2, %1 : f32xW
              %12 = sqrt %11 : f32xW
              %13 = sqrt %12 : f32xW
              %14 = sqrt %13 : f32xW
              %15 = sqrt %14 : f32xW
              %16 = sqrt %15 : f32xW
              %17 = divide %16, %13 : f32xW
              yield %17
            } : f32xW
          }
          rt_HitDistance[0] = %19
        }
    "#]]
    .assert_eq(&lower(&text, CallMode::Packet, 1).unwrap().to_string());
}

#[test]
fn rays_leave_a_loop_at_different_times() {
    // The counter is uniform in the loop and lanes after it.
    check(
        "function f state rt_HitDistance: f32[1] {
            %t: f32 = load state:rt_HitDistance@0
            %0: i32 = constant 0 %1: i32 = constant 1 %half: f32 = constant 0.5
            %n: i32, %x: f32, %unread: f32 = loop (%i: i32 = %0, %y: f32 = %t, %z: f32 = %t) {
                %next: i32 = add %i, %1
                %smaller: f32 = multiply %y, %half
                %more: bool = less %half, %smaller
                repeat %more, %next, %smaller, %smaller
            }
            %float: f32 = convert %n
            %sum: f32 = add %x, %float
            return state:rt_HitDistance@0 = %sum
        }",
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitDistance: f32xW[1] at 17
              prologue {
                %2 = 0 : i32
                %3 = 1 : i32
                %4 = 0.5 : f32
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %5 = unspecified : i32xW
                %18, %19, %20, %21, %22 = loop (%0, %2, %1, %1, %5) (%6: mask, %7: i32, %8: f32xW, %9: f32xW, %10: i32xW) {
                  %11 = add %7, %3 : i32
                  %12 = multiply %8, %4 : f32xW
                  %13 = less %4, %12 : mask
                  %14 = and %6, %13 : mask
                  %15 = any %14 : bool
                  %16 = select %6, %12, %8 : f32xW
                  %17 = select %6, %11, %10 : i32xW
                  yield %15, %14, %11, %16, %12, %17
                } : mask, i32, f32xW, f32xW, i32xW
                %23 = convert %22 : f32xW
                %24 = add %20, %23 : f32xW
              }
              rt_HitDistance[0] = %24
            }
        "#]],
    );
}

#[test]
fn rays_that_count_together_need_no_mask() {
    check(
        "function f state rt_HitDistance: f32[1] member count: i32[1] local table: f32[6] {
            %t: f32 = load state:rt_HitDistance@0
            %count: i32 = load member:count@0
            %0: i32 = constant 0 %1: i32 = constant 1 %zero: f32 = constant 0.0
            %below: bool = less %t, %zero
            %r: f32 = if %below {
                %n: i32, %x: f32 = loop (%i: i32 = %0, %y: f32 = %t) {
                    store local:table@%i, %y
                    %next: i32 = add %i, %1
                    %twice: f32 = add %y, %y
                    %more: bool = less %next, %count
                    repeat %more, %next, %twice
                }
                yield %x
            } else {
                yield %t
            }
            %last: f32 = load local:table@5
            %sum: f32 = add %last, %r
            return state:rt_HitDistance@0 = %sum
        }",
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitDistance: f32xW[1] at 17
              member count: i32[1] at 0
              local table: f32xW[6]
              prologue {
                %2 = load count[0] : i32
                %3 = 0 : i32
                %4 = 1 : i32
                %5 = 0.0 : f32
              }
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %6 = less %1, %5 : mask
                %7 = and %0, %6 : mask
                %8 = any %7 : bool
                %17 = if %8 {
                  %14, %15 = loop (%3, %1) (%9: i32, %10: f32xW) {
                    store table[%9] %10 where %7
                    %11 = add %9, %4 : i32
                    %12 = add %10, %10 : f32xW
                    %13 = less %11, %2 : bool
                    yield %13, %11, %12
                  } : i32, f32xW
                  %16 = select %6, %15, %1 : f32xW
                  yield %16
                } else {
                  yield %1
                } : f32xW
                %18 = load table[5] : f32xW
                %19 = add %18, %17 : f32xW
              }
              rt_HitDistance[0] = %19
            }
        "#]],
    );
}

#[test]
fn small_arrays_are_chosen_from() {
    check(
        "function f state rt_HitPoint: f32[3] scratch axis: i32[1] local v: f32[2] {
            %axis: i32 = load scratch:axis@0
            %c: f32 = load state:rt_HitPoint@%axis
            store local:v@%axis, %c
            %r: f32 = load local:v@1
            return state:rt_HitPoint@0 = %r
        }",
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitPoint: f32xW[3] at 21
              scratch axis: i32xW[1] at 0
              local v: f32xW[2]
              prologue {
                %4 = 1 : i32
                %8 = 2 : i32
                %11 = 0 : i32
              }
              chunk (%0: mask) {
                %1 = load axis[0] : i32xW
                %2 = load rt_HitPoint[0] : f32xW
                %3 = load rt_HitPoint[1] : f32xW
                %5 = greater_equal %1, %4 : mask
                %6 = select %5, %3, %2 : f32xW
                %7 = load rt_HitPoint[2] : f32xW
                %9 = greater_equal %1, %8 : mask
                %10 = select %9, %7, %6 : f32xW
                %12 = less_equal %1, %11 : mask
                %13 = load v[0] : f32xW
                %14 = select %12, %10, %13 : f32xW
                store v[0] %14
                %15 = greater_equal %1, %4 : mask
                %16 = load v[1] : f32xW
                %17 = select %15, %10, %16 : f32xW
                store v[1] %17
                %18 = load v[1] : f32xW
              }
              rt_HitPoint[0] = %18
            }
        "#]],
    );
}

#[test]
fn hosts_are_asked_for_lanes() {
    check(
        "function f state rt_HitPoint: f32[3] state rt_PDF: f32[1] {
            %x: f32 = load state:rt_HitPoint@0
            %0: f32 = constant 0.0 %1: f32 = constant 1.0
            %i: i32 = convert %x
            %lit: bool, %lx: f32, %ly: f32, %lz: f32, %d: f32, %cr: f32, %cg: f32, %cb: f32, %pdf: f32 =
                light_sample %i, %x, %x, %x, %0, %0, %1, %0
            %below: bool = less %x, %0
            %r: f32 = if %below {
                %random: f32 = rand
                yield %random
            } else {
                yield %pdf
            }
            return state:rt_PDF@0 = %r
        }",
        expect![[r#"
            kernel f packet W=8 {
              state rt_HitPoint: f32xW[3] at 21
              state rt_PDF: f32xW[1] at 51
              prologue {
                %2 = 0.0 : f32
                %3 = 1.0 : f32
                %5 = false : bool
              }
              chunk (%0: mask) {
                %1 = load rt_HitPoint[0] : f32xW
                %4 = convert %1 : i32xW
                %40, %41, %42, %43, %44, %45, %46, %47, %48, %49 = loop (%0, %5, %2, %2, %2, %2, %2, %2, %2, %2) (%6: mask, %7: mask, %8: f32xW, %9: f32xW, %10: f32xW, %11: f32xW, %12: f32xW, %13: f32xW, %14: f32xW, %15: f32xW) {
                  %16 = first %6, %4 : i32
                  %17 = equal %4, %16 : mask
                  %18 = and %6, %17 : mask
                  %19, %20, %21, %22, %23, %24, %25, %26, %27 = light_sample %18, %16, %1, %1, %1, %2, %2, %3, %2 : mask, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW
                  %28 = not %17 : mask
                  %29 = and %6, %28 : mask
                  %30 = any %29 : bool
                  %31 = select %18, %19, %7 : mask
                  %32 = select %18, %20, %8 : f32xW
                  %33 = select %18, %21, %9 : f32xW
                  %34 = select %18, %22, %10 : f32xW
                  %35 = select %18, %23, %11 : f32xW
                  %36 = select %18, %24, %12 : f32xW
                  %37 = select %18, %25, %13 : f32xW
                  %38 = select %18, %26, %14 : f32xW
                  %39 = select %18, %27, %15 : f32xW
                  yield %30, %29, %31, %32, %33, %34, %35, %36, %37, %38, %39
                } : mask, mask, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW, f32xW
                %50 = less %1, %2 : mask
                %51 = and %0, %50 : mask
                %52 = any %51 : bool
                %55 = if %52 {
                  %53 = rand %51 : f32xW
                  %54 = select %50, %53, %49 : f32xW
                  yield %54
                } else {
                  yield %49
                } : f32xW
              }
              rt_PDF[0] = %55
            }
        "#]],
    );
}

#[test]
fn errors_say_why() {
    let local = "function f local large: f32[9000] state rt_PDF: f32[1] {
        %1: f32 = load state:rt_PDF@0 store local:large@4, %1 return }";
    let parameter = "function f parameter p: f32[1] { %1: f32 = load parameter:p@0 return }";
    let member = "function f member m: f32[1] { %1: f32 = load member:m@0 return member:m@0 = %1 }";
    let linked = "function f { %1: bool = is_set kd return }";
    for (text, width, message) in [
        (local, 8, "local arrays take 144000 words for 16 rays, more than 65536"),
        (parameter, 8, "a call has no storage for the parameter `p`"),
        (member, 8, "kernels do not store the member `m`"),
        (linked, 8, "the reference `kd` is not linked"),
        ("function f { return }", 5, "packets cannot have 5 rays"),
        ("function f { return }", 32, "packets cannot have 32 rays"),
        ("function f { return }", 0, "packets cannot have 0 rays"),
    ] {
        assert_eq!(lower(text, CallMode::Packet, width).unwrap_err().to_string(), message);
    }
}
