//! Queries of hosts as kernels of their own: what stages have in them, for methods that a host calls by itself.
//!
//! Rays, lit points and the places of shapes are in [columns](QueryColumns). A kernel stores its results in columns,
//! and the state that methods of materials read which are called next.

use std::sync::Arc;

use rtsl_ir::{CompareOp, Constant, Op, Output, Value, Variable};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking};
use rtsl_spec::{Role, TO_OBJECT, TO_WORLD};

use crate::arithmetic::{Arithmetic, Vector, vector_at};
use crate::lights::{LightLink, LitPoint, SampleWeight, SampledColor};
use crate::query_columns::{
    COORDINATES, DERIVATIVES, FOOTPRINT, QueryColumns, SurfaceNeeds, TANGENTS, Weighing,
};
use crate::stage_linker::StageLinker;
use crate::surface::{Hit, ShapeLinks, SurfaceCode};

/// A function that answers a query, with its name.
pub struct QueryLink {
    linker: StageLinker,
}

impl QueryLink {
    /// Begins a function of this name. It may report the calls of methods, for traces.
    pub fn new(name: String, reports_calls: bool) -> QueryLink {
        let mut linker = StageLinker::new(name);
        linker.scratch = Some(Vec::new());
        linker.reports_calls = reports_calls;
        QueryLink { linker }
    }

    /// Links [`HostQuery::Surface`](crate::query_columns::HostQuery::Surface) for shapes whose places are in columns, with
    /// the state for these needs, and this scratch of their methods.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn surface(
        mut self,
        shape: &ShapeLinks,
        needs: SurfaceNeeds,
        scratch: &[Variable],
    ) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let HitInColumns { hit, epsilon, limit } = code.hit_in_columns()?;
        let mut surface = SurfaceCode::begin(code, shape, hit, epsilon)?;
        surface.call_methods(linker, hit, limit, &mut ops)?;
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        for (name, values) in code.stored_state(&surface, hit, needs)? {
            linker.set_state(name, &values);
        }
        linker.store_scratch(scratch, &mut ops)?;
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::Density`](crate::query_columns::HostQuery::Density) for shapes whose places are in columns.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn density(mut self, shape: &ShapeLinks) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let HitInColumns { hit, epsilon, limit } = code.hit_in_columns()?;
        let point = code.query_columns(QueryColumns::POINT)?;
        let hit = hit.seen_from(code, point)?;
        let mut surface = SurfaceCode::begin(code, shape, hit, epsilon)?;
        surface.find_normals(linker, hit, limit, &mut ops)?;
        if let Some(method) = &shape.density {
            surface.call(linker, method, &mut ops)?;
        }
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let density = surface.density(code, hit)?;
        code.store_columns(QueryColumns::DENSITY, &[density]);
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::SampledPoint`](crate::query_columns::HostQuery::SampledPoint) for shapes whose places are in
    /// columns, and which `generate` samples.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn sampled_point(
        mut self,
        shape: &ShapeLinks,
        generate: &Arc<LinkedMethod>,
    ) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let (lit, moment) = (code.lit_point_in_columns()?, code.moment_in_columns()?);
        let sampled = linker.sampled_point(shape, generate, &lit, &moment, &mut ops)?;
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        code.store_way(&sampled.sample);
        code.store_columns(QueryColumns::DENSITY, &[sampled.sample.density]);
        let SampledColor { direction, distance, .. } = sampled.sample;
        let stored = [
            ("rt_RayOrigin", lit.point.to_vec()),
            ("rt_RayDirection", direction.to_vec()),
            ("rt_HitDistance", vec![distance]),
            ("rt_HitPoint", sampled.point.to_vec()),
            ("rt_GeometricNormal", sampled.normal.to_vec()),
            ("rt_ShadingNormal", sampled.normal.to_vec()),
        ];
        for (name, values) in stored.into_iter().chain(moment) {
            linker.set_state(name, &values);
        }
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::SampledEmission`](crate::query_columns::HostQuery::SampledEmission).
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn sampled_emission(
        mut self,
        emission: &LinkedMethod,
        weighing: Weighing,
    ) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let set = linker.light_method("", emission, Vec::new(), &mut ops)?;
        let mut emission = linker.results(&set, Role::Material, "rt_EmissionColor", &mut ops)?;
        let code = &mut Arithmetic { linker, to: &mut ops };
        emission.push(code.query_column(QueryColumns::DENSITY)?);
        let radiance = code.call("rt_usableEmission", &emission)?;
        code.store_radiance(vector_at(&radiance, 0), weighing)?;
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::SampledAlpha`](crate::query_columns::HostQuery::SampledAlpha).
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn sampled_alpha(mut self, lookup: &LinkedMethod, weighing: Weighing) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let set = linker.light_method("", lookup, Vec::new(), &mut ops)?;
        let alpha = linker.results(&set, Role::Texture, "rt_FloatTextureValue", &mut ops)?;
        let code = &mut Arithmetic { linker, to: &mut ops };
        let emission = code.query_columns(QueryColumns::RADIANCE)?;
        let radiance = code.call("rt_emissionWithAlpha", &[&emission, &alpha[..]].concat())?;
        code.store_radiance(vector_at(&radiance, 0), weighing)?;
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::Illumination`](crate::query_columns::HostQuery::Illumination) for lights whose places are in
    /// columns.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn illumination(mut self, light: &LightLink) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let lit = code.lit_point_in_columns()?;
        let sample = linker.shapeless_sample(light, &lit, &mut ops)?;
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let is_found = code.is_found_sample(light, &sample)?;
        code.store_way(&sample);
        code.store_weighed(sample.color, sample.density, is_found)?;
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::SkyEmission`](crate::query_columns::HostQuery::SkyEmission) for lights whose places are in
    /// columns.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn sky_emission(mut self, light: &LightLink) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let ray = code.ray_in_columns()?;
        let emission = linker.sky_emission(light, ray, &mut ops)?;
        Arithmetic { linker, to: &mut ops }.store_columns(QueryColumns::RADIANCE, &emission);
        Ok(self.finish(ops))
    }

    /// Links [`HostQuery::SkyDensity`](crate::query_columns::HostQuery::SkyDensity) for lights whose places are in columns.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn sky_density(mut self, light: &LightLink) -> Linking<Linked> {
        let (linker, mut ops) = (&mut self.linker, Vec::new());
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut ops };
        let (ray, normals) = (code.ray_in_columns()?, code.normals_in_columns()?);
        let density = linker.sky_density(light, ray, normals, &mut ops)?;
        Arithmetic { linker, to: &mut ops }.store_columns(QueryColumns::DENSITY, &[density]);
        Ok(self.finish(ops))
    }

    fn finish(mut self, ops: Vec<Op>) -> Linked {
        self.linker.out.body.ops = ops;
        self.linker.finish()
    }
}

/// A hit with the limits of its search.
struct HitInColumns {
    hit: Hit,
    epsilon: Value,
    limit: Value,
}

impl Arithmetic<'_> {
    fn hit_in_columns(&mut self) -> Linking<HitInColumns> {
        let [origin, direction] = self.ray_in_columns()?;
        let distance = self.query_column(QueryColumns::DISTANCE)?;
        Ok(HitInColumns {
            hit: Hit { origin, direction, distance },
            epsilon: self.query_column(QueryColumns::EPSILON)?,
            limit: self.query_column(QueryColumns::LIMIT)?,
        })
    }

    /// The origin and the direction of a ray.
    fn ray_in_columns(&mut self) -> Linking<[Vector; 2]> {
        let origin = self.query_columns(QueryColumns::ORIGIN)?;
        Ok([origin, self.query_columns(QueryColumns::DIRECTION)?])
    }

    fn normals_in_columns(&mut self) -> Linking<[Vector; 2]> {
        let geometric = self.query_columns(QueryColumns::GEOMETRIC_NORMAL)?;
        Ok([geometric, self.query_columns(QueryColumns::SHADING_NORMAL)?])
    }

    fn lit_point_in_columns(&mut self) -> Linking<LitPoint> {
        Ok(LitPoint {
            point: self.query_columns(QueryColumns::ORIGIN)?,
            normals: self.normals_in_columns()?,
            offset: self.query_column(QueryColumns::OFFSET)?,
        })
    }

    /// The state of all methods.
    fn moment_in_columns(&mut self) -> Linking<[(&'static str, Vec<Value>); 2]> {
        let epsilon = self.query_column(QueryColumns::EPSILON)?;
        let time = self.query_column(QueryColumns::TIME)?;
        Ok([("rt_Epsilon", vec![epsilon]), ("rt_TimeSeed", vec![time])])
    }

    /// Weighs a radiance with a density as the columns tell, and stores both.
    fn store_weighed(&mut self, color: Vector, density: Value, is_found: Value) -> Linking<()> {
        let probability = self.query_column(QueryColumns::PROBABILITY)?;
        let (divides, zero) = (self.query_column(QueryColumns::DIVIDES)?, self.float(0.0)?);
        let divides = self.compare(CompareOp::Greater, divides, zero)?;
        let weight = SampleWeight { divides, is_found, probability };
        let (color, density) = self.weighed(color, density, weight)?;
        self.store_columns(QueryColumns::RADIANCE, &color);
        self.store_columns(QueryColumns::DENSITY, &[density]);
        Ok(())
    }

    /// Stores the radiance of a sampled point of a shape, which may be weighed.
    fn store_radiance(&mut self, radiance: Vector, weighing: Weighing) -> Linking<()> {
        if weighing == Weighing::Later {
            self.store_columns(QueryColumns::RADIANCE, &radiance);
            return Ok(());
        }
        let density = self.query_column(QueryColumns::DENSITY)?;
        let is_found = self.boolean(weighing == Weighing::OfFound)?;
        self.store_weighed(radiance, density, is_found)
    }

    /// Stores the way of a sample.
    fn store_way(&mut self, sample: &SampledColor) {
        self.store_columns(QueryColumns::DIRECTION, &sample.direction);
        self.store_columns(QueryColumns::DISTANCE, &[sample.distance]);
        self.store_columns(QueryColumns::REACH, &[sample.end]);
    }

    /// Returns the state to store, by names, after it has stored the columns.
    fn stored_state(
        &mut self,
        surface: &SurfaceCode<'_>,
        hit: Hit,
        needs: SurfaceNeeds,
    ) -> Linking<Vec<(&'static str, Vec<Value>)>> {
        let footprint = [QueryColumns::WIDTH, QueryColumns::SPREAD];
        let footprint = [self.query_column(footprint[0])?, self.query_column(footprint[1])?];
        let world = surface.in_world(self, hit, footprint)?;
        self.store_columns(QueryColumns::POINT, &world.point);
        self.store_columns(QueryColumns::OFFSET, &[world.offset]);
        self.store_columns(QueryColumns::GEOMETRIC_NORMAL, &world.geometric_normal);
        self.store_columns(QueryColumns::SHADING_NORMAL, &world.shading_normal);
        let mut stored = vec![
            ("rt_RayOrigin", hit.origin.to_vec()),
            ("rt_RayDirection", hit.direction.to_vec()),
            ("rt_HitDistance", vec![hit.distance]),
            ("rt_HitPoint", world.point.to_vec()),
            ("rt_GeometricNormal", world.geometric_normal.to_vec()),
            ("rt_ShadingNormal", world.shading_normal.to_vec()),
        ];
        stored.extend(self.moment_in_columns()?);
        let of_shape = |name: &'static str| {
            let components = (0..).map_while(|component| surface.get(name, component));
            (name, components.collect::<Vec<Value>>())
        };
        if needs.coordinates {
            stored.extend(COORDINATES.map(of_shape));
        }
        let [du, dv] = [world.tangents[6], world.tangents[7]];
        if needs.derivatives {
            stored.extend(DERIVATIVES.map(of_shape));
            let tangents = world.tangents.chunks(3).map(<[Value]>::to_vec);
            stored.extend(TANGENTS.into_iter().zip(tangents));
        }
        if needs.footprints {
            stored.extend([(FOOTPRINT[0], vec![du]), (FOOTPRINT[1], vec![dv])]);
        }
        if needs.inverse_directions {
            let one = self.float(1.0)?;
            let inverse = self.each(|code, axis| code.divide(one, hit.direction[axis]))?;
            stored.push(("rt_InverseRayDirection", inverse.to_vec()));
        }
        if needs.maps {
            let maps = surface.maps(self)?;
            let (to_object, to_world) = maps.split_at(12);
            stored.extend([(TO_OBJECT, to_object.to_vec()), (TO_WORLD, to_world.to_vec())]);
        }
        Ok(stored)
    }
}

impl StageLinker {
    /// Stores scratch as methods have left it: zero where none has set it.
    fn store_scratch(&mut self, variables: &[Variable], to: &mut Vec<Op>) -> Linking<()> {
        let set = self.scratch.take().unwrap_or_default();
        for variable in variables {
            for component in 0..variable.len {
                let is_it = |((name, at), _): &&((String, u32), Value)| {
                    *name == variable.name && *at == component
                };
                let value = match set.iter().rev().find(is_it) {
                    Some((_, value)) => *value,
                    None => self.constant(to, Constant::zero(variable.scalar))?,
                };
                let variable = self.intern_variable(variable.clone());
                self.out.outputs.push(Output { variable, component });
                self.out.body.yields.push(value);
            }
        }
        Ok(())
    }
}
