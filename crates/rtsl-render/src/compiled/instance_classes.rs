//! Instances of one role, grouped by program.

use std::collections::BTreeMap;
use std::ops::Index;
use std::sync::Arc;

use rtsl::{Engine, Instance, Objects, Program};

/// Instances of one program, by index.
pub struct InstanceClass {
    /// The program.
    pub program: Arc<Program>,
    /// The instances' members.
    pub objects: Arc<Objects>,
}

/// Instances by class.
#[derive(Default)]
pub struct InstanceClasses {
    classes: Vec<InstanceClass>,
    /// For each instance its class, and its index there.
    indices: Vec<(InstanceClassId, u32)>,
}

/// Identifies one of the classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InstanceClassId(u32);

impl Index<InstanceClassId> for InstanceClasses {
    type Output = InstanceClass;

    #[inline]
    fn index(&self, class: InstanceClassId) -> &InstanceClass {
        &self.classes[class.0 as usize]
    }
}

impl InstanceClasses {
    /// Groups these instances.
    pub fn new(engine: &Engine, instances: &[Arc<Instance>]) -> Self {
        let mut by_program: BTreeMap<usize, u32> = BTreeMap::new();
        let mut members: Vec<(Arc<Program>, Vec<&Instance>)> = Vec::new();
        let mut indices = Vec::with_capacity(instances.len());
        for instance in instances {
            let program = engine.program(instance);
            let next = members.len() as u32;
            let class = *by_program.entry(Arc::as_ptr(&program) as usize).or_insert(next);
            if class == next {
                members.push((program, Vec::new()));
            }
            let (_, index_in_class) = &mut members[class as usize];
            indices.push((InstanceClassId(class), index_in_class.len() as u32));
            index_in_class.push(instance);
        }
        let classes = members.into_iter().map(|(program, instances)| {
            let objects = Arc::new(program.differing_objects(instances));
            InstanceClass { program, objects }
        });
        InstanceClasses { classes: classes.collect(), indices }
    }

    /// True if there are no instances.
    pub fn is_empty(&self) -> bool {
        self.classes.is_empty()
    }

    /// Returns the class of an instance, and its index there.
    pub fn place(&self, instance: usize) -> (InstanceClassId, u32) {
        self.indices[instance]
    }
}
