//! Lowers functions of no class, which hosts of the language call: those of the texts that surround an integrator.

use std::cell::RefCell;

use rtsl_ir::{Value, Variable, VariableKind};
use rtsl_sema::hir::{Class, FunctionId, Module, Passing, Type};
use rtsl_source::{Diagnostic, deep_stack};

use crate::Purpose;
use crate::class::{Maker, is_buffer};
use crate::facts::FactTable;
use crate::layout::Layouts;
use crate::limits::Lowered;

/// The name of the variable with a function's result.
const RESULT: &str = "result";

/// A function of no class. All its operations are precise. It writes `out` parameters and no state.
#[derive(Clone, Debug)]
pub struct LoweredFunction {
    /// The function. It loads its parameters from scratch of their names, arrays without a size from buffers. Its
    /// outputs are the result, in scratch called `result`, and `out` parameters.
    pub function: rtsl_ir::Function,
    /// The variables of its parameters but those that are `out`, in order.
    pub parameters: Vec<Variable>,
}

/// Lowers a function of a checked module without errors.
///
/// # Errors
/// If a limit on the size of types or functions is exceeded.
pub fn lower_function(module: &Module, id: FunctionId) -> Result<LoweredFunction, Diagnostic> {
    let span = module.functions[id.0 as usize].span;
    let class = Class {
        name: "renderer".to_owned(),
        roles: Vec::new(),
        documentation: None,
        members: Vec::new(),
        constructor: None,
        methods: Vec::new(),
        is_imported: false,
        span,
    };
    deep_stack::run(|| {
        let maker = Maker {
            module,
            class: &class,
            layouts: &Layouts::new(module),
            facts: &FactTable::new(module, [id], &[]),
            tables: &RefCell::default(),
            tested: &RefCell::default(),
            tracing: None,
        };
        maker.make_function(id).map_err(|diagnostic| *diagnostic)
    })
}

impl Maker<'_> {
    fn make_function(&self, id: FunctionId) -> Lowered<LoweredFunction> {
        let function = &*self.module.functions[id.0 as usize];
        let mut lowering = self.lowering(Purpose::Function, &function.name, Some(id));
        lowering.builder.set_precise(true);
        lowering.frame = lowering.new_frame(id, function.span)?;
        lowering.begin_parameters(id, VariableKind::Scratch)?;
        lowering.lower_list(&function.body)?;
        let returned = lowering.leave_frame(function)?;
        let mut output = |name: &str, ty: &Type, values: &[Value]| -> Lowered<()> {
            let kind = VariableKind::Scratch;
            let variable = lowering.new_host_variable(name, ty, kind, function.span)?;
            lowering.output_variable(variable, kind, values);
            Ok(())
        };
        output(RESULT, &function.result, &returned.result)?;
        for (local, values) in function.locals.iter().zip(returned.outputs) {
            if let Some(values) = values {
                output(&local.name, &local.ty, &values)?;
            }
        }
        let mut parameters = Vec::new();
        for (local, passing) in function.locals.iter().zip(&function.parameters) {
            if *passing != Passing::Out {
                let is_buffer = is_buffer(&local.ty);
                let kind = if is_buffer { VariableKind::Buffer } else { VariableKind::Scratch };
                let layout = self.layouts.layout(&local.ty, function.span)?;
                parameters.extend(layout.variables(kind, &local.name));
            }
        }
        debug_assert!(self.tables.borrow().iter().next().is_none(), "it indexes no constants");
        Ok(LoweredFunction { function: lowering.builder.finish(), parameters })
    }
}
