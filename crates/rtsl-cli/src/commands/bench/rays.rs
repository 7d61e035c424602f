//! Random rays with values as a host would set them: they come from a distance towards the neighbourhood of the origin,
//! normals have unit length, and so on.

use rtsl::{LaneBlock, Role, StateVariable};

use super::random::{Random, Vector};

/// The distance of origins.
const DISTANCE: f32 = 4.0;
/// The radius of the ball at which rays aim.
const NEIGHBOURHOOD: f32 = 1.25;

/// One ray with all properties of its hit.
#[derive(Clone, Debug)]
pub struct Ray {
    origin: Vector,
    direction: Vector,
    hit_distance: f32,
    hit_point: Vector,
    geometric_normal: Vector,
    shading_normal: Vector,
    tangent: Vector,
    light_direction: Vector,
    texture_uv: [f32; 2],
    texture_uvw: [f32; 3],
    filter_width: [f32; 2],
    /// Uniform numbers in [0,1).
    seeds: [f32; 3],
}

impl Ray {
    /// Returns a ray for methods of this role. Rays of primitives may miss and usually have no hit yet; those of other
    /// roles have a hit point.
    pub fn random(random: &mut Random, role: Role, origin: Option<Vector>) -> Ray {
        let origin = origin.unwrap_or_else(|| Ray::random_origin(random));
        let target = random.in_ball(NEIGHBOURHOOD);
        let direction = target.plus(origin.times(-1.0)).normalized();
        let hit_distance = match role {
            Role::Primitive if random.one_in(4) => random.between(0.0, 2.0 * DISTANCE),
            Role::Primitive | Role::Integrator => f32::INFINITY,
            Role::Camera | Role::Texture | Role::Light | Role::Material => {
                target.plus(origin.times(-1.0)).dot(direction)
            }
        };
        let facing = direction.times(-1.0);
        let mut normal = random.direction();
        if !random.one_in(8) {
            normal = normal.on_side_of(facing);
        }
        let shading_normal = normal.plus(random.in_ball(0.2)).normalized();
        let around = normal.plus(random.direction().times(0.99)).normalized();
        let light_direction = if random.one_in(8) { around.times(-1.0) } else { around };
        Ray {
            origin,
            direction,
            hit_distance,
            hit_point: target,
            geometric_normal: normal,
            shading_normal,
            tangent: normal.cross(around).normalized(),
            light_direction,
            texture_uv: [(); 2].map(|()| random.unit()),
            texture_uvw: [(); 3].map(|()| random.between(-4.0, 4.0)),
            filter_width: [(); 2].map(|()| random.between(1e-4, 1e-2)),
            seeds: [(); 3].map(|()| random.unit()),
        }
    }

    /// Returns a random origin of rays.
    pub fn random_origin(random: &mut Random) -> Vector {
        random.direction().times(DISTANCE)
    }

    /// Sets a variable from the ray; variables without a value in it stay unchanged.
    pub fn set(&self, variable: &StateVariable, state: &mut LaneBlock, lane: usize) {
        let first = variable.first_component as usize;
        for (component, value) in self.components(variable.name).into_iter().flatten().enumerate() {
            state.floats_mut(first + component)[lane] = value;
        }
    }

    fn components(&self, name: &str) -> Option<Vec<f32>> {
        Some(match name {
            "rt_RayOrigin" => self.origin.0.into(),
            "rt_RayDirection" => self.direction.0.into(),
            "rt_InverseRayDirection" => self.direction.0.map(f32::recip).into(),
            "rt_HitDistance" => vec![self.hit_distance],
            "rt_HitPoint" => self.hit_point.0.into(),
            "rt_GeometricNormal" => self.geometric_normal.0.into(),
            "rt_ShadingNormal" => self.shading_normal.0.into(),
            "rt_dPdu" => self.tangent.0.into(),
            "rt_dPdv" => self.geometric_normal.cross(self.tangent).0.into(),
            "rt_LightDirection" => self.light_direction.0.into(),
            "rt_TextureUV" => self.texture_uv.into(),
            "rt_TextureUVW" => self.texture_uvw.into(),
            "rt_du" => vec![self.filter_width[0]],
            "rt_dv" => vec![self.filter_width[1]],
            "rt_BSDFSeed" => self.seeds.into(),
            "rt_ScreenCoord" => self.seeds[..2].into(),
            "rt_LensCoord" => self.texture_uv.into(),
            "rt_TimeSeed" => vec![self.seeds[2]],
            // Variables that hosts usually leave at their defaults.
            _ => return None,
        })
    }
}

/// Changes some of the ray's floats to unusual values.
pub fn make_unusual(
    random: &mut Random,
    variables: &[&StateVariable],
    state: &mut LaneBlock,
    lane: usize,
) {
    const LANDMARKS: [f32; 9] = [0.0, 1.0, -1.0, 0.5, -0.5, 2.0, 1e-5, 1e5, f32::INFINITY];
    if variables.is_empty() {
        return;
    }
    for _ in 0..=random.below(3) {
        let variable = variables[random.below(variables.len())];
        let count = variable.ty.components() as usize;
        let whole = random.one_in(2);
        let only = random.below(count);
        let factor = random.choose(&[0.0, 1e-3, 0.1, 10.0, -1.0]);
        let spread = random.choose(&[1.0, 10.0, 1000.0]);
        let kind = random.below(3);
        for component in (0..count).filter(|component| whole || *component == only) {
            let float = &mut state.floats_mut(variable.first_component as usize + component)[lane];
            *float = match kind {
                0 => random.choose(&LANDMARKS),
                1 => *float * factor,
                _ => random.between(-spread, spread),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_as_hosts_set_them() {
        let mut random = Random::new(1);
        let mut finite = 0;
        for _ in 0..1000 {
            let ray = Ray::random(&mut random, Role::Primitive, None);
            let is_unit = |vector: Vector| (vector.dot(vector) - 1.0).abs() < 1e-5;
            for vector in [ray.direction, ray.geometric_normal, ray.shading_normal, ray.tangent] {
                assert!(is_unit(vector), "{ray:?}");
            }
            assert!(ray.tangent.dot(ray.geometric_normal).abs() < 1e-4, "{ray:?}");
            finite += usize::from(ray.hit_distance.is_finite());
        }
        assert!((150..350).contains(&finite), "{finite}");
    }
}
