//! Parses the text form.

use std::collections::HashMap;
use std::fmt::{self, Display, Formatter};
use std::sync::Arc;

use rtsl_spec::{Method, Role};

use super::lexer::{Lexer, Token};
use crate::class::ParameterType;
use crate::{
    BinaryOp, CompareOp, Constant, Event, EventValue, Function, Index, MAX_NESTING, Op, OpKind,
    Output, Query, ReferenceCall, ReferencePath, Region, Scalar, StateComponent, UnaryOp, Value,
    ValueScope, Values, Variable, VariableId, VariableKind,
};

/// Parses a function without verifying it: types may be inconsistent.
pub fn parse(text: &str) -> Result<Function, ParseError> {
    Parser::new(text).function()
}

/// The position and reason of a syntax error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseError {
    /// The line, from 1.
    pub line: u32,
    /// The column, from 1, in characters.
    pub column: u32,
    /// A description of the token found and the token expected.
    pub message: String,
}

impl Display for ParseError {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}: {}", self.line, self.column, self.message)
    }
}

impl std::error::Error for ParseError {}

type Result<T, E = ParseError> = std::result::Result<T, E>;

struct Parser<'a> {
    text: &'a str,
    lexer: Lexer<'a>,
    token: Token<'a>,
    /// The offset of `token`.
    offset: usize,
    function: Function,
    /// Used for lookup only, so the iteration order cannot affect results.
    values: HashMap<&'a str, Value>,
    variables: HashMap<(VariableKind, &'a str), VariableId>,
    depth: usize,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Self {
        let mut lexer = Lexer::new(text);
        let (token, offset) = lexer.next();
        Parser {
            text,
            lexer,
            token,
            offset,
            function: Function::new(""),
            values: HashMap::new(),
            variables: HashMap::new(),
            depth: 0,
        }
    }

    fn function(mut self) -> Result<Function> {
        self.expect_keyword("function")?;
        self.function.name = self.expect_word("the function's name")?.to_owned();
        while let Token::Word(_) = self.token {
            self.parse_variable_declaration()?;
        }
        self.expect('{')?;
        let mut body = Region { ops: self.parse_ops()?, ..Region::default() };
        self.expect_keyword("return")?;
        if self.token != Token::Punctuation('}') {
            loop {
                let (variable, component) = self.parse_element()?;
                let Index::Constant(component) = component else {
                    return Err(self.error("the component of an output must be a number"));
                };
                self.function.outputs.push(Output { variable, component });
                self.expect('=')?;
                body.yields.push(self.parse_value()?);
                if !self.maybe(',') {
                    break;
                }
            }
        }
        self.expect('}')?;
        if self.token != Token::End {
            return Err(self.expected("the end of the text"));
        }
        self.function.body = body;
        Ok(self.function)
    }

    fn parse_variable_declaration(&mut self) -> Result<()> {
        let kind = self.parse_variable_kind()?;
        let name = self.expect_word("the variable's name")?;
        self.expect(':')?;
        let (offset, element) = (self.offset, self.expect_word("a type like `f32[3]`")?);
        let Some((scalar, len)) = parse_variable_type(element) else {
            let message = format!("`{element}` is not a type of a variable like `f32[3]`");
            return Err(self.error_at(offset, message));
        };
        let id = VariableId(self.function.variables.len() as u32);
        if self.variables.insert((kind, name), id).is_some() {
            return Err(self.error(format!("{} `{name}` is declared twice", kind.name())));
        }
        self.function.variables.push(Variable { kind, name: name.to_owned(), scalar, len });
        Ok(())
    }

    fn parse_variable_kind(&mut self) -> Result<VariableKind> {
        let Token::Word(word) = self.token else { return Err(self.expected("a kind of variable")) };
        let Some(kind) = VariableKind::from_name(word) else {
            return Err(self.expected("a kind of variable or `{`"));
        };
        self.advance();
        Ok(kind)
    }

    /// Parses operations up to the keyword that ends the region.
    fn parse_ops(&mut self) -> Result<Vec<Op>> {
        let mut ops = Vec::new();
        loop {
            match self.token {
                Token::Word("yield" | "repeat" | "return") => return Ok(ops),
                Token::Word(_) => ops.push(self.parse_op()?),
                Token::Punctuation(_) | Token::End => {
                    return Err(self.expected("an operation"));
                }
            }
        }
    }

    fn parse_op(&mut self) -> Result<Op> {
        let first = self.function.values.len() as u32;
        if self.at_value() {
            loop {
                self.parse_definition()?;
                if !self.maybe(',') {
                    break;
                }
            }
            self.expect('=')?;
        }
        let results = Values { first, count: self.function.values.len() as u32 - first };
        let precise = self.token == Token::Word("precise");
        if precise {
            self.advance();
        }
        let kind = match self.token {
            Token::Word("if") => self.parse_if()?,
            Token::Word("loop") => self.parse_loop()?,
            _ => self.parse_plain_kind(results)?,
        };
        Ok(Op { results, precise, kind })
    }

    /// Parses `%name: type`.
    fn parse_definition(&mut self) -> Result<Value> {
        let (offset, name) = (self.offset, self.expect_word("a value")?);
        self.expect(':')?;
        let scalar = self.parse_scalar()?;
        let value = Value(self.function.values.len() as u32);
        self.function.values.push(scalar);
        if self.values.insert(name, value).is_some() {
            return Err(self.error_at(offset, format!("value {name} is defined twice")));
        }
        Ok(value)
    }

    /// Parses an operation without regions. Separate from the recursive functions because its stack frame is large.
    fn parse_plain_kind(&mut self, results: Values) -> Result<OpKind> {
        let offset = self.offset;
        let keyword = self.expect_word("an operation")?;
        if let Some(op) = UnaryOp::from_name(keyword) {
            return Ok(OpKind::Unary(op, self.parse_value()?));
        }
        if let Some(op) = BinaryOp::from_name(keyword) {
            let [a, b] = self.parse_values()?;
            return Ok(OpKind::Binary(op, a, b));
        }
        if let Some(op) = CompareOp::from_name(keyword) {
            let [a, b] = self.parse_values()?;
            return Ok(OpKind::Compare(op, a, b));
        }
        Ok(match keyword {
            "constant" => OpKind::Constant(self.parse_constant(results)?),
            "select" => {
                let [condition, a, b] = self.parse_values()?;
                OpKind::Select(condition, a, b)
            }
            "fma" => {
                let [a, b, c] = self.parse_values()?;
                OpKind::Fma(a, b, c)
            }
            "convert" => OpKind::Convert(self.result_scalar(results)?, self.parse_value()?),
            "bitcast" => OpKind::Bitcast(self.result_scalar(results)?, self.parse_value()?),
            "load" => {
                let (variable, index) = self.parse_element()?;
                OpKind::Load(variable, index)
            }
            "store" => {
                let (variable, index) = self.parse_element()?;
                self.expect(',')?;
                OpKind::Store(variable, index, self.parse_value()?)
            }
            "length" => OpKind::Length(self.parse_variable()?),
            "trace" => {
                let [a, b, c, d, e, f, limit, weight] = self.parse_values()?;
                OpKind::Trace { origin: [a, b, c], direction: [d, e, f], limit, weight }
            }
            "occluded" => {
                let [a, b, c, d, e, f, limit] = self.parse_values()?;
                OpKind::Occluded { origin: [a, b, c], direction: [d, e, f], limit }
            }
            "light_count" => OpKind::LightCount,
            "light_sample" => {
                let [index, a, b, c, d, e, f, cosine] = self.parse_values()?;
                OpKind::LightSample { index, point: [a, b, c], normal: [d, e, f], cosine }
            }
            "ambient" => OpKind::Ambient,
            "rand" => OpKind::Rand,
            "query" => self.parse_query()?,
            "call" => self.parse_reference_call()?,
            "is_set" => {
                let member = self.expect_word("a reference")?.to_owned();
                OpKind::IsSet(member, self.parse_path()?)
            }
            "seed" => OpKind::Seed(self.parse_value()?),
            "derivative" => {
                let [of, by] = self.parse_values()?;
                OpKind::Derivative(of, by)
            }
            "chain_rule" => self.parse_chain_rule()?,
            "reference_count" => {
                OpKind::ReferenceCount(self.expect_word("a reference")?.to_owned())
            }
            "report_budget" => OpKind::ReportBudget,
            "report" => self.parse_report()?,
            _ => return Err(self.error_at(offset, format!("`{keyword}` is not an operation"))),
        })
    }

    fn parse_query(&mut self) -> Result<OpKind> {
        let (offset, name) = (self.offset, self.expect_word("a query")?);
        let Some(query) = Query::from_name(name) else {
            return Err(self.error_at(offset, format!("`{name}` is not a query")));
        };
        let mut operands = Vec::new();
        for _ in query.operand_scalars() {
            if !operands.is_empty() {
                self.expect(',')?;
            }
            operands.push(self.parse_value()?);
        }
        Ok(OpKind::Query(query, operands))
    }

    /// Parses a report, whose text and places the text form does not have.
    fn parse_report(&mut self) -> Result<OpKind> {
        let (offset, label) = (self.offset, self.expect_word("an occasion")?);
        let mut operands = Vec::new();
        while self.at_value() {
            operands.push(self.parse_value()?);
            if !self.maybe(',') {
                break;
            }
        }
        let ty = |value: &Value| ParameterType::Scalar(self.function.scalar(*value));
        let value = |it: &Value| EventValue::new("", ty(it), ValueScope::default());
        let values: Vec<Arc<EventValue>> = operands.iter().map(|it| Arc::new(value(it))).collect();
        let event = Event::without_text(label, &self.function.name, values)
            .ok_or_else(|| self.error_at(offset, format!("`{label}` is not an occasion")))?;
        Ok(OpKind::Report(Arc::new(event), operands))
    }

    fn parse_chain_rule(&mut self) -> Result<OpKind> {
        let value = self.parse_value()?;
        let mut factors = Vec::new();
        while self.maybe(',') {
            let of = self.parse_value()?;
            self.expect(',')?;
            factors.push((of, self.parse_value()?));
        }
        Ok(OpKind::ChainRule(value, factors))
    }

    fn parse_constant(&mut self, results: Values) -> Result<Constant> {
        let scalar = self.result_scalar(results)?;
        let (offset, word) = (self.offset, self.expect_word("a constant")?);
        let bits = word.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let constant = match (bits, scalar) {
            (Some(bits), _) => Some(Constant::from_bits(scalar, bits)),
            (None, Scalar::F32) => word.parse().ok().map(Constant::F32),
            (None, Scalar::I32) => word.parse().ok().map(Constant::I32),
            (None, Scalar::U32) => word.parse().ok().map(Constant::U32),
            (None, Scalar::Bool) => word.parse().ok().map(Constant::Bool),
        };
        constant.ok_or_else(|| {
            self.error_at(offset, format!("`{word}` is not a constant of type {}", scalar.name()))
        })
    }

    fn parse_if(&mut self) -> Result<OpKind> {
        self.expect_keyword("if")?;
        let condition = self.parse_value()?;
        let then = self.parse_region("yield", Vec::new())?;
        self.expect_keyword("else")?;
        let otherwise = self.parse_region("yield", Vec::new())?;
        Ok(OpKind::If { condition, then, otherwise })
    }

    fn parse_loop(&mut self) -> Result<OpKind> {
        self.expect_keyword("loop")?;
        self.expect('(')?;
        let (mut params, mut initial) = (Vec::new(), Vec::new());
        while self.at_value() {
            params.push(self.parse_definition()?);
            self.expect('=')?;
            initial.push(self.parse_value()?);
            if !self.maybe(',') {
                break;
            }
        }
        self.expect(')')?;
        let body = self.parse_region("repeat", params)?;
        Ok(OpKind::Loop { initial, body })
    }

    fn parse_region(&mut self, terminator: &str, params: Vec<Value>) -> Result<Region> {
        if self.depth == MAX_NESTING {
            return Err(self.error(format!("regions are nested deeper than {MAX_NESTING}")));
        }
        self.depth += 1;
        self.expect('{')?;
        let ops = self.parse_ops()?;
        self.expect_keyword(terminator)?;
        let mut yields = Vec::new();
        while self.at_value() {
            yields.push(self.parse_value()?);
            if !self.maybe(',') {
                break;
            }
        }
        self.expect('}')?;
        self.depth -= 1;
        Ok(Region { params, ops, yields })
    }

    fn parse_reference_call(&mut self) -> Result<OpKind> {
        let (offset, callee) = (self.offset, self.expect_word("`role.method`")?);
        let Some((role, method)) = parse_callee(callee) else {
            return Err(self.error_at(offset, format!("`{callee}` is not a `role.method`")));
        };
        self.expect_keyword("of")?;
        let member = self.expect_word("a reference")?.to_owned();
        let path = self.parse_path()?;
        let overrides = self.parse_list(|parser| {
            let component = parser.parse_state_component()?;
            parser.expect('=')?;
            Ok((component, parser.parse_value()?))
        })?;
        self.expect_keyword("gives")?;
        let results = self.parse_list(Self::parse_state_component)?;
        let call = ReferenceCall { member, path, role, method, overrides, results };
        Ok(OpKind::ReferenceCall(Box::new(call)))
    }

    fn parse_path(&mut self) -> Result<ReferencePath> {
        if !self.maybe('@') {
            return Ok(ReferencePath::Single);
        }
        Ok(ReferencePath::Element(self.parse_value()?))
    }

    /// Parses a parenthesised, comma-separated list.
    fn parse_list<T>(&mut self, mut item: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>> {
        self.expect('(')?;
        let mut items = Vec::new();
        while self.token != Token::Punctuation(')') {
            items.push(item(self)?);
            if !self.maybe(',') {
                break;
            }
        }
        self.expect(')')?;
        Ok(items)
    }

    fn parse_state_component(&mut self) -> Result<StateComponent> {
        let (offset, name) = (self.offset, self.expect_word("a state variable")?);
        self.expect('@')?;
        let component = self.parse_number()?;
        StateComponent::named(name, component).ok_or_else(|| {
            let message = format!("there is no component {component} of a variable `{name}`");
            self.error_at(offset, message)
        })
    }

    /// Parses `kind:name`.
    fn parse_variable(&mut self) -> Result<VariableId> {
        let offset = self.offset;
        let kind = self.parse_variable_kind()?;
        self.expect(':')?;
        let name = self.expect_word("the variable's name")?;
        self.variables.get(&(kind, name)).copied().ok_or_else(|| {
            self.error_at(offset, format!("{} `{name}` is not declared", kind.name()))
        })
    }

    /// Parses `kind:name@index`.
    fn parse_element(&mut self) -> Result<(VariableId, Index)> {
        let variable = self.parse_variable()?;
        self.expect('@')?;
        let index = match self.at_value() {
            true => Index::Dynamic(self.parse_value()?),
            false => Index::Constant(self.parse_number()?),
        };
        Ok((variable, index))
    }

    fn parse_values<const N: usize>(&mut self) -> Result<[Value; N]> {
        let mut values = [Value(0); N];
        for (position, value) in values.iter_mut().enumerate() {
            if position > 0 {
                self.expect(',')?;
            }
            *value = self.parse_value()?;
        }
        Ok(values)
    }

    fn parse_value(&mut self) -> Result<Value> {
        if !self.at_value() {
            return Err(self.expected("a value"));
        }
        let (offset, name) = (self.offset, self.expect_word("a value")?);
        let value = self.values.get(name).copied();
        value.ok_or_else(|| self.error_at(offset, format!("value {name} is not defined above")))
    }

    fn parse_number(&mut self) -> Result<u32> {
        let (offset, word) = (self.offset, self.expect_word("a number")?);
        word.parse().map_err(|_| self.error_at(offset, format!("`{word}` is not a number")))
    }

    fn parse_scalar(&mut self) -> Result<Scalar> {
        let (offset, word) = (self.offset, self.expect_word("a type")?);
        Scalar::from_name(word)
            .ok_or_else(|| self.error_at(offset, format!("`{word}` is not a type")))
    }

    fn result_scalar(&self, results: Values) -> Result<Scalar> {
        if results.count == 0 {
            return Err(self.error("this operation must have a result"));
        }
        Ok(self.function.scalar(results.get(0)))
    }

    fn at_value(&self) -> bool {
        matches!(self.token, Token::Word(word) if word.starts_with('%'))
    }

    fn maybe(&mut self, punctuation: char) -> bool {
        let found = self.token == Token::Punctuation(punctuation);
        if found {
            self.advance();
        }
        found
    }

    fn expect(&mut self, punctuation: char) -> Result<()> {
        if self.maybe(punctuation) {
            return Ok(());
        }
        Err(self.expected(&format!("`{punctuation}`")))
    }

    fn expect_keyword(&mut self, keyword: &str) -> Result<()> {
        if self.token != Token::Word(keyword) {
            return Err(self.expected(&format!("`{keyword}`")));
        }
        self.advance();
        Ok(())
    }

    fn expect_word(&mut self, what: &str) -> Result<&'a str> {
        let Token::Word(word) = self.token else { return Err(self.expected(what)) };
        self.advance();
        Ok(word)
    }

    fn advance(&mut self) {
        (self.token, self.offset) = self.lexer.next();
    }

    fn expected(&self, what: &str) -> ParseError {
        let found = match self.token {
            Token::Word(word) => format!("`{word}`"),
            Token::Punctuation(character) => format!("`{character}`"),
            Token::End => "the end of the text".to_owned(),
        };
        self.error(format!("expected {what}, found {found}"))
    }

    fn error(&self, message: impl Into<String>) -> ParseError {
        self.error_at(self.offset, message)
    }

    fn error_at(&self, offset: usize, message: impl Into<String>) -> ParseError {
        let before = &self.text[..offset];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        ParseError {
            line: before.matches('\n').count() as u32 + 1,
            column: before[line_start..].chars().count() as u32 + 1,
            message: message.into(),
        }
    }
}

/// Parses `f32[3]`.
fn parse_variable_type(word: &str) -> Option<(Scalar, u32)> {
    let (scalar, rest) = word.split_once('[')?;
    let len = rest.strip_suffix(']')?.parse().ok()?;
    Some((Scalar::from_name(scalar)?, len))
}

/// Parses `texture.lookup`.
fn parse_callee(word: &str) -> Option<(Role, Method)> {
    let (role, method) = word.split_once('.')?;
    let role = Role::ALL.into_iter().find(|candidate| candidate.name() == role)?;
    Some((role, Method::from_name(method)?))
}
