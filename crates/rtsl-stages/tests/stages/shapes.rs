//! Texts in and out, for each shape of control around a point.

use expect_test::expect;

use crate::splitting::{stages, text};

#[test]
fn in_a_straight_line() {
    let body = "
        %x: f32 = load state:rt_RayOrigin@0
        %y: f32 = sqrt %x
        %o: bool = occluded %x, %y, %x, %one, %one, %one, %x
        %z: f32 = select %o, %y, %one
        return state:rt_HitDistance@0 = %z";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: f32 = load state:rt_RayOrigin@0
          %3: f32 = sqrt %2
          return scratch:frame.0@0 = %3, scratch:request.0@0 = %2, scratch:request.1@0 = %3, scratch:request.2@0 = %2, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %2, scratch:next@0 = %1
        }

        stage 1: occluded, live 0
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: f32 = load scratch:frame.0@0
          %3: bool = load scratch:answer.0@0
          %4: f32 = select %3, %2, %1
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %4
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn in_one_branch() {
    let body = "
        %c: bool = load member:b@0
        %y: f32 = rand
        %r: f32 = if %c {
            %o: bool = occluded RAY
            %z: f32 = select %o, %y, %one
            yield %z
        } else {
            %square: f32 = multiply %y, %y
            yield %square
        }
        %s: f32 = sqrt %r
        return state:rt_HitDistance@0 = %s";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: f32 = rand
          return scratch:frame.0@0 = %2, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 1: occluded, live 0
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: f32 = load scratch:frame.0@0
          %3: bool = load scratch:answer.0@0
          %4: f32 = select %3, %2, %1
          %5: f32 = sqrt %4
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %5
        }
    "#]].assert_eq(&text(&body.replace("load member:b@0", "convert %one")));
}

#[test]
fn in_both_branches() {
    let body = "
        %y: f32 = rand
        %c: bool = less %y, %one
        %r: f32 = if %c {
            %a: f32, %b: f32, %d: f32 = trace RAY, %one
            yield %a
        } else {
            %p: f32, %q: f32, %t: f32 = trace RAY, %y
            yield %q
        }
        %s: f32 = multiply %r, %y
        return state:rt_HitDistance@0 = %s";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: i32 = constant 2
          %3: f32 = rand
          %4: bool = less %3, %0
          %5: i32, %6: f32 = if %4 {
            yield %1, %0
          } else {
            yield %2, %3
          }
          return scratch:frame.0@0 = %3, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %6, scratch:next@0 = %5
        }

        stage 1: trace, live 0
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch answer.0: f32[1]
        scratch answer.1: f32[1]
        scratch answer.2: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: f32 = load scratch:answer.0@0
          %3: f32 = multiply %1, %2
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %3
        }

        stage 2: trace, live 0
        function Test.radiance.2
        scratch frame.0: f32[1]
        scratch answer.0: f32[1]
        scratch answer.1: f32[1]
        scratch answer.2: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: f32 = load scratch:answer.1@0
          %3: f32 = multiply %1, %2
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %3
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn in_a_loop() {
    let body = "
        %k: f32 = load member:m@0
        %zero: i32 = constant 0
        %i: i32, %sum: f32 = loop (%j: i32 = %zero, %s: f32 = %one) {
            %a: f32, %b: f32, %c: f32 = trace RAY, %one
            %s2: f32 = fma %a, %k, %s
            %first: i32 = constant 1
            %j2: i32 = add %j, %first
            %n: i32 = load member:n@0
            %again: bool = less %j2, %n
            repeat %again, %j2, %s2
        }
        return state:rt_HitDistance@0 = %sum";
    expect![[r#"
        stages Test.radiance
        slot 0: i32
        slot 1: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: i32[1]
        scratch frame.1: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 0
          %2: i32 = constant 1
          return scratch:frame.0@0 = %1, scratch:frame.1@0 = %0, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %2
        }

        stage 1: trace, live 0 1
        function Test.radiance.1
        scratch frame.0: i32[1]
        scratch frame.1: f32[1]
        scratch answer.0: f32[1]
        scratch answer.1: f32[1]
        scratch answer.2: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: i32 = constant 1
          %3: f32 = load state:rt_HitDistance@0
          %4: i32 = load scratch:frame.0@0
          %5: f32 = load scratch:frame.1@0
          %6: f32 = load member:m@0
          %7: f32 = load scratch:answer.0@0
          %8: f32 = fma %7, %6, %5
          %9: i32 = add %4, %2
          %10: i32 = load member:n@0
          %11: bool = less %9, %10
          %12: f32, %13: i32 = if %11 {
            yield %3, %2
          } else {
            yield %8, %0
          }
          return scratch:frame.0@0 = %9, scratch:frame.1@0 = %8, scratch:request.0@0 = %1, scratch:request.1@0 = %1, scratch:request.2@0 = %1, scratch:request.3@0 = %1, scratch:request.4@0 = %1, scratch:request.5@0 = %1, scratch:request.6@0 = %1, scratch:request.7@0 = %1, scratch:next@0 = %13, state:rt_HitDistance@0 = %12
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn in_nested_loops() {
    let body = "
        %outer: f32 = loop (%s: f32 = %one) {
            %inner: f32 = loop (%t: f32 = %s) {
                %o: bool = occluded RAY
                %r: f32 = rand
                %t2: f32 = add %t, %r
                repeat %o, %t2
            }
            %r2: f32 = rand
            %again: bool = less %r2, %inner
            repeat %again, %inner
        }
        return state:rt_HitDistance@0 = %outer";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          return scratch:frame.0@0 = %0, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 1: occluded, live 0
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: i32 = constant 1
          %3: f32 = load state:rt_HitDistance@0
          %4: f32 = load scratch:frame.0@0
          %5: bool = load scratch:answer.0@0
          %6: f32 = rand
          %7: f32 = add %4, %6
          %8: f32, %9: i32 = if %5 {
            yield %3, %2
          } else {
            %10: f32 = rand
            %11: bool = less %10, %7
            %12: f32, %13: i32 = if %11 {
              yield %3, %2
            } else {
              yield %7, %0
            }
            yield %12, %13
          }
          return scratch:frame.0@0 = %7, scratch:request.0@0 = %1, scratch:request.1@0 = %1, scratch:request.2@0 = %1, scratch:request.3@0 = %1, scratch:request.4@0 = %1, scratch:request.5@0 = %1, scratch:request.6@0 = %1, scratch:next@0 = %9, state:rt_HitDistance@0 = %8
        }
    "#]].assert_eq(&text(body));
}

/// A `for` with a `break`: the second bool carries it out.
#[test]
fn in_a_loop_with_a_break() {
    let body = "
        %zero: i32 = constant 0
        %no: bool = constant false
        %yes: bool = constant true
        %i: i32, %stopped: bool = loop (%j: i32 = %zero, %b: bool = %no) {
            %n: i32 = load member:n@0
            %in: bool = less %j, %n
            %again: bool, %j2: i32, %b2: bool = if %in {
                %r: f32 = rand
                %rare: bool = less %r, %one
                %stop: bool = if %rare {
                    %o: bool = occluded RAY
                    yield %o
                } else {
                    yield %no
                }
                %first: i32 = constant 1
                %next: i32 = add %j, %first
                %on: bool = not %stop
                yield %on, %next, %stop
            } else {
                yield %no, %j, %no
            }
            repeat %again, %j2, %b2
        }
        %x: f32 = convert %i
        return state:rt_HitDistance@0 = %x";
    expect![[r#"
        stages Test.radiance
        slot 0: i32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: i32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant 0
          %1: i32 = constant -1
          %2: f32 = constant 1.0
          %3: bool = constant false
          %4: bool = constant true
          %5: i32 = constant 1
          %6: f32 = load state:rt_HitDistance@0
          %7: i32, %8: bool, %9: i32 = loop (%10: i32 = %0, %11: bool = %3, %12: i32 = %0) {
            %13: i32 = load member:n@0
            %14: bool = less %10, %13
            %15: bool, %16: i32, %17: bool = if %14 {
              %18: f32 = rand
              %19: bool = less %18, %2
              %20: i32 = if %19 {
                yield %0
              } else {
                %21: i32 = add %10, %5
                yield %21
              }
              yield %4, %20, %19
            } else {
              yield %3, %10, %3
            }
            %22: bool = not %17
            %23: bool = and %22, %15
            repeat %23, %16, %17, %10
          }
          %24: f32, %25: i32 = if %8 {
            yield %6, %5
          } else {
            %26: f32 = convert %7
            yield %26, %1
          }
          return scratch:frame.0@0 = %9, scratch:request.0@0 = %2, scratch:request.1@0 = %2, scratch:request.2@0 = %2, scratch:request.3@0 = %2, scratch:request.4@0 = %2, scratch:request.5@0 = %2, scratch:request.6@0 = %2, scratch:next@0 = %25, state:rt_HitDistance@0 = %24
        }

        stage 1: occluded, live 0
        function Test.radiance.1
        scratch frame.0: i32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant 0
          %1: i32 = constant -1
          %2: f32 = constant 1.0
          %3: bool = constant false
          %4: i32 = constant 1
          %5: bool = constant true
          %6: f32 = load state:rt_HitDistance@0
          %7: i32 = load scratch:frame.0@0
          %8: bool = load scratch:answer.0@0
          %9: i32 = add %7, %4
          %10: bool = not %8
          %11: i32, %12: bool, %13: i32 = if %10 {
            %14: i32, %15: bool, %16: i32 = loop (%17: i32 = %9, %18: bool = %3, %19: i32 = %0) {
              %20: i32 = load member:n@0
              %21: bool = less %17, %20
              %22: bool, %23: i32, %24: bool = if %21 {
                %25: f32 = rand
                %26: bool = less %25, %2
                %27: i32 = if %26 {
                  yield %0
                } else {
                  %28: i32 = add %17, %4
                  yield %28
                }
                yield %5, %27, %26
              } else {
                yield %3, %17, %3
              }
              %29: bool = not %24
              %30: bool = and %29, %22
              repeat %30, %23, %24, %17
            }
            yield %14, %15, %16
          } else {
            yield %9, %3, %0
          }
          %31: f32, %32: i32 = if %12 {
            yield %6, %4
          } else {
            %33: f32 = convert %11
            yield %33, %1
          }
          return scratch:frame.0@0 = %13, scratch:request.0@0 = %2, scratch:request.1@0 = %2, scratch:request.2@0 = %2, scratch:request.3@0 = %2, scratch:request.4@0 = %2, scratch:request.5@0 = %2, scratch:request.6@0 = %2, scratch:next@0 = %32, state:rt_HitDistance@0 = %31
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn locals_with_dynamic_indices_pass_as_a_whole() {
    let body = "
        %x: f32 = rand
        %n: i32 = load member:n@0
        store local:r@%n, %x
        %o: bool = occluded RAY
        %y: f32 = load local:r@%n
        store local:r@0, %y
        %p: bool = occluded RAY
        return state:rt_HitDistance@0 = %y";
    expect![[r#"
        stages Test.radiance
        slot 0: f32
        slot 1: f32 r@1
        slot 2: f32 r@2

        stage 0: start
        function Test.radiance.0
        local r: f32[3]
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch frame.2: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: f32 = rand
          %3: i32 = load member:n@0
          store local:r@%3, %2
          %4: f32 = load local:r@0
          %5: f32 = load local:r@1
          %6: f32 = load local:r@2
          return scratch:frame.0@0 = %4, scratch:frame.1@0 = %5, scratch:frame.2@0 = %6, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 1: occluded, live 0 1 2
        function Test.radiance.1
        local r: f32[3]
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch frame.2: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 2
          %2: f32 = load scratch:frame.0@0
          store local:r@0, %2
          %3: f32 = load scratch:frame.1@0
          store local:r@1, %3
          %4: f32 = load scratch:frame.2@0
          store local:r@2, %4
          %5: i32 = load member:n@0
          %6: f32 = load local:r@%5
          store local:r@0, %6
          return scratch:frame.0@0 = %6, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 2: occluded, live 0
        function Test.radiance.2
        scratch frame.0: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %1
        }
    "#]].assert_eq(&text(body));
}

/// Cheap values that need nothing that is not kept anyway are computed again.
#[test]
fn cheap_values_are_computed_again() {
    let body = "
        %x: f32 = rand
        %m: f32 = load member:m@2
        %twice: f32 = add %x, %x
        %four: f32 = multiply %twice, %m
        %root: f32 = sqrt %four
        %o: bool = occluded RAY
        %a: f32 = add %x, %four
        %b: f32 = add %a, %root
        %c: f32 = add %b, %m
        return state:rt_HitDistance@0 = %c";
    expect![[r#"
        stages Test.radiance
        slot 0: f32
        slot 1: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: f32 = rand
          %3: f32 = load member:m@2
          %4: f32 = add %2, %2
          %5: f32 = multiply %3, %4
          %6: f32 = sqrt %5
          return scratch:frame.0@0 = %2, scratch:frame.1@0 = %6, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 1: occluded, live 0 1
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: f32 = load scratch:frame.1@0
          %3: f32 = load member:m@2
          %4: f32 = add %1, %1
          %5: f32 = multiply %3, %4
          %6: f32 = add %1, %5
          %7: f32 = add %2, %6
          %8: f32 = add %3, %7
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %8
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn slots_are_shared() {
    let body = "
        %x: f32 = rand
        %o: bool = occluded RAY
        %y: f32 = rand
        %z: f32 = select %o, %x, %y
        %o2: bool = occluded %z, %z, %z, %z, %z, %z, %z
        %v: f32 = select %o2, %y, %one
        return state:rt_HitDistance@0 = %v";
    let stages = stages(body);
    assert_eq!(stages.slots.len(), 1, "{stages}");
}

/// State is gone once the first stage has run.
#[test]
fn state_that_is_read_late_passes_through_the_frame() {
    let body = "
        %o: bool = occluded RAY
        %x: f32 = load state:rt_RayOrigin@1
        %n: i32 = load member:n@0
        %y: f32 = load state:rt_RayDirection@%n
        %z: f32 = add %x, %y
        return state:rt_HitDistance@0 = %z";
    expect![[r#"
        stages Test.radiance
        slot 0: f32
        slot 1: f32 rt_RayDirection@0
        slot 2: f32 rt_RayDirection@1
        slot 3: f32 rt_RayDirection@2

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch frame.2: f32[1]
        scratch frame.3: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          %2: f32 = load state:rt_RayOrigin@1
          %3: f32 = load state:rt_RayDirection@0
          %4: f32 = load state:rt_RayDirection@1
          %5: f32 = load state:rt_RayDirection@2
          return scratch:frame.0@0 = %2, scratch:frame.1@0 = %3, scratch:frame.2@0 = %4, scratch:frame.3@0 = %5, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:next@0 = %1
        }

        stage 1: occluded, live 0 1 2 3
        function Test.radiance.1
        local rt_RayDirection: f32[3]
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch frame.2: f32[1]
        scratch frame.3: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: f32 = load scratch:frame.1@0
          store local:rt_RayDirection@0, %2
          %3: f32 = load scratch:frame.2@0
          store local:rt_RayDirection@1, %3
          %4: f32 = load scratch:frame.3@0
          store local:rt_RayDirection@2, %4
          %5: i32 = load member:n@0
          %6: f32 = load local:rt_RayDirection@%5
          %7: f32 = add %1, %6
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %7
        }
    "#]].assert_eq(&text(body));
}

#[test]
fn outputs_are_stored_where_the_function_ends() {
    let body = "
        %x: f32 = rand
        %c: bool = less %x, %one
        %y: f32 = if %c { yield %x } else {
            %o: bool = occluded RAY
            %z: f32 = convert %o
            yield %z
        }
        return state:rt_HitDistance@0 = %y, scratch:kept@1 = %x";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: i32 = constant 1
          %3: f32 = load state:rt_HitDistance@0
          %4: f32 = load scratch:kept@1
          %5: f32 = rand
          %6: bool = less %5, %1
          %7: f32, %8: f32, %9: i32 = if %6 {
            yield %5, %5, %0
          } else {
            yield %3, %4, %2
          }
          return scratch:frame.0@0 = %5, scratch:request.0@0 = %1, scratch:request.1@0 = %1, scratch:request.2@0 = %1, scratch:request.3@0 = %1, scratch:request.4@0 = %1, scratch:request.5@0 = %1, scratch:request.6@0 = %1, scratch:next@0 = %9, state:rt_HitDistance@0 = %7, scratch:kept@1 = %8
        }

        stage 1: occluded, live 0
        function Test.radiance.1
        scratch frame.0: f32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: bool = load scratch:answer.0@0
          %3: f32 = convert %2
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %3, scratch:kept@1 = %1
        }
    "#]].assert_eq(&text(body));
}
