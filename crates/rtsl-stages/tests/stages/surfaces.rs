//! Texts in and out where stages ask about surfaces.

use expect_test::expect;
use rtsl_stages::{ResumedBy, Surface};

use crate::splitting::{stages, text};

/// While the second surface is searched, the first is kept; queries about it are dispatched.
#[test]
fn two_surfaces_alive() {
    let body = "
        %f: bool, %o: i32, %i: i32, %e: i32, %d: f32 = query nearest_hit RAY, %one
        %a: f32, %b: f32, %c: f32 = query emission %o, %i, %e, SURFACE
        %f2: bool, %o2: i32, %i2: i32, %e2: i32, %d2: f32 = query nearest_hit RAY, %one
        %a2: f32, %b2: f32, %c2: f32 = query emission %o2, %i2, %e2, SURFACE
        %a3: f32, %b3: f32, %c3: f32 = query light_emission %o, %i, %e, SURFACE
        %a4: f32, %b4: f32, %c4: f32 = query light_emission %o2, %i2, %e2, SURFACE
        return state:rt_HitDistance@0 = %a3, state:rt_RayOrigin@0 = %a4";
    expect![[r#"
        stages Test.radiance
        slot 0: i32
        slot 1: i32
        slot 2: i32
        slot 3: f32

        stage 0: start
        function Test.radiance.0
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          return scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %1
        }

        stage 1: nearest_hit, surface answer
        function Test.radiance.1
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch frame.0: i32[1]
        scratch frame.1: i32[1]
        scratch frame.2: i32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 2
          %2: i32 = load scratch:answer.1@0
          %3: i32 = load scratch:answer.2@0
          %4: i32 = load scratch:answer.3@0
          %5: f32, %6: f32, %7: f32 = query emission %2, %3, %4, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0
          return scratch:frame.0@0 = %2, scratch:frame.1@0 = %3, scratch:frame.2@0 = %4, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %1
        }

        stage 2: nearest_hit, surface answer, live 0 1 2
        function Test.radiance.2
        scratch frame.0: i32[1]
        scratch frame.1: i32[1]
        scratch frame.2: i32[1]
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch surface.0: i32[1]
        scratch surface.1: i32[1]
        scratch surface.2: i32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 3
          %2: i32 = load scratch:frame.0@0
          %3: i32 = load scratch:frame.1@0
          %4: i32 = load scratch:frame.2@0
          %5: i32 = load scratch:answer.1@0
          %6: i32 = load scratch:answer.2@0
          %7: i32 = load scratch:answer.3@0
          %8: f32, %9: f32, %10: f32 = query emission %5, %6, %7, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0
          return scratch:frame.0@0 = %5, scratch:frame.1@0 = %6, scratch:frame.2@0 = %7, scratch:surface.0@0 = %2, scratch:surface.1@0 = %3, scratch:surface.2@0 = %4, scratch:next@0 = %1
        }

        stage 3: dispatch, surface request, live 0 1 2
        function Test.radiance.3
        scratch frame.0: i32[1]
        scratch frame.1: i32[1]
        scratch frame.2: i32[1]
        scratch surface.0: i32[1]
        scratch surface.1: i32[1]
        scratch surface.2: i32[1]
        scratch frame.3: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 4
          %2: i32 = load scratch:frame.0@0
          %3: i32 = load scratch:frame.1@0
          %4: i32 = load scratch:frame.2@0
          %5: i32 = load scratch:surface.0@0
          %6: i32 = load scratch:surface.1@0
          %7: i32 = load scratch:surface.2@0
          %8: f32, %9: f32, %10: f32 = query light_emission %5, %6, %7, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0, %0
          return scratch:frame.3@0 = %8, scratch:surface.0@0 = %2, scratch:surface.1@0 = %3, scratch:surface.2@0 = %4, scratch:next@0 = %1
        }

        stage 4: dispatch, surface request, live 3
        function Test.radiance.4
        scratch frame.3: f32[1]
        scratch surface.0: i32[1]
        scratch surface.1: i32[1]
        scratch surface.2: i32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: f32 = load scratch:frame.3@0
          %3: i32 = load scratch:surface.0@0
          %4: i32 = load scratch:surface.1@0
          %5: i32 = load scratch:surface.2@0
          %6: f32, %7: f32, %8: f32 = query light_emission %3, %4, %5, %1, %1, %1, %1, %1, %1, %1, %1, %1, %1, %1
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %2, state:rt_RayOrigin@0 = %6
        }
    "#]].assert_eq(&text(body));
}

/// A shadow ray names the surface that the code needs next, which saves a dispatch.
#[test]
fn a_shadow_ray_names_the_next_surface() {
    let body = "
        %f: bool, %o: i32, %i: i32, %e: i32, %d: f32 = query nearest_hit RAY, %one
        %dark: bool = occluded RAY
        %a: f32 = if %f {
            %x: f32, %b: f32, %c: f32 = query light_emission %o, %i, %e, SURFACE
            yield %x
        } else { yield %d }
        %y: f32 = select %dark, %a, %one
        return state:rt_HitDistance@0 = %y";
    expect![[r#"
        stages Test.radiance
        slot 0: bool
        slot 1: f32

        stage 0: start
        function Test.radiance.0
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          return scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %1
        }

        stage 1: nearest_hit
        function Test.radiance.1
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch frame.0: bool[1]
        scratch frame.1: f32[1]
        scratch surface.0: i32[1]
        scratch surface.1: i32[1]
        scratch surface.2: i32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 2
          %2: bool = load scratch:answer.0@0
          %3: i32 = load scratch:answer.1@0
          %4: i32 = load scratch:answer.2@0
          %5: i32 = load scratch:answer.3@0
          %6: f32 = load scratch:answer.4@0
          return scratch:frame.0@0 = %2, scratch:frame.1@0 = %6, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:surface.0@0 = %3, scratch:surface.1@0 = %4, scratch:surface.2@0 = %5, scratch:next@0 = %1
        }

        stage 2: occluded, surface request, live 0 1
        function Test.radiance.2
        scratch frame.0: bool[1]
        scratch frame.1: f32[1]
        scratch surface.0: i32[1]
        scratch surface.1: i32[1]
        scratch surface.2: i32[1]
        scratch answer.0: bool[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: bool = load scratch:frame.0@0
          %3: f32 = load scratch:frame.1@0
          %4: i32 = load scratch:surface.0@0
          %5: i32 = load scratch:surface.1@0
          %6: i32 = load scratch:surface.2@0
          %7: bool = load scratch:answer.0@0
          %8: f32 = if %2 {
            %9: f32, %10: f32, %11: f32 = query light_emission %4, %5, %6, %1, %1, %1, %1, %1, %1, %1, %1, %1, %1, %1
            yield %9
          } else {
            yield %3
          }
          %12: f32 = select %7, %8, %1
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %12
        }
    "#]].assert_eq(&text(body));
}

/// In the next iteration, the values that the loop's body defines are others: they can't be named.
#[test]
fn a_surface_of_the_next_iteration_is_not_named() {
    let body = "
        %x: f32 = loop (%a: f32 = %one) {
            %o: i32 = convert %a
            %r: f32, %g: f32, %b: f32 = query emission %o, %o, %o, SURFACE
            %dark: bool = occluded RAY
            %n: f32 = rand
            repeat %dark, %n
        }
        return state:rt_HitDistance@0 = %x";
    let stages = stages(body);
    let named: Vec<_> = stages.stages.iter().map(|it| (it.resumed_by, it.surface)).collect();
    let expected = [
        (ResumedBy::Start, Surface::None),
        (ResumedBy::Dispatch, Surface::Request),
        (ResumedBy::Occluded, Surface::None),
    ];
    assert_eq!(named, expected, "{stages}");
}

/// A path tracer: each search is in the loop, and its surface is used in the next iteration.
#[test]
fn a_loop_is_peeled_where_it_starts_with_the_surface() {
    let body = "
        %f: bool, %o: i32, %i: i32, %e: i32, %d: f32 = query nearest_hit RAY, %one
        %no: bool = constant false
        %lf: bool, %lo: i32, %li: i32, %le: i32, %light: f32, %weight: f32 =
            loop (%pf: bool = %f, %po: i32 = %o, %pi: i32 = %i, %pe: i32 = %e, %l: f32 = %one, %w: f32 = %one) {
            %again: bool, %nf: bool, %no2: i32, %ni: i32, %ne: i32, %nl: f32, %nw: f32 = if %pf {
                %x: f32, %y: f32, %z: f32 = query emission %po, %pi, %pe, SURFACE
                %l2: f32 = fma %x, %w, %l
                %dx: f32, %dy: f32, %dz: f32, %cx: f32, %cy: f32, %cz: f32, %pdf: f32, %index: f32 =
                    query sample_bsdf %po, %pi, %pe, SURFACE, VECTOR, %one
                %w2: f32 = multiply %w, %cx
                %qf: bool, %qo: i32, %qi: i32, %qe: i32, %qd: f32 =
                    query nearest_hit VECTOR, %dx, %dy, %dz, %one, %one
                %more: bool = constant true
                yield %more, %qf, %qo, %qi, %qe, %l2, %w2
            } else {
                yield %no, %pf, %po, %pi, %pe, %l, %w
            }
            repeat %again, %nf, %no2, %ni, %ne, %nl, %nw
        }
        return state:rt_HitDistance@0 = %light";
    let stages = stages(body);
    // The start; the first search; the search in the loop. No stage has a loop, and nothing is dispatched.
    assert_eq!(stages.stages.len(), 3, "{stages}");
    expect![[r#"
        stages Test.radiance
        slot 0: f32
        slot 1: f32

        stage 0: start
        function Test.radiance.0
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          return scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %1
        }

        stage 1: nearest_hit, surface answer
        function Test.radiance.1
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 0.0
          %1: i32 = constant -1
          %2: f32 = constant 1.0
          %3: i32 = constant 2
          %4: f32 = load state:rt_HitDistance@0
          %5: bool = load scratch:answer.0@0
          %6: i32 = load scratch:answer.1@0
          %7: i32 = load scratch:answer.2@0
          %8: i32 = load scratch:answer.3@0
          %9: f32, %10: i32, %11: f32, %12: f32, %13: f32, %14: f32, %15: f32 = if %5 {
            %16: f32, %17: f32, %18: f32 = query emission %6, %7, %8, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2
            %19: f32 = add %16, %2
            %20: f32, %21: f32, %22: f32, %23: f32, %24: f32, %25: f32, %26: f32, %27: f32 = query sample_bsdf %6, %7, %8, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2
            yield %4, %3, %19, %23, %20, %21, %22
          } else {
            yield %2, %1, %0, %0, %0, %0, %0
          }
          return scratch:frame.0@0 = %11, scratch:frame.1@0 = %12, scratch:request.0@0 = %2, scratch:request.1@0 = %2, scratch:request.2@0 = %2, scratch:request.3@0 = %13, scratch:request.4@0 = %14, scratch:request.5@0 = %15, scratch:request.6@0 = %2, scratch:request.7@0 = %2, scratch:next@0 = %10, state:rt_HitDistance@0 = %9
        }

        stage 2: nearest_hit, surface answer, live 0 1
        function Test.radiance.2
        scratch frame.0: f32[1]
        scratch frame.1: f32[1]
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 0.0
          %1: i32 = constant -1
          %2: f32 = constant 1.0
          %3: i32 = constant 2
          %4: f32 = load state:rt_HitDistance@0
          %5: f32 = load scratch:frame.0@0
          %6: f32 = load scratch:frame.1@0
          %7: bool = load scratch:answer.0@0
          %8: i32 = load scratch:answer.1@0
          %9: i32 = load scratch:answer.2@0
          %10: i32 = load scratch:answer.3@0
          %11: f32, %12: i32, %13: f32, %14: f32, %15: f32, %16: f32, %17: f32 = if %7 {
            %18: f32, %19: f32, %20: f32 = query emission %8, %9, %10, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2
            %21: f32 = fma %18, %6, %5
            %22: f32, %23: f32, %24: f32, %25: f32, %26: f32, %27: f32, %28: f32, %29: f32 = query sample_bsdf %8, %9, %10, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2, %2
            %30: f32 = multiply %6, %25
            yield %4, %3, %21, %30, %22, %23, %24
          } else {
            yield %5, %1, %0, %0, %0, %0, %0
          }
          return scratch:frame.0@0 = %13, scratch:frame.1@0 = %14, scratch:request.0@0 = %2, scratch:request.1@0 = %2, scratch:request.2@0 = %2, scratch:request.3@0 = %15, scratch:request.4@0 = %16, scratch:request.5@0 = %17, scratch:request.6@0 = %2, scratch:request.7@0 = %2, scratch:next@0 = %12, state:rt_HitDistance@0 = %11
        }
    "#]].assert_eq(&text(body));
}

/// A path tracer with one shadow ray at each surface. What follows its answer asks about that surface again.
const PATH_TRACER: &str = "
    %zero: f32 = constant 0.0
    %first: i32 = constant 0
    %step: i32 = constant 1
    %no: bool = constant false
    %far: f32 = constant inf
    %most: i32 = load member:n@0
    %ox: f32 = load state:rt_RayOrigin@0 %oy: f32 = load state:rt_RayOrigin@1 %oz: f32 = load state:rt_RayOrigin@2
    %dx: f32 = load state:rt_RayDirection@0 %dy: f32 = load state:rt_RayDirection@1
    %dz: f32 = load state:rt_RayDirection@2
    %rdepth: i32, %rlr: f32, %rlg: f32, %rlb: f32, %rwr: f32, %rwg: f32, %rwb: f32,
        %rpx: f32, %rpy: f32, %rpz: f32, %rqx: f32, %rqy: f32, %rqz: f32 = loop (
        %depth: i32 = %first, %lr: f32 = %zero, %lg: f32 = %zero, %lb: f32 = %zero,
        %wr: f32 = %one, %wg: f32 = %one, %wb: f32 = %one,
        %px: f32 = %ox, %py: f32 = %oy, %pz: f32 = %oz, %qx: f32 = %dx, %qy: f32 = %dy, %qz: f32 = %dz) {
        %hit: bool, %o: i32, %i: i32, %e: i32, %t: f32 =
            query nearest_hit %px, %py, %pz, %qx, %qy, %qz, %zero, %far
        %again: bool, %depth2: i32, %lr4: f32, %lg4: f32, %lb4: f32, %wr2: f32, %wg2: f32, %wb2: f32,
            %px2: f32, %py2: f32, %pz2: f32, %qx2: f32, %qy2: f32, %qz2: f32 = if %hit {
            %er: f32, %eg: f32, %eb: f32 =
                query emission %o, %i, %e, %t, %zero, %far, %px, %py, %pz, %qx, %qy, %qz, %zero, %zero
            %lr1: f32 = fma %wr, %er, %lr %lg1: f32 = fma %wg, %eg, %lg %lb1: f32 = fma %wb, %eb, %lb
            %x: f32, %y: f32, %z: f32, %gx: f32, %gy: f32, %gz: f32, %nx: f32, %ny: f32, %nz: f32,
                %u: f32, %v: f32, %u3: f32, %v3: f32, %w3: f32, %ux: f32, %uy: f32, %uz: f32,
                %vx: f32, %vy: f32, %vz: f32, %du: f32, %dv: f32, %offset: f32,
                %dsdu: f32, %dsdv: f32, %dtdu: f32, %dtdv: f32,
                %own0: f32, %own1: f32, %own2: f32, %own3: f32, %own4: f32, %own5: f32, %own6: f32, %own7: f32,
                %own8: f32, %own9: f32, %own10: f32, %own11: f32, %own12: f32, %own13: f32, %own14: f32, %own15: f32,
                %own16: f32, %own17: f32, %own18: f32, %own19: f32, %own20: f32, %own21: f32, %own22: f32, %own23: f32,
                %own24: f32, %own25: f32, %own26: f32, %own27: f32, %own28: f32, %own29: f32, %own30: f32, %own31: f32,
                %own32: f32, %own33: f32, %own34: f32, %own35: f32, %own36: f32, %own37: f32, %own38: f32, %own39: f32,
                %own40: f32, %own41: f32, %own42: f32, %own43: f32, %own44: f32, %own45: f32, %own46: f32, %own47: f32,
                %own48: f32, %own49: f32, %own50: f32, %own51: f32, %own52: f32, %own53: f32, %own54: f32, %own55: f32 =
                query surface_properties %o, %i, %e, %t, %zero, %far, %px, %py, %pz, %qx, %qy, %qz, %zero, %zero
            %s1: f32, %s2: f32 = query sample_pair %depth %s3: f32 = query sample %depth
            %lit: bool, %ax: f32, %ay: f32, %az: f32, %distance: f32, %cr: f32, %cg: f32, %cb: f32, %pdf: f32 =
                query sample_light %x, %y, %z, %gx, %gy, %gz, %nx, %ny, %nz, %offset, %s3
            %lr3: f32, %lg3: f32, %lb3: f32 = if %lit {
                %dark: bool = occluded %x, %y, %z, %ax, %ay, %az, %distance
                %lr2: f32, %lg2: f32, %lb2: f32 = if %dark { yield %lr1, %lg1, %lb1 } else {
                    %fr: f32, %fg: f32, %fb: f32 =
                        query bsdf %o, %i, %e, %t, %zero, %far, %px, %py, %pz, %qx, %qy, %qz, %zero, %zero, %ax, %ay, %az, %zero
                    %cx: f32 = multiply %ax, %nx %cxy: f32 = fma %ay, %ny, %cx %cosine: f32 = fma %az, %nz, %cxy
                    %scale: f32 = divide %cosine, %pdf
                    %kr: f32 = multiply %fr, %cr %kg: f32 = multiply %fg, %cg %kb: f32 = multiply %fb, %cb
                    %jr: f32 = multiply %kr, %scale %jg: f32 = multiply %kg, %scale %jb: f32 = multiply %kb, %scale
                    %ir: f32 = fma %jr, %wr, %lr1 %ig: f32 = fma %jg, %wg, %lg1 %ib: f32 = fma %jb, %wb, %lb1
                    yield %ir, %ig, %ib
                }
                yield %lr2, %lg2, %lb2
            } else { yield %lr1, %lg1, %lb1 }
            %bx: f32, %by: f32, %bz: f32, %br: f32, %bg: f32, %bb: f32, %bpdf: f32, %index: f32 =
                query sample_bsdf %o, %i, %e, %t, %zero, %far, %px, %py, %pz, %qx, %qy, %qz, %zero, %zero,
                    %s1, %s2, %s3, %zero
            %hr: f32 = divide %br, %bpdf %hg: f32 = divide %bg, %bpdf %hb: f32 = divide %bb, %bpdf
            %wr1: f32 = multiply %wr, %hr %wg1: f32 = multiply %wg, %hg %wb1: f32 = multiply %wb, %hb
            %next: i32 = add %depth, %step
            %deeper: bool = less %next, %most
            yield %deeper, %next, %lr3, %lg3, %lb3, %wr1, %wg1, %wb1, %x, %y, %z, %bx, %by, %bz
        } else {
            %kr0: f32, %kg0: f32, %kb0: f32 = query sky_emission %first, %px, %py, %pz, %qx, %qy, %qz
            %lr0: f32 = fma %wr, %kr0, %lr %lg0: f32 = fma %wg, %kg0, %lg %lb0: f32 = fma %wb, %kb0, %lb
            yield %no, %depth, %lr0, %lg0, %lb0, %wr, %wg, %wb, %px, %py, %pz, %qx, %qy, %qz
        }
        repeat %again, %depth2, %lr4, %lg4, %lb4, %wr2, %wg2, %wb2, %px2, %py2, %pz2, %qx2, %qy2, %qz2
    }
    return state:rt_RayOrigin@0 = %rlr, state:rt_RayOrigin@1 = %rlg, state:rt_RayOrigin@2 = %rlb";

/// Start, hit, and shadow ray: no dispatch, and no loop.
#[test]
fn sizes_of_a_path_tracer() {
    let stages = stages(PATH_TRACER);
    let heads = stages.to_string();
    let mut found: String = heads
        .lines()
        .filter(|line| line.starts_with("stage "))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(!heads.contains("loop ("), "{heads}");
    let sizes = stages.sizes();
    found.push_str(&format!("{} slots, {} bytes\n", sizes.slots, sizes.frame_bytes));
    for stage in sizes.stages {
        found.push_str(&format!("{stage:?}\n"));
    }
    expect![[r#"
        stage 0: start
        stage 1: nearest_hit, surface answer, live 0 1 2 3 4 5 6 7 8 9 10 11 12
        stage 2: occluded, surface request, live 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29
        30 slots, 120 bytes
        StageSizes { live: 0, changed: 13, operations: 11 }
        StageSizes { live: 13, changed: 30, operations: 54 }
        StageSizes { live: 30, changed: 13, operations: 67 }
    "#]].assert_eq(&found);
}

/// A call of `shade` is a suspension, and no query about the surface of its stage: others compute it.
#[test]
fn shade_suspends() {
    let body = "
        %f: bool, %o: i32, %i: i32, %e: i32, %d: f32 = query nearest_hit RAY, %one
        %a: f32, %b: f32, %c: f32 = query shade %o, %i, %e, SURFACE
        %s: f32 = add %a, %d
        return state:rt_HitDistance@0 = %s";
    expect![[r#"
        stages Test.radiance
        slot 0: f32

        stage 0: start
        function Test.radiance.0
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 1
          return scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:next@0 = %1
        }

        stage 1: nearest_hit
        function Test.radiance.1
        scratch answer.0: bool[1]
        scratch answer.1: i32[1]
        scratch answer.2: i32[1]
        scratch answer.3: i32[1]
        scratch answer.4: f32[1]
        scratch frame.0: f32[1]
        scratch next: i32[1]
        {
          %0: f32 = constant 1.0
          %1: i32 = constant 2
          %2: i32 = load scratch:answer.1@0
          %3: i32 = load scratch:answer.2@0
          %4: i32 = load scratch:answer.3@0
          %5: f32 = load scratch:answer.4@0
          return scratch:frame.0@0 = %5, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.7@0 = %0, scratch:request.8@0 = %0, scratch:request.9@0 = %0, scratch:request.10@0 = %0, scratch:request.11@0 = %2, scratch:request.12@0 = %3, scratch:request.13@0 = %4, scratch:next@0 = %1
        }

        stage 2: shade, live 0
        function Test.radiance.2
        scratch frame.0: f32[1]
        scratch answer.0: f32[1]
        scratch answer.1: f32[1]
        scratch answer.2: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = load scratch:frame.0@0
          %2: f32 = load scratch:answer.0@0
          %3: f32 = add %1, %2
          return scratch:next@0 = %0, state:rt_HitDistance@0 = %3
        }
    "#]].assert_eq(&text(body));
}

/// A material's loop over the lights suspends at each sample.
#[test]
fn light_samples_suspend() {
    let body = "
        %count: i32 = light_count
        %zero: i32 = constant 0
        %i: i32, %sum: f32 = loop (%at: i32 = %zero, %before: f32 = %one) {
            %lit: bool, %x: f32, %y: f32, %z: f32, %far: f32, %r: f32, %g: f32, %b: f32, %pdf: f32 =
                light_sample %at, %one, %one, %one, %one, %one, %one, %one
            %after: f32 = add %before, %r
            %step: i32 = constant 1
            %next: i32 = add %at, %step
            %again: bool = less %next, %count
            repeat %again, %next, %after
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
          return scratch:frame.0@0 = %1, scratch:frame.1@0 = %0, scratch:request.0@0 = %0, scratch:request.1@0 = %0, scratch:request.2@0 = %0, scratch:request.3@0 = %0, scratch:request.4@0 = %0, scratch:request.5@0 = %0, scratch:request.6@0 = %0, scratch:request.11@0 = %1, scratch:next@0 = %2
        }

        stage 1: light_sample, live 0 1
        function Test.radiance.1
        scratch frame.0: i32[1]
        scratch frame.1: f32[1]
        scratch answer.0: bool[1]
        scratch answer.1: f32[1]
        scratch answer.2: f32[1]
        scratch answer.3: f32[1]
        scratch answer.4: f32[1]
        scratch answer.5: f32[1]
        scratch answer.6: f32[1]
        scratch answer.7: f32[1]
        scratch answer.8: f32[1]
        scratch next: i32[1]
        {
          %0: i32 = constant -1
          %1: f32 = constant 1.0
          %2: i32 = constant 1
          %3: f32 = load state:rt_HitDistance@0
          %4: i32 = load scratch:frame.0@0
          %5: f32 = load scratch:frame.1@0
          %6: i32 = light_count
          %7: f32 = load scratch:answer.5@0
          %8: f32 = add %5, %7
          %9: i32 = add %4, %2
          %10: bool = less %9, %6
          %11: f32, %12: i32 = if %10 {
            yield %3, %2
          } else {
            yield %8, %0
          }
          return scratch:frame.0@0 = %9, scratch:frame.1@0 = %8, scratch:request.0@0 = %1, scratch:request.1@0 = %1, scratch:request.2@0 = %1, scratch:request.3@0 = %1, scratch:request.4@0 = %1, scratch:request.5@0 = %1, scratch:request.6@0 = %1, scratch:request.11@0 = %9, scratch:next@0 = %12, state:rt_HitDistance@0 = %11
        }
    "#]].assert_eq(&text(body));
}
