//! Dead outputs: removes yields that the caller does not read; dead code elimination then removes the operations that
//! only they need.

use rtsl_ir::Function;

/// Keeps the outputs whose flag in `read` is set.
pub fn run(function: &mut Function, read: &[bool]) {
    keep(&mut function.outputs, read);
    keep(&mut function.body.yields, read);
}

/// Keeps the elements whose flag in `wanted` is set.
fn keep<T>(elements: &mut Vec<T>, wanted: &[bool]) {
    let mut wanted = wanted.iter();
    elements.retain(|_| wanted.next().is_some_and(|wanted| *wanted));
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::transformed;

    #[test]
    fn operations_only_for_unread_outputs_are_removed() {
        let text = "
            %a: f32 = load member:m@0
            %b: f32 = sqrt %a
            %c: f32 = add %a, %a
            return scratch:f@0 = %b, scratch:f@1 = %c";
        let kept = transformed(text, |function| {
            super::run(function, &[false, true]);
            crate::dce::run(function);
        });
        expect![[r#"
            %0: f32 = load member:m@0
            %1: f32 = add %0, %0
            return scratch:f@1 = %1
        "#]]
        .assert_eq(&kept);
    }
}
