//! Elements: the many objects that hosts make of one instance, such as the triangles of a mesh.
//!
//! Their constructor runs as a packet kernel whose lanes are elements. The kernel reads the element parameter from a
//! lane array and stores members to others, which are then copied into blocks of objects. All other inputs of the
//! constructor are the same for all elements. The constructor is not contracted, as for a single instance, so that the
//! bits are the same.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use rtsl_abi::offsets::OBJECTS_IN_BLOCK;
use rtsl_abi::{
    CallArguments, CallMode, InstanceBlock, Instances, LaneBlock, Layout, ObjectForm, ObjectRow,
    Objects,
};
use rtsl_ir::class::ParameterTarget;
use rtsl_ir::host::NoHost;
use rtsl_ir::{Function, Output, Scalar, Variable, VariableId, VariableKind};
use rtsl_link::ClassTree;
use rtsl_packet::kernel::KernelVariable;
use rtsl_packet::uniformity::Uniformity;
use rtsl_source::Diagnostic;

use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::kernel_source::KernelSource;
use crate::errors;
use crate::instance::instance::{Instance, parameter_name};

/// The number of elements of one call: their arrays fit into the first-level cache, and the overhead of a call is small
/// beside them.
const ELEMENTS_PER_CALL: usize = 512;

/// The greatest number of elements that the interpreter makes, those of all instances of a program together; the
/// compilation of a kernel takes as long.
const MAX_INTERPRETED: usize = 1024;

const IN_BLOCK: usize = OBJECTS_IN_BLOCK as usize;

/// The scratch variable of the constructor's kernel that holds the number of each element.
const NUMBER: &str = "rt_Element";

/// Makes the elements of instances of one program.
#[derive(Debug)]
pub(crate) struct ElementMaker {
    form: ObjectForm,
    /// The constructor; `None` if none of its outputs depends on the element.
    constructor: Option<Constructor>,
    /// The word of each object that holds its number.
    number: Option<usize>,
}

/// A constructor that runs for many elements at once.
#[derive(Debug)]
struct Constructor {
    function: Function,
    /// The number of elements that the interpreter has made, or was to make.
    interpreted_elements: AtomicUsize,
    interpreted: OnceLock<Result<Kernel, Diagnostic>>,
    compiled: OnceLock<Result<Kernel, Diagnostic>>,
    /// The layout of the instance's data before its constructor ran: members, then the constructor's parameters.
    layout: Layout,
    /// The destinations of the outputs.
    outputs: Vec<MadeWord>,
}

/// A word of a member that the constructor sets for each element.
#[derive(Clone, Copy, Debug)]
struct MadeWord {
    /// The scratch array.
    array: usize,
    /// The word of each object.
    position: usize,
    /// True for bools, which are 0 and -1 in lane arrays.
    is_bool: bool,
}

impl ElementMaker {
    /// # Errors
    /// If the class has no element parameter, or its constructor passes a limit.
    pub fn new(tree: &ClassTree, layout: &Layout) -> Result<ElementMaker, Diagnostic> {
        let class = &tree.class;
        let element = class.element().ok_or_else(|| errors::no_elements(class))?;
        let name = element.parameter;
        let target = class.parameters.iter().find(|it| it.name == name).map(|it| it.target);
        let (kind, number_word) = match target {
            Some(ParameterTarget::Member) => (VariableKind::Member, Some(layout.members[name])),
            Some(ParameterTarget::Constructor) | None => (VariableKind::Parameter, None),
        };
        let constructor = class.constructor.as_ref();
        let linked =
            constructor.map(|it| KernelCompiler::link_constructor(tree, it)).transpose()?;
        let draft = linked.map(|function| Draft::new(function, kind, name));
        let draft = draft.filter(|draft| !draft.function.outputs.is_empty());
        let made = draft.iter().flat_map(Draft::members).flat_map(|variable| {
            let first = layout.members[&variable.name];
            first..first + variable.len
        });
        let form = ObjectForm::new(made.chain(number_word));
        let position = |word: u32| form.position(word, 1).map(|position| position as usize);
        let number = number_word.and_then(position);
        let constructor = draft.map(|draft| draft.finish(layout, &form));
        Ok(ElementMaker { form, constructor, number })
    }

    /// Makes `count` elements of an instance whose data is `block`; the element parameter of the `i`th is `number(i)`.
    ///
    /// # Errors
    /// If the constructor has no code, or runs past its budget.
    pub fn make(
        &self,
        instance: &Instance,
        block: InstanceBlock,
        count: usize,
        number: impl Fn(usize) -> u32,
        compiler: &KernelCompiler,
    ) -> Result<Objects, Diagnostic> {
        let words: Vec<u32> =
            self.form.words().iter().map(|word| block.words()[*word as usize]).collect();
        let mut objects = Objects::new(self.form.clone(), block.into(), count);
        // The lanes past the last element repeat it.
        let number = |index: usize| number(index.min(count.saturating_sub(1)));
        for (block, rows) in objects.rows_mut().chunks_exact_mut(words.len().max(1)).enumerate() {
            rows.iter_mut().zip(&words).for_each(|(row, word)| row.0.fill(*word));
            if let Some(position) = self.number {
                rows[position].0 = std::array::from_fn(|lane| number(block * IN_BLOCK + lane));
            }
        }
        if let Some(constructor) = &self.constructor {
            let kernel = constructor.kernel(count, compiler)?;
            constructor.run(kernel, instance, number, &mut objects)?;
        }
        Ok(objects)
    }
}

impl ElementMaker {
    /// True if a function reads data of elements alone, in which those of other instances may take their place.
    pub fn has_all_of(&self, function: &Function, layout: &Layout) -> bool {
        function.variables.iter().all(|variable| match variable.kind {
            VariableKind::Member => layout
                .members
                .get(&variable.name)
                .is_some_and(|first| self.form.position(*first, variable.len).is_some()),
            VariableKind::Buffer | VariableKind::Parameter => false,
            VariableKind::State
            | VariableKind::Scratch
            | VariableKind::Accepted
            | VariableKind::Local => true,
        })
    }
}

impl Constructor {
    /// Returns the kernel for so many more elements.
    fn kernel(&self, count: usize, compiler: &KernelCompiler) -> Result<&Kernel, Diagnostic> {
        let (function, layout, width) = (&self.function, &self.layout, compiler.width());
        let source = KernelSource { function, mode: CallMode::Packet, width, layout };
        let made = self.interpreted_elements.fetch_add(count, Ordering::Relaxed);
        let kernel = if made.saturating_add(count) <= MAX_INTERPRETED {
            self.interpreted.get_or_init(|| compiler.interpreted(source))
        } else {
            self.compiled.get_or_init(|| Ok(compiler.kernels(&[source])?.remove(0)))
        };
        kernel.as_ref().map_err(Clone::clone)
    }

    fn run(
        &self,
        kernel: &Kernel,
        instance: &Instance,
        number: impl Fn(usize) -> u32,
        objects: &mut Objects,
    ) -> Result<(), Diagnostic> {
        let block = instance.unmade_block(&self.layout);
        let (words, count) = (objects.form().words().len(), objects.len());
        let mut state = LaneBlock::sparse(0, &[], ELEMENTS_PER_CALL);
        let mut scratch = LaneBlock::new(self.layout.scratch_arrays as usize, ELEMENTS_PER_CALL);
        let calls = objects.rows_mut().chunks_mut(ELEMENTS_PER_CALL / IN_BLOCK * words);
        for (first, rows) in (0..count).step_by(ELEMENTS_PER_CALL).zip(calls) {
            let numbers = scratch.words_mut(0).iter_mut().zip(first..);
            numbers.for_each(|(word, index)| *word = number(index));
            let status = kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut scratch,
                count: ELEMENTS_PER_CALL.min(count - first),
                mask: None,
                accepted: None,
                instances: Instances::One(&block),
                host: &mut NoHost,
            });
            if status.budget_exhausted {
                return Err(errors::endless_constructor(&self.function.name));
            }
            for output in &self.outputs {
                let (made, _) = scratch.words(output.array).as_chunks::<IN_BLOCK>();
                for (rows, made) in rows.chunks_exact_mut(words).zip(made) {
                    let word = |word: u32| if output.is_bool { word & 1 } else { word };
                    rows[output.position] = ObjectRow(made.map(word));
                }
            }
        }
        Ok(())
    }
}

/// A constructor that is being turned into a kernel.
struct Draft {
    function: Function,
    /// For each output, the member and its component.
    members: Vec<(Variable, u32)>,
}

impl Draft {
    /// Makes the constructor read the element from a lane array and store members to others. Outputs that are the same
    /// for all elements are removed.
    fn new(mut function: Function, element: VariableKind, parameter: &str) -> Draft {
        for variable in &mut function.variables {
            if variable.kind == element && variable.name == parameter {
                (variable.kind, variable.name) = (VariableKind::Scratch, NUMBER.to_owned());
            } else if variable.kind == VariableKind::Parameter {
                (variable.kind, variable.name) =
                    (VariableKind::Member, parameter_name(&variable.name));
            }
        }
        leave_out_uniform(&mut function);
        let mut members = Vec::new();
        for output in &mut function.outputs {
            let mut member = function.variables[output.variable.0 as usize].clone();
            if member.kind == VariableKind::Scratch {
                // The constructor changes the element's number.
                (member.kind, member.name) = (element, parameter.to_owned());
            }
            let name = format!("{}[{}]", member.name, output.component);
            let scratch =
                Variable { kind: VariableKind::Scratch, name, scalar: member.scalar, len: 1 };
            members.push((member, output.component));
            function.variables.push(scratch);
            *output =
                Output { variable: VariableId(function.variables.len() as u32 - 1), component: 0 };
        }
        Draft { function, members }
    }

    /// Returns the members that differ from element to element.
    fn members(&self) -> impl Iterator<Item = &Variable> {
        self.members.iter().map(|(variable, _)| variable)
    }

    fn finish(self, layout: &Layout, form: &ObjectForm) -> Constructor {
        let Draft { function, members } = self;
        let mut layout = Layout {
            scratch: [(NUMBER.to_owned(), 0)].into(),
            scratch_arrays: 1,
            objects: None,
            ..layout.clone()
        };
        for variable in function.variables.iter().filter(|it| it.kind == VariableKind::Member) {
            if !layout.members.contains_key(&variable.name) {
                layout.members.insert(variable.name.clone(), layout.block_words);
                layout.block_words += variable.len;
            }
        }
        let mut outputs = Vec::new();
        for (output, (member, component)) in function.outputs.iter().zip(&members) {
            let word = layout.members[&member.name] + component;
            let Some(position) = form.position(word, 1) else { continue };
            let array = layout.scratch_arrays;
            layout.scratch.insert(function.variable(output.variable).name.clone(), array);
            layout.scratch_arrays += 1;
            outputs.push(MadeWord {
                array: array as usize,
                position: position as usize,
                is_bool: member.scalar == Scalar::Bool,
            });
        }
        Constructor {
            function,
            interpreted_elements: AtomicUsize::new(0),
            interpreted: OnceLock::new(),
            compiled: OnceLock::new(),
            layout,
            outputs,
        }
    }
}

/// Removes outputs that are the same for all elements.
fn leave_out_uniform(function: &mut Function) {
    let variables = function.variables.iter().map(|variable| KernelVariable {
        variable: variable.clone(),
        varies: CallMode::Packet.varies(variable, false),
        location: 0,
        of_objects: false,
    });
    let uniformity = Uniformity::new(function, &variables.collect::<Vec<_>>());
    let varies = function.body.yields.iter().map(|value| uniformity.varies(*value));
    let caller = rtsl_opt::Caller { read: Some(varies.collect()), ..Default::default() };
    rtsl_opt::specialise(function, &caller, true);
}
