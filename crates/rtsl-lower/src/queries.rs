//! Queries of integrators: surfaces, lights, the sampler.

use rtsl_ir::{OpKind, PROPERTIES_OF_MATERIALS, Query, SURFACE_SCALARS, Value};
use rtsl_source::Span;

use crate::Lowering;
use crate::limits::Lowered;
use crate::state_table::state_id;

impl Lowering<'_> {
    /// Lowers `nearestHit(...)` to a query for the hit and one for the properties of the surface.
    pub fn lower_nearest_hit(
        &mut self,
        arguments: &[Vec<Value>],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let Ray { origin, direction, epsilon, limit, width, spread } = self.ray(arguments, span)?;
        let ray = [&origin[..], &direction, &[epsilon, limit]].concat();
        let hit = self.query(Query::NearestHit, ray);
        let [found, object, instance, element, distance] = hit[..] else {
            unreachable!("a hit has five scalars")
        };
        let mut surface = vec![object, instance, element, distance, epsilon, limit];
        surface.extend(origin);
        surface.extend(direction);
        surface.extend([width, spread]);
        let properties = self.query(Query::SurfaceProperties, surface.clone());
        let members = properties.len() - PROPERTIES_OF_MATERIALS;
        let regularization = self.builder.f32(0.0);
        Ok([&[found], &surface[..], &properties[..members], &[regularization]].concat())
    }

    /// Lowers a function or method that is one query.
    pub fn lower_scene_query(&mut self, name: &str, arguments: Vec<Vec<Value>>) -> Vec<Value> {
        let query = Query::from_name(name).expect("the registry names queries");
        let mut arguments = arguments.into_iter();
        let mut operands = Vec::new();
        let mut last = None;
        if query.is_of_surface() {
            let surface = arguments.next().unwrap_or_default();
            // The regularization is the last field.
            last = surface.last().copied().filter(|_| query.is_of_scattering());
            operands.extend(surface.into_iter().skip(1).take(SURFACE_SCALARS));
        }
        operands.extend(arguments.flatten());
        operands.extend(last);
        self.query(query, operands)
    }

    fn query(&mut self, query: Query, operands: Vec<Value>) -> Vec<Value> {
        self.builder.push(OpKind::Query(query, operands)).iter().collect()
    }

    /// Returns the ray that the arguments describe; without arguments, the integrator's own. Hosts have a least distance
    /// for all rays, so 0 is given for others.
    fn ray(&mut self, arguments: &[Vec<Value>], span: Span) -> Lowered<Ray> {
        if let [origin, direction, rest @ ..] = arguments {
            let zero = self.builder.f32(0.0);
            let rest: Vec<Value> = rest.iter().flatten().copied().collect();
            let limit = match rest.first() {
                Some(limit) => *limit,
                None => self.builder.f32(f32::INFINITY),
            };
            let footprint = |index: usize| rest.get(index).copied().unwrap_or(zero);
            return Ok(Ray {
                origin: origin.clone(),
                direction: direction.clone(),
                epsilon: zero,
                limit,
                width: footprint(1),
                spread: footprint(2),
            });
        }
        let mut state = |name| -> Lowered<Vec<Value>> {
            let variable = self.state_variable(state_id(name), span)?;
            self.get_variable(variable)
        };
        Ok(Ray {
            origin: state("rt_RayOrigin")?,
            direction: state("rt_RayDirection")?,
            epsilon: state("rt_Epsilon")?[0],
            limit: state("rt_HitDistance")?[0],
            width: state("rt_RayWidth")?[0],
            spread: state("rt_RaySpread")?[0],
        })
    }
}

/// A ray, with the least and greatest distance that count, and its footprint.
struct Ray {
    origin: Vec<Value>,
    direction: Vec<Value>,
    epsilon: Value,
    limit: Value,
    width: Value,
    spread: Value,
}

#[cfg(test)]
mod tests {
    use rtsl_ir::Scalar;
    use rtsl_spec::builtins::{self, Lowering, SpecStruct, SpecType, Special};

    use super::*;

    /// The types of the scalars of a value.
    fn scalars(ty: SpecType) -> Vec<Scalar> {
        let of = |scalar: builtins::Scalar| match scalar {
            builtins::Scalar::Bool => Scalar::Bool,
            builtins::Scalar::Int => Scalar::I32,
            builtins::Scalar::Uint => Scalar::U32,
            builtins::Scalar::Float => Scalar::F32,
        };
        match ty {
            SpecType::Bool => vec![Scalar::Bool],
            SpecType::Int => vec![Scalar::I32],
            SpecType::Float => vec![Scalar::F32],
            SpecType::Vec(scalar, count) => vec![of(scalar); count.into()],
            SpecType::Color => vec![Scalar::F32; 3],
            SpecType::Struct(each) => {
                each.fields().iter().flat_map(|field| scalars(field.ty)).collect()
            }
            _ => Vec::new(),
        }
    }

    #[test]
    fn surfaces_begin_with_the_scalars_that_identify_them() {
        let surface = scalars(SpecType::Struct(SpecStruct::Surface));
        let identity = Query::Emission.operand_scalars();
        let properties: Vec<Scalar> = Query::SurfaceProperties.result_scalars().collect();
        let properties = &properties[..properties.len() - PROPERTIES_OF_MATERIALS];
        let fields = [Scalar::Bool].into_iter().chain(identity).chain(properties.iter().copied());
        let expected: Vec<Scalar> = fields.chain([Scalar::F32]).collect();
        assert_eq!(surface, expected);
    }

    #[test]
    fn functions_have_the_operands_and_results_of_their_queries() {
        let methods = SpecStruct::ALL.into_iter().flat_map(builtins::methods_of);
        let methods = methods.map(|it| builtins::method_overloads(SpecStruct::Surface, it.name));
        let functions = builtins::all().map(|it| builtins::overloads(it.name));
        let mut count = 0;
        for overload in methods.chain(functions).flatten() {
            let Lowering::Special(Special::Query(name)) = overload.builtin.lowering else {
                continue;
            };
            let query = Query::from_name(name).expect(name);
            let parameters = overload.parameters.iter().flat_map(|it| match it.ty {
                SpecType::Struct(SpecStruct::Surface) => {
                    Query::Emission.operand_scalars().collect()
                }
                ty => scalars(ty),
            });
            let regularization = query.is_of_scattering().then_some(Scalar::F32);
            assert!(parameters.chain(regularization).eq(query.operand_scalars()), "{overload}");
            assert!(scalars(overload.result).into_iter().eq(query.result_scalars()), "{overload}");
            count += 1;
        }
        let by_passes = [Query::Spawn, Query::SpawnPath, Query::OwnShade, Query::UnshadowedLight];
        // All but those of passes and those that `nearestHit` makes.
        assert_eq!(count, Query::ALL.len() - by_passes.len() - 2);
    }
}
