//! Constructors of a class and of the classes of its references, as kernels of one function.

use rtsl_abi::{CallMode, Layout};
use rtsl_ir::{Function, Output, Scalar, Variable, VariableId, VariableKind};
use rtsl_llvm::{ConstructedWord, Constructor, ConstructorPart};
use rtsl_source::Diagnostic;

use super::class::Construction;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::kernel_source::KernelSource;
use crate::instance::instance::parameter_name;
use crate::program::program::Program;

/// Returns the constructor of a program's class, after those of its references' classes; `None` if none has one.
pub(super) fn constructor(
    program: &Program,
    construction: &Construction,
    prefix: &str,
    compiler: &KernelCompiler,
) -> Result<Option<Constructor>, Diagnostic> {
    let mut parts = Vec::new();
    for (path, function) in linked(program)? {
        let draft = Draft::new(function, &path);
        if !draft.function.outputs.is_empty() {
            parts.push(draft.finish(construction, compiler)?);
        }
    }
    let symbol = format!("{prefix}_construct");
    Ok((!parts.is_empty()).then_some(Constructor { symbol, parts }))
}

/// Returns the constructors of the classes of a program's references, then that of its class. Variables have the names
/// that they have in the tree.
pub(super) fn constructor_functions(program: &Program) -> Result<Vec<Function>, Diagnostic> {
    let named = linked(program)?.into_iter().map(|(path, mut function)| {
        for variable in &mut function.variables {
            if matches!(
                variable.kind,
                VariableKind::Parameter | VariableKind::Member | VariableKind::Buffer
            ) {
                variable.name = format!("{path}{}", variable.name);
            }
        }
        function
    });
    Ok(named.filter(|function| !function.outputs.is_empty()).collect())
}

/// Links the constructors, with the paths to their classes.
fn linked(program: &Program) -> Result<Vec<(String, Function)>, Diagnostic> {
    let mut all = Vec::new();
    // Instances are constructed after those they refer to.
    program.tree().for_each_node(&mut |tree, path| {
        let Some(constructor) = &tree.class.constructor else { return Ok(()) };
        all.push((path.to_owned(), KernelCompiler::link_constructor(tree, constructor)?));
        Ok(())
    })?;
    Ok(all)
}

/// A constructor that reads parameters as members, and stores members to scratch.
struct Draft {
    function: Function,
    /// For each output, the member and its component.
    members: Vec<(Variable, u32)>,
}

impl Draft {
    fn new(mut function: Function, path: &str) -> Draft {
        for variable in &mut function.variables {
            match variable.kind {
                VariableKind::Parameter => {
                    variable.kind = VariableKind::Member;
                    variable.name = format!("{path}{}", parameter_name(&variable.name));
                }
                VariableKind::Member | VariableKind::Buffer => {
                    variable.name = format!("{path}{}", variable.name);
                }
                VariableKind::State
                | VariableKind::Scratch
                | VariableKind::Local
                | VariableKind::Accepted => {}
            }
        }
        let mut members = Vec::new();
        for index in 0..function.outputs.len() {
            let Output { variable, component } = function.outputs[index];
            let member = function.variable(variable).clone();
            let name = format!("{}[{component}]", member.name);
            function.variables.push(Variable {
                kind: VariableKind::Scratch,
                name,
                scalar: member.scalar,
                len: 1,
            });
            let variable = VariableId(function.variables.len() as u32 - 1);
            function.outputs[index] = Output { variable, component: 0 };
            members.push((member, component));
        }
        Draft { function, members }
    }

    fn finish(
        self,
        construction: &Construction,
        compiler: &KernelCompiler,
    ) -> Result<ConstructorPart, Diagnostic> {
        let Draft { function, members } = self;
        let scratch = function.outputs.iter().zip(0..);
        let scratch =
            scratch.map(|(it, array)| (function.variable(it.variable).name.clone(), array));
        let layout = Layout {
            scratch: scratch.collect(),
            scratch_arrays: function.outputs.len() as u32,
            ..construction.layout.clone()
        };
        let outputs = members.iter().map(|(member, component)| ConstructedWord {
            word: layout.members[&member.name] + component,
            is_bool: member.scalar == Scalar::Bool,
        });
        let outputs = outputs.collect();
        let source =
            KernelSource { function: &function, mode: CallMode::Single, width: 1, layout: &layout };
        Ok(ConstructorPart { kernel: compiler.packet(source)?, outputs })
    }
}
