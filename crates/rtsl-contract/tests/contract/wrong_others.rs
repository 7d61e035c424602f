//! Lights, cameras and textures with one mistake each: the contract that it breaks finds it.

use expect_test::expect;

use crate::common::finds;

/// A sky with parts to be replaced.
fn sky(direction: &str, density: &str, radiance: &str) -> String {
    format!(
        "class Sky : rt_Light;
        const float PI = 3.14159265;
        color radiance(vec3 d) {{ return color(1.0 + 0.5 * normalize(d).y); }}
        void illumination() {{
            rt_LightDirection = {direction};
            rt_LightColor = {radiance};
            evaluatePDF();
        }}
        void evaluatePDF() {{ rt_PDF = {density}; }}
        void emission() {{ rt_EmissionColor = radiance(rt_RayDirection); }}"
    )
}

const UNIFORM: &str = "sampleUniformSphere(vec2(rand(), rand()))";
const SHINES: &str = "radiance(rt_LightDirection)";

#[test]
fn a_sky_is_right() {
    finds(
        &sky(UNIFORM, "0.25 / PI", SHINES),
        expect![[r#"
        keeps all
    "#]],
    );
}

#[test]
fn a_sky_with_the_density_of_half_a_sphere() {
    finds(
        &sky(UNIFORM, "0.5 / PI", SHINES),
        expect![[r#"
            breaks
              BROKEN  the density integrates to the part of samples that have one
                      at [0.5, 1.5, -2]: the density's integral is 2.0000, where 1.0000 of the samples have a density
                      (4 of 4 tests)
                      look at: densities count per solid angle; rt_PDF 0 means a light without extent, or that nothing was sampled
        "#]],
    );
}

#[test]
fn a_sky_that_is_sampled_by_another_density() {
    finds(
        &sky(UNIFORM, "(1.0 + rt_LightDirection.z) * 0.25 / PI", SHINES),
        expect![[r#"
            breaks
              BROKEN  samples are distributed as evaluatePDF says
                      at [0.5, 1.5, -2]: chi-square is 19781 in 255 cells, where chance stays below 396; around (-0.091, -0.375, -0.923) there are 749 samples instead of 47.5
                      (4 of 4 tests)
                      inputs of evaluatePDF: rt_LightDirection=-0.09086432,-0.375,-0.92256093
                      look at: densities count per solid angle; rt_PDF 0 means a light without extent, or that nothing was sampled
        "#]],
    );
}

#[test]
fn a_sky_that_is_not_what_it_looks_like() {
    finds(
        &sky(UNIFORM, "0.25 / PI", "radiance(-rt_LightDirection)"),
        expect![[r#"
        breaks
          BROKEN  samples are as bright as rays in their direction
                  towards [0.20654632, 0.075183585, 0.975544] illumination gives [0.9624082, 0.9624082, 0.9624082], emission [1.0375918, 1.0375918, 1.0375918]
                  (79833 of 80000 tests)
                  inputs of emission: rt_RayDirection=0.20654632,0.075183585,0.975544
                  look at: let illumination and emission call one function for the radiance; rt_RayDirection points as rt_LightDirection does
    "#]],
    );
}

#[test]
fn a_lamp_whose_direction_is_not_scaled() {
    let lamp = "class Lamp : rt_Light;
        void illumination() {
            rt_LightDirection = vec3(1.0, 3.0, 2.0) - rt_HitPoint;
            rt_LightDistance = length(rt_LightDirection);
            rt_LightColor = color(1.0 / dot(rt_LightDirection, rt_LightDirection));
        }";
    finds(
        lamp,
        expect![[r#"
        breaks
          BROKEN  directions have unit length
                  illumination gives direction [0.5, 1.5, 4], whose length is 4.3011627
                  (80000 of 80000 tests)
                  inputs of illumination: rt_HitPoint=0.5,1.5,-2
                  look at: illumination: is something left to normalize?
    "#]],
    );
}

/// A rectangle that gives light, with what rays meet of it.
fn panel(others: &str) -> String {
    format!(
        "class Panel : rt_Light;
        public vec3 corner = vec3(-1.0, 3.0, -1.0);
        void illumination() {{
            vec3 d = corner + vec3(2.0 * rand(), 0.0, 2.0 * rand()) - rt_HitPoint;
            rt_LightDistance = length(d);
            rt_LightDirection = d / rt_LightDistance;
            if (d.y <= 0.0) return;
            rt_LightColor = color(10.0);
            rt_PDF = dot(d, d) / (rt_LightDirection.y * 4.0);
        }}
        {others}"
    )
}

#[test]
fn a_panel_that_no_ray_meets() {
    finds(
        &panel(""),
        expect![[r#"
            keeps all
        "#]],
    );
}

#[test]
fn a_panel_near_by_that_rays_meet_everywhere() {
    finds(
        &panel("void emission() { rt_EmissionColor = color(2.0); }"),
        expect![[r#"
        breaks
          BROKEN  rays find samples with a density at infinity alone
                  illumination gives [10, 10, 10] at distance 2.6828434; a ray towards [-0.40747878, 0.6709299, 0.6195272] goes on beyond, and emission gives [2, 2, 2] for it
                  (12288 of 12288 tests)
                  inputs of illumination: rt_HitPoint=0.4,1.2,-1.5
                  look at: emission is for rays that leave the scene: what they find is infinitely far away and has evaluatePDF; leave out emission, and rt_PDF does for samples alone, or let a shape emit what is near
    "#]],
    );
}

/// The radiance of `emission` is that of the panel, and of no ray that leaves the scene.
#[test]
fn a_panel_near_by_that_rays_seem_to_meet() {
    let others = "bool meets(vec3 from, vec3 d) {
            vec2 at = (from + d * ((corner.y - from.y) / d.y) - corner).xz;
            return d.y > 0.0 && corner.y > from.y && min(at.x, at.y) >= 0.0 && max(at.x, at.y) <= 2.0;
        }
        void evaluatePDF() {
            float d = (corner.y - rt_HitPoint.y) / rt_LightDirection.y;
            rt_PDF = meets(rt_HitPoint, rt_LightDirection) ? d * d / (rt_LightDirection.y * 4.0) : 0.0;
        }
        void emission() { if (meets(rt_RayOrigin, rt_RayDirection)) rt_EmissionColor = color(10.0); }";
    finds(
        &panel(others),
        expect![[r#"
        breaks
          BROKEN  rays find samples with a density at infinity alone
                  illumination gives [10, 10, 10] at distance 2.6828434; a ray towards [-0.40747878, 0.6709299, 0.6195272] goes on beyond, and emission gives [10, 10, 10] for it
                  (12288 of 12288 tests)
                  inputs of illumination: rt_HitPoint=0.4,1.2,-1.5
                  look at: emission is for rays that leave the scene: what they find is infinitely far away and has evaluatePDF; leave out emission, and rt_PDF does for samples alone, or let a shape emit what is near
    "#]],
    );
    let without = others.split("void emission").next().unwrap();
    finds(
        &panel(without),
        expect![[r#"
        keeps all
    "#]],
    );
}

#[test]
fn a_sky_that_nobody_can_weigh() {
    let sky = "class Sky : rt_Light;
        void illumination() {
            rt_LightDirection = sampleUniformSphere(vec2(rand(), rand()));
            rt_LightColor = color(1.0);
            rt_PDF = 0.25 / 3.14159265;
        }
        void emission() { rt_EmissionColor = color(1.0); }";
    finds(
        sky,
        expect![[r#"
        breaks
          BROKEN  rays find samples with a density at infinity alone
                  illumination gives a sample of density 0.07957747, and rays meet the light, but the class has no evaluatePDF to weigh the two by
                  (12288 of 12288 tests)
                  look at: emission is for rays that leave the scene: what they find is infinitely far away and has evaluatePDF; leave out emission, and rt_PDF does for samples alone, or let a shape emit what is near
    "#]],
    );
}

#[test]
fn a_camera_whose_rays_end_at_the_edge() {
    let fish_eye = "class FishEye : rt_Camera;
        void generateRay() {
            vec2 p = 2.0 * rt_ScreenCoord - 1.0;
            rt_RayDirection = vec3(p, sqrt(1.0 - dot(p, p)));
        }";
    finds(
        fish_eye,
        expect![[r#"
        breaks
          BROKEN  every place of image and lens has a ray
                  generateRay gives origin [0, 0, 0] and direction [-0.5, -1, NaN]
                  (3435 of 12288 tests)
                  inputs of generateRay: rt_ScreenCoord=0.25,0
                  look at: edges and corners of the image, and of the lens
    "#]],
    );
}

#[test]
fn a_texture_that_divides_by_the_filter() {
    let stripes = "class Stripes : rt_Texture;
        void lookup() { rt_TextureColor = color(clamp(sin(rt_TextureUV.x) / rt_du, 0.0, 1.0)); }";
    finds(
        stripes,
        expect![[r#"
            breaks
              BROKEN  values are numbers, whatever the filter
                      lookup gives colour [NaN, NaN, NaN] and value NaN
                      (1131 of 20480 tests)
                      inputs of lookup: rt_du=0 rt_TextureUV=0,-1
                      look at: divisions by rt_du and rt_dv, which may be 0, and numbers far from 0
              BROKEN  wide filters tend to the mean
                      lookups between 0 and 16 have the mean 0.5947 and differ by 0.4910 from it; with filters 4 wide these are 0.0944 and 0.0980
                      (1 of 1 tests)
                      look at: the filter's width in texture coordinates is rt_du times rt_dsdu and so on
        "#]],
    );
}

#[test]
fn a_filter_that_darkens() {
    let stripes = "class Stripes : rt_Texture;
        void lookup() {
            float sharp = fract(rt_TextureUV.x) < 0.5 ? 1.0 : 0.0;
            rt_TextureColor = color(mix(sharp, 0.2, clamp(rt_du * rt_dsdu, 0.0, 1.0)));
        }";
    finds(
        stripes,
        expect![[r#"
            breaks
              BROKEN  wide filters tend to the mean
                      lookups between 0 and 16 have the mean 0.4927 and differ by 0.5000 from it; with filters 4 wide these are 0.2000 and 0.0000
                      (1 of 1 tests)
                      look at: the filter's width in texture coordinates is rt_du times rt_dsdu and so on
        "#]],
    );
    finds(
        &stripes.replace("0.2", "0.5"),
        expect![[r#"
        keeps all
    "#]],
    );
}

/// Follows light for three surfaces, each of which emits `emitted`.
fn follower(emitted: &str) -> String {
    format!(
        "class Follower : rt_Integrator;
        void radiance() {{
            color seen = color(1.0);
            rt_Surface surface = nearestHit();
            for (int count = 0; surface.found && count < 3; ++count) {{
                rt_SampleColor += seen * {emitted};
                rt_BSDFSample next = surface.sampleBSDF(vec3(sample2D(count), sample1D(count)));
                seen *= next.weight;
                surface = surface.follow(next.direction, next.density);
            }}
        }}"
    )
}

#[test]
fn an_integrator_is_right() {
    finds(
        &follower("surface.emission()"),
        expect![[r#"
        keeps all
    "#]],
    );
}

#[test]
fn an_integrator_that_counts_light_twice() {
    finds(
        &follower("2.0 * surface.emission()"),
        expect![[r#"
        breaks
          BROKEN  no more light is found than is emitted
                  radiance gives 1.7500 on average inside a sphere whose radiance is at most 1
                  (1 of 1 tests)
                  look at: light that is counted twice, by emission() and by sampleLight(), or a division by a density too many
    "#]],
    );
}
