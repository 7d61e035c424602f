//! The variables of a function that are the same for all rays of a packet, in calls for rays and one object.
//!
//! These are a part: the compiler, which looks at values after its passes, may find more.
//!
//! What varies is what can be reached in a graph. Its nodes are variables, values and masks; an edge leads from what a
//! node depends on to the node. The work is in proportion to the function.

use rtsl::Span;
use rtsl_sema::hir::{
    Expression, ExpressionKind, Function, LocalId, Module, Statement, StatementKind, Storage,
};
use rtsl_spec::Direction;
use rtsl_spec::builtins::{self, Builtin, Lowering, Usable};

use crate::visit;

/// The functions of a module that may read what differs between rays, beside their parameters.
pub(crate) struct RayReaders<'m> {
    module: &'m Module,
    /// By the indices of functions.
    reads: Vec<bool>,
}

impl<'m> RayReaders<'m> {
    /// Finds them.
    pub fn of(module: &'m Module) -> RayReaders<'m> {
        let mut graph = Graph::default();
        graph.add_nodes(module.functions.len());
        for (index, function) in module.functions.iter().enumerate() {
            let caller = Node(index as u32);
            visit::for_each_expression(function, &mut |expression| match &expression.kind {
                ExpressionKind::Call(id, _) => graph.add_edge(Node(id.0), caller),
                ExpressionKind::Local(_) => {}
                _ if reads_ray(module, function, expression) => graph.roots.push(caller),
                _ => {}
            });
        }
        let mut reads = graph.reached();
        reads.truncate(module.functions.len());
        RayReaders { module, reads }
    }
}

/// Returns the variables of a method that are uniform, each with the span of its declaration.
pub(crate) fn uniform_locals(
    readers: &RayReaders<'_>,
    function: &Function,
) -> Vec<(LocalId, Span)> {
    let mut rates = Rates { readers, function, graph: Graph::default(), declared: Vec::new() };
    rates.graph.add_nodes(function.locals.len());
    rates.graph.roots.extend((0..function.parameters.len() as u32).map(Node));
    let all_rays = rates.graph.add_node([]);
    rates.statements(&function.body, all_rays);
    let Rates { graph, declared, .. } = rates;
    let varying = graph.reached();
    declared.into_iter().filter(|(local, _)| !varying[local.0 as usize]).collect()
}

/// A variable, a value or a mask. The first nodes of a function's graph are its variables.
#[derive(Clone, Copy)]
struct Node(u32);

#[derive(Default)]
struct Graph {
    /// The nodes that depend on each.
    users: Vec<Vec<Node>>,
    /// The nodes that vary by themselves.
    roots: Vec<Node>,
}

impl Graph {
    fn add_nodes(&mut self, count: usize) {
        self.users.resize_with(self.users.len() + count, Vec::new);
    }

    /// Adds a node that depends on these.
    fn add_node<const N: usize>(&mut self, sources: [Node; N]) -> Node {
        let node = Node(self.users.len() as u32);
        self.users.push(Vec::new());
        sources.into_iter().for_each(|source| self.add_edge(source, node));
        node
    }

    fn add_edge(&mut self, source: Node, user: Node) {
        self.users[source.0 as usize].push(user);
    }

    /// True for each node that depends on a root.
    fn reached(&self) -> Vec<bool> {
        let mut reached = vec![false; self.users.len()];
        let mut waiting = self.roots.clone();
        while let Some(node) = waiting.pop() {
            if !std::mem::replace(&mut reached[node.0 as usize], true) {
                waiting.extend(&self.users[node.0 as usize]);
            }
        }
        reached
    }
}

struct Rates<'m> {
    readers: &'m RayReaders<'m>,
    function: &'m Function,
    graph: Graph,
    declared: Vec<(LocalId, Span)>,
}

impl Rates<'_> {
    /// Adds statements that run under a mask, and returns the mask of the rays that jump.
    fn statements(&mut self, body: &[Statement], mask: Node) -> Node {
        let jumps = self.graph.add_node([]);
        let mut mask = mask;
        for statement in body {
            let jump = self.statement(statement, mask);
            self.graph.add_edge(jump, jumps);
            // After a jump of some rays the rest of the body runs for the others.
            mask = self.graph.add_node([mask, jump]);
        }
        jumps
    }

    fn statement(&mut self, statement: &Statement, mask: Node) -> Node {
        match &statement.kind {
            StatementKind::Expression(value) => {
                self.value(value, mask);
            }
            StatementKind::Declare(local, value) => {
                self.declared.push((*local, statement.span));
                if let Some(value) = value {
                    let value = self.value(value, mask);
                    self.graph.add_edge(value, Node(local.0));
                }
            }
            StatementKind::Block(body) => return self.statements(body, mask),
            StatementKind::If { condition, then, otherwise } => {
                let condition = self.value(condition, mask);
                let mask = self.graph.add_node([mask, condition]);
                let jumps = [self.statements(then, mask), self.statements(otherwise, mask)];
                return self.graph.add_node(jumps);
            }
            StatementKind::Switch { selector, cases } => {
                let selector = self.value(selector, mask);
                let mask = self.graph.add_node([mask, selector]);
                let jumps = self.graph.add_node([]);
                for case in cases {
                    let jump = self.statements(&case.body, mask);
                    self.graph.add_edge(jump, jumps);
                }
                return jumps;
            }
            StatementKind::Loop(it) => {
                self.statements(&it.initializer, mask);
                let mask = self.graph.add_node([mask]);
                if let Some(condition) = &it.condition {
                    let condition = self.value(condition, mask);
                    self.graph.add_edge(condition, mask);
                    if let Some(local) = it.declaration {
                        self.graph.add_edge(condition, Node(local.0));
                    }
                }
                let jumps = self.statements(&it.body, mask);
                self.graph.add_edge(jumps, mask);
                it.step.iter().for_each(|step| {
                    self.value(step, mask);
                });
                return jumps;
            }
            StatementKind::Illuminance(it) => {
                let some_rays = self.varying();
                return self.statements(&it.body, some_rays);
            }
            StatementKind::Return(value) => {
                value.iter().for_each(|value| {
                    self.value(value, mask);
                });
                return mask;
            }
            StatementKind::Break | StatementKind::Continue => return mask,
            StatementKind::Print { .. } => {}
        }
        self.graph.add_node([])
    }

    fn varying(&mut self) -> Node {
        let node = self.graph.add_node([]);
        self.graph.roots.push(node);
        node
    }

    /// Adds the value of an expression, and what the expression assigns under a mask.
    fn value(&mut self, whole: &Expression, mask: Node) -> Node {
        let node = self.graph.add_node([]);
        self.add(whole, node, mask);
        node
    }

    /// Adds what the value `user` depends on by an expression.
    fn add(&mut self, whole: &Expression, user: Node, mask: Node) {
        // Chains may be as long as the text.
        let (first, links) = whole.chain();
        for right in links.into_iter().filter_map(visit::right_operand) {
            self.add(right, user, mask);
        }
        match &first.kind {
            ExpressionKind::Assign { target, value, .. } => {
                let value = self.value(value, mask);
                self.graph.add_edge(value, user);
                self.assign(target, value, user, mask);
            }
            ExpressionKind::Step { target, .. } => {
                let step = self.graph.add_node([]);
                self.assign(target, step, user, mask);
            }
            ExpressionKind::Call(id, arguments) => {
                if self.readers.reads[id.0 as usize] {
                    self.graph.roots.push(user);
                }
                // What a call passes out is unknown.
                self.pass_out(arguments);
            }
            ExpressionKind::Builtin(call) if passes_out(call.builtin) => {
                self.pass_out(&call.arguments);
                self.add_own(first, user);
            }
            _ => self.add_own(first, user),
        }
        if !matches!(first.kind, ExpressionKind::Assign { .. } | ExpressionKind::Step { .. }) {
            for operand in visit::operands(first) {
                self.add(operand, user, mask);
            }
        }
    }

    /// Adds what an expression reads by itself, without its operands.
    fn add_own(&mut self, expression: &Expression, user: Node) {
        if let ExpressionKind::Local(local) = &expression.kind {
            self.graph.add_edge(Node(local.0), user);
        } else if reads_ray(self.readers.module, self.function, expression) {
            self.graph.roots.push(user);
        }
    }

    /// Adds an assignment of a value to a place under a mask; `user` is the value of the whole expression.
    fn assign(&mut self, target: &Expression, value: Node, user: Node, mask: Node) {
        let mut place = target;
        loop {
            match &place.kind {
                ExpressionKind::Index(base, index) => {
                    let index = self.value(index, mask);
                    self.graph.add_edge(index, value);
                    self.graph.add_edge(index, user);
                    place = base;
                }
                ExpressionKind::Field(base, _) | ExpressionKind::Swizzle(base, _) => place = base,
                ExpressionKind::Local(local) => {
                    let local = Node(local.0);
                    self.graph.add_edge(value, local);
                    self.graph.add_edge(mask, local);
                    return self.graph.add_edge(local, user);
                }
                _ => return self.add(place, user, mask),
            }
        }
    }

    fn pass_out(&mut self, arguments: &[Expression]) {
        let locals = arguments.iter().filter_map(root).map(|local| Node(local.0));
        self.graph.roots.extend(locals);
    }
}

/// True if an expression reads by itself what differs between rays, beside variables and through calls.
fn reads_ray(module: &Module, function: &Function, expression: &Expression) -> bool {
    match &expression.kind {
        ExpressionKind::Member(member) => {
            let class = function.class.map(|id| &module.classes[id.0 as usize]);
            let storage = class.map(|class| class.members[member.0 as usize].storage);
            !matches!(storage, Some(Storage::Public | Storage::Private))
        }
        ExpressionKind::State(_)
        | ExpressionKind::Textured(_)
        | ExpressionKind::Computed(..)
        | ExpressionKind::ReferenceCall(_)
        | ExpressionKind::Error => true,
        ExpressionKind::Builtin(call) => {
            call.builtin.usable != Usable::Anywhere
                || matches!(call.builtin.lowering, Lowering::Special(_))
        }
        _ => false,
    }
}

/// The variable whose part a place is.
fn root(place: &Expression) -> Option<LocalId> {
    match &place.kind {
        ExpressionKind::Local(local) => Some(*local),
        ExpressionKind::Index(base, _)
        | ExpressionKind::Field(base, _)
        | ExpressionKind::Swizzle(base, _) => root(base),
        _ => None,
    }
}

/// True if some form of a built-in function has an `out` parameter.
fn passes_out(builtin: &Builtin) -> bool {
    let parameters = builtins::overloads(builtin.name).iter().flat_map(|it| &it.parameters);
    parameters.into_iter().any(|parameter| parameter.direction != Direction::In)
}
