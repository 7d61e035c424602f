//! The check that a render fits the available memory, before it begins.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{Amount, Available, Limit, reserved};

/// Advice for the user.
pub(super) const REMEDY: &str = "give a smaller size with `--size`, or ask for fewer images with `--aov`, or run it where there is more memory";

/// The memory requirement of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Need {
    /// The greatest amount in use at a time.
    pub bytes: Amount,
    /// Address space that is reserved but hardly used, for the stacks of threads.
    pub addresses: Amount,
}

/// Checks that a render fits the available memory.
///
/// # Errors
/// If it does not; the error states both amounts.
pub fn check_render((width, height): (usize, usize), need: Need) -> Result<(), Diagnostic> {
    check(&format!("an image of {width} by {height} pixels"), need, &Available::now())?;
    // If no limit is known, the allocation is attempted. Nothing is written, so no page is used.
    let room = usize::try_from(need.bytes.0).ok().map(reserved::<u8>);
    match room {
        Some(Ok(_)) => Ok(()),
        Some(Err(error)) => Err(error.diagnostic()),
        None => Err(super::OutOfMemory(need.bytes).diagnostic()),
    }
}

fn check(what: &str, need: Need, available: &[Available]) -> Result<(), Diagnostic> {
    for Available { left, limit } in available {
        let needed = match limit {
            Limit::AddressSpace => need.bytes + need.addresses,
            Limit::ControlGroup | Limit::Machine => need.bytes,
        };
        if needed > *left {
            let message =
                format!("{what} takes about {needed} of memory, but only {left} are available");
            let note = match limit {
                Limit::AddressSpace => {
                    let stacks = need.addresses;
                    format!("limited by {limit}; the stacks of threads take {stacks} of it")
                }
                Limit::ControlGroup | Limit::Machine => format!("limited by {limit}"),
            };
            return Err(Diagnostic::new(codes::OUT_OF_MEMORY, message).note(note).help(REMEDY));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_that_is_passed_is_named() {
        let need = Need { bytes: Amount(3 << 30), addresses: Amount(1 << 30) };
        let left = |gibibytes: u64, limit| Available { left: Amount(gibibytes << 30), limit };
        let said = |available: &[Available]| {
            let error = check("an image of 8 by 8 pixels", need, available).unwrap_err();
            rtsl_source::Messages::one(error).to_text(false)
        };
        assert!(check("", need, &[]).is_ok());
        assert!(check("", need, &[left(3, Limit::Machine), left(4, Limit::AddressSpace)]).is_ok());
        let text = said(&[left(9, Limit::Machine), left(3, Limit::AddressSpace)]);
        expect_test::expect![[r#"
            error[E0641]: an image of 8 by 8 pixels takes about 4.0 GiB of memory, but only 3.0 GiB are available
             = note: limited by the process's address space (`ulimit -v`); the stacks of threads take 1.0 GiB of it
             = help: give a smaller size with `--size`, or ask for fewer images with `--aov`, or run it where there is more memory

        "#]].assert_eq(&text);
        assert!(said(&[left(2, Limit::ControlGroup)]).contains("control group"));
    }

    #[test]
    fn the_system_is_asked_where_no_limit_is_known() {
        let need = Need { bytes: Amount(1 << 62), addresses: Amount(0) };
        assert_eq!(check_render((8, 8), need).unwrap_err().code, codes::OUT_OF_MEMORY);
    }
}
