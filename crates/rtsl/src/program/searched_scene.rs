//! The objects of a scene that has few, among which kernels search.

use std::sync::Arc;

use rtsl_abi::{CallMode, InstanceBlock, Layout, ObjectForm, Objects};
use rtsl_integrate::search::{
    BOX, BOX_SCALARS, EPSILON, ITEM, ITEM_ELEMENTS, ITEM_GROUPS, ITEM_OBJECTS, ITEM_SURFACES,
    Search, SearchLinks, SearchedClassLink, link_search,
};
use rtsl_ir::{Function, Index, OpKind, Variable, VariableKind};
use rtsl_opt::dead_outputs;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::members::Members;
use super::program::Program;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::variant::{Variant, placed_layout};

/// Objects of one class among which rays search.
#[derive(Clone)]
pub struct SearchedClass {
    /// Their program.
    pub program: Arc<Program>,
    /// True if their data contains [placements](crate::Placement).
    pub is_placed: bool,
    /// The objects.
    pub objects: Vec<SearchedObject>,
}

/// An object among which rays search.
#[derive(Clone, Debug)]
pub struct SearchedObject {
    /// Its data, and maybe that of others.
    pub data: Arc<Objects>,
    /// Its index in the data.
    pub index: u32,
    /// The least coordinates of its own box, then the greatest: no hit is outside.
    pub bounds: [f32; BOX_SCALARS as usize],
    /// The index of its item: of equally near hits that of the lowest item counts.
    pub item: u32,
}

/// An item as searches tell of it.
#[derive(Clone, Copy, Debug)]
pub struct SearchedItem {
    /// The object.
    pub object: u32,
    /// The element of it.
    pub element: u32,
    /// The [group](crate::StagedProgram::group_array) of its surface.
    pub group: u32,
    /// The index of its surface among the objects of the group.
    pub surface: u32,
}

/// All objects of a scene, with the kernels that search for hits of rays among them.
#[derive(Debug)]
pub struct SearchedScene {
    pub(crate) links: SearchLinks,
    programs: Vec<Arc<Program>>,
    /// The members.
    pub(crate) layout: Layout,
    /// Their data.
    objects: Arc<Objects>,
}

impl SearchedScene {
    /// Returns the objects of some classes; `None` if a class needs more than the ray and scalars. Rays without an
    /// epsilon of their own have this one, and `slack` is the fraction by which the distances at which rays enter and
    /// leave boxes are widened.
    pub fn new(
        classes: &[SearchedClass],
        items: &[SearchedItem],
        (epsilon, slack): (f32, f32),
    ) -> Option<SearchedScene> {
        let links = classes.iter().enumerate().map(|(index, class)| class.link(index));
        let links = links.map(|link| link.filter(SearchedClassLink::is_complete));
        let links: Vec<SearchedClassLink> = links.collect::<Option<_>>()?;
        let mut members = Members::default();
        members.add(EPSILON, [epsilon.to_bits()]);
        members.add(ITEM_OBJECTS, items.iter().map(|item| item.object));
        members.add(ITEM_ELEMENTS, items.iter().map(|item| item.element));
        members.add(ITEM_GROUPS, items.iter().map(|item| item.group));
        members.add(ITEM_SURFACES, items.iter().map(|item| item.surface));
        for (class, link) in classes.iter().zip(&links) {
            class.add_to(link, &mut members);
        }
        let (layout, block) = members.finish();
        Some(SearchedScene {
            links: SearchLinks { classes: links, items: items.len() as u32, slack },
            programs: classes.iter().map(|class| class.program.clone()).collect(),
            layout,
            objects: Arc::new(Objects::of_instances(ObjectForm::new([]), [block])),
        })
    }

    /// The data of all objects, for which kernels are called: the first of these.
    pub fn objects(&self) -> &Arc<Objects> {
        &self.objects
    }

    /// True if the kernels of another scene serve this one, whatever the data.
    pub fn is_like(&self, other: &SearchedScene) -> bool {
        let form = |scene: &SearchedScene| {
            let classes = scene.programs.iter().zip(&scene.links.classes);
            let classes = classes.map(|(program, link)| {
                (Arc::as_ptr(program), link.count, link.intersect.function.variables.len())
            });
            (classes.collect::<Vec<_>>(), scene.links.slack.to_bits())
        };
        form(self) == form(other) && self.layout == other.layout
    }

    /// The data of all objects as a part of other data.
    pub(crate) fn block(&self) -> &InstanceBlock {
        self.objects.shared()
    }

    /// Returns the linked and optimised functions of these searches, with the layout of their kernels and their
    /// variant. Rays and answers are in the scratch of stages of a program with this layout. Of what searches of
    /// nearest hits find they store the scratch that `is_read`.
    pub(crate) fn link(
        &self,
        searches: &[Search],
        stages: &Layout,
        is_read: &impl Fn(&str) -> bool,
        compiler: &KernelCompiler,
    ) -> Result<Vec<(Function, Layout, Variant)>, Diagnostic> {
        let layout = Layout {
            scratch: stages.scratch.clone(),
            scratch_arrays: stages.scratch_arrays,
            ..self.layout.clone()
        };
        let variant = Variant::new(CallMode::Packet).of_objects(self.objects.form().clone());
        let searches = searches.iter().map(|search| {
            let mut linked = link_search(&self.links, *search)?.function;
            if *search == Search::Nearest {
                let outputs = linked.outputs.iter();
                let read: Vec<bool> =
                    outputs.map(|it| is_read(&linked.variable(it.variable).name)).collect();
                dead_outputs::run(&mut linked, &read);
            }
            let function = compiler.optimise_stage(linked, &variant, &layout);
            Ok((function, variant.layout(&layout), variant.clone()))
        });
        searches.collect()
    }
}

impl SearchedClass {
    fn link(&self, index: usize) -> Option<SearchedClassLink> {
        let intersect = self.program.placed_method(Method::Intersect, self.is_placed).ok()?;
        let prefix = format!("class.{index}.");
        Some(SearchedClassLink { prefix, count: self.objects.len() as u32, intersect })
    }

    /// Adds the members that `intersect` reads, and those of searches, as arrays with the scalars of object after
    /// object.
    fn add_to(&self, link: &SearchedClassLink, members: &mut Members) {
        let SearchedClassLink { prefix, intersect, .. } = link;
        let own = self.program.layout();
        let placed = self.is_placed.then(|| placed_layout(own));
        let layout = placed.as_ref().unwrap_or(own);
        for Variable { name, len, .. } in loaded_members(&intersect.function) {
            let first = layout.members[name];
            let scalars = self
                .objects
                .iter()
                .flat_map(|object| (first..first + len).map(|word| object.word(word)));
            members.add(&format!("{prefix}{name}"), scalars);
        }
        let bounds = self.objects.iter().flat_map(|object| object.bounds);
        members.add(&format!("{prefix}{BOX}"), bounds.map(f32::to_bits));
        members.add(&format!("{prefix}{ITEM}"), self.objects.iter().map(|object| object.item));
    }
}

impl SearchedObject {
    fn word(&self, word: u32) -> u32 {
        match self.data.form().position(word, 1) {
            Some(position) => self.data.word(self.index as usize, position as usize),
            None => self.data.shared().words()[word as usize],
        }
    }
}

/// Returns the members that a function loads.
fn loaded_members(function: &Function) -> Vec<&Variable> {
    let mut loaded = vec![false; function.variables.len()];
    function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, Index::Constant(_) | Index::Dynamic(_)) = &op.kind {
            loaded[variable.0 as usize] = true;
        }
    });
    let variables = function.variables.iter().zip(loaded);
    let members =
        variables.filter(|(variable, loaded)| *loaded && variable.kind == VariableKind::Member);
    members.map(|(variable, _)| variable).collect()
}
