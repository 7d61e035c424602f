//! The comparison of a case with RTSL.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::Class;

use crate::case::{Case, Expect, Stage, Step, shape_of, word_of};
use crate::drawing::draw;
use crate::items::Storage;
use crate::reference;
use crate::rules;
use crate::run::{Problem, Runner, Words};
use crate::translate::{Translation, translate};

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is about something that the manual names as different.
    Excluded(&'static str),
    Agrees,
    /// The reason.
    Differs(String),
}

/// A stage's translation and class.
pub struct Compiled {
    pub stage: Stage,
    pub translation: Translation,
    pub class: Option<Arc<Class>>,
}

/// Compiles a case, runs it, and compares.
pub fn judge(case: &Case, runner: &Runner) -> Outcome {
    if let Some(rule) = rules::before(case) {
        return Outcome::Excluded(rule);
    }
    let outputs: BTreeSet<&str> = case.values.outputs.iter().map(|it| it.name.as_str()).collect();
    let mut stages = Vec::new();
    let mut errors = Vec::new();
    for shader in &case.shaders {
        let translation = translate(shader, case.version, &outputs);
        let verdict = runner.compile(&translation.text);
        errors.extend(verdict.errors);
        stages.push(Compiled { stage: shader.stage, translation, class: verdict.class });
    }
    if case.expect == Expect::Refused {
        return match rules::lacking(&errors) {
            Some(rule) => Outcome::Excluded(rule),
            None if errors.is_empty() => accepted(case),
            None => Outcome::Agrees,
        };
    }
    if let Some(Problem { code, message }) = errors.first() {
        // Others may follow from the first.
        if let Some(rule) = rules::refused(&errors[0]) {
            return Outcome::Excluded(rule);
        }
        if reference::is_installed() && !reference::accepts(case) {
            return Outcome::Excluded(rules::LATER);
        }
        return Outcome::Differs(format!("{code} {message}"));
    }
    if case.expect == Expect::Accepted {
        return Outcome::Agrees;
    }
    let compared = if case.steps.is_empty() {
        compare(case, &stages, runner)
    } else {
        draw(case, &stages, runner)
    };
    match compared {
        Ok(()) => Outcome::Agrees,
        Err(problem) => match rules::failed(&problem) {
            Some(rule) => Outcome::Excluded(rule),
            None => Outcome::Differs(problem),
        },
    }
}

/// The outcome of a case that expects to be refused and was accepted. GLSL 4.60, whose core RTSL has, accepts much that
/// earlier versions and GLSL ES refuse; its reference compiler tells what.
fn accepted(case: &Case) -> Outcome {
    if reference::accepts(case) {
        return Outcome::Excluded(rules::EARLIER);
    }
    match rules::accepted(case) {
        Some(rule) => Outcome::Excluded(rule),
        None => Outcome::Differs("accepted".to_owned()),
    }
}

/// Runs a program for each row of its values.
fn compare(case: &Case, stages: &[Compiled], runner: &Runner) -> Result<(), String> {
    let values = &case.values;
    let lists = [&values.inputs, &values.outputs];
    let rows = lists.iter().flat_map(|it| it.iter()).map(|it| it.rows.len()).max().unwrap_or(1);
    for row in 0..rows {
        let mut given = Words::new();
        for value in values.inputs.iter().chain(&values.uniforms) {
            given.insert(value.name.clone(), value.row(row).to_vec());
        }
        let results = run_stages(stages, &given, runner)?;
        for output in &values.outputs {
            let expected = output.row(row);
            let found = results.get(&output.name).ok_or_else(|| format!("no `{}`", output.name))?;
            if !is_close(&output.ty, found, expected) {
                let shown = |words: &[u32]| shown(&output.ty, words);
                let (found, expected) = (shown(found), shown(expected));
                return Err(format!("row {row}: `{}` is {found}, not {expected}", output.name));
            }
        }
    }
    Ok(())
}

/// Runs the stages one after another; each receives what those before it pass on.
pub fn run_stages(stages: &[Compiled], given: &Words, runner: &Runner) -> Result<Words, String> {
    let mut words = given.clone();
    for stage in stages {
        let class = stage.class.as_ref().ok_or("no class")?;
        let results = runner.call(class, &words)?;
        let ins = stage
            .translation
            .variables
            .iter()
            .filter(|it| it.storage == Storage::In && !it.is_uniform);
        ins.for_each(|it| drop(words.remove(&it.name)));
        words.extend(results);
    }
    Ok(words)
}

/// dEQP's tolerance: a twentieth of the value and a twentieth more.
fn is_close(ty: &str, found: &[u32], expected: &[u32]) -> bool {
    let is_float = shape_of(ty).is_some_and(|(scalar, _)| scalar == 'f');
    let is_matrix = ty.starts_with("mat");
    found.len() == expected.len()
        && found.iter().zip(expected).all(|(found, expected)| {
            let (a, b) = (f32::from_bits(*found), f32::from_bits(*expected));
            let scale = if is_matrix { 0.0 } else { b.abs() };
            if is_float { (a - b).abs() <= 0.05 * scale + 0.05 } else { found == expected }
        })
}

fn shown(ty: &str, words: &[u32]) -> String {
    let scalar = shape_of(ty).map_or('u', |(scalar, _)| scalar);
    let shown = words.iter().map(|word| match scalar {
        'f' => f32::from_bits(*word).to_string(),
        'i' => (*word as i32).to_string(),
        _ => word.to_string(),
    });
    format!("({})", shown.collect::<Vec<_>>().join(", "))
}

/// Puts the numbers of a step that sets a uniform where they belong: `name[2]` begins at an element.
pub fn set_uniform(words: &mut Words, step: &Step) {
    let Step::Uniform { ty, name, numbers } = step else { return };
    let Some((scalar, count)) = shape_of(ty) else { return };
    let numbers: Vec<u32> = numbers.iter().map(|it| word_of(scalar, *it)).collect();
    // `name` and `name[0]` are the same of an array; the later counts.
    let first = name.strip_suffix("[0]");
    words.remove(&first.map_or_else(|| format!("{name}[0]"), str::to_owned));
    if numbers.len() <= count {
        words.insert(name.clone(), numbers);
        return;
    }
    let (base, first) = match name.strip_suffix(']').and_then(|it| it.rsplit_once('[')) {
        Some((base, index)) => (base, index.parse().unwrap_or(0usize)),
        None => (name.as_str(), 0),
    };
    for (index, element) in numbers.chunks(count).enumerate() {
        words.insert(format!("{base}[{}]", first + index), element.to_vec());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{deqp, piglit};

    fn outcomes(text: &str) -> Vec<Outcome> {
        let runner = Runner::new();
        let cases = deqp::parse("own", text).expect("it is well-formed");
        cases.iter().map(|case| judge(case, &runner)).collect()
    }

    #[test]
    fn values_are_compared_row_by_row() {
        let text = r#"
            group sums "Sums"
                case right
                    values {
                        input float in0 = [ 1.0 | 2.0 ];
                        uniform ivec2 count = ivec2(3, 4);
                        output float out0 = [ 8.0 | 9.0 ];
                    }
                    vertex ""
                        ${VERTEX_DECLARATIONS}
                        varying float passed;
                        void main() { passed = in0; ${VERTEX_OUTPUT} }
                    ""
                    fragment ""
                        ${FRAGMENT_DECLARATIONS}
                        varying float passed;
                        void main() { out0 = passed + float(count.x + count.y); ${FRAGMENT_OUTPUT} }
                    ""
                end
                case wrong
                    values { output bvec2 out0 = bvec2(true, false); }
                    both ""
                        ${DECLARATIONS}
                        bool state = true;
                        void set(bool value) { state = value; }
                        void main() { set(false); out0 = bvec2(true, !state); ${OUTPUT} }
                    ""
                end
            end
        "#;
        let wrong = "row 0: `out0` is (1, 1), not (1, 0)".to_owned();
        assert_eq!(outcomes(text), [Outcome::Agrees, Outcome::Differs(wrong)]);
    }

    #[test]
    fn refusals_are_compared() {
        let text = r#"
            case refused
                expect compile_fail
                both ""
                    void main() { int \
                        2a; }
                ""
            end
            case input
                expect compile_fail
                version 300 es
                fragment ""
                    in float a;
                    void main() { a = 1.0; }
                ""
            end
            case sampler
                expect build_successful
                fragment ""
                    uniform sampler2D image;
                    void main() {}
                ""
            end
        "#;
        let [refused, input, sampler] = &outcomes(text)[..] else { panic!("three cases") };
        assert_eq!(*refused, Outcome::Agrees);
        // As a parameter the input is constant.
        assert_eq!(*input, Outcome::Agrees);
        assert_eq!(*sampler, Outcome::Excluded(rules::SAMPLERS));
    }

    #[test]
    fn drawings_have_the_colours_of_their_rectangles() {
        let text = "[require]\nGLSL >= 1.20\nSIZE 10 10\n\n[vertex shader passthrough]\n\n\
            [fragment shader]\nuniform vec4 colors[2];\nuniform int chosen;\n\
            void main() { gl_FragColor = colors[chosen]; }\n\n[test]\n\
            uniform vec4 colors[1] 0.5 0 1 1\nuniform int chosen 1\n\
            clear color 1 1 1 1\nclear\ndraw rect -1 -1 1 2\n\
            probe rgba 2 2 0.5 0 1 1\nrelative probe rgb (0.75, 0.5) (1, 1, 1)\n";
        let case = piglit::program("own.shader_test", text);
        assert_eq!(judge(&case, &Runner::new()), Outcome::Agrees);
    }
}
