//! The room on the stack of the calling thread.

use std::cell::Cell;
use std::hint::black_box;

/// The addresses of a thread's stack.
#[derive(Clone, Copy, Debug)]
struct StackRange {
    /// The lowest usable address: stacks grow downward.
    low: usize,
    high: usize,
}

impl StackRange {
    /// The range before the system is asked for it.
    const UNKNOWN: StackRange = StackRange { low: 0, high: 0 };
    /// The range of a thread for which the system gives none.
    const ALL: StackRange = StackRange { low: 0, high: usize::MAX };
}

thread_local! {
    static RANGE: Cell<StackRange> = const { Cell::new(StackRange::UNKNOWN) };
}

/// True if the stack of the calling thread has room for `bytes` more. True as well where the room is unknown: on
/// systems that do not tell it, and on stacks that the program has made itself.
pub fn has_stack(bytes: usize) -> bool {
    let local = 0_u8;
    let here = black_box(&raw const local) as usize;
    let range = match RANGE.get() {
        StackRange { low: _, high: 0 } => find_range(),
        range => range,
    };
    let is_inside = (range.low..range.high).contains(&here);
    !is_inside || here - range.low >= bytes
}

#[cold]
fn find_range() -> StackRange {
    let range = system::stack().unwrap_or(StackRange::ALL);
    RANGE.set(range);
    range
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod system {
    use std::mem::MaybeUninit;
    use std::ptr::null_mut;

    use super::StackRange;

    pub fn stack() -> Option<StackRange> {
        let mut attributes = MaybeUninit::uninit();
        let (mut low, mut size) = (null_mut(), 0);
        // Safety: the first function initialises the attributes of the running thread unless it fails, the second reads
        // them and writes two local variables, and the third frees them.
        let failed = unsafe {
            if libc::pthread_getattr_np(libc::pthread_self(), attributes.as_mut_ptr()) != 0 {
                return None;
            }
            let failed = libc::pthread_attr_getstack(attributes.as_ptr(), &mut low, &mut size) != 0;
            libc::pthread_attr_destroy(attributes.as_mut_ptr());
            failed
        };
        let low = low as usize;
        if failed { None } else { Some(StackRange { low, high: low.checked_add(size)? }) }
    }
}

#[cfg(target_os = "macos")]
mod system {
    use super::StackRange;

    pub fn stack() -> Option<StackRange> {
        // Safety: both functions read the constant data of the running thread.
        let (high, size) = unsafe {
            let thread = libc::pthread_self();
            (
                libc::pthread_get_stackaddr_np(thread) as usize,
                libc::pthread_get_stacksize_np(thread),
            )
        };
        Some(StackRange { low: high.checked_sub(size)?, high })
    }
}

/// Other C libraries for Linux give only the part of the main thread's stack that is in use.
#[cfg(not(any(all(target_os = "linux", target_env = "gnu"), target_os = "macos")))]
mod system {
    use super::StackRange;

    pub fn stack() -> Option<StackRange> {
        None
    }
}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    #[test]
    fn room_is_that_of_the_thread() {
        let room = || [0, 300 << 10, 3 << 20, usize::MAX].map(has_stack);
        for (kib, expected) in
            [(512, [true, true, false, false]), (4096, [true, true, true, false])]
        {
            let thread = std::thread::Builder::new().stack_size(kib << 10);
            assert_eq!(thread.spawn(room).unwrap().join().unwrap(), expected, "{kib} KiB");
        }
    }

    #[test]
    fn room_shrinks_with_each_level() {
        fn levels(depth: usize) -> usize {
            let frame = black_box([0_u8; 16 << 10]);
            let deeper = if has_stack(64 << 10) { levels(depth + 1) } else { depth };
            black_box(frame);
            deeper
        }
        let thread = std::thread::Builder::new().stack_size(1 << 20);
        let depth = thread.spawn(|| levels(0)).unwrap().join().unwrap();
        assert!((10..64).contains(&depth), "{depth} levels");
    }
}
