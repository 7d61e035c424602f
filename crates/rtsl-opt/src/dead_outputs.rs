//! Unread outputs: what the caller does not look at is not yielded; dead code elimination then
//! removes what nothing else needs.

use rtsl_ir::Function;

/// Keeps the outputs that are read, as `read` says for each.
pub fn run(function: &mut Function, read: &[bool]) {
    keep(&mut function.outputs, read);
    keep(&mut function.body.yields, read);
}

/// Keeps the elements where `wanted` holds.
fn keep<T>(elements: &mut Vec<T>, wanted: &[bool]) {
    let mut wanted = wanted.iter();
    elements.retain(|_| wanted.next().is_some_and(|wanted| *wanted));
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::transformed;

    #[test]
    fn what_only_an_unread_output_needs_goes() {
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
