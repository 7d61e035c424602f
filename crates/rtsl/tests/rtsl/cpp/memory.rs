//! The inputs and results of a call, in words.

use std::collections::BTreeMap;

use rtsl_abi::description::{ClassDescription, FieldKind};
use rtsl_ir::{Function, Interpreter, Storage, Variable, VariableId, VariableKind};
use rtsl_testing::functions::HashHost;

/// The words of one call.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    pub block: Vec<u32>,
    /// By the first word of their entries: elements, and their words.
    pub buffers: BTreeMap<u32, (u32, Vec<u32>)>,
    /// By the components of the one table.
    pub state: Vec<u32>,
    pub scratch: Vec<u32>,
}

impl Memory {
    /// Runs a function of the class: whether it accepted a hit, and whether its budget ran out.
    pub fn run(&mut self, class: &ClassDescription, function: &Function) -> (bool, bool) {
        let variables = function.variables.iter().map(|variable| locate(class, variable)).collect();
        let mut interpreter = Interpreter::prepare(function).unwrap();
        let mut storage = Located { memory: self, variables };
        let outcome = interpreter.run(0, &mut storage, &mut HashHost::default());
        (outcome.accepted, outcome.budget_exceeded)
    }
}

#[derive(Clone, Copy)]
enum Location {
    State(usize),
    Block(usize),
    Buffer(u32),
    Scratch(usize),
    Nowhere,
}

fn locate(class: &ClassDescription, variable: &Variable) -> Location {
    let kind = match variable.kind {
        VariableKind::State => {
            let variable = rtsl_spec::lookup_state(&variable.name).unwrap();
            return Location::State(variable.first_component as usize);
        }
        VariableKind::Member => FieldKind::Member,
        VariableKind::Parameter => FieldKind::Parameter,
        VariableKind::Buffer => FieldKind::Buffer,
        VariableKind::Scratch => FieldKind::Scratch,
        VariableKind::Local | VariableKind::Accepted => return Location::Nowhere,
    };
    let mut fields = class.fields.iter().chain(&class.scratch);
    let field = fields.find(|field| field.kind == kind && field.name == variable.name).unwrap();
    match kind {
        FieldKind::Scratch => Location::Scratch(field.offset as usize),
        FieldKind::Buffer => Location::Buffer(field.offset),
        FieldKind::Member | FieldKind::Parameter => Location::Block(field.offset as usize),
    }
}

struct Located<'a> {
    memory: &'a mut Memory,
    variables: Vec<Location>,
}

impl Storage for Located<'_> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        let index = index as usize;
        match self.variables[variable.0 as usize] {
            Location::State(first) => self.memory.state[first + index],
            Location::Block(first) => self.memory.block[first + index],
            Location::Buffer(offset) => self.memory.buffers[&offset].1[index],
            Location::Scratch(first) => self.memory.scratch[first + index],
            Location::Nowhere => unreachable!("it has no storage"),
        }
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        match self.variables[buffer.0 as usize] {
            Location::Buffer(offset) => self.memory.buffers[&offset].0,
            _ => unreachable!("it is no buffer"),
        }
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        let index = component as usize;
        match self.variables[variable.0 as usize] {
            Location::State(first) => self.memory.state[first + index] = bits,
            Location::Block(first) => self.memory.block[first + index] = bits,
            Location::Scratch(first) => self.memory.scratch[first + index] = bits,
            Location::Buffer(_) | Location::Nowhere => unreachable!("it is not stored to"),
        }
    }
}
