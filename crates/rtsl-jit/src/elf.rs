//! Lays out in memory the object files (ELF, 64 bits, little endian) that LLVM generates.
//!
//! The crate `object` reads the tables. A small linker suffices because kernels need little (code, constants, a few
//! kinds of relocation). It works the same with every version of LLVM, takes microseconds, frees its memory with the
//! module, and checks every symbol to which code refers. An object with other contents is refused.

use std::collections::BTreeMap;

use object::LittleEndian;
use object::elf::{self, FileHeader64, Machine, Rela64, SectionHeader64, Sym64};
use object::read::elf::{
    FileHeader as _, Rela as _, SectionHeader as _, SectionTable, Sym as _, SymbolTable,
};
use object::read::{Error as ReadError, SectionIndex, SymbolIndex};

use crate::error::JitError;
use crate::memory::PAGE;
use crate::relocation::{self, Place, Via};

const ENDIAN: LittleEndian = LittleEndian;
/// The size of a stub for a call out of the module: a jump through a pointer, and the pointer.
const STUB_SIZE: usize = 24;

type Header = FileHeader64<LittleEndian>;
type Section = SectionHeader64<LittleEndian>;
type Symbol = Sym64<LittleEndian>;

/// An object file with parsed tables.
pub struct Object<'a> {
    bytes: &'a [u8],
    machine: Machine,
    sections: SectionTable<'a, Header>,
    symbols: SymbolTable<'a, Header>,
}

/// The memory layout, as offsets from the start of the memory.
pub struct Layout {
    /// The size of the memory.
    pub size: usize,
    /// The size of the code at the start, whole pages.
    pub code_size: usize,
    /// The offset of each section that is loaded.
    sections: Vec<Option<usize>>,
    /// The offset of the stub of each external symbol, by the symbol's index.
    stubs: BTreeMap<usize, usize>,
}

impl<'a> Object<'a> {
    /// Parses the tables.
    pub fn parse(bytes: &'a [u8]) -> Result<Object<'a>, JitError> {
        let header = Header::parse(bytes).map_err(malformed)?;
        header.endian().map_err(malformed)?;
        let sections = header.sections(ENDIAN, bytes).map_err(malformed)?;
        let symbols = sections.symbols(ENDIAN, bytes, elf::SHT_SYMTAB).map_err(malformed)?;
        Ok(Object { bytes, machine: header.e_machine(ENDIAN), sections, symbols })
    }

    /// Plans the memory: code first, then constants, then stubs' pointers.
    pub fn layout(&self) -> Result<Layout, JitError> {
        let mut layout = Layout {
            size: 0,
            code_size: 0,
            sections: vec![None; self.sections.len()],
            stubs: BTreeMap::new(),
        };
        self.place_sections(&mut layout, true)?;
        for index in self.outside_symbols()? {
            layout.size = layout.size.next_multiple_of(8);
            layout.stubs.insert(index, layout.size);
            layout.size += STUB_SIZE;
        }
        layout.size = layout.size.next_multiple_of(PAGE);
        layout.code_size = layout.size;
        self.place_sections(&mut layout, false)?;
        Ok(layout)
    }

    fn place_sections(&self, layout: &mut Layout, code: bool) -> Result<(), JitError> {
        for (index, section) in self.sections.enumerate() {
            let flags = section.sh_flags(ENDIAN);
            if !self.is_loaded(section)? || flags.contains(elf::SHF_EXECINSTR) != code {
                continue;
            }
            let size = in_memory(section.sh_size(ENDIAN))?;
            if flags.contains(elf::SHF_WRITE) && size > 0 {
                return Err(bad(&format!("writable data in `{}`", self.section_name(section)?)));
            }
            let alignment = in_memory(section.sh_addralign(ENDIAN))?.max(1);
            let place = layout.size.checked_next_multiple_of(alignment).ok_or_else(too_large)?;
            layout.sections[index.0] = Some(place);
            layout.size = place.checked_add(size).ok_or_else(too_large)?;
        }
        Ok(())
    }

    /// Returns the indices of the external symbols to which relocations refer.
    fn outside_symbols(&self) -> Result<Vec<usize>, JitError> {
        let mut outside = Vec::new();
        for (_, relocations) in self.relocations()? {
            for relocation in relocations {
                let index = relocation.r_sym(ENDIAN, false) as usize;
                let symbol = self.symbol(index)?;
                if symbol.st_shndx(ENDIAN) == elf::SHN_UNDEF && symbol.st_name(ENDIAN) != 0 {
                    outside.push(index);
                }
            }
        }
        outside.sort_unstable();
        outside.dedup();
        Ok(outside)
    }

    /// Refuses an object that refers to an unknown external symbol.
    pub fn check_outside_symbols(&self, is_known: impl Fn(&str) -> bool) -> Result<(), JitError> {
        for index in self.outside_symbols()? {
            let name = self.symbol_name(self.symbol(index)?)?;
            if !is_known(name) {
                return Err(JitError::UndefinedSymbol(name.to_owned()));
            }
        }
        Ok(())
    }

    /// Copies the sections to `memory`, which will run at `base`, and applies the relocations; `resolve` returns the
    /// addresses of external symbols.
    pub fn write(
        &self,
        layout: &Layout,
        base: u64,
        memory: &mut [u8],
        resolve: impl Fn(&str) -> Option<u64>,
    ) -> Result<(), JitError> {
        for (section, place) in self.sections.iter().zip(&layout.sections) {
            let Some(place) = *place else { continue };
            // Empty for a section of zeros, which the memory holds already.
            let content = section.data(ENDIAN, self.bytes).map_err(malformed)?;
            memory[place..place + content.len()].copy_from_slice(content);
        }
        for (index, place) in &layout.stubs {
            let name = self.symbol_name(self.symbol(*index)?)?;
            let address =
                resolve(name).ok_or_else(|| JitError::UndefinedSymbol(name.to_owned()))?;
            relocation::write_stub(self.machine, &mut memory[*place..*place + STUB_SIZE], address)?;
        }
        for (target, relocations) in self.relocations()? {
            let Some(start) = layout.sections[target.0] else { continue };
            for relocation in relocations {
                let offset = in_memory(relocation.r_offset(ENDIAN))?;
                let offset = start.checked_add(offset).ok_or_else(too_large)?;
                let index = relocation.r_sym(ENDIAN, false) as usize;
                let via = self.symbol_address(layout, base, index)?;
                let place = Place { memory, offset, base };
                let kind = relocation.r_type(ENDIAN, false);
                let addend = relocation.r_addend(ENDIAN);
                relocation::apply(self.machine, kind, place, via, addend)?;
            }
        }
        Ok(())
    }

    fn symbol_address(&self, layout: &Layout, base: u64, index: usize) -> Result<Via, JitError> {
        if let Some(stub) = layout.stubs.get(&index) {
            let stub = base + *stub as u64;
            return Ok(Via { address: stub, pointer: Some(stub + relocation::STUB_POINTER) });
        }
        let symbol = self.symbol(index)?;
        let address = match symbol.st_shndx(ENDIAN) {
            elf::SHN_ABS => symbol.st_value(ENDIAN),
            section if section.is_reserved() => {
                return Err(bad(&format!("the common symbol `{}`", self.symbol_name(symbol)?)));
            }
            section => {
                let place = layout.sections.get(usize::from(section.0)).copied().flatten();
                let place =
                    place.ok_or_else(|| bad("a relocation to a section that is not loaded"))?;
                base.wrapping_add(place as u64).wrapping_add(symbol.st_value(ENDIAN))
            }
        };
        Ok(Via { address, pointer: None })
    }

    /// Returns the relocations of each section that is loaded.
    fn relocations(&self) -> Result<Vec<SectionRelocations<'a>>, JitError> {
        let mut found = Vec::new();
        for section in self.sections.iter() {
            let target = section.info_link(ENDIAN);
            let Some((relocations, _)) = section.rela(ENDIAN, self.bytes).map_err(malformed)?
            else {
                continue;
            };
            if self.is_loaded(self.sections.section(target).map_err(malformed)?)? {
                found.push((target, relocations));
            }
        }
        Ok(found)
    }

    /// Returns the functions by name, each with its offset in the memory.
    pub fn functions(&self, layout: &Layout) -> Result<BTreeMap<String, usize>, JitError> {
        let mut functions = BTreeMap::new();
        for symbol in self.symbols.iter().filter(|symbol| symbol.st_type() == elf::STT_FUNC) {
            let section = usize::from(symbol.st_shndx(ENDIAN).0);
            let Some(place) = layout.sections.get(section).copied().flatten() else { continue };
            let offset = place.checked_add(in_memory(symbol.st_value(ENDIAN))?);
            if let Some(offset) = offset.filter(|offset| *offset < layout.size) {
                functions.insert(self.symbol_name(symbol)?.to_owned(), offset);
            }
        }
        Ok(functions)
    }

    /// True if the section is loaded. Unwind tables are not: nothing unwinds through a kernel.
    fn is_loaded(&self, section: &Section) -> Result<bool, JitError> {
        let is_allocated = section.sh_flags(ENDIAN).contains(elf::SHF_ALLOC);
        Ok(is_allocated && self.section_name(section)? != ".eh_frame")
    }

    fn section_name(&self, section: &Section) -> Result<&'a str, JitError> {
        text(self.sections.section_name(ENDIAN, section))
    }

    fn symbol(&self, index: usize) -> Result<&'a Symbol, JitError> {
        self.symbols.symbol(SymbolIndex(index)).map_err(malformed)
    }

    fn symbol_name(&self, symbol: &Symbol) -> Result<&'a str, JitError> {
        text(self.symbols.symbol_name(ENDIAN, symbol))
    }
}

/// A section with the relocations that change it.
type SectionRelocations<'a> = (SectionIndex, &'a [Rela64<LittleEndian>]);

fn bad(reason: &str) -> JitError {
    JitError::Object(reason.to_owned())
}

fn malformed(error: ReadError) -> JitError {
    JitError::Object(error.to_string())
}

fn too_large() -> JitError {
    bad("a size or an offset exceeds the memory")
}

/// Returns a size or an offset. Values above 2^32 - 1 are errors, so that sums of a few do not overflow.
fn in_memory(value: u64) -> Result<usize, JitError> {
    u32::try_from(value).map(|value| value as usize).map_err(|_| too_large())
}

fn text(name: Result<&[u8], ReadError>) -> Result<&str, JitError> {
    let name = name.map_err(malformed)?;
    std::str::from_utf8(name).map_err(|_| bad("a name that is not UTF-8"))
}
