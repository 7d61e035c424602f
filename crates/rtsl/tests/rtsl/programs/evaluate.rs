//! Runs programs as the language says, statement by statement: an oracle that shares nothing with
//! the compiler but the arithmetic of scalars.

use rtsl_ir::{BinaryOp, CompareOp, Scalar, UnaryOp, evaluate};

use crate::programs::tree::*;

/// A run takes too long to be a test.
#[derive(Debug)]
pub struct TooLong;

type Run<T> = Result<T, TooLong>;

/// The number of expressions that a run may evaluate.
const FUEL: u32 = 200_000;

/// Runs `lookup` on the members' bits, which it changes, with this `rt_TextureUVW`.
pub fn run(program: &Program, members: &mut Vec<Vec<u32>>, input: [f32; 3]) -> Run<()> {
    let input = input.map(f32::to_bits);
    let lookup = program.functions.len() - 1;
    let members_of_ray = std::mem::take(members);
    let mut machine = Machine {
        program,
        members: members_of_ray,
        input,
        function: lookup,
        locals: Vec::new(),
        fuel: FUEL,
    };
    let done = machine.call(lookup, Vec::new());
    *members = machine.members;
    done.map(|_| ())
}

struct Machine<'p> {
    program: &'p Program,
    members: Vec<Vec<u32>>,
    input: [u32; 3],
    /// The innermost call, and its variables.
    function: usize,
    locals: Vec<Vec<u32>>,
    fuel: u32,
}

/// The control flow after a statement.
#[derive(Debug, PartialEq)]
enum Flow {
    Next,
    Break,
    Continue,
    Return(Vec<u32>),
}

/// A target whose indices have been evaluated: the scalars it names.
struct Place {
    name: Name,
    scalars: Vec<usize>,
}

impl Machine<'_> {
    /// The result, and the parameters' values at the return.
    fn call(&mut self, index: usize, arguments: Vec<Vec<u32>>) -> Run<(Vec<u32>, Vec<Vec<u32>>)> {
        let function = &self.program.functions[index];
        let mut locals = arguments;
        for variable in &function.variables[locals.len()..] {
            locals.push(vec![0; variable.scalars()]);
        }
        let caller = std::mem::replace(&mut self.locals, locals);
        let calling = std::mem::replace(&mut self.function, index);
        let flow = self.list(function, &function.body)?;
        let mut locals = std::mem::replace(&mut self.locals, caller);
        self.function = calling;
        locals.truncate(function.parameters.len());
        let result = match flow {
            Flow::Return(result) if !result.is_empty() => result,
            _ => vec![0; function.result.map_or(0, |ty| usize::from(ty.size))],
        };
        Ok((result, locals))
    }

    fn list(&mut self, function: &Function, list: &[Statement]) -> Run<Flow> {
        for statement in list {
            let flow = self.statement(function, statement)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn statement(&mut self, function: &Function, statement: &Statement) -> Run<Flow> {
        match statement {
            Statement::Declare(index, value) => {
                self.locals[*index] = match value {
                    Some(value) => self.expression(value)?,
                    None => vec![0; function.variables[*index].scalars()],
                };
                Ok(Flow::Next)
            }
            Statement::Expression(value) => {
                self.expression(value)?;
                Ok(Flow::Next)
            }
            Statement::If(condition, then, otherwise) => {
                let chosen = if self.test(condition)? { then } else { otherwise };
                self.list(function, chosen)
            }
            Statement::For(counter, count, body) => {
                self.locals[*counter] = vec![0];
                loop {
                    let count = self.expression(count)?[0] as i32;
                    if self.locals[*counter][0] as i32 >= count {
                        return Ok(Flow::Next);
                    }
                    match self.list(function, body)? {
                        Flow::Break => return Ok(Flow::Next),
                        Flow::Return(result) => return Ok(Flow::Return(result)),
                        Flow::Next | Flow::Continue => {}
                    }
                    self.locals[*counter][0] += 1;
                }
            }
            Statement::While(counter, count, condition, body) => {
                self.locals[*counter] = vec![0];
                while self.another(*counter, *count, condition)? {
                    match self.list(function, body)? {
                        Flow::Break => break,
                        Flow::Return(result) => return Ok(Flow::Return(result)),
                        Flow::Next | Flow::Continue => {}
                    }
                }
                Ok(Flow::Next)
            }
            Statement::DoWhile(counter, count, condition, body) => {
                self.locals[*counter] = vec![0];
                loop {
                    match self.list(function, body)? {
                        Flow::Break => break,
                        Flow::Return(result) => return Ok(Flow::Return(result)),
                        Flow::Next | Flow::Continue => {}
                    }
                    if !self.another(*counter, *count, condition)? {
                        break;
                    }
                }
                Ok(Flow::Next)
            }
            Statement::Switch(selector, cases) => self.switch(function, selector, cases),
            Statement::Break => Ok(Flow::Break),
            Statement::Continue => Ok(Flow::Continue),
            Statement::Return(value) => Ok(Flow::Return(match value {
                Some(value) => self.expression(value)?,
                None => Vec::new(),
            })),
        }
    }

    fn another(&mut self, counter: usize, count: u32, condition: &Expression) -> Run<bool> {
        let rounds = self.locals[counter][0];
        self.locals[counter][0] += 1;
        Ok(rounds < count && self.test(condition)?)
    }

    fn switch(
        &mut self,
        function: &Function,
        selector: &Expression,
        cases: &[(Option<i32>, Vec<Statement>)],
    ) -> Run<Flow> {
        let selector = self.expression(selector)?[0] as i32;
        let matching = cases.iter().position(|(label, _)| *label == Some(selector));
        let default = || cases.iter().position(|(label, _)| label.is_none());
        let Some(first) = matching.or_else(default) else { return Ok(Flow::Next) };
        for (_, body) in &cases[first..] {
            match self.list(function, body)? {
                Flow::Break => return Ok(Flow::Next),
                Flow::Next => {}
                flow @ (Flow::Continue | Flow::Return(_)) => return Ok(flow),
            }
        }
        Ok(Flow::Next)
    }

    fn test(&mut self, condition: &Expression) -> Run<bool> {
        Ok(self.expression(condition)?[0] != 0)
    }

    fn expression(&mut self, expression: &Expression) -> Run<Vec<u32>> {
        self.fuel = self.fuel.checked_sub(1).ok_or(TooLong)?;
        let size = usize::from(expression.ty.size);
        match &expression.kind {
            Kind::Constant(bits) => Ok(bits.clone()),
            Kind::Input(components) => {
                Ok(components.iter().map(|index| self.input[usize::from(*index)]).collect())
            }
            Kind::Read(target) => {
                let place = self.place(target)?;
                Ok(self.read(&place))
            }
            Kind::Swizzle(value, components) => {
                let value = self.expression(value)?;
                Ok(components.iter().map(|index| value[usize::from(*index)]).collect())
            }
            Kind::Unary(op, value) => {
                let function = evaluate::unary(*op, value.ty.scalar).unwrap();
                Ok(self.expression(value)?.into_iter().map(function).collect())
            }
            Kind::Binary(op, a, b) => {
                let (x, y) = (self.expression(a)?, self.expression(b)?);
                Ok(binary(*op, a.ty.scalar, &x, &y))
            }
            Kind::Compare(op, a, b) => {
                let (x, y) = (self.expression(a)?, self.expression(b)?);
                Ok(vec![compare(*op, a.ty.scalar, &x, &y)])
            }
            Kind::Logical(or, a, b) => {
                let first = self.test(a)?;
                Ok(vec![u32::from(if first == *or { first } else { self.test(b)? })])
            }
            Kind::Conditional(condition, a, b) => {
                let chosen = if self.test(condition)? { a } else { b };
                self.expression(chosen)
            }
            Kind::Construct(parts) => {
                let mut components = Vec::new();
                for part in parts {
                    let convert = evaluate::convert(part.ty.scalar, expression.ty.scalar);
                    let keep = part.ty.scalar == expression.ty.scalar;
                    let value = self.expression(part)?.into_iter();
                    components.extend(value.map(|bits| if keep { bits } else { convert(bits) }));
                }
                if components.len() == 1 {
                    components = vec![components[0]; size];
                }
                components.truncate(size);
                Ok(components)
            }
            Kind::Builtin(builtin, arguments) => {
                let values: Run<Vec<Vec<u32>>> =
                    arguments.iter().map(|argument| self.expression(argument)).collect();
                Ok(builtin_value(*builtin, arguments[0].ty.scalar, &values?))
            }
            Kind::Call(index, arguments) => self.call_with(*index, arguments),
            Kind::Assign(target, op, value) => {
                let place = self.place(target)?;
                let old = self.read(&place);
                let new = self.expression(value)?;
                let new = match op {
                    Some(op) => binary(*op, value.ty.scalar, &old, &new),
                    None => new,
                };
                self.write(&place, &new);
                Ok(new)
            }
            Kind::Step { target, up, prefix } => {
                let place = self.place(target)?;
                let old = self.read(&place);
                let scalar = expression.ty.scalar;
                let one = if scalar == Scalar::F32 { 1.0f32.to_bits() } else { 1 };
                let op = if *up { BinaryOp::Add } else { BinaryOp::Subtract };
                let new = binary(op, scalar, &old, &[one]);
                self.write(&place, &new);
                Ok(if *prefix { new } else { old })
            }
        }
    }

    fn call_with(&mut self, index: usize, arguments: &[Argument]) -> Run<Vec<u32>> {
        let function = &self.program.functions[index];
        let mut values = Vec::new();
        let mut places = Vec::new();
        for (number, argument) in arguments.iter().enumerate() {
            match argument {
                Argument::Value(value) => {
                    values.push(self.expression(value)?);
                    places.push(None);
                }
                Argument::Place(target) => {
                    let place = self.place(target)?;
                    values.push(match function.parameters[number] {
                        Passing::Out => vec![0; function.variables[number].scalars()],
                        Passing::In | Passing::InOut => self.read(&place),
                    });
                    places.push(Some(place));
                }
            }
        }
        let (result, outputs) = self.call(index, values)?;
        for (place, output) in places.iter().zip(outputs) {
            if let Some(place) = place {
                self.write(place, &output);
            }
        }
        Ok(result)
    }

    fn place(&mut self, target: &Target) -> Run<Place> {
        let variable = match target.name {
            Name::Member(index) => &self.program.members[index],
            Name::Local(index) => &self.program.functions[self.function].variables[index],
        };
        let (size, count) = (usize::from(variable.ty.size), variable.count);
        let mut first = 0;
        let mut all = size * count.unwrap_or(1) as usize;
        if let (Some(index), Some(count)) = (&target.element, count) {
            first = self.index(index, count as usize)? * size;
            all = size;
        }
        let scalars = match &target.components {
            Components::All => (first..first + all).collect(),
            Components::Swizzle(components) => {
                components.iter().map(|index| first + usize::from(*index)).collect()
            }
            Components::Dynamic(index) => vec![first + self.index(index, size)?],
        };
        Ok(Place { name: target.name, scalars })
    }

    fn index(&mut self, index: &Expression, count: usize) -> Run<usize> {
        let value = self.expression(index)?[0];
        let last = count as i64 - 1;
        let value = match index.ty.scalar {
            Scalar::U32 => i64::from(value),
            _ => i64::from(value as i32),
        };
        Ok(value.clamp(0, last) as usize)
    }

    fn scalars_of(&mut self, name: Name) -> &mut Vec<u32> {
        match name {
            Name::Local(index) => &mut self.locals[index],
            Name::Member(index) => &mut self.members[index],
        }
    }

    fn read(&mut self, place: &Place) -> Vec<u32> {
        let scalars = self.scalars_of(place.name);
        place.scalars.iter().map(|index| scalars[*index]).collect()
    }

    fn write(&mut self, place: &Place, values: &[u32]) {
        let scalars = self.scalars_of(place.name);
        for (index, value) in place.scalars.iter().zip(values) {
            scalars[*index] = *value;
        }
    }
}

fn spread(a: &[u32], b: &[u32], operation: impl Fn(u32, u32) -> u32) -> Vec<u32> {
    let count = a.len().max(b.len());
    (0..count).map(|index| operation(a[index % a.len()], b[index % b.len()])).collect()
}

fn binary(op: BinaryOp, scalar: Scalar, a: &[u32], b: &[u32]) -> Vec<u32> {
    spread(a, b, evaluate::binary(op, scalar).unwrap())
}

fn compare(op: CompareOp, scalar: Scalar, a: &[u32], b: &[u32]) -> u32 {
    let equal = evaluate::compare(CompareOp::Equal, scalar).unwrap();
    let all_equal = || a.iter().zip(b).all(|(a, b)| equal(*a, *b) != 0);
    match op {
        CompareOp::Equal => u32::from(all_equal()),
        CompareOp::NotEqual => u32::from(!all_equal()),
        _ => evaluate::compare(op, scalar).unwrap()(a[0], b[0]),
    }
}

fn builtin_value(builtin: Builtin, scalar: Scalar, values: &[Vec<u32>]) -> Vec<u32> {
    let unary = |op| values[0].iter().map(|a| evaluate::unary(op, scalar).unwrap()(*a)).collect();
    let of = |op, a: &[u32], b: &[u32]| binary(op, scalar, a, b);
    let float = |value: f32| vec![value.to_bits()];
    match builtin {
        Builtin::Abs => unary(UnaryOp::Abs),
        Builtin::Floor => unary(UnaryOp::Floor),
        Builtin::Ceil => unary(UnaryOp::Ceil),
        Builtin::Trunc => unary(UnaryOp::Trunc),
        Builtin::Sqrt => unary(UnaryOp::Sqrt),
        Builtin::Min => of(BinaryOp::Min, &values[0], &values[1]),
        Builtin::Max => of(BinaryOp::Max, &values[0], &values[1]),
        Builtin::Clamp => of(BinaryOp::Min, &of(BinaryOp::Max, &values[0], &values[1]), &values[2]),
        Builtin::Mix => {
            let rest = of(BinaryOp::Subtract, &float(1.0), &values[2]);
            let a = of(BinaryOp::Multiply, &values[0], &rest);
            let b = of(BinaryOp::Multiply, &values[1], &values[2]);
            of(BinaryOp::Add, &a, &b)
        }
        Builtin::Step => spread(&values[0], &values[1], |edge, x| {
            let below = f32::from_bits(x) < f32::from_bits(edge);
            if below { 0.0f32 } else { 1.0 }.to_bits()
        }),
        Builtin::Sign => {
            let sign = |bits: &u32| {
                let x = f32::from_bits(*bits);
                if x > 0.0 {
                    1.0f32
                } else if x < 0.0 {
                    -1.0
                } else {
                    0.0
                }
                .to_bits()
            };
            values[0].iter().map(sign).collect()
        }
        Builtin::Fma => (0..values[0].len())
            .map(|index| evaluate::fma(values[0][index], values[1][index], values[2][index]))
            .collect(),
        Builtin::Dot => {
            let products = of(BinaryOp::Multiply, &values[0], &values[1]);
            products[1..]
                .iter()
                .fold(vec![products[0]], |sum, product| of(BinaryOp::Add, &sum, &[*product]))
        }
        Builtin::Any => vec![u32::from(values[0].iter().any(|bit| *bit != 0))],
        Builtin::All => vec![u32::from(values[0].iter().all(|bit| *bit != 0))],
        Builtin::LessThan => {
            let less = evaluate::compare(CompareOp::Less, scalar).unwrap();
            spread(&values[0], &values[1], less)
        }
        Builtin::Prelude(name) => unreachable!("{name} is not for this oracle"),
        Builtin::FloatBitsToInt => {
            let canonical = |bits: &u32| {
                if f32::from_bits(*bits).is_nan() { 0x7fc0_0000 } else { *bits }
            };
            values[0].iter().map(canonical).collect()
        }
    }
}
