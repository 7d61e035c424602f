//! Requests to the host.

use rtsl_ir::{Query, Scalar, Value};
use rtsl_spec::COLOR_COMPONENTS;

use super::Lowering;
use crate::kernel::{OpKind, Ray, Type};

const COLOR: [Scalar; COLOR_COMPONENTS as usize] = [Scalar::F32; COLOR_COMPONENTS as usize];

impl Lowering<'_> {
    /// Lowers an operation that queries the host.
    pub(super) fn lower_request(&mut self, op: &rtsl_ir::Op) {
        use rtsl_ir::OpKind as Request;
        let mask = self.mask;
        let results = match &op.kind {
            Request::Trace { origin, direction, limit, weight } => {
                let ray = self.ray(*origin, *direction, *limit);
                let weight = self.value(*weight);
                self.request(OpKind::Trace { mask, ray, weight }, &COLOR)
            }
            Request::Occluded { origin, direction, limit } => {
                let ray = self.ray(*origin, *direction, *limit);
                self.request(OpKind::Occluded { mask, ray }, &[Scalar::Bool])
            }
            Request::LightSample { index, point, normal, cosine } => {
                self.light_sample(*index, *point, *normal, *cosine)
            }
            Request::Ambient => {
                let types = COLOR.map(Type::uniform);
                let hoist = self.is_hoistable(&OpKind::Ambient);
                self.push(OpKind::Ambient, &types, hoist).iter().collect()
            }
            Request::Query(query, operands) => self.query(*query, operands),
            Request::Rand => self.request(OpKind::Rand(mask), &[Scalar::F32]),
            Request::ReportBudget => self.request(OpKind::ReportBudget, &[]),
            other => unreachable!("{other:?} is no request"),
        };
        self.set_results(op, &results);
    }

    fn request(&mut self, kind: OpKind, results: &[Scalar]) -> Vec<Value> {
        let types: Vec<Type> = results.iter().map(|scalar| Type::lanes(*scalar)).collect();
        self.push(kind, &types, false).iter().collect()
    }

    fn query(&mut self, query: Query, operands: &[Value]) -> Vec<Value> {
        let operands = operands.iter().map(|operand| self.value(*operand)).collect();
        if query.is_uniform() {
            let types: Vec<Type> = query.result_scalars().map(Type::uniform).collect();
            let kind = OpKind::Query { mask: None, query, operands };
            let hoist = self.is_hoistable(&kind);
            return self.push(kind, &types, hoist).iter().collect();
        }
        let results: Vec<Scalar> = query.result_scalars().collect();
        self.request(OpKind::Query { mask: Some(self.mask), query, operands }, &results)
    }

    fn ray(&self, origin: [Value; 3], direction: [Value; 3], limit: Value) -> Ray {
        Ray {
            origin: self.values_of(origin),
            direction: self.values_of(direction),
            limit: self.value(limit),
        }
    }

    /// Hosts take one light index at a time. Loops over lights make it uniform. If it varies in a shader, lanes with
    /// the same index are grouped.
    fn light_sample(
        &mut self,
        index: Value,
        point: [Value; 3],
        normal: [Value; 3],
        cosine: Value,
    ) -> Vec<Value> {
        let (index, cosine) = (self.value(index), self.value(cosine));
        let (point, normal) = (self.values_of(point), self.values_of(normal));
        let mut scalars = vec![Scalar::Bool];
        scalars.extend([Scalar::F32; 3 + 1 + COLOR_COMPONENTS as usize + 1]);
        if self.ty(index).lanes {
            return self.for_each_distinct(index, &scalars.clone(), |lowering, index, mask| {
                lowering
                    .request(OpKind::LightSample { mask, index, point, normal, cosine }, &scalars)
            });
        }
        let mask = self.mask;
        self.request(OpKind::LightSample { mask, index, point, normal, cosine }, &scalars)
    }
}
