//! Release of the resident pages of a loaded library.
//!
//! A process keeps the pages of a library's file that it ever touched, with their neighbours. The system keeps the file
//! in its cache anyway, so released pages return within microseconds when they are touched again.

/// The pages of a library that are identical to its file.
pub struct LibraryPages {
    ranges: Vec<system::Pages>,
}

impl LibraryPages {
    /// Returns the pages of the library that contains the code at this address; none if the system does not report
    /// them.
    pub fn of_code_at(address: *const ()) -> LibraryPages {
        LibraryPages { ranges: system::pages_of_file(address.addr()) }
    }

    /// Releases the pages until they are touched again. Other threads may use them meanwhile.
    pub fn release(&self) {
        self.ranges.iter().for_each(system::release);
    }
}

#[cfg(target_os = "linux")]
mod system {
    use std::ffi::{c_int, c_void};
    use std::ops::Range;

    use libc::{
        Elf64_Phdr, MADV_DONTNEED, PF_W, PT_DYNAMIC, PT_LOAD, dl_iterate_phdr, dl_phdr_info,
        madvise,
    };
    use object::NativeEndian;
    use object::elf::{self, Dyn64};
    use object::read::elf::Dyn as _;

    use crate::memory::PAGE;

    /// The addresses of whole pages.
    pub type Pages = Range<usize>;

    /// An entry of a library's dynamic section.
    type DynamicEntry = Dyn64<NativeEndian>;

    struct Search {
        address: usize,
        found: Vec<Pages>,
    }

    pub fn pages_of_file(address: usize) -> Vec<Pages> {
        let mut search = Search { address, found: Vec::new() };
        // Safety: `visit` has the argument type that it is passed here.
        unsafe { dl_iterate_phdr(Some(visit), (&raw mut search).cast()) };
        search.found
    }

    unsafe extern "C" fn visit(info: *mut dl_phdr_info, _: usize, search: *mut c_void) -> c_int {
        // Safety: the loader describes a library, whose table has that many entries; the pointer is that of
        // `pages_of_file`, which waits.
        let (base, segments, search) = unsafe {
            let info = &*info;
            let segments = std::slice::from_raw_parts(info.dlpi_phdr, info.dlpi_phnum.into());
            (info.dlpi_addr as usize, segments, &mut *search.cast::<Search>())
        };
        let is_here = |segment: &&Elf64_Phdr| addresses(base, segment).contains(&search.address);
        if !of_kind(segments, PT_LOAD).any(|segment| is_here(&segment)) {
            return 0;
        }
        // Safety: the segments are those of a loaded library.
        if !unsafe { has_text_relocations(base, segments) } {
            let unwritable =
                of_kind(segments, PT_LOAD).filter(|segment| segment.p_flags & PF_W == 0);
            search.found.extend(unwritable.map(|segment| {
                let Range { start, end } = addresses(base, segment);
                start.next_multiple_of(PAGE)..end / PAGE * PAGE
            }));
        }
        // Stops the iteration.
        1
    }

    fn of_kind(segments: &[Elf64_Phdr], kind: u32) -> impl Iterator<Item = &Elf64_Phdr> {
        segments.iter().filter(move |segment| segment.p_type == kind)
    }

    fn addresses(base: usize, segment: &Elf64_Phdr) -> Range<usize> {
        let start = base.wrapping_add(segment.p_vaddr as usize);
        start..start + segment.p_memsz as usize
    }

    /// True if the loader wrote to pages that are not writable afterwards. Linkers refuse to make such libraries unless
    /// forced.
    ///
    /// # Safety
    /// The segments are those of a library that is loaded at `base`.
    unsafe fn has_text_relocations(base: usize, segments: &[Elf64_Phdr]) -> bool {
        of_kind(segments, PT_DYNAMIC).any(|segment| {
            let Range { start, end } = addresses(base, segment);
            let count = (end - start) / size_of::<DynamicEntry>();
            let entries = std::ptr::with_exposed_provenance::<DynamicEntry>(start);
            // Safety: the loader reads this section as such entries, and leaves it in memory.
            let entries = unsafe { std::slice::from_raw_parts(entries, count) };
            let entries = entries.iter().map(|entry| (entry.d_tag(NativeEndian), entry));
            let mut entries = entries.take_while(|(tag, _)| *tag != elf::DT_NULL);
            entries.any(|(tag, entry)| match tag {
                elf::DT_TEXTREL => true,
                elf::DT_FLAGS => entry.d_val(NativeEndian) & elf::DF_TEXTREL.0 != 0,
                _ => false,
            })
        })
    }

    pub fn release(pages: &Pages) {
        let start = std::ptr::with_exposed_provenance_mut(pages.start);
        // Safety: whole pages of a private mapping that neither the loader nor the library writes to: they are
        // identical to the file, from which the system maps them again when they are next touched.
        unsafe { madvise(start, pages.end.saturating_sub(pages.start), MADV_DONTNEED) };
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    pub type Pages = std::ops::Range<usize>;

    pub fn pages_of_file(_: usize) -> Vec<Pages> {
        Vec::new()
    }

    pub fn release(_: &Pages) {}
}
