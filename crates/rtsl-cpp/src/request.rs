//! Requests of methods to the renderer.

use rtsl_ir::{Op, OpKind, Value, Values};
use rtsl_spec::COLOR_COMPONENTS;

use crate::expression::Expression;
use crate::method::Writer;
use crate::statement::Statement;

/// The renderer's interface in the generated text.
pub(crate) const HOST: &str = r#"
/// A sample of a light.
struct LightSample {
    /// Towards the light, unit length.
    float direction[3];
    float distance;
    /// Radiance, or all that it contributes where the density is 0.
    float color[COLORS];
    /// Per solid angle; 0 for a delta.
    float pdf;
};

/// The renderer's answers to requests of methods, in world space. They do not change the ray's state.
struct Host {
    virtual ~Host() = default;

    /// The radiance along a ray, of which at most `weight` counts.
    virtual void trace(const float (&origin)[3], const float (&direction)[3], float limit,
                       float weight, float (&radiance)[COLORS]) = 0;

    /// True if an object intersects the ray before the limit.
    virtual bool occluded(const float (&origin)[3], const float (&direction)[3], float limit) = 0;

    /// The number of light samples, which is constant during a call.
    virtual int32_t light_count() = 0;

    /// A sample of a light at a point; true if the light reaches it unshadowed, from where the cosine to
    /// the normal is at least this.
    virtual bool light_sample(int32_t index, const float (&point)[3], const float (&normal)[3],
                              float cosine, LightSample &light) = 0;

    /// The light that comes from everywhere.
    virtual void ambient(float (&color)[COLORS]) = 0;

    /// The next number of the ray's sampler, in [0, 1).
    virtual float rand() = 0;
};
"#;

impl Writer<'_> {
    /// Emits an operation that queries the host.
    pub fn request(&mut self, op: &Op, out: &mut Vec<Statement>) {
        self.needs.host |= !matches!(op.kind, OpKind::ReportBudget);
        match &op.kind {
            OpKind::Trace { origin, direction, limit, weight } => {
                let origin = self.vector("origin", *origin, out);
                let direction = self.vector("direction", *direction, out);
                let radiance = self.array("radiance", out);
                let [limit, weight] = self.operands([*limit, *weight], out);
                let arguments =
                    [origin, direction, limit, weight, Expression::atom(radiance.clone())];
                out.push(Statement::Evaluate(Expression::call("host.trace", arguments)));
                self.components(op.results, 0, &radiance, COLOR_COMPONENTS);
            }
            OpKind::Occluded { origin, direction, limit } => {
                let origin = self.vector("origin", *origin, out);
                let direction = self.vector("direction", *direction, out);
                let [limit] = self.operands([*limit], out);
                let call = Expression::call("host.occluded", [origin, direction, limit]);
                self.answer("is_occluded", op.results.get(0), call, out);
            }
            OpKind::LightCount => {
                let call = Expression::call("host.light_count", []);
                self.answer("light_count", op.results.get(0), call, out);
            }
            OpKind::LightSample { index, point, normal, cosine } => {
                self.light_sample(op.results, *index, *point, *normal, *cosine, out);
            }
            OpKind::Ambient => {
                let ambient = self.array("ambient", out);
                let arguments = [Expression::atom(ambient.clone())];
                out.push(Statement::Evaluate(Expression::call("host.ambient", arguments)));
                self.components(op.results, 0, &ambient, COLOR_COMPONENTS);
            }
            OpKind::Rand => {
                let call = Expression::call("host.rand", []);
                self.answer("random", op.results.get(0), call, out);
            }
            OpKind::ReportBudget => {
                self.needs.state = true;
                let (target, value) =
                    ("state.budget_exceeded".to_owned(), Expression::atom("true"));
                out.push(Statement::Assign { target, value });
            }
            _ => unreachable!("only requests come here"),
        }
    }

    fn light_sample(
        &mut self,
        results: Values,
        index: Value,
        point: [Value; 3],
        normal: [Value; 3],
        cosine: Value,
        out: &mut Vec<Statement>,
    ) {
        let point = self.vector("point", point, out);
        let normal = self.vector("normal", normal, out);
        let light = self.new_name("light");
        let define = |type_name: &str, name: &str, value| Statement::Define {
            is_constant: false,
            type_name: type_name.to_owned(),
            name: name.to_owned(),
            value: Some(value),
        };
        out.push(define("LightSample", &light, Expression::List(Vec::new())));
        let [index, cosine] = self.operands([index, cosine], out);
        let arguments = [index, point, normal, cosine, Expression::atom(light.clone())];
        let reached = self.answer_name("reaches", results.get(0));
        out.push(define("const bool", &reached, Expression::call("host.light_sample", arguments)));
        // A light that does not reach the point is black, even if the host has written other values.
        out.push(Statement::If {
            condition: Expression::atom(reached.clone()).inverted(),
            then: vec![Statement::Assign {
                target: light.clone(),
                value: Expression::call("LightSample", []),
            }],
            otherwise: Vec::new(),
        });
        self.set_value(results.get(0), Expression::atom(reached));
        self.components(results, 1, &format!("{light}.direction"), 3);
        self.components(results, 4, &format!("{light}.distance"), 1);
        self.components(results, 5, &format!("{light}.color"), COLOR_COMPONENTS);
        self.components(results, 5 + COLOR_COMPONENTS, &format!("{light}.pdf"), 1);
    }

    /// Defines a constant array of three values.
    fn vector(&mut self, name: &str, values: [Value; 3], out: &mut Vec<Statement>) -> Expression {
        let values = self.operands(values, out);
        let name = self.new_name(name);
        out.push(Statement::Define {
            is_constant: true,
            type_name: "float".to_owned(),
            name: format!("{name}[3]"),
            value: Some(Expression::List(values.into())),
        });
        Expression::atom(name)
    }

    /// Defines a colour that the host sets.
    fn array(&mut self, name: &str, out: &mut Vec<Statement>) -> String {
        let name = self.new_name(name);
        out.push(Statement::Define {
            is_constant: false,
            type_name: "float".to_owned(),
            name: format!("{name}[{COLOR_COMPONENTS}]"),
            value: Some(Expression::List(Vec::new())),
        });
        name
    }

    /// Defines results as the scalars that the host has set.
    fn components(&mut self, results: Values, first: u32, name: &str, len: u32) {
        for index in 0..len {
            let text = crate::method::indexed(name, index, len);
            self.set_value(results.get(first + index), Expression::atom(text));
        }
    }

    /// Defines a result that the host's function returns; the call is emitted even if the result is unused.
    fn answer(&mut self, name: &str, result: Value, call: Expression, out: &mut Vec<Statement>) {
        if self.uses.count(result) == 0 {
            out.push(Statement::Evaluate(call));
            return;
        }
        let name = self.answer_name(name, result);
        let type_name = crate::literal::type_name(self.function.scalar(result)).to_owned();
        self.set_value(result, Expression::atom(name.clone()));
        out.push(Statement::Define { is_constant: true, type_name, name, value: Some(call) });
    }
}
