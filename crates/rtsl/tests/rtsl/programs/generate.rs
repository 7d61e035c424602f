//! Makes programs out of choices. Every program is correct, ends, and uses what the choices say of the
//! language: all statements, jumps anywhere, calls with `out` and `inout`, effects inside
//! expressions, arrays with indices that may be out of range.

use rtsl_ir::{BinaryOp, CompareOp, Constant, Scalar, UnaryOp};
use rtsl_testing::functions::Entropy;

use crate::programs::tree::*;

/// The built-in functions that a program uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builtins {
    /// Those that the evaluator knows.
    Exact,
    /// Transcendental ones and noise too.
    All,
}

/// The program that these bytes stand for.
pub fn program(bytes: &[u8], builtins: Builtins) -> Program {
    let mut generator = Generator {
        entropy: Entropy::new(bytes),
        program: Program { members: members(), functions: Vec::new() },
        variables: Vec::new(),
        visible: Vec::new(),
        result: None,
        loops: 0,
        breakable: 0,
        statements: 0,
        builtins,
    };
    let helpers = generator.entropy.below(4);
    for index in 0..helpers {
        generator.helper(index);
    }
    generator.lookup();
    generator.program
}

/// Statements of one function.
const MAX_STATEMENTS: usize = 24;
/// Expressions in expressions.
const MAX_DEPTH: u32 = 4;
/// Loops in loops of one function.
const MAX_LOOPS: u32 = 2;

const SCALARS: [Scalar; 4] = [Scalar::F32, Scalar::I32, Scalar::U32, Scalar::Bool];

/// Inputs and results: one of each kind, and arrays on both sides of the size at which they become
/// memory.
fn members() -> Vec<Variable> {
    let types = [
        (Scalar::F32, 1, None),
        (Scalar::F32, 3, None),
        (Scalar::I32, 1, None),
        (Scalar::I32, 2, None),
        (Scalar::U32, 1, None),
        (Scalar::Bool, 1, None),
        (Scalar::Bool, 4, None),
        (Scalar::F32, 1, Some(3)),
        (Scalar::F32, 2, Some(6)),
        (Scalar::I32, 1, Some(7)),
    ];
    let members = types.iter().enumerate().map(|(index, &(scalar, size, count))| Variable {
        name: format!("m{index}"),
        ty: Type { scalar, size },
        count,
        counter: false,
    });
    members.collect()
}

struct Generator<'a> {
    entropy: Entropy<'a>,
    program: Program,
    /// Of the function being made.
    variables: Vec<Variable>,
    /// Those declared here.
    visible: Vec<usize>,
    /// The type of the function's result.
    result: Option<Type>,
    loops: u32,
    /// Loops and switches around.
    breakable: u32,
    statements: usize,
    builtins: Builtins,
}

impl Generator<'_> {
    fn ty(&mut self) -> Type {
        let scalar = self.entropy.choose(&SCALARS);
        let size = self.entropy.choose(&[1, 1, 1, 2, 3, 4]);
        Type { scalar, size }
    }

    fn variable(&mut self, ty: Type, count: Option<u32>, counter: bool) -> usize {
        let name = format!("v{}", self.variables.len());
        self.variables.push(Variable { name, ty, count, counter });
        self.variables.len() - 1
    }

    fn helper(&mut self, index: usize) {
        self.begin();
        let parameters: Vec<Passing> = (0..self.entropy.below(4))
            .map(|_| self.entropy.choose(&[Passing::In, Passing::In, Passing::Out, Passing::InOut]))
            .collect();
        for _ in &parameters {
            let ty = self.ty();
            let variable = self.variable(ty, None, false);
            self.visible.push(variable);
        }
        self.result = if self.entropy.chance(220) { Some(self.ty()) } else { None };
        self.finish(format!("f{index}"), parameters);
    }

    fn lookup(&mut self) {
        self.begin();
        self.result = None;
        self.finish("lookup".to_owned(), Vec::new());
    }

    fn begin(&mut self) {
        (self.variables, self.visible) = (Vec::new(), Vec::new());
        (self.loops, self.breakable, self.statements) = (0, 0, 0);
    }

    fn finish(&mut self, name: String, parameters: Vec<Passing>) {
        let mut body = self.list(0);
        if self.result.is_some() {
            body.push(self.return_statement());
        }
        let variables = std::mem::take(&mut self.variables);
        let result = self.result;
        self.program.functions.push(Function { name, result, parameters, variables, body });
    }

    // Statements.

    fn list(&mut self, depth: u32) -> Vec<Statement> {
        let outside = self.visible.len();
        let mut list = Vec::new();
        let count = 1 + self.entropy.below(if depth == 0 { 12 } else { 4 });
        for _ in 0..count {
            if self.statements >= MAX_STATEMENTS || self.entropy.is_empty() {
                break;
            }
            self.statements += 1;
            list.push(self.statement(depth));
        }
        self.visible.truncate(outside);
        list
    }

    fn statement(&mut self, depth: u32) -> Statement {
        let nested = depth < 4;
        match self.entropy.below(16) {
            0..=2 => self.declaration(),
            3..=6 => {
                let (target, ty) = self.target();
                Statement::Expression(self.assignment(target, ty, 0))
            }
            7..=9 if nested => {
                let condition = self.expression(Type::BOOL, 1);
                let then = self.list(depth + 1);
                let otherwise =
                    if self.entropy.chance(128) { self.list(depth + 1) } else { Vec::new() };
                Statement::If(condition, then, otherwise)
            }
            10..=11 if nested && self.loops < MAX_LOOPS => self.repeat(depth),
            12 if nested => self.switch(depth),
            13 if self.breakable > 0 => {
                let jump = if self.loops > 0 && self.entropy.chance(128) {
                    Statement::Continue
                } else {
                    Statement::Break
                };
                self.sometimes(jump)
            }
            14 if depth > 0 => {
                let jump = self.return_statement();
                self.sometimes(jump)
            }
            15 => {
                let ty = self.ty();
                let call = self.call(None, 1);
                Statement::Expression(match call {
                    Some(call) => call,
                    None => self.expression(ty, 1),
                })
            }
            _ => {
                let (target, ty) = self.target();
                Statement::Expression(self.assignment(target, ty, 0))
            }
        }
    }

    fn declaration(&mut self) -> Statement {
        let ty = self.ty();
        let count = if self.entropy.chance(80) {
            Some(self.entropy.choose(&[2, 3, 4, 5, 9]))
        } else {
            None
        };
        let initialized = count.is_none() && self.entropy.chance(200);
        let value = initialized.then(|| self.expression(ty, 1));
        let variable = self.variable(ty, count, false);
        self.visible.push(variable);
        Statement::Declare(variable, value)
    }

    /// The jump, behind a condition where that is the choice.
    fn sometimes(&mut self, jump: Statement) -> Statement {
        if self.entropy.chance(60) {
            return jump;
        }
        Statement::If(self.expression(Type::BOOL, 2), vec![jump], Vec::new())
    }

    fn return_statement(&mut self) -> Statement {
        Statement::Return(self.result.map(|ty| self.expression(ty, 1)))
    }

    fn repeat(&mut self, depth: u32) -> Statement {
        let counter = self.variable(Type::INT, None, true);
        let kind = self.entropy.below(3);
        let count = self.entropy.below(4) as u32;
        let limit = Expression { ty: Type::INT, kind: Kind::Constant(vec![count]) };
        let bound = if kind == 0 && self.entropy.chance(128) {
            let value = self.expression(Type::INT, 2);
            Expression { ty: Type::INT, kind: Kind::Builtin(Builtin::Min, vec![value, limit]) }
        } else {
            limit
        };
        let condition = match kind {
            0 => None,
            _ => Some(self.expression(Type::BOOL, 2)),
        };
        self.visible.push(counter);
        (self.loops, self.breakable) = (self.loops + 1, self.breakable + 1);
        let body = self.list(depth + 1);
        (self.loops, self.breakable) = (self.loops - 1, self.breakable - 1);
        self.visible.pop();
        match (kind, condition) {
            (1, Some(condition)) => Statement::While(counter, count, condition, body),
            (_, Some(condition)) => Statement::DoWhile(counter, count, condition, body),
            (_, None) => Statement::For(counter, bound, body),
        }
    }

    fn switch(&mut self, depth: u32) -> Statement {
        let selector = self.expression(Type::INT, 2);
        let count = 1 + self.entropy.below(4);
        let default = self.entropy.below(count * 2);
        self.breakable += 1;
        let mut cases = Vec::new();
        for index in 0..count {
            let mut body = self.list(depth + 1);
            if self.entropy.chance(150) {
                body.push(Statement::Break);
            }
            // A label at the end needs a statement.
            if body.is_empty() {
                body.push(Statement::Break);
            }
            cases.push(((index != default).then_some(index as i32), body));
        }
        self.breakable -= 1;
        Statement::Switch(selector, cases)
    }

    // Variables.

    /// All variables that can be named here.
    fn names(&self) -> Vec<(Name, &Variable)> {
        let locals =
            self.visible.iter().map(|index| (Name::Local(*index), &self.variables[*index]));
        let members = self.program.members.iter().enumerate();
        locals.chain(members.map(|(index, member)| (Name::Member(index), member))).collect()
    }

    /// Something to assign, with its type.
    fn target(&mut self) -> (Target, Type) {
        let names: Vec<(Name, Variable)> = self
            .names()
            .into_iter()
            .filter(|(_, variable)| !variable.counter)
            .map(|(name, variable)| (name, variable.clone()))
            .collect();
        let (name, variable) = &names[self.entropy.below(names.len())];
        self.part(*name, variable, true)
    }

    /// A target of this type, if a variable has it.
    fn target_of(&mut self, ty: Type, writable: bool) -> Option<Target> {
        let names: Vec<(Name, Variable)> = self
            .names()
            .into_iter()
            .filter(|(_, variable)| variable.ty == ty && !(writable && variable.counter))
            .map(|(name, variable)| (name, variable.clone()))
            .collect();
        if names.is_empty() {
            return None;
        }
        let (name, variable) = &names[self.entropy.below(names.len())];
        let element = self.element(variable);
        Some(Target { name: *name, element, components: Components::All })
    }

    fn part(&mut self, name: Name, variable: &Variable, writable: bool) -> (Target, Type) {
        let element = self.element(variable);
        let Type { scalar, size } = variable.ty;
        let (components, size) = match self.entropy.below(4) {
            0 if size > 1 => {
                let first = self.entropy.below(usize::from(size)) as u8;
                let second = (first + 1) % size;
                let mut picks = vec![first, second];
                picks.truncate(1 + self.entropy.below(2));
                if !writable && self.entropy.chance(80) {
                    picks.push(first);
                }
                let count = picks.len() as u8;
                (Components::Swizzle(picks), count)
            }
            1 if size > 1 => (Components::Dynamic(Box::new(self.index(u32::from(size)))), 1),
            _ => (Components::All, size),
        };
        (Target { name, element, components }, Type { scalar, size })
    }

    fn element(&mut self, variable: &Variable) -> Option<Expression> {
        variable.count.map(|count| self.index(count))
    }

    /// An index: a constant in range, or something not constant that may be out of range.
    fn index(&mut self, count: u32) -> Expression {
        let dynamic = if self.entropy.chance(160) {
            let ty = if self.entropy.chance(60) { Type::scalar(Scalar::U32) } else { Type::INT };
            self.target_of(ty, false).map(|target| Expression {
                ty,
                kind: Kind::Read(Box::new(Target { element: None, ..target })),
            })
        } else {
            None
        };
        match dynamic {
            // Arrays would ask for an index again.
            Some(Expression { kind: Kind::Read(target), ty }) if !self.is_array(target.name) => {
                let offset = self.entropy.below(3) as u32;
                let read = Expression { ty, kind: Kind::Read(target) };
                let offset = Expression { ty, kind: Kind::Constant(vec![offset]) };
                let kind = Kind::Binary(BinaryOp::Subtract, Box::new(read), Box::new(offset));
                Expression { ty, kind }
            }
            _ => {
                let constant = self.entropy.below(count as usize) as u32;
                Expression { ty: Type::INT, kind: Kind::Constant(vec![constant]) }
            }
        }
    }

    fn is_array(&self, name: Name) -> bool {
        match name {
            Name::Local(index) => self.variables[index].count.is_some(),
            Name::Member(index) => self.program.members[index].count.is_some(),
        }
    }

    // Expressions.

    fn assignment(&mut self, target: Target, ty: Type, depth: u32) -> Expression {
        let op = if self.entropy.chance(90) { self.operator(ty.scalar) } else { None };
        let value = Box::new(self.expression(ty, depth + 1));
        Expression { ty, kind: Kind::Assign(Box::new(target), op, value) }
    }

    fn operator(&mut self, scalar: Scalar) -> Option<BinaryOp> {
        use BinaryOp::*;
        let integer =
            [Add, Subtract, Multiply, Divide, Remainder, And, Or, Xor, ShiftLeft, ShiftRight];
        match scalar {
            Scalar::F32 => Some(self.entropy.choose(&[Add, Subtract, Multiply, Divide])),
            Scalar::I32 | Scalar::U32 => Some(self.entropy.choose(&integer)),
            Scalar::Bool => None,
        }
    }

    fn expression(&mut self, ty: Type, depth: u32) -> Expression {
        let kind = self.kind(ty, depth);
        Expression { ty, kind }
    }

    fn boxed(&mut self, ty: Type, depth: u32) -> Box<Expression> {
        Box::new(self.expression(ty, depth))
    }

    fn kind(&mut self, ty: Type, depth: u32) -> Kind {
        if depth >= MAX_DEPTH || self.entropy.is_empty() {
            return self.leaf(ty);
        }
        let next = depth + 1;
        match self.entropy.below(16) {
            0..=2 => self.leaf(ty),
            3..=4 => match self.operator(ty.scalar) {
                Some(op) => {
                    let narrow = ty.size > 1 && self.entropy.chance(70);
                    let right = if narrow { Type::scalar(ty.scalar) } else { ty };
                    Kind::Binary(op, self.boxed(ty, next), self.boxed(right, next))
                }
                None => self.truth(ty, next),
            },
            5 => self.unary(ty, next),
            6 => {
                let condition = self.boxed(Type::BOOL, next);
                Kind::Conditional(condition, self.boxed(ty, next), self.boxed(ty, next))
            }
            7 => self.construct(ty, next),
            8..=9 => self.builtin(ty, next),
            10 => match self.call(Some(ty), next) {
                Some(call) => call.kind,
                None => self.leaf(ty),
            },
            11 => match self.target_of(ty, true) {
                Some(target) => self.assignment(target, ty, next).kind,
                None => self.leaf(ty),
            },
            12 if ty.scalar != Scalar::Bool => match self.target_of(ty, true) {
                Some(target) => Kind::Step {
                    target: Box::new(target),
                    up: self.entropy.chance(128),
                    prefix: self.entropy.chance(128),
                },
                None => self.leaf(ty),
            },
            13 => {
                let whole = Type { size: 2 + self.entropy.below(3) as u8, ..ty };
                let picks = (0..ty.size)
                    .map(|_| self.entropy.below(usize::from(whole.size)) as u8)
                    .collect();
                Kind::Swizzle(self.boxed(whole, next), picks)
            }
            _ if ty.scalar == Scalar::Bool => self.truth(ty, next),
            _ => self.leaf(ty),
        }
    }

    fn leaf(&mut self, ty: Type) -> Kind {
        match self.entropy.below(4) {
            0 if ty.scalar == Scalar::F32 => {
                Kind::Input((0..ty.size).map(|_| self.entropy.below(3) as u8).collect())
            }
            0 => Kind::Constant(self.constant(ty)),
            _ => match self.target_of(ty, false) {
                Some(target) => Kind::Read(Box::new(target)),
                None => Kind::Constant(self.constant(ty)),
            },
        }
    }

    fn constant(&mut self, ty: Type) -> Vec<u32> {
        let bits = |constant: Constant| match constant {
            // Which NaN a text means is not the point here.
            Constant::F32(value) if value.is_nan() => f32::INFINITY.to_bits(),
            other => other.bits(),
        };
        (0..ty.size).map(|_| bits(self.entropy.constant(ty.scalar))).collect()
    }

    fn unary(&mut self, ty: Type, depth: u32) -> Kind {
        match (ty.scalar, ty.size) {
            (Scalar::Bool, 1) => Kind::Unary(UnaryOp::Not, self.boxed(ty, depth)),
            (Scalar::Bool, _) => self.leaf(ty),
            (Scalar::F32, _) => Kind::Unary(UnaryOp::Negate, self.boxed(ty, depth)),
            (Scalar::I32 | Scalar::U32, _) => {
                let op = self.entropy.choose(&[UnaryOp::Negate, UnaryOp::Not]);
                Kind::Unary(op, self.boxed(ty, depth))
            }
        }
    }

    /// A bool from others or from a comparison.
    fn truth(&mut self, ty: Type, depth: u32) -> Kind {
        if ty.size > 1 {
            let scalar = self.entropy.choose(&[Scalar::F32, Scalar::I32, Scalar::U32]);
            let operands = Type { scalar, ..ty };
            let arguments =
                vec![self.expression(operands, depth), self.expression(operands, depth)];
            return Kind::Builtin(Builtin::LessThan, arguments);
        }
        match self.entropy.below(6) {
            0 => Kind::Logical(false, self.boxed(ty, depth), self.boxed(ty, depth)),
            1 => Kind::Logical(true, self.boxed(ty, depth), self.boxed(ty, depth)),
            2 => Kind::Binary(BinaryOp::Xor, self.boxed(ty, depth), self.boxed(ty, depth)),
            3 => {
                let operands = self.ty();
                let op = self.entropy.choose(&[CompareOp::Equal, CompareOp::NotEqual]);
                Kind::Compare(op, self.boxed(operands, depth), self.boxed(operands, depth))
            }
            _ => {
                use CompareOp::*;
                let op = self.entropy.choose(&[Less, LessEqual, Greater, GreaterEqual]);
                let scalar = self.entropy.choose(&[Scalar::F32, Scalar::I32, Scalar::U32]);
                let operands = Type::scalar(scalar);
                Kind::Compare(op, self.boxed(operands, depth), self.boxed(operands, depth))
            }
        }
    }

    fn construct(&mut self, ty: Type, depth: u32) -> Kind {
        let mut parts = Vec::new();
        let mut size = 0;
        while size < ty.size {
            let mut part = self.ty();
            part.size = part.size.min(ty.size - size);
            size += part.size;
            parts.push(self.expression(part, depth));
            // One scalar is spread.
            if parts.len() == 1 && size == 1 && ty.size > 1 && self.entropy.chance(60) {
                break;
            }
        }
        Kind::Construct(parts)
    }

    fn builtin(&mut self, ty: Type, depth: u32) -> Kind {
        use Builtin::*;
        let float = Type { scalar: Scalar::F32, ..ty };
        if ty.scalar == Scalar::F32 && self.builtins == Builtins::All && self.entropy.chance(128) {
            return self.prelude(ty, depth);
        }
        let builtin = match (ty.scalar, ty.size) {
            (Scalar::F32, 1) => self.entropy.choose(&[
                Abs, Floor, Ceil, Trunc, Sqrt, Min, Max, Clamp, Mix, Step, Sign, Fma, Dot,
            ]),
            (Scalar::F32, _) => self
                .entropy
                .choose(&[Abs, Floor, Ceil, Trunc, Sqrt, Min, Max, Clamp, Mix, Step, Sign, Fma]),
            (Scalar::I32, _) => self.entropy.choose(&[Abs, Min, Max, Clamp, FloatBitsToInt]),
            (Scalar::U32, _) => self.entropy.choose(&[Min, Max, Clamp]),
            (Scalar::Bool, 1) => self.entropy.choose(&[Any, All]),
            (Scalar::Bool, _) => return self.truth(ty, depth),
        };
        let wide = |generator: &mut Self, scalar| Type {
            scalar,
            size: 2 + generator.entropy.below(3) as u8,
        };
        let types = match builtin {
            Abs | Floor | Ceil | Trunc | Sqrt | Sign => vec![ty],
            Min | Max | Step => vec![ty; 2],
            Clamp | Mix | Fma => vec![ty; 3],
            Dot => {
                let vector = wide(self, Scalar::F32);
                vec![vector, vector]
            }
            Any | All => vec![wide(self, Scalar::Bool)],
            FloatBitsToInt => vec![float],
            LessThan | Prelude(_) => unreachable!("made elsewhere"),
        };
        Kind::Builtin(builtin, types.into_iter().map(|ty| self.expression(ty, depth)).collect())
    }

    /// A function that the prelude has for numbers and vectors.
    fn prelude(&mut self, ty: Type, depth: u32) -> Kind {
        const ONE: [&str; 14] = [
            "sin",
            "cos",
            "tan",
            "asin",
            "acos",
            "atan",
            "exp",
            "log",
            "exp2",
            "log2",
            "inversesqrt",
            "fract",
            "normalize",
            "tanh",
        ];
        const TWO: [&str; 5] = ["pow", "atan", "mod", "reflect", "distance"];
        const TO_NUMBER: [&str; 2] = ["length", "noise"];
        let (name, arguments) = match self.entropy.below(4) {
            0 if ty.size == 1 => {
                let size = 2 + self.entropy.below(2) as u8;
                (self.entropy.choose(&TO_NUMBER), vec![Type { size, ..ty }])
            }
            1 => (self.entropy.choose(&TWO[..if ty.size == 1 { 5 } else { 4 }]), vec![ty; 2]),
            _ => (self.entropy.choose(&ONE), vec![ty]),
        };
        let arguments = arguments.into_iter().map(|ty| self.expression(ty, depth)).collect();
        Kind::Builtin(Builtin::Prelude(name), arguments)
    }

    /// A call of an earlier function with this result, or with any.
    fn call(&mut self, ty: Option<Type>, depth: u32) -> Option<Expression> {
        let functions = self.program.functions.iter().enumerate();
        let fitting: Vec<usize> = functions
            .filter(|(_, function)| ty.is_none() || function.result == ty)
            .map(|(index, _)| index)
            .collect();
        if fitting.is_empty() || self.loops > 1 {
            return None;
        }
        let index = fitting[self.entropy.below(fitting.len())];
        let function = &self.program.functions[index];
        let types: Vec<Type> =
            function.variables[..function.parameters.len()].iter().map(|it| it.ty).collect();
        let (passings, result) = (function.parameters.clone(), function.result);
        let mut arguments = Vec::new();
        for (passing, ty) in passings.into_iter().zip(types) {
            arguments.push(match passing {
                Passing::In => Argument::Value(self.expression(ty, depth + 1)),
                Passing::Out | Passing::InOut => Argument::Place(self.target_of(ty, true)?),
            });
        }
        let ty = result.unwrap_or(Type::FLOAT);
        Some(Expression { ty, kind: Kind::Call(index, arguments) })
    }
}
