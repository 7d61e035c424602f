//! Every class of the standard library keeps its contracts: with its defaults, over the ranges of its
//! parameters, and as the table says.

use std::sync::Arc;

use rtsl::{Class, Compiler, Engine, Instance, Role, Value, library};
use rtsl_contract::{Options, check, engine_options, settings};

/// The classes of a role.
fn classes(role: Role) -> Vec<Arc<Class>> {
    let compiler = Compiler::default();
    let units = library::files().iter().filter_map(|it| compiler.compile(it.path, it.text).unit);
    let classes = units.flat_map(|unit| unit.classes().to_vec());
    classes.filter(|class| class.roles.contains(&role)).collect()
}

/// What is broken, as text.
fn broken(engine: &Engine, name: &str, instance: &Arc<Instance>, options: &Options) -> String {
    let report = check(engine, instance, options);
    let report = report.unwrap_or_else(|problem| panic!("{name}: {}", problem.message));
    if std::env::var_os("RTSL_SHOW_REPORTS").is_some() {
        eprintln!("{name}\n{report}");
    }
    if report.holds() { String::new() } else { format!("{name}\n{report}\n") }
}

fn check_role(role: Role, options: &Options) {
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let mut all = String::new();
    for class in classes(role) {
        let mut program = None;
        for setting in settings(&class) {
            let name = format!("{} with {setting}", class.name);
            let instance = setting
                .instance(&class, &required(&class))
                .unwrap_or_else(|it| panic!("{name}: {:?}", it.into_vec()));
            // Kernels are kept while somebody has the program.
            program.get_or_insert_with(|| engine.program(&instance));
            all += &broken(&engine, &name, &instance, options);
        }
    }
    assert!(all.is_empty(), "{all}");
}

/// Values for what has no default.
fn required(_class: &Class) -> Vec<(String, Value)> {
    Vec::new()
}

#[test]
fn materials() {
    check_role(Role::Material, &Options { samples: 8_000, ..Options::default() });
}
