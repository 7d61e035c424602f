//! Instances of one role, grouped by program.

use std::collections::BTreeMap;
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
    /// The classes.
    pub classes: Vec<InstanceClass>,
    /// For each instance its class, and its index there.
    pub indices: Vec<(u32, u32)>,
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
            indices.push((class, index_in_class.len() as u32));
            index_in_class.push(instance);
        }
        let classes = members.into_iter().map(|(program, instances)| {
            let objects = Arc::new(program.differing_objects(instances));
            InstanceClass { program, objects }
        });
        InstanceClasses { classes: classes.collect(), indices }
    }
}
