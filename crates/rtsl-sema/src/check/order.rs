//! The order in which to declare structs, enumerations and constants that may refer to each other.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_syntax::ast::{Expression, ExpressionKind, Initializer, Item, TypeName};

/// The order of the structs and constants among some items.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// The indices of the items, each after those that it refers to.
    pub(super) sorted: Vec<usize>,
    /// One item of each cycle of declarations.
    pub(super) circular: BTreeSet<usize>,
}

/// Sorts the structs and constants among `items` so that each can be declared after those it refers
/// to.
pub(super) fn declaration_order(items: &[&Item]) -> Order {
    let mut declared: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, item) in items.iter().enumerate() {
        match item {
            Item::Struct(declaration) => {
                declared.entry(&declaration.name.name).or_insert(index);
            }
            Item::Enumeration(declaration) => {
                let choices = declaration.choices.iter().map(|(choice, _)| choice);
                for name in std::iter::once(&declaration.name).chain(choices) {
                    declared.entry(&name.name).or_insert(index);
                }
            }
            Item::Variable(variable) => {
                declared.entry(&variable.name.name).or_insert(index);
            }
            Item::Assertion(_) | Item::Function(_) | Item::Class(_) => {}
        }
    }
    let mut order = Order::default();
    let mut marks = vec![Mark::New; items.len()];
    for start in 0..items.len() {
        visit(start, items, &declared, &mut marks, &mut order);
    }
    order
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Mark {
    New,
    /// Waits for the items that it refers to.
    Open,
    Done,
}

/// Searches depth first with an explicit stack, since chains of constants have no bound.
fn visit(
    start: usize,
    items: &[&Item],
    declared: &BTreeMap<&str, usize>,
    marks: &mut [Mark],
    order: &mut Order,
) {
    let declares_none =
        matches!(items[start], Item::Assertion(_) | Item::Function(_) | Item::Class(_));
    if marks[start] != Mark::New || declares_none {
        return;
    }
    marks[start] = Mark::Open;
    let mut stack = vec![(start, needed(items[start], declared))];
    while let Some((index, pending)) = stack.last_mut() {
        let Some(next) = pending.pop() else {
            marks[*index] = Mark::Done;
            order.sorted.push(*index);
            stack.pop();
            continue;
        };
        match marks[next] {
            Mark::New => {
                marks[next] = Mark::Open;
                stack.push((next, needed(items[next], declared)));
            }
            Mark::Open => {
                order.circular.insert(next);
            }
            Mark::Done => {}
        }
    }
}

/// The items that `item` refers to, the first last.
fn needed(item: &Item, declared: &BTreeMap<&str, usize>) -> Vec<usize> {
    let mut names = Vec::new();
    match item {
        Item::Struct(declaration) => {
            for field in &declaration.fields {
                names_of_type(&field.ty, &mut names);
            }
        }
        Item::Enumeration(declaration) => {
            for value in declaration.choices.iter().filter_map(|(_, value)| value.as_ref()) {
                names_of(value, &mut names);
            }
            // Values may be those of choices before.
            let own =
                |name: &&str| declaration.choices.iter().any(|(choice, _)| choice.name == **name);
            names.retain(|name| !own(name));
        }
        Item::Variable(variable) => {
            names_of_type(&variable.ty, &mut names);
            if let Some(initializer) = &variable.initializer {
                names_of_initializer(initializer, &mut names);
            }
        }
        Item::Assertion(_) | Item::Function(_) | Item::Class(_) => {}
    }
    names.iter().rev().filter_map(|name| declared.get(name).copied()).collect()
}

fn names_of_type<'a>(ty: &'a TypeName, names: &mut Vec<&'a str>) {
    names.push(&ty.name.name);
    for size in ty.sizes.iter().flatten() {
        names_of(size, names);
    }
}

fn names_of_initializer<'a>(initializer: &'a Initializer, names: &mut Vec<&'a str>) {
    match initializer {
        Initializer::Expression(expression) => names_of(expression, names),
        Initializer::List(items, _) => {
            for item in items {
                names_of_initializer(item, names);
            }
        }
    }
}

fn names_of<'a>(expression: &'a Expression, names: &mut Vec<&'a str>) {
    let (first, links) = expression.chain();
    names_of_operand(first, names);
    for link in links {
        if let ExpressionKind::Binary(_, _, right) | ExpressionKind::Sequence(_, right) = &link.kind
        {
            names_of(right, names);
        }
    }
}

/// Collects the names in an expression that is not a link of a chain.
fn names_of_operand<'a>(expression: &'a Expression, names: &mut Vec<&'a str>) {
    match &expression.kind {
        ExpressionKind::Error
        | ExpressionKind::Sequence(..)
        | ExpressionKind::Binary(..)
        | ExpressionKind::Int(_)
        | ExpressionKind::Uint(_)
        | ExpressionKind::Float(_)
        | ExpressionKind::Bool(_) => {}
        ExpressionKind::Name(name) => names.push(name),
        ExpressionKind::Assign { target, value, .. } => {
            names_of(target, names);
            names_of(value, names);
        }
        ExpressionKind::Unary(_, operand)
        | ExpressionKind::Step { target: operand, .. }
        | ExpressionKind::Member(operand, _) => names_of(operand, names),
        ExpressionKind::Conditional(condition, then, otherwise) => {
            names_of(condition, names);
            names_of(then, names);
            names_of(otherwise, names);
        }
        ExpressionKind::Index(base, index) => {
            names_of(base, names);
            if let Some(index) = index {
                names_of(index, names);
            }
        }
        ExpressionKind::Call { callee, arguments }
        | ExpressionKind::MethodCall { receiver: callee, arguments, .. } => {
            names_of(callee, names);
            for argument in arguments {
                names_of(argument, names);
            }
        }
    }
}
