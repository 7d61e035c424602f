//! Reads the object files (ELF, 64 bits, little endian) that LLVM generates and lays them out in memory.
//!
//! A small linker suffices because kernels need little (code, constants, a few kinds of relocation). It works the same
//! with every version of LLVM, takes microseconds, frees its memory with the module, and checks every symbol to which
//! code refers. An object with other contents is refused.

use std::collections::BTreeMap;

use crate::error::JitError;
use crate::memory::PAGE;
use crate::relocation::{self, Place, Via};

const SECTION_SYMBOLS: u32 = 2;
const SECTION_RELOCATIONS: u32 = 4;
const SECTION_NO_BITS: u32 = 8;
const FLAG_WRITE: u64 = 1;
const FLAG_ALLOCATE: u64 = 2;
const FLAG_EXECUTE: u64 = 4;
const INDEX_UNDEFINED: u16 = 0;
const INDEX_ABSOLUTE: u16 = 0xfff1;
const INDEX_RESERVED: u16 = 0xff00;
const TYPE_FUNCTION: u8 = 2;
/// The size of a stub for a call out of the module: a jump through a pointer, and the pointer.
const STUB_SIZE: usize = 24;

/// An object file with parsed tables.
pub struct Object<'a> {
    bytes: &'a [u8],
    machine: u16,
    sections: Vec<Section<'a>>,
    symbols: Vec<Symbol<'a>>,
}

struct Section<'a> {
    name: &'a str,
    kind: u32,
    flags: u64,
    offset: usize,
    size: usize,
    link: usize,
    info: usize,
    alignment: usize,
}

struct Symbol<'a> {
    name: &'a str,
    kind: u8,
    section: u16,
    value: u64,
}

/// The memory layout, as offsets from the start of the memory.
pub struct Layout {
    /// The size of the memory.
    pub size: usize,
    /// The size of the code at the start, whole pages.
    pub code_size: usize,
    /// The offset of each section that is loaded.
    sections: Vec<Option<usize>>,
    /// The offset of the stub of each external symbol.
    stubs: BTreeMap<usize, usize>,
}

impl<'a> Object<'a> {
    /// Parses the tables.
    pub fn parse(bytes: &'a [u8]) -> Result<Object<'a>, JitError> {
        if bytes.get(..6) != Some(b"\x7fELF\x02\x01") {
            return Err(bad("not a 64-bit little-endian ELF file"));
        }
        let mut object = Object {
            bytes,
            machine: u16_at(bytes, 18)?,
            sections: Vec::new(),
            symbols: Vec::new(),
        };
        object.read_sections()?;
        object.read_symbols()?;
        Ok(object)
    }

    fn read_sections(&mut self) -> Result<(), JitError> {
        let bytes = self.bytes;
        let table = usize_at(bytes, 40)?;
        let count = usize::from(u16_at(bytes, 60)?);
        let names_index = usize::from(u16_at(bytes, 62)?);
        let header = |index: usize| table.checked_add(index * 64).ok_or_else(truncated);
        let names = usize_at(bytes, header(names_index)? + 24)?;
        for index in 0..count {
            let at = header(index)?;
            self.sections.push(Section {
                name: text_at(bytes, names + u32_at(bytes, at)? as usize)?,
                kind: u32_at(bytes, at + 4)?,
                flags: u64_at(bytes, at + 8)?,
                offset: usize_at(bytes, at + 24)?,
                size: usize_at(bytes, at + 32)?,
                link: u32_at(bytes, at + 40)? as usize,
                info: u32_at(bytes, at + 44)? as usize,
                alignment: usize_at(bytes, at + 48)?.max(1),
            });
        }
        Ok(())
    }

    fn read_symbols(&mut self) -> Result<(), JitError> {
        let Some(table) = self.sections.iter().find(|section| section.kind == SECTION_SYMBOLS)
        else {
            return Ok(());
        };
        let names = self.sections.get(table.link).ok_or_else(truncated)?.offset;
        for at in (table.offset..).step_by(24).take(table.size / 24) {
            self.symbols.push(Symbol {
                name: text_at(self.bytes, names + u32_at(self.bytes, at)? as usize)?,
                kind: self.bytes.get(at + 4).ok_or_else(truncated)? & 15,
                section: u16_at(self.bytes, at + 6)?,
                value: u64_at(self.bytes, at + 8)?,
            });
        }
        Ok(())
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
        for (index, section) in self.sections.iter().enumerate() {
            if !section.is_loaded() || (section.flags & FLAG_EXECUTE != 0) != code {
                continue;
            }
            if section.flags & FLAG_WRITE != 0 && section.size > 0 {
                return Err(bad(&format!("writable data in `{}`", section.name)));
            }
            let aligned = layout.size.checked_next_multiple_of(section.alignment);
            let place = aligned.ok_or_else(truncated)?;
            layout.sections[index] = Some(place);
            layout.size = place.checked_add(section.size).ok_or_else(truncated)?;
        }
        Ok(())
    }

    /// Returns the external symbols to which relocations refer.
    fn outside_symbols(&self) -> Result<Vec<usize>, JitError> {
        let mut outside = Vec::new();
        for (_, relocations) in self.relocation_sections() {
            for relocation in self.relocations(relocations) {
                let index = relocation?.symbol;
                let symbol = self.symbols.get(index).ok_or_else(truncated)?;
                if symbol.section == INDEX_UNDEFINED && !symbol.name.is_empty() {
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
        let names = self.outside_symbols()?.into_iter().map(|index| self.symbols[index].name);
        match names.into_iter().find(|name| !is_known(name)) {
            Some(name) => Err(JitError::UndefinedSymbol(name.to_owned())),
            None => Ok(()),
        }
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
            if section.kind != SECTION_NO_BITS {
                let end = section.offset.checked_add(section.size).ok_or_else(truncated)?;
                let from = self.bytes.get(section.offset..end).ok_or_else(truncated)?;
                memory[place..place + section.size].copy_from_slice(from);
            }
        }
        for (index, place) in &layout.stubs {
            let name = self.symbols[*index].name;
            let address =
                resolve(name).ok_or_else(|| JitError::UndefinedSymbol(name.to_owned()))?;
            relocation::write_stub(self.machine, &mut memory[*place..*place + STUB_SIZE], address)?;
        }
        for (target, relocations) in self.relocation_sections() {
            let Some(start) = layout.sections[target] else { continue };
            for relocation in self.relocations(relocations) {
                let relocation = relocation?;
                let offset = start.checked_add(relocation.offset).ok_or_else(truncated)?;
                let via = self.symbol_address(layout, base, relocation.symbol)?;
                let place = Place { memory, offset, base };
                relocation::apply(self.machine, relocation.kind, place, via, relocation.addend)?;
            }
        }
        Ok(())
    }

    fn symbol_address(&self, layout: &Layout, base: u64, index: usize) -> Result<Via, JitError> {
        if let Some(stub) = layout.stubs.get(&index) {
            let stub = base + *stub as u64;
            return Ok(Via { address: stub, pointer: Some(stub + relocation::STUB_POINTER) });
        }
        let symbol = self.symbols.get(index).ok_or_else(truncated)?;
        let address = match symbol.section {
            INDEX_ABSOLUTE => symbol.value,
            section if section >= INDEX_RESERVED => {
                return Err(bad(&format!("the common symbol `{}`", symbol.name)));
            }
            section => {
                let place = layout.sections.get(usize::from(section)).copied().flatten();
                let place =
                    place.ok_or_else(|| bad("a relocation to a section that is not loaded"))?;
                base.wrapping_add(place as u64).wrapping_add(symbol.value)
            }
        };
        Ok(Via { address, pointer: None })
    }

    /// Returns the sections of relocations with the section that each changes, if that is loaded.
    fn relocation_sections(&self) -> impl Iterator<Item = (usize, &Section<'a>)> {
        self.sections.iter().filter_map(|section| {
            let target = self.sections.get(section.info)?;
            let serves = section.kind == SECTION_RELOCATIONS && target.is_loaded();
            serves.then_some((section.info, section))
        })
    }

    fn relocations(
        &self,
        section: &Section<'a>,
    ) -> impl Iterator<Item = Result<Relocation, JitError>> + use<'a> {
        let bytes = self.bytes;
        (section.offset..).step_by(24).take(section.size / 24).map(move |at| {
            let info = u64_at(bytes, at + 8)?;
            Ok(Relocation {
                offset: usize_at(bytes, at)?,
                kind: info as u32,
                symbol: (info >> 32) as usize,
                addend: u64_at(bytes, at + 16)? as i64,
            })
        })
    }

    /// Returns the global functions, by name.
    pub fn functions(&self, layout: &Layout) -> BTreeMap<String, usize> {
        let functions = self.symbols.iter().filter(|symbol| symbol.kind == TYPE_FUNCTION);
        functions
            .filter_map(|symbol| {
                let place = (*layout.sections.get(usize::from(symbol.section))?)?;
                let offset = place.checked_add(usize::try_from(symbol.value).ok()?)?;
                (offset < layout.size).then(|| (symbol.name.to_owned(), offset))
            })
            .collect()
    }
}

impl Section<'_> {
    /// True if the section is loaded. Unwind tables are not: nothing unwinds through a kernel.
    fn is_loaded(&self) -> bool {
        self.flags & FLAG_ALLOCATE != 0 && self.name != ".eh_frame"
    }
}

struct Relocation {
    offset: usize,
    kind: u32,
    symbol: usize,
    addend: i64,
}

fn bad(reason: &str) -> JitError {
    JitError::Object(reason.to_owned())
}

fn truncated() -> JitError {
    bad("a table points outside the file")
}

fn array_at<const N: usize>(bytes: &[u8], at: usize) -> Result<[u8; N], JitError> {
    bytes.get(at..).and_then(|rest| rest.first_chunk::<N>()).copied().ok_or_else(truncated)
}

fn u16_at(bytes: &[u8], at: usize) -> Result<u16, JitError> {
    array_at(bytes, at).map(u16::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> Result<u32, JitError> {
    array_at(bytes, at).map(u32::from_le_bytes)
}

fn u64_at(bytes: &[u8], at: usize) -> Result<u64, JitError> {
    array_at(bytes, at).map(u64::from_le_bytes)
}

/// Reads an offset or a size. Values above 2^32 - 1 are errors, so that arithmetic with them does not overflow.
fn usize_at(bytes: &[u8], at: usize) -> Result<usize, JitError> {
    let value = u64_at(bytes, at)?;
    if value > u64::from(u32::MAX) { Err(truncated()) } else { Ok(value as usize) }
}

fn text_at(bytes: &[u8], at: usize) -> Result<&str, JitError> {
    let rest = bytes.get(at..).ok_or_else(truncated)?;
    let end = rest.iter().position(|byte| *byte == 0).ok_or_else(truncated)?;
    std::str::from_utf8(&rest[..end]).map_err(|_| bad("a name that is not UTF-8"))
}
