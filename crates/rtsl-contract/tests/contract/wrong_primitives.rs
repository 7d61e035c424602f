//! Primitives with one mistake each: the contract that it breaks finds it.

use expect_test::expect;

use crate::common::finds;

/// A ball with parts to be replaced.
fn ball(first: &str, bounds: &str, normal: &str, area: &str) -> String {
    format!(
        "class Ball : rt_Primitive;
        public float radius = 1.5;
        const float PI = 3.14159265;
        void intersect() {{
            float a = dot(rt_RayDirection, rt_RayDirection);
            float b = dot(rt_RayOrigin, rt_RayDirection);
            vec3 nearest = rt_RayOrigin - rt_RayDirection * (b / a);
            float discriminant = radius * radius - dot(nearest, nearest);
            if (discriminant < 0.0) return;
            float root = sqrt(a * discriminant);
            {first}
        }}
        void computeBounds() {{ rt_BoundMin = vec3(-{bounds}); rt_BoundMax = vec3({bounds}); }}
        void computeNormal() {{ rt_GeometricNormal = {normal}; }}
        void generateSample() {{
            rt_GeometricNormal = sampleUniformSphere(vec2(rand(), rand()));
            rt_HitPoint = radius * rt_GeometricNormal;
            samplePDF();
        }}
        void samplePDF() {{
            vec3 w = rt_HitPoint - rt_RayOrigin;
            float square = dot(w, w);
            float cosine = abs(dot(normalize(rt_HitPoint), w)) / sqrt(square);
            rt_PDF = square / (cosine * {area});
        }}"
    )
}

const BOTH: &str = "if (!hit((-b - root) / a)) hit((root - b) / a);";
const AREA: &str = "4.0 * PI * radius * radius";
const NORMAL: &str = "rt_HitPoint";

#[test]
fn a_ball_is_right() {
    finds(
        &ball(BOTH, "radius", NORMAL, AREA),
        expect![[r#"
        keeps all
    "#]],
    );
}

#[test]
fn bounds_that_are_too_small() {
    finds(
        &ball(BOTH, "0.9 * radius", NORMAL, AREA),
        expect![[r#"
        breaks
          BROKEN  hits lie within the bounds
                  the hit at [1.358924, -0.18941987, 0.60617304] lies 0.008924127 outside of the box from [-1.3499999, -1.3499999, -1.3499999] to [1.3499999, 1.3499999, 1.3499999]
                  (785 of 2509 tests)
                  inputs of intersect: rt_RayOrigin=1.6439428,-0.21048777,1.0105126 rt_RayDirection=-1.1525893,0.08519662,-1.635111 rt_Epsilon=0.00011677762 rt_HitDistance=inf
                  look at: computeBounds: an extent, a half size taken for a whole one, or a box without its centre
    "#]],
    );
}

#[test]
fn a_normal_that_points_inward() {
    finds(
        &ball(BOTH, "radius", "-rt_HitPoint", AREA),
        expect![[r#"
        breaks
          BROKEN  normals point outward
                  a ray from outside first hits at [-1.3990346, -0.5406552, -0.019875674], where the normal [0.93268955, 0.3604367, 0.013250446] points inward
                  (969 of 969 tests)
                  inputs of intersect: rt_RayOrigin=-10.386411,-2.9084487,-1.5366133 rt_RayDirection=0.95437795,0.25143823,0.1610638 rt_Epsilon=0.00025980762 rt_HitDistance=inf
                  look at: the sign in computeNormal, or the order of a cross product
          BROKEN  normals of samples are those of computeNormal
                  at [1.4384962, -0.35145116, -0.23918778] generateSample says the normal is [0.9589975, -0.23430076, -0.15945852], computeNormal [-0.95899755, 0.23430064, 0.1594585]
                  (32527 of 32527 tests)
                  look at: the sign of rt_GeometricNormal in generateSample
    "#]],
    );
}

#[test]
fn a_normal_of_another_surface() {
    finds(
        &ball(BOTH, "radius", "rt_HitPoint * vec3(1.0, 0.8, 1.0)", AREA),
        expect![[r#"
            breaks
              BROKEN  the normal is the surface's
                      at [-1.3990346, -0.5406552, -0.019875674] the normal is [-0.9552963, -0.29533845, -0.0135716135], neighbouring hits say [-0.93267465, -0.36047685, -0.013207994]
                      (668 of 795 tests)
                      inputs of intersect: rt_RayOrigin=-10.386411,-2.9084487,-1.5366133 rt_RayDirection=0.95437795,0.25143823,0.1610638 rt_Epsilon=0.00025980762 rt_HitDistance=inf
                      look at: computeNormal: rt_HitPoint is in the primitive's space; has scaling been undone?
        "#]],
    );
}

#[test]
fn the_farther_hit_first() {
    let both = "if (!hit((root - b) / a)) hit((-b - root) / a);";
    finds(
        &ball(both, "radius", NORMAL, AREA),
        expect![[r#"
        breaks
          BROKEN  the nearest hit is found, within the ray's limits
                  with no limit the nearest hit is at 1.602029, with rt_HitDistance 1.6004269 there is one at 0.37394187
                  (1861 of 4238 tests)
                  inputs of intersect: rt_RayOrigin=1.8266033,-0.23387532,1.1227919 rt_RayDirection=-1.1525893,0.08519662,-1.635111 rt_Epsilon=0.00012975292 rt_HitDistance=1.6004269
                  look at: offer every hit to hit() and let it choose: it knows rt_Epsilon and rt_HitDistance
          BROKEN  hits are found from everywhere
                  a ray hits at [-1.1101136, -0.3395828, -0.94991094]; one towards that point from [-1.739832, -4.2173047, -1.9968188] finds one at 1.3642427
                  (854 of 2119 tests)
                  inputs of intersect: rt_RayOrigin=-1.739832,-4.2173047,-1.9968188 rt_RayDirection=0.62971836,3.877722,1.0469079 rt_Epsilon=0.00006390352 rt_HitDistance=inf
                  look at: intersect: a hit that is none, or one that is missed
          BROKEN  sampled points lie on the surface
                  from [5.3008285, 6.4441442, -6.1946936]: generateSample gives [1.4384962, -0.35145116, -0.23918778] with density 10.962787; a ray towards it finds a hit at 1.0951086 of the way
                  (12219 of 80000 tests)
                  inputs of intersect: rt_RayOrigin=5.3008285,6.4441442,-6.1946936 rt_RayDirection=-3.8623323,-6.795595,5.955506 rt_Epsilon=0.00002643871 rt_HitDistance=inf
                  look at: generateSample: rt_HitPoint is a point in the primitive's space
    "#]],
    );
}

#[test]
fn a_direction_taken_for_one_of_unit_length() {
    finds(
        &ball("if (!hit(-b - root)) hit(root - b);", "radius", NORMAL, AREA),
        expect![[r#"
            breaks
              BROKEN  hits lie within the bounds
                      the hit at [-15.7630415, 5.052097, -2.7256608] lies 14.2630415 outside of the box from [-1.5, -1.5, -1.5] to [1.5, 1.5, 1.5]
                      (1626 of 2120 tests)
                      inputs of intersect: rt_RayOrigin=7.1886015,-3.3931713,0.055788543 rt_RayDirection=-1.7678745,0.65050566,-0.21424407 rt_Epsilon=0.00013703654 rt_HitDistance=inf
                      look at: computeBounds: an extent, a half size taken for a whole one, or a box without its centre
              BROKEN  directions may have any length
                      the hit is one at 1.4992483; with a direction 3.7 times as long it is one at 5.5472183
                      (2119 of 2119 tests)
                      inputs of intersect: rt_RayOrigin=1.8266033,-0.23387532,1.1227919 rt_RayDirection=-1.1525893,0.08519662,-1.635111 rt_Epsilon=0.00012975292 rt_HitDistance=inf
                      look at: the parameter of a hit counts in units of rt_RayDirection's length; divide by its square where you solve for it
              BROKEN  hits are found from everywhere
                      a ray hits at [0.098585755, -0.10614443, -1.3286453]; one towards that point from [-6.513146, -5.2665734, 3.228478] finds one at 75.999084
                      (2119 of 2119 tests)
                      inputs of intersect: rt_RayOrigin=-6.513146,-5.2665734,3.228478 rt_RayDirection=6.6117315,5.160429,-4.557123 rt_Epsilon=0.000027218435 rt_HitDistance=inf
                      look at: intersect: a hit that is none, or one that is missed
              BROKEN  rays from within find the far side
                      rays from outside hit at [-0.8344992, 1.3391137, -0.57403207] and, against each other, at [-0.820229, 0.29118928, 1.2216514]; one from between them to the latter finds one at 1.0807077
                      (423 of 762 tests)
                      inputs of intersect: rt_RayOrigin=-0.8273641,0.8151515,0.32380968 rt_RayDirection=0.007135093,-0.5239622,0.89784175 rt_Epsilon=0.00024991823 rt_HitDistance=inf
                      look at: intersect: offer the farther hit where the nearer one is refused, as in `if (!hit(near)) hit(far);`
              BROKEN  sampled points lie on the surface
                      from [5.3008285, 6.4441442, -6.1946936]: generateSample gives [0.8277012, -0.81876636, 0.94579715] with density 8.116375; a ray towards it finds a hit at 105.75001 of the way
                      (73979 of 80000 tests)
                      inputs of intersect: rt_RayOrigin=5.3008285,6.4441442,-6.1946936 rt_RayDirection=-4.4731274,-7.262911,7.1404905 rt_Epsilon=0.00002335541 rt_HitDistance=inf
                      look at: generateSample: rt_HitPoint is a point in the primitive's space
              BROKEN  the density integrates to the part of samples that are seen
                      from [-1.7227691, -2.0943468, 2.0132754]: the density's integral is 0.2352, where 0.0000 of the samples are seen
                      (2 of 4 tests)
                      inputs of samplePDF: rt_RayOrigin=-1.7227691,-2.0943468,2.0132754 rt_HitPoint=0,0,0
                      look at: densities count per solid angle: one over the area, times the distance squared, over the cosine at the light
        "#]],
    );
}

#[test]
fn a_density_by_a_wrong_area() {
    finds(
        &ball(BOTH, "radius", NORMAL, "2.0 * PI * radius * radius"),
        expect![[r#"
            breaks
              BROKEN  the density integrates to the part of samples that are seen
                      from [5.3008285, 6.4441442, -6.1946936]: the density's integral is 0.7580, where 0.3767 of the samples are seen
                      (4 of 4 tests)
                      inputs of samplePDF: rt_RayOrigin=5.3008285,6.4441442,-6.1946936 rt_HitPoint=0.78089505,1.013102,-0.7834698
                      look at: densities count per solid angle: one over the area, times the distance squared, over the cosine at the light
        "#]],
    );
}

#[test]
fn a_density_without_its_cosine() {
    finds(
        &ball(BOTH, "radius", NORMAL, "1.0 / cosine * 4.0 * PI * radius * radius"),
        expect![[r#"
            breaks
              BROKEN  the density integrates to the part of samples that are seen
                      from [5.3008285, 6.4441442, -6.1946936]: the density's integral is 0.2008, where 0.3767 of the samples are seen
                      (4 of 4 tests)
                      inputs of samplePDF: rt_RayOrigin=5.3008285,6.4441442,-6.1946936 rt_HitPoint=0,0,0
                      look at: densities count per solid angle: one over the area, times the distance squared, over the cosine at the light
              BROKEN  samples are distributed as samplePDF says
                      from [5.3008285, 6.4441442, -6.1946936]: chi-square is 2295 in 286 cells, where chance stays below 434; around (-0.628, -0.579, 0.520) there are 127 samples instead of 53.2
                      (2 of 4 tests)
                      inputs of samplePDF: rt_RayOrigin=5.3008285,6.4441442,-6.1946936 rt_HitPoint=0,0,0
                      look at: densities count per solid angle: one over the area, times the distance squared, over the cosine at the light
        "#]],
    );
}

#[test]
fn a_ball_without_its_far_root() {
    finds(
        &ball("hit((-b - root) / a);", "radius", NORMAL, AREA),
        expect![[r#"
        breaks
          BROKEN  rays from within find the far side
                  rays from outside hit at [1.3956019, -0.20201674, 0.51135546] and, against each other, at [-0.019878173, -0.097387865, -1.4967031]; one from between them to the latter finds none
                  (1858 of 1858 tests)
                  inputs of intersect: rt_RayOrigin=0.68786186,-0.14970231,-0.49267384 rt_RayDirection=-0.70774,0.052314438,-1.0040293 rt_Epsilon=0.000211309 rt_HitDistance=inf
                  look at: intersect: offer the farther hit where the nearer one is refused, as in `if (!hit(near)) hit(far);`
          BROKEN  sampled points lie on the surface
                  from [-0.1574672, 0.26244533, 0.41991252]: generateSample gives [-0.3267698, -1.4169421, -0.3680985] with density 0.12584126; a ray towards it finds nothing
                  (20000 of 80000 tests)
                  inputs of intersect: rt_RayOrigin=-0.1574672,0.26244533,0.41991252 rt_RayDirection=-0.1693026,-1.6793875,-0.788011 rt_Epsilon=0.0001394727 rt_HitDistance=inf
                  look at: generateSample: rt_HitPoint is a point in the primitive's space
    "#]],
    );
}

#[test]
fn a_box_without_its_exit() {
    let text = "class Box : rt_Primitive;
        void intersect() {
            vec3 a = (vec3(-1.0) - rt_RayOrigin) * rt_InverseRayDirection;
            vec3 b = (vec3(1.0) - rt_RayOrigin) * rt_InverseRayDirection;
            vec3 near = min(a, b), far = max(a, b);
            float entry = max(near.x, max(near.y, near.z));
            if (entry <= min(far.x, min(far.y, far.z))) hit(entry);
        }
        void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }";
    finds(
        text,
        expect![[r#"
        breaks
          BROKEN  rays from within find the far side
                  rays from outside hit at [-1.0000001, 0.9408984, -0.84161] and, against each other, at [1, 0.9408984, -0.84161]; one from between them to the latter finds none
                  (2662 of 2662 tests)
                  inputs of intersect: rt_RayOrigin=-0.000000059604645,0.9408984,-0.84161 rt_InverseRayDirection=1,inf,inf rt_Epsilon=0.00017320509 rt_HitDistance=inf
                  look at: intersect: offer the farther hit where the nearer one is refused, as in `if (!hit(near)) hit(far);`
    "#]],
    );
}

/// The part of one shape outside of another, by the nearest hits alone. With two equal shapes it would be empty, and so
/// without a mistake.
#[test]
fn a_difference_of_two_shapes_without_its_inner_side() {
    let text = "class Outside : rt_Primitive;
        public rt_Primitive first;
        public rt_Primitive second;
        void intersect() {
            float a = first.intersect(rt_HitDistance = 1e30), b = second.intersect(rt_HitDistance = 1e30);
            if (a < b) hit(first.intersect());
        }
        void computeNormal() { rt_GeometricNormal = first.computeNormal(); }
        void computeBounds() { rt_BoundMin = first.computeBounds(); }";
    finds(
        text,
        expect![[r#"
        breaks
          BROKEN  hits are found from everywhere
                  a ray hits at [0.3462485, -0.6948421, 0.6303225]; one towards that point from [-2.344063, 0.38408634, 2.8030746] finds none
                  (332 of 1396 tests)
                  inputs of intersect: rt_RayOrigin=-2.344063,0.38408634,2.8030746 rt_RayDirection=2.6903114,-1.0789285,-2.172752 rt_InverseRayDirection=0.3717042,-0.9268455,-0.46024582 rt_Epsilon=0.00004781331 rt_HitDistance=inf
                  look at: intersect: a hit that is none, or one that is missed
          BROKEN  rays from within find the far side
                  rays from outside hit at [0.93040127, -0.13467783, 0.3409037] and, against each other, at [-0.013252207, -0.064925246, -0.9978022]; one from between them to the latter finds none
                  (649 of 890 tests)
                  inputs of intersect: rt_RayOrigin=0.45857453,-0.09980154,-0.32844925 rt_RayDirection=-0.47182673,0.03487629,-0.66935295 rt_InverseRayDirection=-2.1194222,28.672773,-1.4939802 rt_Epsilon=0.00021130899 rt_HitDistance=inf
                  look at: intersect: offer the farther hit where the nearer one is refused, as in `if (!hit(near)) hit(far);`
    "#]],
    );
}

/// Coordinates that jump have no derivatives. The class has no `computeDerivatives` that could be wrong.
#[test]
fn coordinates_without_derivatives() {
    let text = "class Steps : rt_Primitive;
        void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
        void computeTextureCoordinates() { rt_TextureUV = rt_HitPoint.xy + 0.01 * floor(100.0 * rt_HitPoint.yx); }";
    finds(
        text,
        expect![[r#"
        breaks
          BROKEN  derivatives are those of the texture coordinates
                  at [-0.004179671, -1.1584533, -0.00000011133659] a step of [0.06002617, 0.059818983] in texture coordinates is one of [0.060026214, -0.0001809597, 0.00000003057488] in space; rt_dPdu and rt_dPdv say [0.06002617, 0.059818983, 0]
                  (978 of 978 tests)
                  inputs of intersect: rt_RayOrigin=0.13162069,-2.095384,4.5704694 rt_RayDirection=-0.029094938,0.20073536,-0.97921336 rt_Epsilon=0.0003 rt_HitDistance=inf
                  look at: computeDerivatives: the factor of an angle, such as 2 pi for a whole turn, or exchanged directions; for a class without it, computeTextureCoordinates, from which they follow
    "#]],
    );
}

/// Coordinates that `intersect` leaves in scratch have the derivatives of those that are computed from the point.
#[test]
fn coordinates_by_scratch_are_right() {
    let text = "class Square : rt_Primitive;
        scratch vec2 where;
        void intersect() {
            float t = -rt_RayOrigin.z / rt_RayDirection.z;
            vec2 p = (rt_RayOrigin + t * rt_RayDirection).xy;
            if (abs(p.x) <= 1.0 && abs(p.y) <= 1.0 && hit(t)) where = p;
        }
        void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
        void computeTextureCoordinates() { rt_TextureUV = vec2(0.01 * where.x, 3.0 * where.y + where.x); }
        void computeBounds() { rt_BoundMin = vec3(-1.0, -1.0, 0.0); rt_BoundMax = vec3(1.0, 1.0, 0.0); }";
    finds(text, expect![["keeps all\n"]]);
}
