//! Memory addresses of the scalars of a part of a variable.

use std::ops::Range;

use rtsl_ir::{BinaryOp, Index, Scalar, Value, VariableKind};

use crate::Lowering;
use crate::access::{Access, Position, Step};
use crate::leaf_part::{LeafPart, Positions};
use crate::limits::Lowered;
use crate::variables::SourceVariableId;

impl Lowering<'_> {
    /// Computes the addresses of the scalars of a part; every dynamic index left is one into
    /// memory.
    pub fn resolve(&mut self, access: &Access) -> Lowered<Vec<LeafPart>> {
        let layout = &self.variable(access.root).layout;
        let mut leaves = 0..layout.leaves.len();
        let mut steps = access.steps.as_slice();
        // A struct may have many fields: the others are never looked at.
        while let [Step::Field(id, field), rest @ ..] = steps {
            let Range { start, end } = self.layouts.field_leaves(*id, *field, access.span)?;
            leaves = leaves.start + start..leaves.start + end;
            steps = rest;
        }
        let part = |leaf: usize| LeafPart {
            leaf,
            terms: Vec::new(),
            positions: Positions::Range { start: 0, len: layout.leaves[leaf].len },
        };
        let mut parts: Vec<LeafPart> = leaves.map(part).collect();
        for step in steps {
            match step {
                Step::Field(id, field) => {
                    let leaves = self.layouts.field_leaves(*id, *field, access.span)?;
                    parts = parts.drain(leaves).collect();
                }
                Step::Components(components) => {
                    for part in &mut parts {
                        let Positions::Range { start, .. } = part.positions else { continue };
                        let positions = components.iter().map(|pick| start + u32::from(*pick));
                        part.positions = Positions::List(positions.collect());
                    }
                }
                Step::Element { position, count: Some(count), .. } => {
                    self.resolve_element(&mut parts, *position, *count);
                }
                Step::Element { position, count: None, .. } => {
                    self.resolve_buffer_element(access, &mut parts, *position);
                }
            }
        }
        Ok(parts)
    }

    fn resolve_element(&mut self, parts: &mut [LeafPart], position: Position, count: u32) {
        let index = match position {
            Position::Constant(_) => None,
            Position::Dynamic(index) => Some(self.clamp_index(index, count)),
        };
        for part in parts {
            let Positions::Range { start, len } = &mut part.positions else { continue };
            *len /= count;
            match (position, index) {
                (Position::Dynamic(_), Some(index)) => part.terms.push((index, *len)),
                (Position::Constant(constant), _) => *start += constant * *len,
                (Position::Dynamic(_), None) => {}
            }
        }
    }

    fn resolve_buffer_element(
        &mut self,
        access: &Access,
        parts: &mut [LeafPart],
        position: Position,
    ) {
        let index = match position {
            Position::Constant(0) => return,
            Position::Constant(constant) => self.builder.i32(constant as i32),
            Position::Dynamic(index) => index,
        };
        let last = self.last_index_of_buffer(access.root);
        let index = self.clamp_index_to(index, last);
        for part in parts {
            let Positions::Range { len, .. } = part.positions else { continue };
            part.terms.push((index, len));
        }
    }

    /// The number of elements of a buffer variable, i32.
    pub fn length_of_buffer(&mut self, buffer: SourceVariableId) -> Option<Value> {
        let variable = self.variable(buffer);
        let variable = variable.layout.variables(VariableKind::Buffer, &variable.name).next()?;
        let variable = self.builder.variable(variable);
        Some(self.builder.length(variable))
    }

    fn last_index_of_buffer(&mut self, buffer: SourceVariableId) -> Value {
        let one = self.builder.i32(1);
        match self.length_of_buffer(buffer) {
            Some(length) => self.builder.subtract(length, one),
            None => self.builder.i32(0),
        }
    }

    /// Converts the index to an i32 and clamps it to 0 to `count - 1`.
    pub fn clamp_index(&mut self, index: Value, count: u32) -> Value {
        let last = self.builder.i32(count as i32 - 1);
        self.clamp_index_to(index, last)
    }

    /// Converts the index to an i32 and clamps it to 0 to `count - 1`.
    pub fn clamp_index_below(&mut self, index: Value, count: Value) -> Value {
        let one = self.builder.i32(1);
        let last = self.builder.subtract(count, one);
        self.clamp_index_to(index, last)
    }

    fn clamp_index_to(&mut self, index: Value, last: Value) -> Value {
        match self.builder.scalar(index) {
            Scalar::U32 => {
                let last = self.builder.convert(Scalar::U32, last);
                let index = self.builder.binary(BinaryOp::Min, index, last);
                self.builder.convert(Scalar::I32, index)
            }
            _ => {
                let zero = self.builder.i32(0);
                let index = self.builder.binary(BinaryOp::Max, index, zero);
                self.builder.binary(BinaryOp::Min, index, last)
            }
        }
    }

    /// The index of one scalar of a part in its IR variable.
    pub fn index_of(&mut self, part: &LeafPart, position: u32) -> Index {
        let mut sum = None;
        for (index, stride) in &part.terms {
            let stride = self.builder.i32(*stride as i32);
            let one = self.builder.i32(1);
            let term = if stride == one { *index } else { self.builder.multiply(*index, stride) };
            sum = Some(match sum {
                None => term,
                Some(sum) => self.builder.add(sum, term),
            });
        }
        match sum {
            None => Index::Constant(position),
            Some(sum) if position == 0 => Index::Dynamic(sum),
            Some(sum) => {
                let position = self.builder.i32(position as i32);
                Index::Dynamic(self.builder.add(sum, position))
            }
        }
    }
}
